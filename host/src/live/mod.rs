//! The running program as a function of what happens: inputs with their times in, views, commands and requests out.
//!
//! Nothing here opens a device, a file or a socket, and only [`SessionClock`] reads a clock, for those that do.

mod acts;
mod calibrating;
mod config;
mod engine;
mod facing;
mod follow;
mod input;
mod port;
mod recall;
mod request;
mod restoring;
mod show;
mod takes;
mod teaching;
mod telling;
mod trace;
mod view;
mod wearable;
mod world;

pub use acts::LearnJob;
pub use config::EngineConfig;
pub use engine::{Engine, EngineError};
pub use follow::{Body, BodyError, is_stall, simulated};

pub use crate::calibration::{CalibrationResult, Estimate, Person, Profile, StepView};
pub use input::{Act, HandSeen, Input, LinkEvent, RobotSeen, Timed, TrackerEvent};
pub use port::{Injector, Inputs, Plug, Port, SessionClock};
pub use request::{Prompt, Request};
pub use teaching::Frames;
pub use view::{
    CalibrationView, ChannelView, ClockView, DemonstrationView, FileView, FitView, HandView, Lamp,
    LatencyView, LibraryView, LinkView, Message, PasskeyView, PathPoint, PointView,
    RecognitionView, RecordingView, RobotView, SemgView, TeachingView, TouchView, Trace,
    TrackerView, View,
};
pub use world::World;

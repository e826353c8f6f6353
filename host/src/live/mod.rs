//! The running program as a function of what happens: inputs with their times in, views, commands and requests out.
//!
//! Nothing here opens a device, a file or a socket, and only [`SessionClock`] reads a clock, for those that do.

mod input;
mod port;
mod request;
mod view;

pub use crate::calibration::{CalibrationResult, Estimate, Person, StepView};
pub use input::{Act, HandSeen, Input, LinkEvent, RobotSeen, Timed, TrackerEvent};
pub use port::{Inputs, Plug, Port, SessionClock};
pub use request::{Prompt, Request};
pub use view::{
    CalibrationView, ChannelView, ClockView, DemonstrationView, FileView, FitView, HandView, Lamp,
    LatencyView, LibraryView, LinkView, Message, PathPoint, RecognitionView, RecordingView,
    RobotView, SemgView, Trace, TrackerView, View,
};

//! What the engine stands in.

use std::sync::Arc;

use super::acts::LearnJob;
use super::input::Input;
use super::request::Request;
use super::teaching::Frames;
use super::view::View;
use crate::calibration::Profile;
use crate::library::Library;
use crate::robot::command::Command;
use crate::robot::gate::State;
use crate::robot::limits::Setpoint;

/// What surrounds the engine. Live it is devices, a file and a page; in a replay, a file.
pub trait World {
    /// The next moment: its time and what happened, or only that time passed; none ends the run. Times never fall. Where
    /// moments of a running program lie too far apart ([`super::is_stall`]), the later one is an [`Input::Stalled`].
    fn next(&mut self) -> Option<(u64, Option<Input>)>;
    /// An input is taken at this time, which is not before that of the one before: what a recording keeps.
    fn took(&mut self, at_us: u64, input: &Input);
    /// Asks the wearable's source, or the person, for something.
    fn ask(&mut self, at_us: u64, request: Request);
    /// Something is to be learnt; [`Input::Learnt`] tells of it, and then [`World::learnt`] gives it.
    fn learn(&mut self, job: LearnJob);
    /// What the last [`Input::Learnt`] told of, if it is at hand; otherwise it is learnt there and then.
    fn learnt(&mut self) -> Option<Arc<Library>>;
    /// A person was measured, and the wearable works with it.
    fn measured(&mut self, profile: &Profile);
    /// A command was made, before the gate.
    fn commanded(&mut self, at_us: u64, command: &Command);
    /// The gate took the command; it may follow it.
    fn accepted(&mut self, _command: &Command) {}
    /// What the robot is told now, behind the gate.
    fn set(&mut self, at_us: u64, setpoint: &Setpoint, state: State);
    /// Somebody taught where shoulder or robot are; the engine uses it already.
    fn taught(&mut self, _frames: &Frames) {}
    /// There is something to see.
    fn show(&mut self, view: &View);
}

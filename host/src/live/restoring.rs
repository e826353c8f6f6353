//! A person is measured with levels that mean nothing, and the wearable keeps what it is given: the levels of before go back
//! into it, whatever ends the measurement.

use super::calibrating::Sent;
use super::engine::Engine;
use super::request::Request;
use super::world::World;
use crate::calibration::measures;

const ON_ITS_WAY: &str = "the wearable works with the levels of a measurement: what it had before goes back to it as soon as it answers";
const LEFT: &str = "the wearable was left in the middle of a calibration, and its stiffness means nothing: calibrate again, or recall a person";

impl Engine {
    /// Why stiffness means nothing, if so: the wearable works, or may work, with the levels of a measurement.
    pub(super) fn meaningless(&self) -> Option<&'static str> {
        if self.calibrating.under_way() {
            Some("somebody is being measured: finish or cancel that first")
        } else if self.calibrating.before.is_some() {
            Some(ON_ITS_WAY)
        } else {
            let in_use = self.wearable.calibration.as_ref();
            in_use.is_some_and(measures).then_some(LEFT)
        }
    }

    /// A person arms.
    pub(super) fn arm(&mut self) -> Result<(), String> {
        match self.meaningless() {
            Some(reason) => Err(reason.to_owned()),
            None => self.follow.arm(self.now_us),
        }
    }

    /// The wearable told what it works with.
    pub(super) fn told_calibration(&mut self) {
        if self.meaningless() == Some(LEFT) {
            self.tell(true, LEFT.to_owned());
        }
    }

    /// Sends back what was in use before, until it is there; the wearable was asked what it works with since the last attempt.
    pub(super) fn restore_due(&mut self, world: &mut impl World) {
        let Some(before) = self.calibrating.before else {
            return;
        };
        let quiet = self.calibrating.idle() && self.calibrating.recalled.is_none();
        if !quiet || self.wearable.unconfirmed || self.wearable.newest.is_none() {
            return;
        }
        match &self.wearable.calibration {
            Some(in_use) if measures(in_use) => self.send(Sent::Back, before, 1, world),
            Some(_) => self.calibrating.before = None,
            None => {}
        }
    }

    /// The run ends: nobody will be there for an answer.
    pub(super) fn leave(&mut self, world: &mut impl World) {
        if let Some(before) = self.calibrating.before
            && let Some(frame) = self.wearable.calibrate(before, self.now_us)
        {
            world.ask(self.now_us, Request::Frame(frame));
        }
    }
}

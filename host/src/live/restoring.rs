//! A person is measured with levels that mean nothing, and the wearable keeps what it is given: the levels of before go back
//! into it, whatever ends the measurement.

use super::calibrating::Sent;
use super::engine::Engine;
use super::request::Request;
use super::world::World;
use crate::calibration::{measures, unknown};

/// Why a robot is not to follow what this wearable says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum Unfollowable {
    /// A person is under the guide.
    #[error("somebody is being measured: finish or cancel that first")]
    Measuring,
    /// A measurement is over, and the levels of before are not back.
    #[error(
        "the wearable works with the levels of a measurement: what it had before goes back to it as soon as it answers"
    )]
    OnItsWay,
    /// Another run, or another host, did not end what it began.
    #[error(
        "the wearable was left in the middle of a calibration, and its stiffness means nothing: calibrate again, or recall a person"
    )]
    Left,
    /// They are neither measured nor the illustrative ones.
    #[error(
        "the wearable works with levels that were measured on nobody and that nobody knows: calibrate, or recall a person"
    )]
    Unknown,
    /// It was not asked yet, or not since it restarted or was calibrated.
    #[error("the wearable has not told its calibration yet: wait a second, then arm")]
    Untold,
}

impl Engine {
    /// Why stiffness means nothing, if so: the wearable works, or may work, with the levels of a measurement.
    pub(super) fn meaningless(&self) -> Option<Unfollowable> {
        if self.calibrating.under_way() {
            Some(Unfollowable::Measuring)
        } else if self.calibrating.before.is_some() {
            Some(Unfollowable::OnItsWay)
        } else {
            let in_use = self.wearable.calibration.as_ref();
            in_use.is_some_and(measures).then_some(Unfollowable::Left)
        }
    }

    /// Why nobody may arm, if so, whatever the gate says. The illustrative levels may be tried: the page says what they are.
    pub(super) fn unfollowable(&self) -> Option<Unfollowable> {
        self.meaningless().or(match &self.wearable.calibration {
            Some(_) if self.wearable.unconfirmed => Some(Unfollowable::Untold),
            Some(in_use) => unknown(in_use).then_some(Unfollowable::Unknown),
            None => Some(Unfollowable::Untold),
        })
    }

    /// A person arms.
    pub(super) fn arm(&mut self) -> Result<(), String> {
        match self.unfollowable() {
            Some(reason) => Err(reason.to_string()),
            None => self.follow.arm(self.now_us),
        }
    }

    /// The wearable told what it works with.
    pub(super) fn told_calibration(&mut self) {
        if let Some(reason @ (Unfollowable::Left | Unfollowable::Unknown)) = self.unfollowable() {
            self.tell(true, reason.to_string());
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

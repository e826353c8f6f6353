//! Somebody who was measured before wears the wearable again.

use super::calibrating::Sent;
use super::engine::Engine;
use super::world::World;
use crate::calibration::Profile;

impl Engine {
    /// Takes what is kept of a person; it goes to the wearable as soon as that has told what it is.
    pub(super) fn recall(
        &mut self,
        name: &str,
        profile: Option<Box<Profile>>,
    ) -> Result<(), String> {
        if !self.calibrating.idle() {
            return Err("somebody is being measured: finish or cancel that first".to_owned());
        }
        let profile =
            profile.ok_or_else(|| format!("nothing is kept of `{name}`: calibrate them"))?;
        self.calibrating.recalled = Some(profile);
        Ok(())
    }

    /// Sends it, unless the wearable works with it already.
    pub(super) fn recall_due(&mut self, world: &mut impl World) {
        let Some(in_use) = self
            .wearable
            .calibration
            .filter(|_| self.calibrating.idle())
        else {
            return;
        };
        let (Some(profile), Ok((muscles, semg_hz))) = (&self.calibrating.recalled, self.muscles())
        else {
            return;
        };
        let name = &profile.person.name;
        let problem = match profile.calibration() {
            Err(error) => format!("what is kept of {name}: {error}"),
            Ok(calibration) if calibration == in_use => return self.recalled(),
            Ok(calibration) => {
                let used = usize::from(calibration.channels);
                let same_muscles = calibration.muscles.get(..used) == Some(&muscles[..]);
                if same_muscles && calibration.semg_hz.to_bits() == semg_hz.to_bits() {
                    // What was followed until now was felt by other numbers.
                    self.follow.disarm();
                    return self.send(Sent::Recalled, calibration, 1, world);
                }
                format!(
                    "{name} was measured by another wearable: {used} channels at {} scans a second, this one has {} at \
                     {semg_hz}, or they sit elsewhere; calibrate again",
                    calibration.semg_hz,
                    muscles.len()
                )
            }
        };
        self.calibrating.recalled = None;
        self.tell(true, problem);
    }

    /// The wearable works with it.
    pub(super) fn recalled(&mut self) {
        if let Some(profile) = self.calibrating.recalled.take() {
            self.know(profile);
        }
    }
}

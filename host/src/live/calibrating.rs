//! The guided calibration and the check of the fit, as the engine runs them.

use tonus_shared::semg::quality::Quality;
use tonus_shared::wire::{Calibration, MAX_CHANNELS, Muscle, Reply, Stream};

use super::engine::Engine;
use super::input::Act;
use super::request::{Prompt, Request};
use super::view::{CalibrationView, FitView, Lamp};
use super::wearable::{Calibrated, Wearable};
use super::world::World;
use crate::calibration::{
    CalibrationResult, FitCheck, Guide, Measured, Outcome, Person, Profile, StepView, Verdict,
    measures, volts,
};

/// A calibration that is not answered is sent so many times.
const ATTEMPTS: u32 = 4;

/// What is measured.
#[derive(Debug)]
enum Under {
    /// A person.
    Guide(Box<Guided>),
    /// Whether the wearable sits as it did.
    Check(Box<FitCheck>),
}

#[derive(Debug)]
struct Guided {
    person: Person,
    guide: Guide,
}

/// Why a calibration was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sent {
    ToMeasure,
    ToUse,
    Back,
    Recalled,
}

/// What is held of calibrating.
#[derive(Debug, Default)]
pub(super) struct Calibrating {
    under: Option<Under>,
    /// On its way to the wearable.
    sent: Option<(Sent, Calibration, u32)>,
    /// What was in use before somebody was measured, until that or something measured is in the wearable.
    pub(super) before: Option<Calibration>,
    /// The last one that was measured, here or before.
    known: Option<Box<Profile>>,
    /// Somebody measured before, as soon as the wearable says what it works with.
    pub(super) recalled: Option<Box<Profile>>,
    verdict: Option<Verdict>,
}

impl Calibrating {
    /// Whether nobody is measured and nothing is on its way.
    pub(super) fn idle(&self) -> bool {
        self.under.is_none() && self.sent.is_none()
    }

    /// Whether steps may be measured: the wearable answered.
    fn ready(&self) -> bool {
        self.under.is_some() && self.sent.is_none()
    }

    /// Whether somebody is asked for something here.
    pub(super) fn busy(&self) -> bool {
        self.under.is_some()
    }

    /// Whether somebody is being measured: what the stiffness says means nothing then.
    pub(super) fn under_way(&self) -> bool {
        matches!(self.under, Some(Under::Guide(_)))
    }

    fn step(&self) -> Option<StepView> {
        match self.under.as_ref()? {
            Under::Guide(guided) => Some(guided.guide.view()),
            Under::Check(check) => Some(check.view()),
        }
    }

    /// How much is over of the step in which the elbow is bent and the upper arm hangs, while it is measured.
    pub(super) fn bent(&self) -> Option<f64> {
        if !self.ready() || self.prompt() != Prompt::Flex {
            return None;
        }
        self.step()
            .filter(|step| step.measuring)
            .map(|step| step.progress)
    }

    fn prompt(&self) -> Prompt {
        match &self.under {
            None => Prompt::Free,
            Some(Under::Guide(guided)) => guided.guide.task().into(),
            Some(Under::Check(check)) => check.task().into(),
        }
    }

    /// What is being found, or else what stands behind the calibration in use.
    fn result(&self, in_use: Option<&Calibration>) -> Option<CalibrationResult> {
        if let Some(Under::Guide(guided)) = &self.under {
            return guided.guide.result().map(|outcome| outcome.result.clone());
        }
        let known = self.known.as_ref()?;
        let stands = known
            .calibration()
            .is_ok_and(|measured| Some(&measured) == in_use);
        stands.then(|| known.result.clone())
    }

    fn outcome(&self) -> Option<&Outcome> {
        match self.under.as_ref()? {
            Under::Guide(guided) => guided.guide.result(),
            Under::Check(_) => None,
        }
    }

    /// What is to be seen of a wearable.
    pub(super) fn view(&self, wearable: &Wearable) -> CalibrationView {
        let in_use = wearable.calibration.as_ref();
        let name = |calibration: &Calibration| match &self.known {
            Some(known) => known.person.name.clone(),
            None => format!("revision {}", calibration.revision),
        };
        CalibrationView {
            // Whoever runs the engine knows.
            people: Vec::new(),
            in_use: (in_use.filter(|calibration| calibration.revision != 0)).map(name),
            waiting: self.sent.is_some() || wearable.newest.is_some() && !wearable.introduced(),
            step: self.step(),
            result: self.result(in_use),
            fit: self.verdict.as_ref().map(|verdict| FitView {
                lamp: if verdict.findings.is_empty() {
                    Lamp::Good
                } else {
                    Lamp::Bad
                },
                text: verdict.text.clone(),
            }),
        }
    }
}

impl Engine {
    /// An act of calibrating.
    pub(super) fn calibrate(&mut self, act: Act, world: &mut impl World) -> Result<(), String> {
        match act {
            Act::Calibrate(person) => self.begin_guide(person, world),
            Act::Recall { name, profile } => self.recall(&name, profile),
            Act::CheckFit => self.begin_check(),
            Act::CalibrationStep => {
                if !self.calibrating.ready() {
                    return Err("wait until the wearable has answered".to_owned());
                }
                match &mut self.calibrating.under {
                    Some(Under::Guide(guided)) => guided.guide.start(),
                    Some(Under::Check(check)) => check.start(),
                    None => {}
                }
                let prompt = self.calibrating.prompt();
                world.ask(self.now_us, Request::Prompt(prompt));
                Ok(())
            }
            Act::CalibrationNext => {
                let on = match &mut self.calibrating.under {
                    Some(Under::Guide(guided)) => guided.guide.go_on(),
                    Some(Under::Check(check)) => check.go_on(),
                    None => false,
                };
                if on {
                    Ok(())
                } else {
                    Err("this step is not measured yet: start it first".to_owned())
                }
            }
            Act::CalibrationBack => self.back(world),
            Act::CalibrationUse => self.use_outcome(world),
            _ => self.cancel(world),
        }
    }

    pub(super) fn muscles(&self) -> Result<(Vec<Muscle>, f32), String> {
        let configuration = self.wearable.configuration.as_ref();
        let configuration = configuration.ok_or("no wearable streams yet: connect it first")?;
        let used = usize::from(configuration.channels);
        let muscles = configuration.muscles.iter().take(used).copied();
        Ok((muscles.collect(), configuration.semg_hz))
    }

    fn begin_guide(&mut self, person: Person, world: &mut impl World) -> Result<(), String> {
        if !self.calibrating.idle() {
            return Err("somebody is being measured: finish or cancel that first".to_owned());
        }
        let name = Person::name_of(&person.name).map_err(|error| error.to_string())?;
        let person = Person { name, ..person };
        let (muscles, semg_hz) = self.muscles()?;
        let before = self.wearable.calibration;
        let told = before.ok_or("the wearable has not told its calibration yet: wait a second")?;
        let before = self.calibrating.before.unwrap_or(told);
        let revision = before.revision.wrapping_add(1).max(1);
        let guide = Guide::begin(&person, &muscles, semg_hz, revision);
        let guide = guide.map_err(|error| error.to_string())?;
        self.follow.disarm();
        self.calibrating.verdict = None;
        let measuring = guide.measuring();
        self.calibrating.under = Some(Under::Guide(Box::new(Guided { person, guide })));
        // A wearable that was left in the middle of one has nothing to go back to.
        self.calibrating.before = Some(before).filter(|before| !measures(before));
        self.send(Sent::ToMeasure, measuring, 1, world);
        Ok(())
    }

    fn begin_check(&mut self) -> Result<(), String> {
        if self.calibrating.under.is_some() {
            return Err("somebody is being measured: finish or cancel that first".to_owned());
        }
        let (muscles, _) = self.muscles()?;
        let known = self.calibrating.known.as_ref();
        let known = known.ok_or("nobody was calibrated yet: calibrate first")?;
        let check = FitCheck::begin(known.pattern.clone(), &muscles);
        let check = check.map_err(|error| error.to_string())?;
        self.calibrating.verdict = None;
        self.calibrating.under = Some(Under::Check(Box::new(check)));
        Ok(())
    }

    fn use_outcome(&mut self, world: &mut impl World) -> Result<(), String> {
        if self.calibrating.sent.is_some() {
            return Err("wait until the wearable has answered".to_owned());
        }
        let outcome = self.calibrating.outcome();
        let outcome = outcome.ok_or("the calibration is not finished: measure every step")?;
        let calibration = outcome.calibration;
        self.send(Sent::ToUse, calibration, 1, world);
        Ok(())
    }

    fn back(&mut self, world: &mut impl World) -> Result<(), String> {
        if self.calibrating.sent.is_some() {
            return Err("wait until the wearable has answered".to_owned());
        }
        let back = match &mut self.calibrating.under {
            None => return Err("nobody is being measured".to_owned()),
            Some(Under::Guide(guided)) => guided.guide.back(),
            Some(Under::Check(check)) => check.back(),
        };
        if !back {
            return Err("this is the first step".to_owned());
        }
        // What was being measured is over.
        world.ask(self.now_us, Request::Prompt(Prompt::Free));
        Ok(())
    }

    fn cancel(&mut self, world: &mut impl World) -> Result<(), String> {
        let prompt = Request::Prompt(Prompt::Free);
        match self.calibrating.under.take() {
            None => return Err("nobody is being measured".to_owned()),
            Some(Under::Check(_)) => {}
            Some(Under::Guide(_)) => match self.calibrating.before {
                Some(before) => self.send(Sent::Back, before, 1, world),
                None => self.calibrating.sent = None,
            },
        }
        world.ask(self.now_us, prompt);
        Ok(())
    }

    pub(super) fn send(
        &mut self,
        why: Sent,
        calibration: Calibration,
        attempt: u32,
        world: &mut impl World,
    ) {
        let now_us = self.now_us;
        if let Some(frame) = self.wearable.calibrate(calibration, now_us) {
            self.calibrating.sent = Some((why, calibration, attempt));
            world.ask(now_us, Request::Frame(frame));
        } else {
            self.calibrating.sent = None;
            self.tell(
                true,
                "this calibration does not fit into a packet".to_owned(),
            );
        }
    }

    /// A reply came, or time passed: what became of the calibration on its way.
    pub(super) fn answered(&mut self, reply: Option<&Reply>, world: &mut impl World) {
        self.recall_due(world);
        self.restore_due(world);
        let Some(became) = self.wearable.calibrated(reply, self.now_us) else {
            return;
        };
        let Some((why, calibration, attempt)) = self.calibrating.sent.take() else {
            return;
        };
        match became {
            Calibrated::Done => {
                self.wearable.calibration = Some(calibration);
                if why == Sent::ToMeasure {
                    return;
                }
                self.wearable.unconfirmed = true;
                self.calibrating.before = None;
                match why {
                    Sent::ToUse => self.in_use(world),
                    Sent::Recalled => self.recalled(),
                    Sent::ToMeasure | Sent::Back => {}
                }
            }
            Calibrated::Silent if attempt < ATTEMPTS => {
                self.send(why, calibration, attempt + 1, world);
            }
            Calibrated::Silent | Calibrated::Refused(_) => {
                let because = match became {
                    Calibrated::Refused(refusal) => format!("it was refused: {refusal:?}"),
                    _ => "it does not answer".to_owned(),
                };
                self.tell(
                    true,
                    format!("the wearable did not take the calibration: {because}; try again"),
                );
                // Silence may be of the answer alone: it is to say what it works with.
                self.wearable.unconfirmed = true;
                match why {
                    Sent::ToMeasure => self.calibrating.under = None,
                    Sent::Recalled => self.calibrating.recalled = None,
                    Sent::Back if became != Calibrated::Silent => self.calibrating.before = None,
                    Sent::ToUse | Sent::Back => {}
                }
            }
        }
    }

    /// The wearable works with what was measured.
    fn in_use(&mut self, world: &mut impl World) {
        if let Some(Under::Guide(guided)) = self.calibrating.under.take()
            && let Some(outcome) = guided.guide.result()
        {
            let profile = Profile::new(&guided.person, outcome);
            world.measured(&profile);
            self.know(Box::new(profile));
        }
    }

    pub(super) fn know(&mut self, profile: Box<Profile>) {
        let text = format!("the calibration of {} is in use", profile.person.name);
        self.calibrating.known = Some(profile);
        self.calibrating.verdict = None;
        self.tell(false, text);
    }

    /// One instant for whatever is measured.
    pub(super) fn measure(&mut self, acquired_us: u64, stream: &Stream) {
        if !self.calibrating.ready() {
            return;
        }
        let Some(in_use) = self.wearable.calibration else {
            return;
        };
        let hand_m = self.hand.map(|hand| hand.position_m);
        let mut envelope_v = [0.0; MAX_CHANNELS];
        let mut good = [false; MAX_CHANNELS];
        for channel in 0..MAX_CHANNELS {
            let (rest_v, mvc_v) = (in_use.rest_v[channel], in_use.mvc_v[channel]);
            let share = stream.envelopes[channel];
            envelope_v[channel] = volts(share, rest_v, mvc_v).unwrap_or(f64::from(rest_v));
            let quality = stream.quality[channel];
            good[channel] = quality == Quality::GOOD || quality == Quality::HUM;
        }
        let used = usize::from(stream.channels).min(MAX_CHANNELS);
        let measured = Measured {
            envelope_v: &envelope_v[..used],
            good: &good[..used],
            hand_m,
        };
        match &mut self.calibrating.under {
            Some(Under::Guide(guided)) => guided.guide.sample(acquired_us, &measured),
            Some(Under::Check(check)) => {
                check.sample(acquired_us, &measured);
                if let Some(verdict) = check.verdict() {
                    self.calibrating.verdict = Some(verdict.clone());
                    self.calibrating.under = None;
                }
            }
            None => {}
        }
    }
}

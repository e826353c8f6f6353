//! A person at a terminal who calibrates or records: told what to do line by line, answering with Enter.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::mpsc::{Receiver, TryRecvError};

use super::hands::Hands;
use crate::live::{Act, CalibrationResult, Person, StepView, View};

/// What the person at the terminal pressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pressed {
    /// Enter alone, or behind anything that means nothing here.
    Enter,
    /// `b` and Enter: back.
    Back,
    /// `a` and Enter: arm.
    Arm,
}

impl From<&str> for Pressed {
    fn from(line: &str) -> Self {
        match line.trim() {
            "b" | "B" => Self::Back,
            "a" | "A" => Self::Arm,
            _ => Self::Enter,
        }
    }
}

/// Lines, as the person at the terminal ends them.
#[derive(Debug)]
pub struct Enter(Option<Receiver<Pressed>>);

impl Enter {
    /// Nobody needs to press anything: for simulated people.
    #[must_use]
    pub fn at_once() -> Self {
        Self(None)
    }

    /// As the keyboard, or whoever else hears it, tells.
    #[must_use]
    pub fn of(lines: Receiver<Pressed>) -> Self {
        Self(Some(lines))
    }

    /// As [`Enter::heard`], where nothing can be armed.
    fn pressed(&mut self) -> Result<Option<Pressed>, Gone> {
        let heard = self.heard()?;
        Ok(heard.map(|pressed| match pressed {
            Pressed::Arm => Pressed::Enter,
            other => other,
        }))
    }

    /// What was pressed since the last time, if anything; an error when nobody will ever press anything again.
    pub(super) fn heard(&mut self) -> Result<Option<Pressed>, Gone> {
        match self.0.as_ref().map(Receiver::try_recv) {
            None => Ok(Some(Pressed::Enter)),
            Some(Ok(pressed)) => Ok(Some(pressed)),
            Some(Err(TryRecvError::Empty)) => Ok(None),
            Some(Err(TryRecvError::Disconnected)) => Err(Gone),
        }
    }
}

/// Nobody sits at the terminal any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Gone;

/// Says lines; `tonus` prints them.
pub type Say = Box<dyn FnMut(&str)>;

/// Between two acts, microseconds.
const THINKS_US: u64 = 300_000;

/// Goes through the calibration step by step.
pub struct Calibrates {
    person: Person,
    enter: Enter,
    say: Say,
    begun: bool,
    used: bool,
    /// Whether the person went back to the step that is shown, though it is measured.
    back: bool,
    asked: Option<(u32, bool)>,
    acted_us: u64,
    done: bool,
    finished: Rc<Cell<bool>>,
}

impl Calibrates {
    /// For this person.
    #[must_use]
    pub fn new(person: Person, enter: Enter, say: Say) -> Self {
        Self {
            person,
            enter,
            say,
            begun: false,
            used: false,
            back: false,
            asked: None,
            acted_us: 0,
            done: false,
            finished: Rc::default(),
        }
    }

    /// Becomes true when the calibration is in use.
    #[must_use]
    pub fn finished(&self) -> Rc<Cell<bool>> {
        Rc::clone(&self.finished)
    }

    fn act(&mut self, view: &View) -> Option<Act> {
        let calibration = &view.calibration;
        if calibration.waiting {
            return None;
        }
        let Some(step) = &calibration.step else {
            if self.begun {
                // In use, or refused: then a message says why.
                self.done = true;
                self.finished.set(self.used);
                return None;
            }
            self.begun = view.link.up && view.semg.is_some();
            return self.begun.then(|| Act::Calibrate(self.person.clone()));
        };
        if step.measuring {
            return None;
        }
        let ready = step.name == "result" && calibration.result.is_some();
        if step.done && !ready && !self.back {
            return Some(Act::CalibrationNext);
        }
        let asked = (step.number, step.problem.is_some());
        if self.asked != Some(asked) {
            self.asked = Some(asked);
            (self.say)(&question(step, calibration.result.as_ref()));
        }
        let act = match self.enter.pressed() {
            Ok(None) => return None,
            Ok(Some(Pressed::Back)) if step.number == 1 => return None,
            Ok(Some(Pressed::Back)) => {
                self.back = true;
                Act::CalibrationBack
            }
            Ok(Some(_)) | Err(Gone) if ready => {
                self.used = true;
                Act::CalibrationUse
            }
            // There is nothing to begin where everything is measured and yet tells nothing.
            Ok(Some(_)) if step.name == "result" => return self.give_up(),
            Ok(Some(_)) => {
                self.back = false;
                Act::CalibrationStep
            }
            Err(Gone) => return self.give_up(),
        };
        self.asked = None;
        Some(act)
    }

    fn give_up(&mut self) -> Option<Act> {
        self.done = true;
        Some(Act::CalibrationCancel)
    }
}

/// What to do and what to press.
fn question(step: &StepView, result: Option<&CalibrationResult>) -> String {
    if let Some(result) = result {
        let [a, b, c, d] = result.rest_stiffness_nm_per_rad.map(|k| k.value);
        return format!(
            "l1 {:.2} ± {:.2}, l2 {:.2} ± {:.2}, joints {a:.1} {b:.1} {c:.1} {d:.1} N m/rad, the fit leaves {:.1} mm. \
             Enter uses this, b and Enter goes back.",
            result.l1.value, result.l1.std, result.l2.value, result.l2.std, result.residual_mm
        );
    }
    let problem = (step.problem.as_ref()).map_or(String::new(), |problem| format!("{problem}\n"));
    let StepView {
        number,
        of,
        instruction,
        ..
    } = step;
    let keys = match (step.name.as_str(), step.done, number) {
        ("result", ..) => "b and Enter goes back, Enter gives up.",
        (_, true, _) => "It is measured: Enter measures it again, b and Enter goes back further.",
        (_, false, 1) => "Enter begins.",
        (_, false, _) => "Enter begins, b and Enter goes back.",
    };
    format!("{problem}step {number} of {of}: {instruction} {keys}")
}

impl Hands for Calibrates {
    fn look(&mut self, view: &View) -> Vec<Act> {
        if self.done || view.at_us < self.acted_us + THINKS_US {
            return Vec::new();
        }
        let act = self.act(view);
        if act.is_some() {
            self.acted_us = view.at_us;
        }
        act.into_iter().collect()
    }

    fn over(&self) -> bool {
        self.done
    }
}

/// Records demonstrations of one skill, one after another.
pub struct Records {
    label: String,
    count: usize,
    enter: Enter,
    /// A simulated person needs so long for one, microseconds; a real one says when.
    lasts_us: Option<u64>,
    say: Say,
    begun_us: Option<u64>,
    asked: bool,
    told: usize,
    acted_us: u64,
    done: bool,
}

impl Records {
    /// `count` demonstrations of `label`. `lasts_us`: each ends by itself after this time; otherwise by Enter.
    #[must_use]
    pub fn new(label: String, count: usize, enter: Enter, lasts_us: Option<u64>, say: Say) -> Self {
        Self {
            label,
            count,
            enter,
            lasts_us,
            say,
            begun_us: None,
            asked: false,
            told: 0,
            acted_us: 0,
            done: false,
        }
    }

    fn act(&mut self, view: &View) -> Option<Act> {
        let made = view.demonstrations.len();
        if let Some(kept) = view.demonstrations.get(self.told) {
            self.told += 1;
            let outcome = kept.problem.clone().unwrap_or_else(|| {
                let [from_s, to_s] = kept.kept_s;
                format!("{:.2} s of movement, {} instants", to_s - from_s, kept.rows)
            });
            (self.say)(&format!("demonstration {}: {outcome}", kept.id));
        }
        if made >= self.count {
            self.done = true;
            return None;
        }
        if let Some(begun_us) = self.begun_us {
            let over = match self.lasts_us {
                Some(lasts_us) => view.at_us >= begun_us + lasts_us,
                // Nobody will press it any more: it is over.
                None => self
                    .enter
                    .pressed()
                    .map_or(true, |pressed| pressed.is_some()),
            };
            if over && view.recording.is_some() {
                self.begun_us = None;
                self.asked = false;
                return Some(Act::Stop);
            }
            return None;
        }
        let ready = view.link.up && view.semg.is_some() && view.tracker.up;
        if !ready || view.recording.is_some() {
            return None;
        }
        if !self.asked {
            self.asked = true;
            (self.say)(&format!(
                "{} {} of {}: Enter begins, Enter ends.",
                self.label,
                made + 1,
                self.count
            ));
        }
        match self.enter.pressed() {
            Ok(Some(_)) => {
                self.begun_us = Some(view.at_us);
                Some(Act::Record {
                    label: self.label.clone(),
                })
            }
            Ok(None) => None,
            Err(Gone) => {
                self.done = true;
                None
            }
        }
    }
}

impl Hands for Records {
    fn look(&mut self, view: &View) -> Vec<Act> {
        if self.done || view.at_us < self.acted_us + THINKS_US {
            return Vec::new();
        }
        let act = self.act(view);
        if act.is_some() {
            self.acted_us = view.at_us;
        }
        act.into_iter().collect()
    }

    fn over(&self) -> bool {
        self.done
    }
}

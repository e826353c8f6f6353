//! The guided calibration of the scripted program: steps that are measured when asked, a result, a check of the fit.

use tonus::live::{CalibrationResult, CalibrationView, Estimate, FitView, Lamp, StepView};

/// Steps of the calibration, with how much of the maximum the person gives in each.
const STEPS: [(&str, &str, f64); 4] = [
    ("rest", "Let the arm hang and all muscles go.", 0.0),
    (
        "contract",
        "Contract all muscles of the upper arm with all your strength.",
        1.0,
    ),
    (
        "load",
        "Hold 1 kg in your hand at the height of the elbow and press the muscles against each other, about 30 %.",
        0.3,
    ),
    (
        "result",
        "This was measured. Use it, or cancel and begin again.",
        0.0,
    ),
];
const FIT: [(&str, &str, f64); 2] = [
    ("fit_flex", "Bend the elbow against the table's edge.", 0.4),
    ("fit_extend", "Press the hand down on the table.", 0.4),
];
/// A measurement, a learning and the way to a decision last so long, seconds.
const MEASURE_S: f64 = 1.0;
/// The wearable answers a calibration after so long, seconds.
const ANSWER_S: f64 = 1.0;

/// A calibration, or the check of the fit.
#[derive(Default)]
pub(crate) struct Guided {
    pub(crate) view: CalibrationView,
    channels: usize,
    person: Option<String>,
    checks_fit: bool,
    /// When the measurement of the step under way began.
    measuring_since_s: Option<f64>,
    /// When the wearable answers, and whether the person's calibration is in use then.
    answers: Option<(f64, bool)>,
    /// So many steps are measured.
    measured: u32,
}

impl Guided {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            channels,
            view: CalibrationView {
                people: vec!["ben".into(), "p07".into()],
                ..CalibrationView::default()
            },
            ..Self::default()
        }
    }

    pub(crate) fn recall(&mut self, name: String) {
        self.view.in_use = Some(name);
        self.view.result = Some(self.result());
    }

    pub(crate) fn begin(&mut self, person: Option<String>, checks_fit: bool, now_s: f64) {
        self.person = person;
        self.checks_fit = checks_fit;
        self.view.result = None;
        self.view.fit = None;
        self.measured = 0;
        self.answers = (!checks_fit).then_some((now_s + ANSWER_S, false));
        self.go_to(1);
    }

    /// Whether the wearable has answered.
    pub(crate) fn start(&mut self, now_s: f64) -> bool {
        let ready = self.answers.is_none();
        if ready {
            self.measuring_since_s = Some(now_s);
        }
        ready
    }

    pub(crate) fn use_result(&mut self, now_s: f64) {
        self.answers = Some((now_s + ANSWER_S, true));
    }

    pub(crate) fn cancel(&mut self) {
        self.view.step = None;
    }

    fn go_to(&mut self, number: u32) {
        let steps: &[_] = if self.checks_fit { &FIT } else { &STEPS };
        let (name, instruction, _) = steps[number as usize - 1];
        self.measuring_since_s = None;
        self.view.step = Some(StepView {
            name: name.into(),
            number,
            of: steps.len() as u32,
            instruction: instruction.into(),
            done: name == "result" || number <= self.measured,
            progress: if number <= self.measured { 1.0 } else { 0.0 },
            ..StepView::default()
        });
        self.view.result = (name == "result").then(|| self.result());
    }

    /// Whether there is one before.
    pub(crate) fn back(&mut self) -> bool {
        let number = self.view.step.as_ref().map_or(0, |step| step.number);
        if number > 1 {
            self.go_to(number - 1);
        }
        number > 1
    }

    /// Whether there was a next one that is not measured.
    pub(crate) fn next_step(&mut self) -> bool {
        let Some(step) = self.view.step.take_if(|step| step.done) else {
            return false;
        };
        if self.measured < step.of {
            self.go_to(self.measured + 1);
            return true;
        }
        let text = "The wearable sits as it did.".into();
        self.view.fit = Some(FitView {
            lamp: Lamp::Good,
            text,
        });
        true
    }

    /// What the person gives in the step that is measured.
    pub(crate) fn effort(&self) -> f64 {
        let steps = STEPS.iter().chain(&FIT);
        let name = self.view.step.as_ref().map_or("", |step| &step.name);
        let effort = steps
            .filter(|step| step.0 == name)
            .map(|step| step.2)
            .next();
        self.measuring_since_s.and(effort).unwrap_or(0.0)
    }

    pub(crate) fn measure(&mut self, now_s: f64) {
        if let Some((_, in_use)) = self.answers.take_if(|(at_s, _)| *at_s <= now_s)
            && in_use
        {
            self.view.in_use = self.person.take();
            self.view.step = None;
        }
        self.view.waiting = self.answers.is_some();
        let (Some(step), Some(since_s)) = (&mut self.view.step, self.measuring_since_s) else {
            return;
        };
        step.progress = ((now_s - since_s) / MEASURE_S).min(1.0);
        step.done = step.progress >= 1.0;
        step.measuring = !step.done;
        if step.done {
            self.measured = self.measured.max(step.number);
            self.measuring_since_s = None;
        }
    }

    fn result(&self) -> CalibrationResult {
        let estimate = |value, std| Estimate { value, std };
        let rest_stiffness_nm_per_rad = [13.1, 12.6, 11.9, 12.4].map(|value| estimate(value, 1.3));
        CalibrationResult {
            rest_uv: vec![estimate(4.2, 0.3); self.channels],
            mvc_uv: vec![estimate(612.0, 18.0); self.channels],
            l1: estimate(3.9, 0.4),
            l2: estimate(1.1, 0.2),
            rest_stiffness_nm_per_rad,
            residual_mm: 2.3,
            notes: vec!["The loads do not tell shoulder 3: the value is the prior's.".into()],
        }
    }
}

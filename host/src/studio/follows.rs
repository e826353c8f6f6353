//! A person at a terminal whom a robot follows: told what is recognised, arming and disarming by key.

use super::hands::Hands;
use super::terminal::{Enter, Pressed, Say};
use crate::live::{Act, Lamp, RecognitionView, View};

/// Tells what changes, and arms on `a` and Enter alone; Enter disarms.
pub struct Follows {
    enter: Enter,
    say: Say,
    link: Option<bool>,
    bad: Vec<String>,
    robot: String,
    recognised: Option<String>,
}

impl Follows {
    /// What is pressed, and who tells.
    #[must_use]
    pub fn new(enter: Enter, say: Say) -> Self {
        Self {
            enter,
            say,
            link: None,
            bad: Vec::new(),
            robot: String::new(),
            recognised: None,
        }
    }

    fn tell(&mut self, view: &View) {
        if self.link != Some(view.link.up) {
            self.link = Some(view.link.up);
            (self.say)(&view.link.text);
        }
        let bad = channels(view);
        if bad != self.bad {
            let text = bad.join("; ");
            self.bad = bad;
            let good = "every channel is clean".to_owned();
            (self.say)(if text.is_empty() { &good } else { &text });
        }
        let robot = robot(view);
        if robot != self.robot {
            (self.say)(&robot);
            self.robot = robot;
        }
        let recognised = view.recognition.as_ref().and_then(recognised);
        if recognised != self.recognised {
            if let Some(text) = &recognised {
                (self.say)(text);
            }
            self.recognised = recognised;
        }
    }

    fn act(&mut self, view: &View) -> Option<Act> {
        let disarmed = view.robot.state == "disarmed";
        // Where nobody can press anything any more, nobody arms; a robot that follows goes on until the program ends.
        match self.enter.heard() {
            Ok(Some(Pressed::Arm)) if disarmed => Some(Act::Arm),
            Ok(Some(Pressed::Arm) | None) | Err(_) => None,
            Ok(Some(Pressed::Enter | Pressed::Back)) if disarmed => {
                (self.say)("the robot is disarmed: a and Enter arms");
                None
            }
            Ok(Some(Pressed::Enter | Pressed::Back)) => Some(Act::Disarm),
        }
    }
}

/// What is wrong with which channel.
fn channels(view: &View) -> Vec<String> {
    let channels = view.semg.iter().flat_map(|semg| &semg.channels);
    let bad = channels.filter(|channel| channel.lamp == Lamp::Bad);
    let text = |warnings: &[String]| warnings.join(", ");
    bad.map(|channel| format!("{}: {}", channel.muscle, text(&channel.warnings)))
        .collect()
}

fn robot(view: &View) -> String {
    let robot = &view.robot;
    let key = match (robot.state.as_str(), robot.can_arm) {
        ("disarmed", true) => "; a and Enter arms",
        ("disarmed", false) => "",
        _ => "; Enter disarms",
    };
    let state = robot.state.replace('_', " ");
    format!("robot {state}: {}{key}", robot.reason)
}

/// What a movement under way is taken for, once it is known.
fn recognised(recognition: &RecognitionView) -> Option<String> {
    if !recognition.under_way {
        return None;
    }
    if recognition.unknown {
        let nearest = recognition.nearest.as_deref();
        let nearest = nearest.map_or(String::new(), |skill| format!(", nearest to {skill}"));
        return Some(format!("a movement of no skill{nearest}: the robot holds"));
    }
    let (label, after_s) = recognition.decision.as_ref()?;
    Some(format!("{label}, recognised after {after_s:.1} s"))
}

impl Hands for Follows {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.tell(view);
        self.act(view).into_iter().collect()
    }

    /// Ctrl-C ends it.
    fn over(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;
    use std::sync::mpsc::channel;

    use super::*;

    fn view(state: &str, can_arm: bool) -> View {
        let mut view = View::default();
        view.robot.state = state.to_owned();
        view.robot.reason = "some reason".to_owned();
        view.robot.can_arm = can_arm;
        view
    }

    #[test]
    fn only_its_key_arms_and_enter_disarms() {
        let (person, lines) = channel();
        let mut follows = Follows::new(Enter::of(lines), Box::new(|_| {}));
        let (off, on) = (view("disarmed", true), view("holding", false));
        let mut pressed = |pressed: Option<&str>, view: &View| {
            if let Some(line) = pressed {
                person.send(Pressed::from(line)).unwrap();
            }
            follows.look(view)
        };
        assert_eq!(pressed(None, &off), []);
        assert_eq!(pressed(Some(""), &off), []);
        assert_eq!(pressed(Some("yes"), &off), []);
        assert_eq!(pressed(Some("a"), &off), [Act::Arm]);
        assert_eq!(pressed(Some("a"), &on), []);
        assert_eq!(pressed(None, &on), []);
        assert_eq!(pressed(Some(""), &on), [Act::Disarm]);
        assert_eq!(pressed(Some("b"), &on), [Act::Disarm]);
        drop(person);
        assert_eq!(follows.look(&off), []);
    }

    #[test]
    fn what_changes_is_told_once() {
        let told = Rc::new(RefCell::new(Vec::new()));
        let say = Rc::clone(&told);
        let (_person, lines) = channel();
        let enter = Enter::of(lines);
        let mut follows = Follows::new(
            enter,
            Box::new(move |text| say.borrow_mut().push(text.to_owned())),
        );
        let mut now = view("disarmed", true);
        now.link.text = "connected".to_owned();
        now.link.up = true;
        for _ in 0..3 {
            let _acts = follows.look(&now);
        }
        now.robot.state = "falling_back".to_owned();
        now.recognition = Some(RecognitionView {
            under_way: true,
            decision: Some(("lift_book".to_owned(), 0.84)),
            ..RecognitionView::default()
        });
        for _ in 0..3 {
            let _acts = follows.look(&now);
        }
        if let Some(recognition) = &mut now.recognition {
            recognition.unknown = true;
            recognition.nearest = Some("lift_box".to_owned());
        }
        let _acts = follows.look(&now);
        assert_eq!(
            *told.borrow(),
            [
                "connected",
                "robot disarmed: some reason; a and Enter arms",
                "robot falling back: some reason; Enter disarms",
                "lift_book, recognised after 0.8 s",
                "a movement of no skill, nearest to lift_box: the robot holds",
            ]
        );
    }
}

//! One demonstration of many that nothing can be learnt from.

use tonus::live::{Act, View};
use tonus::source::simulated::SimulatedConfig;
use tonus::studio::story::Story;
use tonus::studio::virtually::Someone;

use crate::world::run;

#[derive(Default, PartialEq, Clone, Copy)]
enum Still {
    #[default]
    Before,
    Recording,
    Over,
}

/// Records one more before they train, in which nobody moves.
#[derive(Default)]
struct Forgets {
    story: Story,
    still: Still,
    skills: Vec<(String, u32)>,
    told: Vec<String>,
}

impl Someone for Forgets {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.told = view.messages.iter().map(|told| told.text.clone()).collect();
        self.skills.clone_from(&view.library.skills);
        match self.still {
            Still::Before => {
                let acts = self.story.look(view);
                if acts != [Act::Train] {
                    return acts;
                }
                self.still = Still::Recording;
                let label = "nothing".to_owned();
                vec![Act::Record { label }, Act::Stop]
            }
            Still::Recording if view.recording.is_some() => Vec::new(),
            Still::Recording => {
                self.still = Still::Over;
                vec![Act::Train]
            }
            Still::Over => Vec::new(),
        }
    }

    fn over(&self) -> bool {
        let refused = self
            .told
            .iter()
            .any(|told| told.starts_with("demonstration"));
        self.still == Still::Over && (refused || !self.skills.is_empty()) || self.story.over()
    }
}

#[test]
fn a_demonstration_with_a_problem_is_left_out_and_named() {
    let forgets = run(SimulatedConfig::default(), Forgets::default(), 500);
    let labels: Vec<&str> = forgets
        .skills
        .iter()
        .map(|(label, _)| label.as_str())
        .collect();
    assert!(
        labels.len() > 1 && !labels.contains(&"nothing"),
        "{labels:?} {:?}",
        forgets.told
    );
    let named = |text: &String| text.contains("left out") && text.contains("(nothing)");
    assert!(forgets.told.iter().any(named), "{:?}", forgets.told);
}

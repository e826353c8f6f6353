//! What a view says beside the engine's words, and what of a view goes to the recording.

use crate::live::{Message, RecognitionView, View};
use crate::recording::Entry;

/// Problems of what surrounds the engine, each told once for as long as it is there.
#[derive(Debug, Default)]
pub(super) struct Problems {
    told: Vec<Message>,
}

impl Problems {
    /// Puts the problems that there are now between the view's messages, at the time at which each was first seen.
    pub(super) fn tell(&mut self, view: &mut View, now: impl IntoIterator<Item = String>) {
        let now: Vec<String> = now.into_iter().collect();
        self.told.retain(|told| now.contains(&told.text));
        for text in now {
            if !self.told.iter().any(|told| told.text == text) {
                self.told.push(Message {
                    at_us: view.at_us,
                    problem: true,
                    text,
                });
            }
        }
        view.messages.extend(self.told.iter().cloned());
        view.messages.sort_by_key(|message| message.at_us);
    }
}

/// What of the views is recorded already.
#[derive(Debug, Default)]
pub(super) struct Noted {
    messages: Vec<Message>,
    recognition: Option<RecognitionView>,
}

impl Noted {
    /// Each message that is new, and the recognition while a movement is under way or when it is another one.
    pub(super) fn entries(&mut self, view: &View) -> Vec<Entry> {
        let new = (view.messages.iter()).filter(|message| !self.messages.contains(message));
        let mut entries: Vec<Entry> = new.cloned().map(Entry::Message).collect();
        if self.messages != view.messages {
            self.messages.clone_from(&view.messages);
        }
        let Some(recognition) = view.recognition.as_ref().map(told) else {
            self.recognition = None;
            return entries;
        };
        let other = self.recognition.as_ref() != Some(&recognition);
        if other || recognition.under_way {
            entries.push(Entry::Recognition {
                at_us: view.at_us,
                recognition: recognition.clone(),
            });
            self.recognition = Some(recognition);
        }
        entries
    }
}

/// Without the paths, which are long and follow from the rest; a number that is none is nothing that was told.
fn told(recognition: &RecognitionView) -> RecognitionView {
    RecognitionView {
        labels: recognition.labels.clone(),
        posterior: recognition.posterior.clone(),
        under_way: recognition.under_way,
        phase: recognition.phase.filter(|phase| phase.is_finite()),
        decision: recognition.decision.clone(),
        unknown: recognition.unknown,
        unjudged: recognition.unjudged,
        nearest: recognition.nearest.clone(),
        novelty: recognition.novelty.filter(|novelty| novelty.is_finite()),
        human_path: Vec::new(),
        robot_path: Vec::new(),
        robot_stiffness_n_per_m: Vec::new(),
        history: recognition.history.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(at_us: u64, text: &str) -> Message {
        Message {
            at_us,
            problem: false,
            text: text.to_owned(),
        }
    }

    fn view(at_us: u64, messages: &[Message]) -> View {
        View {
            at_us,
            messages: messages.to_vec(),
            ..View::default()
        }
    }

    fn texts(view: &View) -> Vec<(u64, &str)> {
        let told = view.messages.iter();
        told.map(|message| (message.at_us, message.text.as_str()))
            .collect()
    }

    #[test]
    fn a_problem_keeps_its_time_while_it_is_there_and_comes_back_anew() {
        let mut problems = Problems::default();
        let full = || Some("the disk is full".to_owned());
        let mut first = view(10, &[message(5, "hello")]);
        problems.tell(&mut first, full());
        assert_eq!(texts(&first), [(5, "hello"), (10, "the disk is full")]);
        let mut second = view(50, &[message(5, "hello"), message(30, "learnt")]);
        problems.tell(&mut second, full());
        assert_eq!(
            texts(&second),
            [(5, "hello"), (10, "the disk is full"), (30, "learnt")]
        );
        let mut mended = view(90, &[]);
        problems.tell(&mut mended, None);
        assert_eq!(texts(&mended), []);
        let mut again = view(130, &[]);
        problems.tell(&mut again, full());
        assert_eq!(texts(&again), [(130, "the disk is full")]);
    }

    #[test]
    fn each_message_is_recorded_once_and_a_movement_view_by_view() {
        let mut noted = Noted::default();
        let [a, b, c] = [message(1, "a"), message(1, "b"), message(3, "a")];
        let entries = noted.entries(&view(40, &[a.clone(), b.clone()]));
        assert_eq!(
            entries,
            [Entry::Message(a.clone()), Entry::Message(b.clone())]
        );
        assert_eq!(noted.entries(&view(80, &[a, b.clone()])), []);
        // The oldest went out of sight; the same text at another time is another message.
        let entries = noted.entries(&view(120, &[b.clone(), c.clone()]));
        assert_eq!(entries, [Entry::Message(c.clone())]);

        let at_rest = RecognitionView {
            labels: vec!["lift_book".to_owned()],
            ..RecognitionView::default()
        };
        let moving = RecognitionView {
            under_way: true,
            novelty: Some(f64::INFINITY),
            ..at_rest.clone()
        };
        let recorded = RecognitionView {
            novelty: None,
            ..moving.clone()
        };
        let seen = [&at_rest, &at_rest, &moving, &moving, &at_rest, &at_rest];
        let mut kept = Vec::new();
        for (number, recognition) in (0..).zip(seen) {
            let view = View {
                at_us: number,
                recognition: Some(recognition.clone()),
                ..view(number, &[b.clone(), c.clone()])
            };
            for entry in noted.entries(&view) {
                let Entry::Recognition { at_us, recognition } = entry else {
                    panic!("no message is new");
                };
                kept.push((at_us, recognition));
            }
        }
        assert_eq!(
            kept,
            [
                (0, at_rest.clone()),
                (2, recorded.clone()),
                (3, recorded),
                (4, at_rest)
            ]
        );
    }
}

//! What people are told: messages, each once, and the movements that are over.

use super::engine::Engine;
use super::view::Message;
use crate::clock::Notice;
use crate::session::Session;

/// Messages that are kept to be seen.
const MESSAGES: usize = 30;
/// Movements that are kept to be seen.
const HISTORY: usize = 12;

/// The movement under way, to be told of when it ends.
#[derive(Debug, Default)]
pub(super) struct Moved {
    under_way: bool,
    best: Option<String>,
    unknown: bool,
}

impl Engine {
    /// What the wearable's clock did.
    pub(super) fn noticed(&mut self, notice: Notice) {
        // Commands of before are of another time, and only a person knows whether what follows is of this one.
        if let Notice::Rebooted { .. } | Notice::Stepped { .. } | Notice::Resumed { .. } = notice {
            self.follow.mistime();
        }
        match notice {
            Notice::Started { .. } => {}
            Notice::Rebooted { .. } => {
                // It may have been calibrated by another host, or another wearable may be there.
                self.wearable.unconfirmed = true;
                self.tell(true, "the wearable restarted".to_owned());
            }
            Notice::Stepped { by_us } => self.tell(
                true,
                format!("the wearable's clock stepped by {:.1} ms", by_us * 1e-3),
            ),
            Notice::Late { by_us } if by_us > 0.0 => self.tell(
                true,
                format!(
                    "the wearable's packets come {:.0} ms later than they did: they count as so much older",
                    by_us * 1e-3
                ),
            ),
            Notice::Late { .. } => {
                self.tell(false, "the wearable's packets come in time again".to_owned());
            }
            Notice::Resumed { silence_us } => self.tell(
                false,
                format!("the wearable is back after {} s", silence_us / 1_000_000),
            ),
        }
    }

    /// Tells of each movement when it is over.
    pub(super) fn remember(&mut self, session: &Session<'_>) {
        let under_way = session.under_way();
        if under_way {
            let labels = self.library.as_deref().map(|l| l.model.labels());
            let posterior = session.posterior();
            let best = (posterior.iter().enumerate()).max_by(|a, b| a.1.total_cmp(b.1));
            let label = best.and_then(|(skill, _)| labels?.get(skill).cloned());
            self.moved = Moved {
                under_way,
                best: label,
                unknown: session.unknown(),
            };
        } else if std::mem::take(&mut self.moved.under_way) {
            let label = self.moved.best.take().filter(|_| !self.moved.unknown);
            self.history.push(label);
            let extra = self.history.len().saturating_sub(HISTORY);
            self.history.drain(..extra);
        }
    }

    pub(super) fn tell(&mut self, problem: bool, text: String) {
        // What goes on happening is told once.
        if self.messages.last().is_some_and(|last| last.text == text) {
            return;
        }
        self.messages.push(Message {
            at_us: self.now_us,
            problem,
            text,
        });
        let extra = self.messages.len().saturating_sub(MESSAGES);
        self.messages.drain(..extra);
    }
}

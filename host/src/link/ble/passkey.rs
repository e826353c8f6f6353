//! Where a passkey that is wanted meets whoever knows it: people at a page and at a terminal, the first of whom counts.
//!
//! The digits go from them to the pairing and nowhere else: no view, recording or message holds them.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::AskPasskey;

/// Digits of a passkey.
const DIGITS: usize = 6;
/// So long people have: the wearable's own half of a pairing gives up 30 s after the last it heard (Bluetooth Core
/// Specification, volume 3, part H, 3.4), and the digits have to get there.
pub const LIMIT: Duration = Duration::from_secs(28);

/// Why digits are not taken. What was given is not told again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotTaken {
    /// Not six digits.
    #[error(
        "a passkey is {DIGITS} digits from 0 to 9, {got} characters were given: type what the wearable shows"
    )]
    Digits {
        /// Characters given.
        got: usize,
    },
    /// Nobody asks, or does not any more.
    #[error("no passkey is wanted now: it was given already, or the time for it is over")]
    NotWanted,
}

/// What is wanted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// The wearable that shows it.
    pub by: String,
    /// Time that is left to give it.
    pub left: Duration,
}

/// The meeting place; clones are the same one.
#[derive(Clone, Default)]
pub struct Passkeys {
    shared: Arc<(Mutex<Asking>, Condvar)>,
}

#[derive(Default)]
struct Asking {
    /// Who wants it, and until when.
    wanted: Option<(String, Instant)>,
    given: Option<u32>,
    /// Whether somebody at the terminal was asked and has not pressed Enter: that line cannot be taken back, so it counts
    /// for whatever is asked when it comes.
    terminal: bool,
    /// Whether a page can give it; otherwise nobody is waited for but the terminal.
    page: bool,
}

impl Passkeys {
    /// Nobody asks yet. `page`: people at a page may answer, so that a terminal where nobody sits does not end it.
    #[must_use]
    pub fn new(page: bool) -> Self {
        let passkeys = Self::default();
        passkeys.lock().page = page;
        passkeys
    }

    /// Asks here and at the terminal at once.
    #[must_use]
    pub fn asker(&self, terminal: AskPasskey) -> AskPasskey {
        let here = self.clone();
        Arc::new(move |name| here.ask(name, &terminal, LIMIT))
    }

    /// Asks everybody for the passkey that `name` shows and waits for the first who gives one, at most `limit`.
    pub fn ask(&self, name: &str, terminal: &AskPasskey, limit: Duration) -> Option<u32> {
        let until = Instant::now() + limit;
        {
            let mut asking = self.lock();
            asking.wanted = Some((name.to_owned(), until));
            asking.given = None;
        }
        self.ask_terminal(name, terminal);
        let (_, changed) = &*self.shared;
        let mut asking = self.lock();
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let nobody = !asking.page && !asking.terminal;
            if asking.given.is_some() || left.is_zero() || nobody {
                asking.wanted = None;
                return asking.given.take();
            }
            let waited = changed.wait_timeout(asking, left);
            asking = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// The terminal is asked on a thread of its own, which may wait there for ever.
    fn ask_terminal(&self, name: &str, terminal: &AskPasskey) {
        if std::mem::replace(&mut self.lock().terminal, true) {
            return;
        }
        let (here, name, ask) = (self.clone(), name.to_owned(), Arc::clone(terminal));
        let started = std::thread::Builder::new()
            .name("passkey".to_owned())
            .spawn(move || {
                let typed = ask(&name);
                here.lock().terminal = false;
                if let Some(passkey) = typed {
                    // Too late is too late; the pairing tells by itself.
                    let _taken = here.give(passkey);
                }
                here.shared.1.notify_all();
            });
        if started.is_err() {
            self.lock().terminal = false;
        }
    }

    /// What is wanted now, if anything.
    #[must_use]
    pub fn wanted(&self) -> Option<Wanted> {
        let asking = self.lock();
        let (by, until) = asking.wanted.as_ref()?;
        // Given, and on its way.
        asking.given.is_none().then(|| Wanted {
            by: by.clone(),
            left: until.saturating_duration_since(Instant::now()),
        })
    }

    /// Somebody gives it; the first counts.
    ///
    /// # Errors
    /// [`NotTaken`].
    pub fn give(&self, passkey: u32) -> Result<(), NotTaken> {
        let mut asking = self.lock();
        if asking.wanted.is_none() || asking.given.is_some() {
            return Err(NotTaken::NotWanted);
        }
        asking.given = Some(passkey);
        self.shared.1.notify_all();
        Ok(())
    }

    /// Every field is replaced in one step, so a thread that panicked left it whole.
    fn lock(&self) -> MutexGuard<'_, Asking> {
        self.shared.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Six digits as people type them; spaces around them do not count.
///
/// # Errors
/// [`NotTaken::Digits`].
pub fn passkey(typed: &str) -> Result<u32, NotTaken> {
    let typed = typed.trim();
    let digits = typed.len() == DIGITS && typed.bytes().all(|byte| byte.is_ascii_digit());
    let number = digits.then(|| typed.parse().ok()).flatten();
    number.ok_or(NotTaken::Digits {
        got: typed.chars().count(),
    })
}

#[cfg(test)]
mod tests;

//! The stream on a thread of its own.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::{Builder, JoinHandle};

use thiserror::Error;
use tonus_native::lsl::{Lsl, LslError};

use super::Broadcast;
use crate::clock::ClockConfig;
use crate::live::{Input, SessionClock, Timed};

/// Frames that wait: some seconds of them.
const QUEUE: usize = 1024;

/// Why nothing is sent.
#[derive(Debug, Error)]
pub enum SpeakerError {
    /// The library.
    #[error(transparent)]
    Lsl(#[from] LslError),
    /// The system gives no thread.
    #[error("no thread for the LSL stream: {0}")]
    Thread(#[from] std::io::Error),
}

/// Sends what the engine takes, which never waits for it.
#[derive(Debug)]
pub struct Speaker {
    frames: Option<SyncSender<Timed>>,
    thread: Option<JoinHandle<()>>,
    problem: Arc<OnceLock<String>>,
}

impl Speaker {
    /// Loads liblsl and waits for a wearable on this link, whose clock is read as `told` says.
    ///
    /// # Errors
    /// [`SpeakerError`].
    pub fn start(link: &str, told: ClockConfig, clock: SessionClock) -> Result<Self, SpeakerError> {
        let broadcast = Broadcast::new(Lsl::load(None)?, link, told);
        let (frames, received) = sync_channel(QUEUE);
        let problem = Arc::new(OnceLock::new());
        let told = Arc::clone(&problem);
        let speak = move || {
            if let Err(error) = speak(broadcast, &received, clock) {
                // The first one; there is no second.
                let _set = told.set(format!("the LSL stream ended: {error}"));
            }
        };
        let thread = Builder::new().name("lsl".to_owned()).spawn(speak)?;
        Ok(Self {
            frames: Some(frames),
            thread: Some(thread),
            problem,
        })
    }

    /// The engine took an input. One that finds no room is left out: listeners see the gap in the stamps.
    pub fn take(&self, at_us: u64, input: &Input) {
        if let (Input::Frame(_), Some(frames)) = (input, &self.frames) {
            let input = input.clone();
            let _left_out = frames.try_send(Timed { at_us, input });
        }
    }

    /// Why nothing is sent any more.
    #[must_use]
    pub fn problem(&self) -> Option<&str> {
        self.problem.get().map(String::as_str)
    }
}

impl Drop for Speaker {
    fn drop(&mut self) {
        self.frames = None;
        if let Some(thread) = self.thread.take() {
            // One that panicked has nothing more to send.
            let _ended = thread.join();
        }
    }
}

fn speak(
    mut broadcast: Broadcast,
    frames: &Receiver<Timed>,
    clock: SessionClock,
) -> Result<(), LslError> {
    while let Ok(timed) = frames.recv() {
        broadcast.take(&timed, clock.now_us())?;
    }
    Ok(())
}

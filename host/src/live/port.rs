//! The socket that a source plugs into: inputs in, requests out, one clock.
//!
//! Both ways are bounded. A full queue of inputs drops the new one and counts it: the engine is late then, and what it takes
//! counts from when it takes it. Only what a link says of itself waits for room.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel,
};
use std::time::{Duration, Instant};

use super::input::{Input, Timed};
use super::request::Request;

/// Inputs that wait for the engine: a second of everything.
const INPUTS: usize = 2048;
/// Requests that wait for a source.
const REQUESTS: usize = 256;

/// The session's clock: microseconds since it started.
#[derive(Clone, Copy, Debug)]
pub struct SessionClock {
    started: Instant,
    /// Seconds of session in a second.
    pace: f64,
}

impl SessionClock {
    /// Starts now.
    #[must_use]
    pub fn start() -> Self {
        Self::at_pace(1.0)
    }

    /// Starts now and runs so many times as fast: for a recording in the place of devices, whose clocks then all run so.
    #[must_use]
    pub fn at_pace(pace: f64) -> Self {
        Self {
            started: Instant::now(),
            pace,
        }
    }

    /// Microseconds since the start.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        let us = self.started.elapsed().as_micros();
        if self.pace == 1.0 {
            return u64::try_from(us).unwrap_or(u64::MAX);
        }
        #[allow(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "microseconds of days; what is larger or no number is cut"
        )]
        let us = (us as f64 * self.pace) as u64;
        us
    }
}

/// A source's end.
#[derive(Debug)]
pub struct Port {
    clock: SessionClock,
    inputs: SyncSender<Timed>,
    requests: Receiver<Request>,
    shared: Arc<Shared>,
}

/// The engine's end of one source.
#[derive(Debug)]
pub struct Plug {
    requests: SyncSender<Request>,
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    stopping: AtomicBool,
    dropped_inputs: AtomicU64,
    dropped_requests: AtomicU64,
}

/// Puts inputs in from anywhere: a page, a thread that learnt something.
#[derive(Clone, Debug)]
pub struct Injector {
    clock: SessionClock,
    inputs: SyncSender<Timed>,
    closed: Arc<AtomicBool>,
}

impl Injector {
    /// Something happened now; whether there was room.
    pub fn input(&self, input: Input) -> bool {
        let at_us = self.clock.now_us();
        let sent = self.inputs.try_send(Timed { at_us, input });
        if let Err(TrySendError::Disconnected(_)) = sent {
            self.closed.store(true, Ordering::Relaxed);
        }
        sent.is_ok()
    }

    /// Whether anybody still takes inputs, as far as the last one told.
    #[must_use]
    pub fn open(&self) -> bool {
        !self.closed.load(Ordering::Relaxed)
    }
}

/// The queue that all sources fill.
#[derive(Debug)]
pub struct Inputs {
    clock: SessionClock,
    sender: SyncSender<Timed>,
    receiver: Receiver<Timed>,
}

impl Inputs {
    /// An empty queue.
    #[must_use]
    pub fn new(clock: SessionClock) -> Self {
        let (sender, receiver) = sync_channel(INPUTS);
        Self {
            clock,
            sender,
            receiver,
        }
    }

    /// Another source.
    #[must_use]
    pub fn port(&self) -> (Port, Plug) {
        let (sender, requests) = sync_channel(REQUESTS);
        let shared = Arc::new(Shared::default());
        let port = Port {
            clock: self.clock,
            inputs: self.sender.clone(),
            requests,
            shared: Arc::clone(&shared),
        };
        let plug = Plug {
            requests: sender,
            shared,
        };
        (port, plug)
    }

    /// For whoever is no device.
    #[must_use]
    pub fn injector(&self) -> Injector {
        Injector {
            clock: self.clock,
            inputs: self.sender.clone(),
            closed: Arc::default(),
        }
    }

    /// Session time now, microseconds.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        self.clock.now_us()
    }

    /// The next input, or none within `limit`.
    #[must_use]
    pub fn next(&self, limit: Duration) -> Option<Timed> {
        self.receiver.recv_timeout(limit).ok()
    }
}

impl Port {
    /// Session time now, microseconds.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        self.clock.now_us()
    }

    /// The session's clock.
    #[must_use]
    pub fn clock(&self) -> SessionClock {
        self.clock
    }

    /// Something happened now.
    pub fn input(&self, input: Input) {
        self.input_at(self.now_us(), input);
    }

    /// Something happened at this session time.
    pub fn input_at(&self, at_us: u64, input: Input) {
        let timed = Timed { at_us, input };
        if matches!(timed.input, Input::Link(_)) {
            // A link that was lost must not be thought to be there.
            if self.inputs.send(timed).is_err() {
                self.shared.stopping.store(true, Ordering::Relaxed);
            }
            return;
        }
        match self.inputs.try_send(timed) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => {
                self.shared.dropped_inputs.fetch_add(1, Ordering::Relaxed);
            }
            Err(TrySendError::Disconnected(_)) => {
                self.shared.stopping.store(true, Ordering::Relaxed)
            }
        }
    }

    /// What the engine asks for, if anything within `limit`; zero asks at once.
    #[must_use]
    pub fn request(&self, limit: Duration) -> Option<Request> {
        let got = if limit.is_zero() {
            self.requests
                .try_recv()
                .map_err(|error| error == TryRecvError::Disconnected)
        } else {
            let got = self.requests.recv_timeout(limit);
            got.map_err(|error| error == RecvTimeoutError::Disconnected)
        };
        match got {
            Ok(request) => Some(request),
            Err(gone) => {
                if gone {
                    self.shared.stopping.store(true, Ordering::Relaxed);
                }
                None
            }
        }
    }

    /// Whether the program ends: the source lets go of its device and returns.
    #[must_use]
    pub fn stopping(&self) -> bool {
        self.shared.stopping.load(Ordering::Relaxed)
    }
}

impl Plug {
    /// Asks the source for something; a full queue drops it and counts.
    pub fn ask(&self, request: Request) {
        if self.requests.try_send(request).is_err() {
            self.shared.dropped_requests.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Tells the source to end.
    pub fn stop(&self) {
        self.shared.stopping.store(true, Ordering::Relaxed);
    }

    /// Inputs and requests that found no room.
    #[must_use]
    pub fn dropped(&self) -> (u64, u64) {
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        (
            count(&self.shared.dropped_inputs),
            count(&self.shared.dropped_requests),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_finds_no_room_is_dropped_and_counted() {
        let inputs = Inputs::new(SessionClock::start());
        let (port, plug) = inputs.port();
        for at_us in 0..INPUTS as u64 + 3 {
            port.input_at(at_us, Input::Hand(None));
        }
        for _ in 0..REQUESTS + 2 {
            plug.ask(Request::Frame(vec![1]));
        }
        assert_eq!(plug.dropped(), (3, 2));
        assert_eq!(
            inputs.next(Duration::ZERO).map(|timed| timed.at_us),
            Some(0)
        );
        assert_eq!(port.request(Duration::ZERO), Some(Request::Frame(vec![1])));
    }

    #[test]
    fn a_source_learns_that_the_program_ends() {
        let inputs = Inputs::new(SessionClock::start());
        let (port, plug) = inputs.port();
        assert!(!port.stopping());
        plug.stop();
        assert!(port.stopping());
        let (port, plug) = inputs.port();
        drop(plug);
        assert_eq!(port.request(Duration::ZERO), None);
        assert!(port.stopping());
        let (port, _plug) = inputs.port();
        drop(inputs);
        port.input(Input::Hand(None));
        assert!(port.stopping());
    }
}

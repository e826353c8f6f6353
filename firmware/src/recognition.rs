//! Recognition as a task of low priority: the newest stiffness and hand position in, an inference packet out, 50 times a
//! second.
//!
//! Whoever is late is not followed further: a step that takes longer than its period drops the least likely of the
//! hypotheses, so that the next one has less to do.

use core::{
    convert::Infallible,
    sync::atomic::{AtomicU32, Ordering},
};

use embassy_futures::select::{Either, select};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, signal::Signal};
use embassy_time::{Duration, Instant, Ticker, Timer};
use tonus_shared::{
    image::{ImageError, ModelImage, WEARABLE, image_len},
    recognition::{PERIOD_US, Recognition, RecognitionError, Storage},
    wire::{Inference, Stream},
};

use crate::storage::partitions::{DK, XIAO};

/// Largest image that inference has room for, bytes.
const LARGEST_BYTES: usize = image_len(
    WEARABLE.dofs,
    WEARABLE.functions,
    WEARABLE.rank,
    WEARABLE.skills,
);
const _: () = assert!(DK.model_capacity() as usize >= LARGEST_BYTES);
const _: () = assert!(XIAO.model_capacity() as usize >= LARGEST_BYTES);

/// Between two signs of life while there is no model.
const IDLE: Duration = Duration::from_secs(1);
/// Of the hypotheses, what is kept after a step that came late: three of four.
const KEPT: (usize, usize) = (3, 4);

/// What comes in, the newest of each, and what is counted.
pub struct Inbox {
    stream: Signal<CriticalSectionRawMutex, (u64, Stream)>,
    hand: Signal<CriticalSectionRawMutex, (u64, Option<[f32; 3]>)>,
    changed: Signal<CriticalSectionRawMutex, ()>,
    released: Signal<CriticalSectionRawMutex, ()>,
    dropped: AtomicU32,
    refused: AtomicU32,
}

impl Inbox {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            stream: Signal::new(),
            hand: Signal::new(),
            changed: Signal::new(),
            released: Signal::new(),
            dropped: AtomicU32::new(0),
            refused: AtomicU32::new(0),
        }
    }

    /// A stream packet whose newest scan was at `acquired_us`.
    pub fn stream(&self, acquired_us: u64, stream: Stream) {
        self.stream.signal((acquired_us, stream));
    }

    /// Where the hand was at a time of the wearable's clock, metres; none when it was not seen.
    pub fn hand(&self, at_us: u64, position_m: Option<[f32; 3]>) {
        self.hand.signal((at_us, position_m));
    }

    /// Another model is in use from now on. Waits until [`serve`] has let go of the one before.
    pub async fn change_over(&self) {
        self.released.reset();
        self.changed.signal(());
        self.released.wait().await;
    }

    /// Hypotheses dropped for want of room or time since the start; wraps.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Steps in which something was refused since the start; wraps.
    #[must_use]
    pub fn refused(&self) -> u32 {
        self.refused.load(Ordering::Relaxed)
    }

    fn take(&self, recognition: &mut Recognition<'_>) -> Result<(), RecognitionError> {
        let hand = self.hand.try_take();
        let hand = hand.map_or(Ok(()), |(at_us, position_m)| {
            recognition.hand(at_us, position_m)
        });
        if let Some((acquired_us, stream)) = self.stream.try_take() {
            recognition.stream(acquired_us, &stream)?;
        }
        hand
    }
}

impl Default for Inbox {
    fn default() -> Self {
        Self::new()
    }
}

/// Why recognition does not run.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StartError {
    /// Bytes that are no model for this build.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A model that recognition refuses.
    #[error(transparent)]
    Recognition(#[from] RecognitionError),
}

/// Recognises for ever by the newest model that `model` gives, and gives what is to be sent to `say`; nothing at rest.
/// `now_us` is the clock of the packets. `alive` is called at least once a second.
///
/// A model that is refused is told of by `refused`, once; it stays unused until another one is in use.
pub async fn serve<'m>(
    model: impl AsyncFn() -> Option<&'m [u8]>,
    storage: &mut Storage,
    inbox: &Inbox,
    now_us: impl Fn() -> u64,
    mut say: impl FnMut(u64, Inference),
    mut notice: impl FnMut(Notice),
) -> Infallible {
    loop {
        match model().await {
            Some(bytes) => {
                notice(Notice::Model(true));
                let ended = run(bytes, storage, inbox, &now_us, &mut say, &mut notice).await;
                if let Err(error) = ended {
                    notice(Notice::Refused(error));
                    idle(inbox, &mut notice).await;
                }
            }
            None => {
                notice(Notice::Model(false));
                idle(inbox, &mut notice).await;
            }
        }
        inbox.released.signal(());
    }
}

/// What [`serve`] tells of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Notice {
    /// It goes on.
    Alive,
    /// There is a model, or there is none.
    Model(bool),
    /// The model cannot be used.
    Refused(StartError),
}

/// Waits until another model is in use.
async fn idle(inbox: &Inbox, notice: &mut impl FnMut(Notice)) {
    while let Either::Second(()) = select(inbox.changed.wait(), Timer::after(IDLE)).await {
        notice(Notice::Alive);
    }
}

/// Recognises by `model` until another one is in use.
async fn run(
    model: &[u8],
    storage: &mut Storage,
    inbox: &Inbox,
    now_us: &impl Fn() -> u64,
    say: &mut impl FnMut(u64, Inference),
    notice: &mut impl FnMut(Notice),
) -> Result<(), StartError> {
    let image = ModelImage::parse(model, &WEARABLE)?;
    let mut recognition = Recognition::new(&image, storage)?;
    let before = inbox.dropped();
    let mut ticker = Ticker::every(Duration::from_micros(PERIOD_US));
    loop {
        if let Either::First(()) = select(inbox.changed.wait(), ticker.next()).await {
            return Ok(());
        }
        notice(Notice::Alive);
        let began = Instant::now();
        let taken = inbox.take(&mut recognition);
        let at_us = now_us();
        match recognition.tick(at_us) {
            Ok(Some(inference)) => say(at_us, inference),
            Ok(None) => {}
            Err(_) => _ = inbox.refused.fetch_add(1, Ordering::Relaxed),
        }
        if taken.is_err() {
            inbox.refused.fetch_add(1, Ordering::Relaxed);
        }
        if began.elapsed() > Duration::from_micros(PERIOD_US) {
            recognition.keep(recognition.hypotheses() * KEPT.0 / KEPT.1);
            // What was missed is not caught up with: the next step is a whole period away.
            ticker.reset();
        }
        let dropped = before.wrapping_add(recognition.dropped());
        inbox.dropped.store(dropped, Ordering::Relaxed);
    }
}

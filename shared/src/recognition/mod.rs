//! Recognition on the chip: stiffness and hand positions in, [`Inference`] packets out, 50 times a second.
//!
//! ```text
//! stream, hand (newest of each; onset detector) -> tick: begin | condition | end -> Inference
//! ```
//!
//! A movement begins when the hand's speed says so, and while no hand is sent, when the stiffness changes. Then a grid
//! of hypotheses is set up around the onset, as on the host: every skill, durations by its log-normal prior, onsets by the
//! detector's error; all are conditioned on what was kept from just before and on what follows, one observation of
//! each sensor in every interval of the image. At rest nothing is said.

mod answers;
mod error;
mod sensor;
mod storage;

use heapless::Deque;

use crate::image::{ModelImage, Role};
use crate::onset::{MotionEdge, OnsetConfig, OnsetDetector};
use crate::promp::{Bank, Grid, Hypothesis, Observed, Quantity};
use crate::wire::{Inference, Stream, StreamFlags};
pub use error::RecognitionError;
use sensor::{Newest, Seen, Sensor, step};
pub use storage::{HYPOTHESES, Storage};

/// Inference packets so often, microseconds.
pub const PERIOD_US: u64 = 20_000;
/// Onsets of each duration, while that leaves [`LEAST_DURATIONS`].
const ONSETS: usize = 2;
/// Durations of each skill at least.
const LEAST_DURATIONS: usize = 4;
/// Log-odds against the best below which a hypothesis is dropped, nats: as on the host.
const FLOOR_NATS: f32 = 25.0;
/// A hand that was seen so recently says when a movement begins, microseconds.
const HAND_RECENT_US: u64 = 300_000;
/// How late after its onset a movement may be told of, microseconds.
const LATEST_US: u64 = 500_000;
/// The movement is over when the hand rests and this much of the posterior says so; the same while it moves.
const OVER: [f32; 2] = [0.5, 0.99];
/// Instants that are kept before a movement begins: two sensors in the latest onset and the lead.
const KEPT: usize = 64;
/// What counts as a beginning where only stiffness is known; the "speed" is that of its logarithms, 1/s. A tenth of
/// a second of the stream, twice as fast as a posture drifts. Chosen, not measured on people.
const BY_STIFFNESS: OnsetConfig = OnsetConfig {
    window_s: 0.1,
    start_m_per_s: 1.5,
    rest_multiple: 2.0,
    release: 0.4,
    shortest_movement_s: 0.05,
    shortest_pause_s: 0.1,
};

/// The mixture of a model's skills, following one movement after the other.
#[derive(Debug)]
pub struct Recognition<'a> {
    image: &'a ModelImage<'a>,
    bank: Bank<'a, f32, &'a mut [Hypothesis<f32>], &'a mut [f32]>,
    scratch: &'a mut [f32],
    /// DoFs by axis.
    positions: Option<[usize; 3]>,
    stiffnesses: [usize; 3],
    interval_us: u64,
    /// In `f64`: seconds since the wearable started would be too coarse otherwise after an hour.
    by_hand: OnsetDetector<f64>,
    by_stiffness: OnsetDetector<f64>,
    hand_us: Option<u64>,
    hand: Newest,
    stiffness: Newest,
    kept: Deque<Seen, KEPT>,
    /// An onset that the next tick acts on, seconds.
    onset_s: Option<f64>,
    /// Where the bank's time begins.
    origin_us: u64,
    dropped: u32,
}

impl<'a> Recognition<'a> {
    /// At rest.
    ///
    /// # Errors
    /// An image that this build has no room for: parse it with [`crate::image::WEARABLE`].
    pub fn new(
        image: &'a ModelImage<'a>,
        storage: &'a mut Storage,
    ) -> Result<Self, RecognitionError> {
        let of = |role: fn(u8) -> Role| {
            let [x, y, z] = [0, 1, 2].map(|axis| image.dof(role(axis)));
            Some([x?, y?, z?])
        };
        let stiffnesses = of(Role::HumanStiffness).ok_or(RecognitionError::NoStiffness)?;
        let Storage {
            slots,
            numbers,
            scratch,
        } = storage;
        let settings = image.settings();
        Ok(Self {
            image,
            bank: Bank::new(
                image.latent(),
                image.skills(),
                slots.as_mut_slice(),
                numbers.as_mut_slice(),
                Some(FLOOR_NATS),
            )?,
            scratch,
            positions: of(Role::HumanPosition),
            stiffnesses,
            interval_us: microseconds(f64::from(settings.interval_s)).max(1),
            by_hand: OnsetDetector::new(&settings.onset)?,
            by_stiffness: OnsetDetector::new(&BY_STIFFNESS)?,
            hand_us: None,
            hand: Newest::default(),
            stiffness: Newest::default(),
            kept: Deque::new(),
            onset_s: None,
            origin_us: 0,
            dropped: 0,
        })
    }

    /// Takes a stream packet whose newest scan was at `acquired_us`. One whose activation or stiffness only stands for
    /// what could not be measured says nothing.
    ///
    /// # Errors
    /// A stiffness that is not positive; it is left out.
    pub fn stream(&mut self, acquired_us: u64, stream: &Stream) -> Result<(), RecognitionError> {
        let held = [StreamFlags::STIFFNESS_HELD, StreamFlags::ACTIVATION_HELD];
        if held.into_iter().any(|flag| stream.flags.contains(flag)) {
            return Ok(());
        }
        let n_per_m = stream.stiffness_n_per_m;
        for (axis, value) in n_per_m.into_iter().enumerate() {
            if !(value.is_finite() && value > 0.0) {
                return Err(RecognitionError::Stiffness { axis, value });
            }
        }
        let at_us = stream.describes_us(acquired_us);
        let values = n_per_m.map(libm::logf);
        let edge = step(&mut self.by_stiffness, at_us, values)?;
        self.stiffness.seen = Some(Seen {
            sensor: Sensor::Stiffness,
            at_us,
            values,
        });
        let recent = |hand_us: u64| at_us.saturating_sub(hand_us) <= HAND_RECENT_US;
        if !self.hand_us.is_some_and(recent) {
            self.note(edge);
        }
        Ok(())
    }

    /// Takes the hand's position (metres, shoulder frame), `None` when the tracker does not see it, at a time of the
    /// wearable's clock. A model without positions takes from it when movements begin, nothing else.
    ///
    /// # Errors
    /// A position that is not finite; it is left out.
    pub fn hand(
        &mut self,
        at_us: u64,
        position_m: Option<[f32; 3]>,
    ) -> Result<(), RecognitionError> {
        let Some(values) = position_m else {
            return Ok(());
        };
        // After a gap a slope over it would be none of the hand's.
        if self
            .hand_us
            .is_some_and(|last| at_us.saturating_sub(last) > HAND_RECENT_US)
        {
            self.by_hand.restart();
        }
        let edge = step(&mut self.by_hand, at_us, values)?;
        self.hand_us = Some(self.hand_us.map_or(at_us, |last| last.max(at_us)));
        self.hand.seen = Some(Seen {
            sensor: Sensor::Hand,
            at_us,
            values,
        });
        self.note(edge);
        Ok(())
    }

    fn note(&mut self, edge: Option<MotionEdge<f64>>) {
        if let (Some(MotionEdge::Onset { at_s }), false) = (edge, self.begun()) {
            self.onset_s = Some(at_s);
        }
    }

    /// Whether a movement is followed.
    #[must_use]
    pub fn begun(&self) -> bool {
        !self.bank.hypotheses().is_empty()
    }

    /// Hypotheses that are followed.
    #[must_use]
    pub fn hypotheses(&self) -> usize {
        self.bank.hypotheses().len()
    }

    /// Hypotheses dropped for want of room or time since the start; wraps.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped.wrapping_add(self.bank.dropped().full)
    }

    /// Follows no more than the `most` likely hypotheses of this movement from here on: for who comes late to
    /// [`Recognition::tick`].
    pub fn keep(&mut self, most: usize) {
        self.bank.keep(most);
    }

    /// To be called every [`PERIOD_US`]: takes what came since, and says what the person is doing and how firm they are
    /// at `now_us`; `None` at rest.
    ///
    /// **Budget.** Per observed number and hypothesis about `K r + 3/2 r^2` multiply-adds, three numbers for each sensor
    /// in each interval of the image; the answer costs about as much as two sensors. The tick in which a
    /// movement begins also conditions on what was kept, up to half a second: it may take several periods.
    ///
    /// # Errors
    /// [`RecognitionError`]. An observation that inference refuses is left out; a movement that cannot begin is none.
    pub fn tick(&mut self, now_us: u64) -> Result<Option<Inference>, RecognitionError> {
        let sensors = [&mut self.hand, &mut self.stiffness];
        let newest = sensors.map(|sensor| sensor.take(self.interval_us));
        for seen in newest.into_iter().flatten() {
            self.take(seen)?;
        }
        if let Some(onset_s) = self.onset_s.take() {
            let begun = self.begin(onset_s);
            if begun.is_err() {
                self.end();
            }
            begun?;
        }
        let resting = !match self.hand_us {
            Some(hand_us) if now_us.saturating_sub(hand_us) <= HAND_RECENT_US => {
                self.by_hand.moving()
            }
            _ => self.by_stiffness.moving(),
        };
        let enough = if resting { OVER[0] } else { OVER[1] };
        let over = self.bank.over(self.since_origin_s(now_us));
        if over.is_some_and(|over| over >= enough) {
            self.end();
        }
        self.answer(now_us)
    }

    /// Conditions on an instant, or keeps it at rest.
    fn take(&mut self, seen: Seen) -> Result<(), RecognitionError> {
        if self.begun() {
            return self.observe(&seen);
        }
        let lead_us = microseconds(f64::from(self.image.settings().lead_s));
        let oldest_us = seen.at_us.saturating_sub(lead_us + LATEST_US);
        while self.kept.is_full() || self.kept.front().is_some_and(|old| old.at_us < oldest_us) {
            self.kept.pop_front();
        }
        let _has_room = self.kept.push_back(seen);
        Ok(())
    }

    fn observe(&mut self, seen: &Seen) -> Result<(), RecognitionError> {
        let dofs = match seen.sensor {
            Sensor::Stiffness => self.stiffnesses,
            Sensor::Hand => match self.positions {
                Some(dofs) => dofs,
                None => return Ok(()),
            },
        };
        let time_s = self.since_origin_s(seen.at_us);
        for (dof, value) in dofs.into_iter().zip(seen.values) {
            let noise_std = self.image.dofs().get(dof).map_or(1.0, |dof| dof.noise_std);
            self.bank.observe(&Observed {
                dof,
                quantity: Quantity::Position,
                time_s,
                value,
                variance: noise_std * noise_std,
            })?;
        }
        Ok(())
    }

    /// Hypotheses around an onset that was detected, conditioned on what was kept.
    fn begin(&mut self, onset_s: f64) -> Result<(), RecognitionError> {
        self.reset();
        let settings = self.image.settings();
        let expected_s = onset_s - f64::from(settings.onset_late_s);
        self.origin_us = microseconds(expected_s);
        let each = HYPOTHESES / self.image.skills().len().max(1);
        let onsets = if each / ONSETS >= LEAST_DURATIONS {
            ONSETS
        } else {
            1
        };
        let onset_grid = Grid::new(onsets);
        for (skill, named) in self.image.named().iter().enumerate() {
            for (tempo, log_share) in Grid::new(each / onsets).points::<f32>() {
                let log_duration = named.log_duration_mean + tempo * named.log_duration_std;
                for (late, log_late) in onset_grid.points::<f32>() {
                    let hypothesis = Hypothesis {
                        skill,
                        duration_s: libm::expf(log_duration),
                        onset_s: late * settings.onset_std_s,
                        log_prior: log_share + log_late,
                    };
                    self.bank.add(hypothesis, &[])?;
                }
            }
        }
        let lead_us = microseconds(f64::from(settings.lead_s));
        let since_us = self.origin_us.saturating_sub(lead_us);
        while let Some(seen) = self.kept.pop_front() {
            if seen.at_us >= since_us {
                self.observe(&seen)?;
            }
        }
        Ok(())
    }

    fn end(&mut self) {
        self.reset();
        self.kept.clear();
    }

    fn reset(&mut self) {
        self.dropped = self.dropped();
        self.bank.reset();
    }

    #[allow(clippy::cast_precision_loss, reason = "seconds of one movement")]
    fn since_origin_s(&self, at_us: u64) -> f32 {
        at_us.wrapping_sub(self.origin_us).cast_signed() as f32 * 1e-6
    }
}

/// Zero for what is before the clock began.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturating"
)]
fn microseconds(seconds: f64) -> u64 {
    (seconds * 1e6) as u64
}

//! The arm's posture at a tick, and what it rests on.

use nalgebra::{Quaternion, Vector3};

use crate::Real;
use crate::stiffness::{
    ASSUMED_ELBOW_RAD, ArmPosture, ArmStiffness, BLEND_RAD, PostureError, Segments,
};
use crate::wire::{MAX_CO_CONTRACTION, StreamFlags};

use super::config::PipelineError;
use super::input::{Inputs, MAX_AGE_US};

/// Hand and posture further apart than this: the hand was moved into reach, m.
const CLAMPED_M: f32 = 1e-3;

/// What a posture rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    HandAndUpperArm,
    /// The swivel is assumed to be zero.
    Hand,
    /// The elbow angle is assumed.
    UpperArm,
    /// The arm is assumed to hang, the elbow bent.
    Assumed,
}

/// A posture and how far to trust it.
pub(super) struct Pose {
    pub(super) posture: ArmPosture<f32>,
    pub(super) source: Source,
    /// The measurements fit no arm: the last posture stands, and so must the stiffness.
    pub(super) held: bool,
    pub(super) flags: StreamFlags,
}

/// Makes postures of measurements, or of stated assumptions.
///
/// Measurements that fit no arm (out of reach, hand and attitude at odds) hold the last posture for as long as a lost
/// hand would count, 0.1 s; then the hand is taken for not seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arm {
    segments: Segments<f32>,
    assumed: ArmPosture<f32>,
    last: ArmPosture<f32>,
    unfit_since_us: Option<u64>,
}

impl Arm {
    /// Also gives the diagonal of the stiffness at rest in the assumed posture, N/m.
    pub(super) fn new(arm: &ArmStiffness<f32>) -> Result<(Self, [f32; 3]), PipelineError> {
        let assumed = ArmPosture::from_angles([0.0, 0.0, 0.0, f32::of(ASSUMED_ELBOW_RAD)])?;
        let resting = arm.at(0.0, &assumed)?;
        let reached = arm.at(f32::MAX, &assumed)?.co_contraction;
        if reached > MAX_CO_CONTRACTION {
            return Err(PipelineError::CoContraction {
                reached,
                limit: MAX_CO_CONTRACTION,
            });
        }
        let new = Self {
            segments: *arm.segments(),
            assumed,
            last: assumed,
            unfit_since_us: None,
        };
        Ok((new, resting.cartesian.diagonal().into()))
    }

    /// The posture at device time `now_us`.
    pub(super) fn pose(&mut self, inputs: &Inputs, now_us: u64) -> Pose {
        let hand = inputs.hand.recent(now_us).map(Vector3::from);
        let upper_arm = inputs.orientation.recent(now_us).map(Quaternion::from);
        let flags = StreamFlags::default().with(StreamFlags::ORIENTATION_SEEN, upper_arm.is_some());
        let (measured, source) = match (&hand, &upper_arm) {
            (Some(hand), Some(upper_arm)) => (
                ArmPosture::from_hand_and_upper_arm(&self.segments, hand, upper_arm),
                Source::HandAndUpperArm,
            ),
            (Some(hand), None) => (
                ArmPosture::from_hand_and_swivel(&self.segments, hand, 0.0),
                Source::Hand,
            ),
            (None, upper_arm) => {
                self.unfit_since_us = None;
                return self.without_hand(*upper_arm, flags);
            }
        };
        let flags_seen = flags.with(StreamFlags::HAND_SEEN, true);
        let Ok(posture) = measured else {
            let since_us = *self.unfit_since_us.get_or_insert(now_us);
            if now_us - since_us > MAX_AGE_US {
                return self.without_hand(upper_arm, flags);
            }
            return Pose {
                posture: self.last,
                source,
                held: true,
                flags: flags_seen,
            };
        };
        self.unfit_since_us = None;
        let moved = hand
            .is_some_and(|hand| (posture.hand_position(&self.segments) - hand).norm() > CLAMPED_M);
        self.accept(
            posture,
            source,
            flags_seen.with(StreamFlags::POSTURE_CLAMPED, moved),
        )
    }

    fn without_hand(&mut self, upper_arm: Option<Quaternion<f32>>, flags: StreamFlags) -> Pose {
        let from_upper_arm = upper_arm
            .map(|upper_arm| ArmPosture::from_upper_arm(&upper_arm, f32::of(ASSUMED_ELBOW_RAD)));
        match from_upper_arm {
            Some(Ok(posture)) => self.accept(posture, Source::UpperArm, flags),
            // Attitudes were checked when they came; should one fail, it is as good as not seen.
            None | Some(Err::<_, PostureError>(_)) => {
                self.accept(self.assumed, Source::Assumed, flags)
            }
        }
    }

    fn accept(&mut self, posture: ArmPosture<f32>, source: Source, flags: StreamFlags) -> Pose {
        self.last = posture;
        let straight = posture.elbow_rad() < f32::of(BLEND_RAD[1]);
        Pose {
            posture,
            source,
            held: false,
            flags: flags.with(StreamFlags::NEAR_SINGULAR, straight),
        }
    }
}

//! Where the person's shoulder is, as the tracker sees it.

use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};

/// Where a seated person's shoulder is when the tracker lies on the table a forearm before them, in body heights: so far
/// behind it and so far above it. Chosen, not measured: 42 and 38 cm at 1.75 m.
const BEHIND_HEIGHTS: f64 = 0.24;
const ABOVE_HEIGHTS: f64 = 0.22;
/// Half the shoulders' width, in body heights: Drillis and Contini 1966, as in Winter, fig. 4.1.
const BESIDE_HEIGHTS: f64 = 0.129;
/// A shoulder further from the tracker than this is no place to reach from, m.
const FARTHEST_M: f64 = 1.5;
/// Touches of the shoulder that lie further apart than this (RMS) are no one place, m.
const MOST_SPREAD_M: f64 = 0.03;

/// The shoulder frame (x forward, y left, z up, origin at the shoulder's centre) in the tracker's (Leap: x right, y up, z to
/// the person, who sits before it and looks along -z).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shoulder {
    /// The shoulder's centre, tracker frame, m.
    pub centre_m: [f64; 3],
    /// How far the person is turned to the left of the tracker's -z, rad.
    #[serde(default)]
    pub turned_left_rad: f64,
}

/// Why that is no shoulder.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ShoulderError {
    /// Nothing was seen while it was touched.
    #[error(
        "no hand was seen while the shoulder was touched: touch it within the tracker's sight, or use the default"
    )]
    NotSeen,
    /// The hand moved.
    #[error(
        "the hand moved by {spread_m:.3} m while it touched the shoulder ({MOST_SPREAD_M} m are allowed): hold it still and try again"
    )]
    Moved {
        /// RMS distance from the middle, m.
        spread_m: f64,
    },
    /// Too far away, or not a number.
    #[error(
        "a shoulder at {centre_m:?} m from the tracker: it must be finite and within {FARTHEST_M} m"
    )]
    Far {
        /// The place given, tracker frame, m.
        centre_m: [f64; 3],
    },
    /// A height that nobody has.
    #[error("body height is {height_m} m; give one from 0.8 to 2.5 m (metres, not centimetres)")]
    Height {
        /// The height given, m.
        height_m: f64,
    },
}

impl Shoulder {
    /// The default of a person of this height who sits straight before the tracker, which lies on the table in front of
    /// them; `left` for the left arm. Wrong by a hand's breadth easily: stiffness then errs by some percent, and a
    /// straight arm may seem out of reach.
    ///
    /// # Errors
    /// [`ShoulderError::Height`].
    pub fn by_height(height_m: f64, left: bool) -> Result<Self, ShoulderError> {
        if !(0.8..=2.5).contains(&height_m) {
            return Err(ShoulderError::Height { height_m });
        }
        let right = if left {
            -BESIDE_HEIGHTS
        } else {
            BESIDE_HEIGHTS
        };
        Ok(Self {
            centre_m: [right, ABOVE_HEIGHTS, BEHIND_HEIGHTS].map(|share| share * height_m),
            turned_left_rad: 0.0,
        })
    }

    /// By touching the shoulder with the other hand: where the tracker saw it meanwhile, tracker frame, m.
    ///
    /// # Errors
    /// [`ShoulderError::NotSeen`], [`ShoulderError::Moved`], [`ShoulderError::Far`].
    pub fn by_touch(seen_m: &[[f64; 3]]) -> Result<Self, ShoulderError> {
        if seen_m.is_empty() {
            return Err(ShoulderError::NotSeen);
        }
        let places = || seen_m.iter().map(|place| Vector3::from(*place));
        let count = seen_m.len() as f64;
        let middle = places().sum::<Vector3<f64>>() / count;
        let square = places().map(|p| (p - middle).norm_squared()).sum::<f64>() / count;
        let spread_m = square.sqrt();
        if spread_m > MOST_SPREAD_M {
            return Err(ShoulderError::Moved { spread_m });
        }
        let shoulder = Self {
            centre_m: middle.into(),
            turned_left_rad: 0.0,
        };
        shoulder.check().map(|()| shoulder)
    }

    /// Whether the numbers can be a shoulder's, as after reading them from a file.
    ///
    /// # Errors
    /// [`ShoulderError::Far`].
    pub fn check(&self) -> Result<(), ShoulderError> {
        let distance_m = Vector3::from(self.centre_m).norm();
        // NaN is within nothing.
        if distance_m <= FARTHEST_M && self.turned_left_rad.is_finite() {
            Ok(())
        } else {
            Err(ShoulderError::Far {
                centre_m: self.centre_m,
            })
        }
    }

    /// A point of the shoulder's frame, in the tracker's, m: back from [`Self::point_m`].
    #[must_use]
    pub fn in_tracker_m(&self, shoulder_m: [f64; 3]) -> [f64; 3] {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), self.turned_left_rad);
        let [forward, left, up]: [f64; 3] = (turn * Vector3::from(shoulder_m)).into();
        let [x, y, z] = self.centre_m;
        [x - left, y + up, z - forward]
    }

    /// A point of the tracker's frame, in the shoulder's, m.
    #[must_use]
    pub fn point_m(&self, tracker_m: [f64; 3]) -> [f64; 3] {
        let [right, up, back] = std::array::from_fn(|axis| tracker_m[axis] - self.centre_m[axis]);
        let straight = Vector3::new(-back, -right, up);
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), -self.turned_left_rad);
        (turn * straight).into()
    }
}

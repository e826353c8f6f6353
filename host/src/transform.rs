//! From the tracker's frame to the robot's, taught by touching points; and from the tracker's to the person's shoulder.
//!
//! Robot and tracker are fixed to the same table. A person's hand touches points whose places in the robot's frame are known
//! (marks on the table, or the robot's own hand led there), and the tracker says where it saw the hand. The rigid transform
//! that brings the second to the first with the least squared distance is that of Kabsch (1976), with the sign that keeps
//! it a rotation (Umeyama 1991), without scale: both frames are in metres.
//!
//! The shoulder is not fixed to the table: the frame of a person moves with them. [`Shoulder`] says where it is, by touching
//! the shoulder with the hand, or by a stated default.

mod shoulder;

pub use shoulder::{Shoulder, ShoulderError};

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Fewest points: three fix a rigid transform.
pub const LEAST_POINTS: usize = 3;
/// Points nearer to each other than this teach no direction: a tracker's millimetres would turn the frame by degrees, m.
const LEAST_APART_M: f64 = 0.08;
/// Points spread less than this across their line (RMS) are collinear, m.
const LEAST_WIDTH_M: f64 = 0.02;
/// A transform that leaves more than this (RMS) was taught with a slip, m.
const MOST_RESIDUAL_M: f64 = 0.015;
/// A stored quaternion's norm may be this far from one, as text rounds.
const UNIT_TOLERANCE: f64 = 1e-3;

/// One touched point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Touched {
    /// Where the tracker saw the hand, tracker frame, m.
    pub tracker_m: [f64; 3],
    /// Where the point is, robot base frame, m.
    pub robot_m: [f64; 3],
}

/// Why points teach no transform.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TransformError {
    /// Fewer than three points.
    #[error("{got} points were touched, at least {LEAST_POINTS} are needed: touch more")]
    TooFew {
        /// Points given.
        got: usize,
    },
    /// A NaN or an infinity.
    #[error("point {point} has a coordinate that is not a finite number: touch it again")]
    NotFinite {
        /// Which point, from 1.
        point: usize,
    },
    /// Two points are too near to each other.
    #[error(
        "points {first} and {second} are {apart_m:.3} m apart, at least {LEAST_APART_M} m are needed: choose points further apart"
    )]
    TooClose {
        /// One point, from 1.
        first: usize,
        /// The other.
        second: usize,
        /// Their distance, m.
        apart_m: f64,
    },
    /// All points lie on one line: the turn about it stays open.
    #[error(
        "the points lie on one line (they spread {width_m:.3} m across it, at least {LEAST_WIDTH_M} m are needed): choose a triangle"
    )]
    Collinear {
        /// RMS distance from the line, m.
        width_m: f64,
    },
    /// Two sets of points that no rigid motion joins.
    #[error(
        "the points fit to {residual_m:.3} m only, {MOST_RESIDUAL_M} m are allowed; point {worst} is off most: check its place and touch it again"
    )]
    Residual {
        /// RMS distance left, m.
        residual_m: f64,
        /// The point that is off most, from 1.
        worst: usize,
    },
    /// A stored rotation that is none.
    #[error(
        "rotation_xyzw has norm {norm}, it must be a unit quaternion: teach the transform again"
    )]
    NotUnit {
        /// Its norm.
        norm: f64,
    },
    /// A stored translation or rotation that is not finite.
    #[error("the stored transform has a number that is not finite: teach the transform again")]
    Stored,
}

/// A rigid transform as it stands in the configuration: `p_to = R p_from + t`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stored {
    /// Unit quaternion, x, y, z, w.
    pub rotation_xyzw: [f64; 4],
    /// Metres.
    pub translation_m: [f64; 3],
}

/// A rigid transform between two frames in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform(Isometry3<f64>);

/// A transform and how well its points fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taught {
    /// Tracker to robot.
    pub transform: Transform,
    /// RMS distance that is left, m; zero says little where three points alone were touched.
    pub residual_m: f64,
}

impl Transform {
    /// The same frame.
    #[must_use]
    pub fn identity() -> Self {
        Self(Isometry3::identity())
    }

    /// Finds tracker to robot from touched points.
    ///
    /// # Errors
    /// [`TransformError`]: too few, too close, collinear, or points that do not fit each other.
    pub fn teach(touched: &[Touched]) -> Result<Taught, TransformError> {
        if touched.len() < LEAST_POINTS {
            return Err(TransformError::TooFew { got: touched.len() });
        }
        let finite = |point: &Touched| {
            let mut all = point.tracker_m.iter().chain(&point.robot_m);
            all.all(|x| x.is_finite())
        };
        if let Some(at) = touched.iter().position(|point| !finite(point)) {
            return Err(TransformError::NotFinite { point: at + 1 });
        }
        let from: Vec<Vector3<f64>> = touched.iter().map(|p| p.tracker_m.into()).collect();
        let to: Vec<Vector3<f64>> = touched.iter().map(|p| p.robot_m.into()).collect();
        for places in [&from, &to] {
            spread(places)?;
        }
        let transform = Self(kabsch(&from, &to));
        let left: Vec<f64> = from
            .iter()
            .zip(&to)
            .map(|(from, to)| (transform.apply(&(*from).into()) - to).norm())
            .collect();
        let square = left.iter().map(|x| x * x).sum::<f64>() / left.len() as f64;
        let residual_m = square.sqrt();
        if residual_m > MOST_RESIDUAL_M {
            let worst = left.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            let worst = worst.map_or(0, |(at, _)| at) + 1;
            return Err(TransformError::Residual { residual_m, worst });
        }
        Ok(Taught {
            transform,
            residual_m,
        })
    }

    /// From the configuration.
    ///
    /// # Errors
    /// [`TransformError::NotUnit`], [`TransformError::Stored`].
    pub fn from_stored(stored: &Stored) -> Result<Self, TransformError> {
        let [x, y, z, w] = stored.rotation_xyzw;
        let quaternion = Quaternion::new(w, x, y, z);
        let norm = quaternion.norm();
        if !(norm.is_finite() && stored.translation_m.iter().all(|t| t.is_finite())) {
            return Err(TransformError::Stored);
        }
        if (norm - 1.0).abs() > UNIT_TOLERANCE {
            return Err(TransformError::NotUnit { norm });
        }
        Ok(Self(Isometry3::from_parts(
            Translation3::from(stored.translation_m),
            UnitQuaternion::from_quaternion(quaternion),
        )))
    }

    /// For the configuration.
    #[must_use]
    pub fn to_stored(&self) -> Stored {
        let rotation = self.0.rotation.quaternion();
        Stored {
            rotation_xyzw: [rotation.i, rotation.j, rotation.k, rotation.w],
            translation_m: self.0.translation.vector.into(),
        }
    }

    /// A point of the first frame, in the second, m.
    #[must_use]
    pub fn point_m(&self, point_m: [f64; 3]) -> [f64; 3] {
        self.apply(&point_m.into()).into()
    }

    /// A direction or velocity of the first frame, in the second.
    #[must_use]
    pub fn direction(&self, direction: [f64; 3]) -> [f64; 3] {
        (self.0.rotation * Vector3::from(direction)).into()
    }

    /// From the second frame to the first.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self(self.0.inverse())
    }

    fn apply(&self, point: &Point3<f64>) -> Vector3<f64> {
        (self.0 * point).coords
    }
}

fn mean(places: &[Vector3<f64>]) -> Vector3<f64> {
    places.iter().sum::<Vector3<f64>>() / places.len() as f64
}

/// Refuses places that are too near or on one line.
fn spread(places: &[Vector3<f64>]) -> Result<(), TransformError> {
    for (first, a) in places.iter().enumerate() {
        for (second, b) in places.iter().enumerate().skip(first + 1) {
            let apart_m = (a - b).norm();
            if apart_m < LEAST_APART_M {
                return Err(TransformError::TooClose {
                    first: first + 1,
                    second: second + 1,
                    apart_m,
                });
            }
        }
    }
    let middle = mean(places);
    let scatter: Matrix3<f64> = places
        .iter()
        .map(|place| (place - middle) * (place - middle).transpose())
        .sum();
    let mut widths = scatter.symmetric_eigenvalues();
    widths.as_mut_slice().sort_by(f64::total_cmp);
    // Two of three directions are across the line of the largest.
    let width_m = ((widths[0] + widths[1]).max(0.0) / places.len() as f64).sqrt();
    if width_m < LEAST_WIDTH_M {
        return Err(TransformError::Collinear { width_m });
    }
    Ok(())
}

fn kabsch(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Isometry3<f64> {
    let (from_middle, to_middle) = (mean(from), mean(to));
    let covariance: Matrix3<f64> = from
        .iter()
        .zip(to)
        .map(|(from, to)| (to - to_middle) * (from - from_middle).transpose())
        .sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (
        svd.u.unwrap_or_else(Matrix3::identity),
        svd.v_t.unwrap_or_else(Matrix3::identity),
    );
    // A mirror image is no motion: turn the direction that is known least.
    let mut signs = Vector3::from_element(1.0);
    if (u * v_t).determinant() < 0.0 {
        let least = svd.singular_values.imin();
        signs[least] = -1.0;
    }
    let rotation = u * Matrix3::from_diagonal(&signs) * v_t;
    let rotation = UnitQuaternion::from_matrix(&rotation);
    Isometry3::from_parts(
        Translation3::from(to_middle - rotation * from_middle),
        rotation,
    )
}

#[cfg(test)]
mod tests;

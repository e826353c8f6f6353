//! How much one performance of a class may differ from another, and the references whitened by it.

use core::f64::consts::PI;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::{GateError, Seen};

/// Settings that [`super::Gate::learn`] tries.
const BANDWIDTHS: [f64; 3] = [0.3, 0.5, 0.8];
const DIAGONAL_SHARES: [f64; 2] = [0.1, 0.5];
const NOISE_SHARES: [f64; 2] = [0.1, 0.2];
/// Placement (as a share) and timing (phase): neither, or both.
const NUISANCES: [(f64, f64); 2] = [(0.0, 0.0), (0.4, 0.1)];
/// From nearly the sum of squares to nearly a count.
const TAILS: [f64; 3] = [30.0, 1.0, 0.3];

/// What the covariance of one performance about another is made of. Lengths are shares of each DoF's standard deviation
/// over all demonstrations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GateSettings {
    /// Share of the class's own standard deviation, above 0: the less, the nearer a reference must be.
    pub bandwidth: f64,
    /// Share, 0 to 1, that the class's covariance is drawn towards the pooled variances.
    pub diagonal_share: f64,
    /// Independent noise, above 0.
    pub noise_share: f64,
    /// Offset of a whole movement in each position, from 0.
    pub placement_share: f64,
    /// Standard deviation, phase, of a movement that is ahead in its middle; half of it of one that is ahead in its
    /// first half and late in its second. From 0.
    pub timing: f64,
    /// `nu` of the surprise, squared standard deviations, above 0: large, and all counts as in a Mahalanobis distance.
    pub tail: f64,
}

impl Default for GateSettings {
    fn default() -> Self {
        Self {
            bandwidth: 0.3,
            diagonal_share: 0.1,
            noise_share: 0.2,
            placement_share: 0.4,
            timing: 0.1,
            tail: 1.0,
        }
    }
}

impl GateSettings {
    /// All that are tried, of one tail.
    pub(super) fn tried() -> impl Iterator<Item = Self> {
        let pairs = BANDWIDTHS
            .into_iter()
            .flat_map(|bandwidth| DIAGONAL_SHARES.map(|share| (bandwidth, share)));
        let triples = pairs.flat_map(|pair| NOISE_SHARES.map(|noise| (pair, noise)));
        triples.flat_map(|((bandwidth, diagonal_share), noise_share)| {
            NUISANCES.map(|(placement_share, timing)| Self {
                bandwidth,
                diagonal_share,
                noise_share,
                placement_share,
                timing,
                ..Self::default()
            })
        })
    }

    /// Of settings, each with how well it tells apart and the standard error of that: of those no worse than the best
    /// by more than one standard error (Breiman, Friedman, Olshen and Stone 1984) those of the least
    /// bandwidth, of those the ones of the least tail, of those the best.
    pub(super) fn chosen(tried: &[((f64, f64), Self)]) -> Option<Self> {
        let better = |a: &&((f64, f64), Self), b: &&((f64, f64), Self)| a.0.0.total_cmp(&b.0.0);
        let ((most, error), _) = *tried.iter().max_by(better)?;
        let good = tried.iter().filter(|((told, _), _)| *told >= most - error);
        let order = |a: &&((f64, f64), Self), b: &&((f64, f64), Self)| {
            let bandwidth = a.1.bandwidth.total_cmp(&b.1.bandwidth);
            let tail = a.1.tail.total_cmp(&b.1.tail);
            bandwidth.then(tail).then(better(b, a))
        };
        good.min_by(order).map(|(_, settings)| *settings)
    }

    /// These with every tail that is tried.
    pub(super) fn tails(self) -> [Self; TAILS.len()] {
        TAILS.map(|tail| Self { tail, ..self })
    }

    pub(super) fn check(&self) -> Result<(), GateError> {
        let share = (0.0..=1.0).contains(&self.diagonal_share);
        let numbers = [
            ("the bandwidth", self.bandwidth, self.bandwidth > 0.0),
            ("the diagonal share", self.diagonal_share, share),
            ("the noise", self.noise_share, self.noise_share > 0.0),
            (
                "the placement",
                self.placement_share,
                self.placement_share >= 0.0,
            ),
            ("the timing", self.timing, self.timing >= 0.0),
            ("the tail", self.tail, self.tail > 0.0),
        ];
        for (what, value, within) in numbers {
            if !(value.is_finite() && within) {
                return Err(GateError::Config {
                    what,
                    value,
                    range: "a finite number, above 0 where nothing would be left",
                });
            }
        }
        Ok(())
    }
}

/// The classes of some demonstrations: factor and whitened references of each.
pub(super) struct Kernels {
    /// `None` for a class with fewer than two of them.
    pub(super) classes: Vec<Option<Kernel>>,
}

/// One class.
pub(super) struct Kernel {
    /// `L`, scaled DoFs.
    pub(super) factor: DMatrix<f64>,
    /// `J x n`: one column per reference.
    pub(super) whitened: DMatrix<f64>,
}

impl Kernels {
    pub(super) fn of(
        seen: &Seen,
        members: &[usize],
        settings: &GateSettings,
    ) -> Result<Self, GateError> {
        let width = seen.rows.ncols();
        let of_class = |q: usize| -> Vec<usize> {
            let members = members.iter().copied();
            members.filter(|&i| seen.class[i] == q).collect()
        };
        let mut squares = DVector::zeros(width);
        let mut freedom = 0.0;
        let mut spreads = Vec::with_capacity(seen.classes.len());
        for q in 0..seen.classes.len() {
            let own = of_class(q);
            if own.len() < 2 {
                spreads.push(None);
                continue;
            }
            let rows = seen.rows.select_rows(&own);
            let mean = rows.row_mean();
            let mut deviations = rows.clone();
            for mut row in deviations.row_iter_mut() {
                row -= &mean;
            }
            for (sum, column) in squares.iter_mut().zip(deviations.column_iter()) {
                *sum += column.norm_squared();
            }
            freedom += (own.len() - 1) as f64;
            let covariance = deviations.tr_mul(&deviations) / (own.len() - 1) as f64;
            spreads.push(Some((rows, mean, covariance)));
        }
        let pooled = squares / f64::max(freedom, 1.0);
        let mut classes = Vec::with_capacity(spreads.len());
        for (spread, name) in spreads.into_iter().zip(&seen.classes) {
            let Some((rows, mean, mut covariance)) = spread else {
                classes.push(None);
                continue;
            };
            let share = settings.diagonal_share;
            covariance *= 1.0 - share;
            covariance += DMatrix::from_diagonal(&(&pooled * share));
            covariance *= settings.bandwidth * settings.bandwidth;
            tolerate(seen, &mean.transpose(), settings, &mut covariance);
            let numerical = || GateError::Numerical {
                class: name.clone(),
            };
            let factor = Cholesky::new(covariance).ok_or_else(numerical)?.unpack();
            let whitened = factor.solve_lower_triangular(&rows.transpose());
            classes.push(Some(Kernel {
                whitened: whitened.ok_or_else(numerical)?,
                factor,
            }));
        }
        Ok(Self { classes })
    }

    /// Lower triangles, row after row, with the scales of the DoFs folded in.
    pub(super) fn packed(&self, scale: &[f64]) -> Vec<f64> {
        let mut packed = Vec::new();
        for kernel in self.classes.iter().flatten() {
            for row in 0..kernel.factor.nrows() {
                let unit = scale[row % scale.len()];
                packed.extend((0..=row).map(|column| kernel.factor[(row, column)] * unit));
            }
        }
        packed
    }

    /// All references, class after class.
    pub(super) fn references(&self) -> Vec<f64> {
        let kernels = self.classes.iter().flatten();
        kernels
            .flat_map(|k| k.whitened.as_slice().iter().copied())
            .collect()
    }

    /// Class of each reference.
    pub(super) fn skills(&self) -> Vec<usize> {
        let kernels = self.classes.iter().flatten().enumerate();
        kernels
            .flat_map(|(q, kernel)| vec![q; kernel.whitened.ncols()])
            .collect()
    }
}

/// Adds to a class's covariance what never counts as another movement: noise, another place, another pace.
fn tolerate(
    seen: &Seen,
    mean: &DVector<f64>,
    settings: &GateSettings,
    covariance: &mut DMatrix<f64>,
) {
    let (count, width) = (seen.dofs.len(), mean.len());
    for j in 0..width {
        covariance[(j, j)] += settings.noise_share * settings.noise_share;
    }
    for (offset, (_, dof)) in seen.dofs.iter().enumerate() {
        if dof.is_position() {
            let constant = |j: usize, _| {
                if j % count == offset {
                    settings.placement_share
                } else {
                    0.0
                }
            };
            let constant = DVector::from_fn(width, constant);
            covariance.ger(1.0, &constant, &constant, 1.0);
        }
    }
    // To be ahead by tau(s) moves what is seen by tau(s) dy/ds.
    for (harmonic, std) in [(1.0, settings.timing), (2.0, 0.5 * settings.timing)] {
        let moved = |j: usize, _| {
            let ahead = std * libm::sin(PI * harmonic * seen.phases[j / count]);
            ahead * slope(mean, &seen.phases, count, j)
        };
        let moved = DVector::from_fn(width, moved);
        covariance.ger(1.0, &moved, &moved, 1.0);
    }
}

/// Slope of the class's mean at row `j` between the neighbouring instants: how far to tolerate, not a velocity.
fn slope(mean: &DVector<f64>, phases: &[f64], count: usize, j: usize) -> f64 {
    let instant = j / count;
    let before = instant.saturating_sub(1);
    let after = (instant + 1).min(phases.len() - 1);
    if after == before {
        return 0.0;
    }
    let offset = j % count;
    let rise = mean[after * count + offset] - mean[before * count + offset];
    rise / (phases[after] - phases[before])
}

//! Novelty: is this movement any that is known?
//!
//! A skill's demonstrations are few, and people perform a skill in more than one way: what is far from the mean of all
//! may be near one of them. So a movement is compared with every demonstration, the *references*. Its observations `x` in
//! their fixed order and those `x_i` of reference `i` are whitened by the covariance that one performance may differ from
//! another by, `C_q = L_q L_q^T`:
//!
//! ```text
//! d_ij = row j of L_q^-1 (x - x_i)        surprise_i(k) = 1/k sum_{j < k} ln(1 + d_ij^2 / nu)
//! ```
//!
//! `d_ij` is the innovation of observation `j` given those before it, in standard deviations: the sum of squares over `j`
//! is the Mahalanobis distance. The logarithm (a Cauchy tail) keeps one odd moment, a different start say, from
//! counting for the whole movement. The least surprise over the references is the score; above the threshold for
//! that `k` the movement is none of the known.

use super::error::ModelError;
use super::linear::dot;
use crate::Real;

/// Numbers in the packed lower triangle of `rows` rows.
#[must_use]
pub const fn triangle_len(rows: usize) -> usize {
    rows * (rows + 1) / 2
}

/// Numbers that a watch stores: the whitened rows of every skill, and surprise and squared distance of every
/// reference.
#[must_use]
pub const fn watch_len(skills: usize, rows: usize, references: usize) -> usize {
    skills * rows + 2 * references
}

/// What is known, as a gate learnt it: all borrowed (flash).
#[derive(Clone, Copy, Debug)]
pub struct Known<'a, T> {
    /// Per skill, the lower triangle of the Cholesky factor `L_q`, row after row: `Q x J (J + 1) / 2` for `J` rows.
    pub factors: &'a [T],
    /// The whitened references `L_q^-1 x_i`, `N x J`.
    pub references: &'a [T],
    /// Skill of each reference, `N`.
    pub skills: &'a [usize],
    /// `nu`, above 0.
    pub tail: T,
    /// Greatest surprise of the known after each number of rows, `J`.
    pub thresholds: &'a [T],
}

impl<T: Real> Known<'_, T> {
    /// Rows of a whole movement, `J`.
    #[must_use]
    pub const fn rows(&self) -> usize {
        self.thresholds.len()
    }

    /// Skills, `Q`.
    #[must_use]
    pub fn skill_count(&self) -> usize {
        let last = self.skills.iter().max();
        last.map_or(0, |last| last.saturating_add(1))
    }

    /// Row `row` of a skill's factor, up to and with the diagonal.
    fn factor(&self, skill: usize, row: usize) -> &[T] {
        let start = skill * triangle_len(self.rows()) + triangle_len(row);
        &self.factors[start..=start + row]
    }

    fn check(&self) -> Result<(), ModelError> {
        let (rows, count) = (self.rows(), self.skills.len());
        for (what, number) in [("row of the gate", rows), ("reference", count)] {
            if number == 0 {
                return Err(ModelError::Empty { what });
            }
        }
        let skills = self.skill_count();
        let lists = [
            (
                "the factors",
                self.factors,
                skills.saturating_mul(triangle_len(rows)),
            ),
            (
                "the references",
                self.references,
                count.saturating_mul(rows),
            ),
            ("the thresholds", self.thresholds, rows),
            ("the tail", core::slice::from_ref(&self.tail), 1),
        ];
        for (what, list, expected) in lists {
            if list.len() != expected {
                let got = list.len();
                return Err(ModelError::Length {
                    what,
                    expected,
                    got,
                });
            }
            if let Some(index) = list.iter().position(|value| !value.is_finite()) {
                let value = list[index].widen();
                return Err(ModelError::NonFinite { what, index, value });
            }
        }
        let positive = |skill| (0..rows).all(|row| self.factor(skill, row)[row] > T::zero());
        if self.tail <= T::zero() || !(0..skills).all(positive) {
            return Err(ModelError::Empty {
                what: "positive tail and diagonal",
            });
        }
        Ok(())
    }
}

/// A row that a watch refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum WatchError {
    /// NaN or infinite.
    #[error("{value} was observed: drop the sample")]
    Value {
        /// The value.
        value: f64,
    },
    /// More rows than the gate knows.
    #[error("the gate has seen all its {rows} rows: reset it for the next movement")]
    Full {
        /// How many there are.
        rows: usize,
    },
    /// So far from everything that the scalar cannot hold the distance.
    #[error("{value} was observed: its distance overflows, check the unit")]
    Overflow {
        /// The value.
        value: f64,
    },
}

/// How well a movement is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Novelty<T> {
    /// Least mean surprise over the references.
    pub score: T,
    /// Greatest score of the known after as many rows.
    pub threshold: T,
    /// Skill of the reference of least surprise: what to substitute.
    pub nearest: usize,
    /// Its root mean square innovation, in standard deviations of one performance from another.
    pub distance: T,
}

impl<T: Real> Novelty<T> {
    /// Whether the movement is none of the known.
    #[must_use]
    pub fn unknown(&self) -> bool {
        self.score > self.threshold
    }
}

/// One movement against all that is known, row after row.
///
/// `B` is storage of at least [`watch_len`] numbers: `[T; N]` on the chip, `Vec<T>` on the host. With the references of a
/// skill next to each other a row costs at most `2 Q J` multiply-adds, and two divisions and a logarithm per reference.
#[derive(Clone, Debug)]
pub struct Watch<'a, T, B> {
    known: Known<'a, T>,
    seen: usize,
    storage: B,
}

impl<'a, T: Real, B: AsRef<[T]> + AsMut<[T]>> Watch<'a, T, B> {
    /// Before the first row. Takes `storage` over, whatever it holds.
    ///
    /// # Errors
    /// Lists of `known` that do not fit together or hold a number that is not finite, storage too short.
    pub fn new(known: Known<'a, T>, storage: B) -> Result<Self, ModelError> {
        known.check()?;
        let needed = watch_len(known.skill_count(), known.rows(), known.skills.len());
        let got = storage.as_ref().len();
        if got < needed {
            return Err(ModelError::Storage {
                what: "the watch's storage",
                needed,
                got,
            });
        }
        let mut watch = Self {
            known,
            seen: 0,
            storage,
        };
        watch.reset();
        Ok(watch)
    }

    /// Forgets every row, for the next movement.
    pub fn reset(&mut self) {
        self.seen = 0;
        self.storage.as_mut().fill(T::zero());
    }

    /// Rows observed so far.
    #[must_use]
    pub const fn seen(&self) -> usize {
        self.seen
    }

    /// The next row in the gate's order.
    ///
    /// # Errors
    /// [`WatchError`]; the watch is as before then.
    pub fn observe(&mut self, value: T) -> Result<(), WatchError> {
        let (known, row) = (self.known, self.seen);
        let rows = known.rows();
        if row >= rows {
            return Err(WatchError::Full { rows });
        }
        let widened = value.widen();
        if !value.is_finite() {
            return Err(WatchError::Value { value: widened });
        }
        let skills = known.skill_count();
        let (whitened, sums) = self.storage.as_mut().split_at_mut(skills * rows);
        // Forward substitution. An entry counts from `seen` on only, so that a refusal leaves everything as it was.
        for (skill, whitened) in whitened.chunks_exact_mut(rows).enumerate() {
            let factor = known.factor(skill, row);
            let (before, rest) = whitened.split_at_mut(row);
            rest[0] = (value - dot(&factor[..row], before)) / factor[row];
        }
        let innovation = |reference: usize, skill: usize| {
            whitened[skill * rows + row] - known.references[reference * rows + row]
        };
        let mut finite = true;
        let of_reference = || known.skills.iter().copied().enumerate();
        for ((reference, skill), sums) in of_reference().zip(sums.chunks_exact(2)) {
            let d = innovation(reference, skill);
            finite &= (sums[1] + d * d + d * d / known.tail).is_finite();
        }
        if !finite {
            return Err(WatchError::Overflow { value: widened });
        }
        for ((reference, skill), sums) in of_reference().zip(sums.chunks_exact_mut(2)) {
            let d = innovation(reference, skill);
            sums[0] += (d * d / known.tail).ln_1p();
            sums[1] += d * d;
        }
        self.seen += 1;
        Ok(())
    }

    /// Mean surprise of every reference so far, and its skill; nothing before the first row.
    pub fn surprises(&self) -> impl Iterator<Item = (usize, T)> {
        let count = if self.seen > 0 {
            self.known.skills.len()
        } else {
            0
        };
        let rows = T::of(self.seen as f64);
        let skills = self.known.skills.iter().copied().take(count);
        skills
            .zip(self.sums())
            .map(move |(skill, sums)| (skill, sums[0] / rows))
    }

    /// The answer after the rows so far, `None` before the first.
    #[must_use]
    pub fn novelty(&self) -> Option<Novelty<T>> {
        let threshold = *self.known.thresholds.get(self.seen.checked_sub(1)?)?;
        let rows = T::of(self.seen as f64);
        let all = self.known.skills.iter().zip(self.sums());
        let (nearest, sums) =
            all.reduce(|best, next| if next.1[0] < best.1[0] { next } else { best })?;
        Some(Novelty {
            score: sums[0] / rows,
            threshold,
            nearest: *nearest,
            distance: (sums[1] / rows).sqrt(),
        })
    }

    fn sums(&self) -> impl Iterator<Item = &[T]> {
        let whitened = self.known.skill_count() * self.known.rows();
        self.storage.as_ref()[whitened..].chunks_exact(2)
    }
}

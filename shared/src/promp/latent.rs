//! The latent space of a model: a basis, and the loading that its skills share.

use super::basis::Basis;
use super::error::{ModelError, RowError};
use super::linear::all_finite;
use super::row::{Functions, Order, Row};
use crate::Real;

/// Numbers in a loading of `dofs` DoFs, `basis` functions each, and `rank` columns.
#[must_use]
pub const fn loading_len(dofs: usize, basis: usize, rank: usize) -> usize {
    dofs * basis * rank
}

/// The latent space `w = mu + L z` that all skills of a model share: a basis and a loading.
#[derive(Clone, Copy, Debug)]
pub struct Latent<'a, T> {
    basis: Basis,
    dofs: usize,
    rank: usize,
    loading: &'a [T],
}

impl<'a, T: Real> Latent<'a, T> {
    /// A view of `loading`: `D*K x r`, row-major, rows DoF-major (`loading[(d * K + k) * r + j]`), in
    /// the DoFs' raw units (any scaling used in learning folded in).
    ///
    /// # Errors
    /// A zero dimension, a length other than `dofs * basis.count() * rank`, a number that is not finite.
    pub fn new(
        basis: Basis,
        dofs: usize,
        rank: usize,
        loading: &'a [T],
    ) -> Result<Self, ModelError> {
        for (what, size) in [("DoF", dofs), ("latent dimension", rank)] {
            if size == 0 {
                return Err(ModelError::Empty { what });
            }
        }
        let expected = dofs
            .checked_mul(basis.count())
            .and_then(|weights| weights.checked_mul(rank))
            .ok_or(ModelError::TooLarge {
                dofs,
                basis: basis.count(),
                rank,
            })?;
        check_len("the loading", loading, expected)?;
        check_finite("the loading", loading)?;
        Ok(Self {
            basis,
            dofs,
            rank,
            loading,
        })
    }

    /// The basis.
    #[must_use]
    pub const fn basis(&self) -> &Basis {
        &self.basis
    }

    /// Degrees of freedom, `D`.
    #[must_use]
    pub const fn dofs(&self) -> usize {
        self.dofs
    }

    /// Latent dimensions, `r`.
    #[must_use]
    pub const fn rank(&self) -> usize {
        self.rank
    }

    /// Weights of a movement, `D * K`.
    #[must_use]
    pub const fn weights(&self) -> usize {
        self.dofs * self.basis.count()
    }

    /// The loading, as given.
    #[must_use]
    pub const fn loading(&self) -> &'a [T] {
        self.loading
    }

    /// Writes the basis functions of the row to `psi` (`K` long; `psi'(s) / duration` for a velocity) and
    /// `a = L_d^T psi` to `a` (`r` long). With [`Skill::offset`] the row's value is
    /// `offset(psi) + a^T z`. Cost: the basis and `K * r` multiply-adds.
    ///
    /// # Errors
    /// No such DoF, phase not finite, duration not positive and finite, a buffer of the wrong length,
    /// a row that the scalar cannot hold.
    pub fn row(&self, row: &Row<T>, psi: &mut [T], a: &mut [T]) -> Result<(), RowError> {
        self.functions(row, psi)?;
        self.project(row, Functions::of(psi), a)
    }

    /// The first half of [`Latent::row`], which rows of one phase and order share: `psi`.
    pub(super) fn functions(&self, row: &Row<T>, psi: &mut [T]) -> Result<(), RowError> {
        match row.order {
            Order::Position => self.basis.values(row.phase, psi),
            Order::Velocity { duration_s } => {
                if !(duration_s.is_finite() && duration_s > T::zero()) {
                    return Err(RowError::Duration {
                        duration_s: duration_s.widen(),
                    });
                }
                self.basis.derivatives(row.phase, psi)?;
                for value in psi.iter_mut() {
                    *value /= duration_s;
                }
                Ok(())
            }
        }
    }

    /// The second half: `a`, from `psi`.
    pub(super) fn project(
        &self,
        row: &Row<T>,
        functions: Functions<'_, T>,
        a: &mut [T],
    ) -> Result<(), RowError> {
        self.project_by((self.loading, self.rank), row, functions, a)
    }

    /// As [`Latent::project`] by another loading of so many columns.
    pub(super) fn project_by(
        &self,
        (loading, rank): (&[T], usize),
        row: &Row<T>,
        functions: Functions<'_, T>,
        a: &mut [T],
    ) -> Result<(), RowError> {
        if row.dof >= self.dofs {
            return Err(RowError::Dof {
                dof: row.dof,
                dofs: self.dofs,
            });
        }
        if a.len() != rank {
            return Err(RowError::Buffer {
                what: "row",
                expected: rank,
                got: a.len(),
            });
        }
        let block = self.basis.count() * rank;
        functions.combine(&loading[row.dof * block..(row.dof + 1) * block], a);
        row.bounded(all_finite(a))
    }
}

pub(super) fn check_len<T>(
    what: &'static str,
    slice: &[T],
    expected: usize,
) -> Result<(), ModelError> {
    if slice.len() == expected {
        return Ok(());
    }
    Err(ModelError::Length {
        what,
        expected,
        got: slice.len(),
    })
}

pub(super) fn check_finite<T: Real>(what: &'static str, slice: &[T]) -> Result<(), ModelError> {
    match slice.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(ModelError::NonFinite {
            what,
            index,
            value: slice[index].widen(),
        }),
    }
}

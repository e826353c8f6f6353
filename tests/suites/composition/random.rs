//! Random skills in either scalar, and the same Gaussians written out in weight space.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus_shared::Real;
use tonus_shared::promp::{Basis, Latent, Order, Row, Skill};

pub(crate) const DOFS: usize = 3;
pub(crate) const BASIS: usize = 7;
pub(crate) const RANK: usize = 9;
pub(crate) const DURATION_S: f64 = 1.7;

/// One latent space and some skills in it; the numbers are exact in `f32` too.
pub(crate) struct Space<T> {
    pub(crate) basis: Basis,
    loading: Vec<T>,
    means: Vec<Vec<T>>,
    roots: Vec<Vec<T>>,
    triangles: Vec<Vec<T>>,
    residual: Vec<T>,
}

impl<T: Real> Space<T> {
    pub(crate) fn random(seed: u64, skills: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |n: usize| -> Vec<T> {
            let drawn = (0..n).map(|_| rng.random_range(-1.0_f32..1.0));
            drawn.map(|x| T::of(f64::from(x))).collect()
        };
        let loading = draw(DOFS * BASIS * RANK);
        let means = (0..skills).map(|_| draw(DOFS * BASIS)).collect();
        let roots: Vec<Vec<T>> = (0..skills).map(|_| draw(RANK * RANK)).collect();
        let triangle = |root: &Vec<T>| tonus_tests::triangle(RANK, root);
        Self {
            basis: Basis::gaussian(BASIS).unwrap(),
            loading,
            means,
            triangles: roots.iter().map(triangle).collect(),
            roots,
            residual: vec![T::of(0.5); DOFS],
        }
    }

    pub(crate) fn latent(&self) -> Latent<'_, T> {
        Latent::new(self.basis, DOFS, RANK, &self.loading).unwrap()
    }

    pub(crate) fn skill(&self, index: usize) -> Skill<'_, T> {
        let root = Some(self.triangles[index].as_slice());
        let mean = &self.means[index];
        Skill::new(&self.latent(), mean, root, &self.residual, T::zero()).unwrap()
    }

    /// Mean and covariance of a skill's weights.
    pub(crate) fn dense(&self, skill: usize) -> (DVector<f64>, DMatrix<f64>) {
        let wide = |list: &[T]| -> Vec<f64> { list.iter().map(|x| x.widen()).collect() };
        let loading = DMatrix::from_row_slice(DOFS * BASIS, RANK, &wide(&self.loading));
        let root = loading * DMatrix::from_row_slice(RANK, RANK, &wide(&self.roots[skill]));
        let covariance = &root * root.transpose();
        (DVector::from_vec(wide(&self.means[skill])), covariance)
    }

    /// The row of the observation matrix.
    pub(crate) fn weights_row(&self, row: &Row<T>) -> DVector<f64> {
        let phase = row.phase.widen();
        let mut psi = vec![0.0; BASIS];
        match row.order {
            Order::Position => self.basis.values(phase, &mut psi).unwrap(),
            Order::Velocity { duration_s } => {
                self.basis.derivatives(phase, &mut psi).unwrap();
                psi.iter_mut().for_each(|p| *p /= duration_s.widen());
            }
        }
        let mut dense = DVector::zeros(DOFS * BASIS);
        dense.rows_mut(row.dof * BASIS, BASIS).copy_from_slice(&psi);
        dense
    }
}

/// Asserts that `got` is `expected` to `tolerance` times `scale`.
pub(crate) fn near<T: Real>(got: T, expected: f64, tolerance: f64) {
    let error = (got.widen() - expected).abs();
    assert!(
        error <= tolerance,
        "{got} is not {expected}: off by {error:.1e}, {tolerance:.1e} allowed"
    );
}

//! Learning as the reference did it: ridge least squares per DoF, thin SVD. Independent of the host's
//! own learner, so that the kernels are judged on their own.

use std::path::Path;

use nalgebra::{DMatrix, DVector};
use tonus_shared::Real;
use tonus_shared::promp::{Basis, Latent, Skill};

pub(crate) const BASIS: usize = 30;
const RIDGE: f64 = 1e-8;

/// A numeric CSV: column names and rows.
pub(crate) struct Table {
    names: Vec<String>,
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Table {
    pub(crate) fn read(path: &Path) -> Self {
        let mut reader = csv::Reader::from_path(path).unwrap();
        let names = reader.headers().unwrap().iter().map(String::from).collect();
        let rows = reader
            .records()
            .map(|record| record.unwrap().iter().map(|f| f.parse().unwrap()).collect())
            .collect();
        Self { names, rows }
    }

    pub(crate) fn column(&self, name: &str) -> Vec<f64> {
        let at = self.names.iter().position(|n| n == name).unwrap();
        self.rows.iter().map(|row| row[at]).collect()
    }
}

/// The weights of every demonstration in `demos.csv`, and its class.
pub(crate) struct Demonstrations {
    pub(crate) dofs: Vec<String>,
    pub(crate) labels: Vec<usize>,
    /// One row per demonstration, `D * K` columns.
    pub(crate) weights: DMatrix<f64>,
}

impl Demonstrations {
    pub(crate) fn fit(folder: &Path, dofs: &[String]) -> Self {
        let table = Table::read(&folder.join("demos.csv"));
        let basis = Basis::gaussian(BASIS).unwrap();
        let samples = 200;
        let phases = &table.column("s")[..samples];
        let mut psi = DMatrix::<f64>::zeros(samples, BASIS);
        let mut values = vec![0.0; BASIS];
        for (i, phase) in phases.iter().enumerate() {
            basis.values(*phase, &mut values).unwrap();
            psi.row_mut(i).copy_from_slice(&values);
        }
        // Least squares on the stacked system [psi; sqrt(ridge) I], by QR: no normal equations.
        let mut stacked = DMatrix::zeros(samples + BASIS, BASIS);
        stacked.rows_mut(0, samples).copy_from(&psi);
        stacked.rows_mut(samples, BASIS).fill_diagonal(RIDGE.sqrt());
        let qr = stacked.qr();
        let count = table.rows.len() / samples;
        let mut weights = DMatrix::zeros(count, dofs.len() * BASIS);
        for (d, name) in dofs.iter().enumerate() {
            let column = table.column(name);
            for n in 0..count {
                let mut right = DVector::zeros(samples + BASIS);
                right
                    .rows_mut(0, samples)
                    .copy_from_slice(&column[n * samples..(n + 1) * samples]);
                let solution = qr.r().solve_upper_triangular(&(qr.q().transpose() * right));
                for (k, weight) in solution.unwrap().iter().enumerate() {
                    weights[(n, d * BASIS + k)] = *weight;
                }
            }
        }
        let labels = table.column("label");
        Self {
            dofs: dofs.to_vec(),
            labels: (0..count).map(|n| labels[n * samples] as usize).collect(),
            weights,
        }
    }
}

/// Skills over one loading, all parameters owned.
pub(crate) struct Model<T> {
    pub(crate) dofs: usize,
    pub(crate) rank: usize,
    loading: Vec<T>,
    means: Vec<Vec<T>>,
    roots: Vec<Option<Vec<T>>>,
    residual: Vec<T>,
}

impl<T: Real> Model<T> {
    pub(crate) fn latent(&self) -> Latent<'_, T> {
        let basis = Basis::gaussian(BASIS).unwrap();
        Latent::new(basis, self.dofs, self.rank, &self.loading).unwrap()
    }

    pub(crate) fn skills(&self) -> Vec<Skill<'_, T>> {
        let log_prior = T::of(-(self.means.len() as f64).ln());
        self.means
            .iter()
            .zip(&self.roots)
            .map(|(mean, root)| {
                Skill::new(
                    &self.latent(),
                    mean,
                    root.as_deref(),
                    &self.residual,
                    log_prior,
                )
                .unwrap()
            })
            .collect()
    }
}

impl Model<f64> {
    /// All demonstrations as one skill: `Sigma = L L^T`, rank `N - 1`.
    pub(crate) fn single(demos: &Demonstrations) -> Self {
        let count = demos.weights.nrows();
        let mean = demos.weights.row_mean();
        let centred = centre(&demos.weights, &vec![0; count], &[mean.transpose()]);
        let (loading, _) = factor(&centred, demos.dofs.len(), count - 1, count - 1);
        Self {
            dofs: demos.dofs.len(),
            rank: count - 1,
            loading: row_major(&loading),
            means: vec![mean.iter().copied().collect()],
            roots: vec![None],
            residual: vec![0.0; demos.dofs.len()],
        }
    }

    /// One skill per class in the pooled within-class subspace (rank `N - Q`). The class covariance
    /// `Z^T Z / (n - 1)` of its demonstrations' coordinates has the root `Z^T / sqrt(n - 1)`, padded.
    pub(crate) fn classes(demos: &Demonstrations, classes: usize) -> Self {
        let members = |class: usize| -> Vec<usize> {
            (0..demos.labels.len())
                .filter(|n| demos.labels[*n] == class)
                .collect()
        };
        let means: Vec<DVector<f64>> = (0..classes)
            .map(|class| {
                demos
                    .weights
                    .select_rows(&members(class))
                    .row_mean()
                    .transpose()
            })
            .collect();
        let count = demos.weights.nrows();
        let rank = count - classes;
        let centred = centre(&demos.weights, &demos.labels, &means);
        let (loading, coordinates) = factor(&centred, demos.dofs.len(), rank, rank);
        let roots = (0..classes).map(|class| {
            let rows = members(class);
            let scale = ((rows.len() - 1) as f64).sqrt();
            let mut root = DMatrix::zeros(rank, rank);
            root.columns_mut(0, rows.len())
                .copy_from(&(coordinates.select_rows(&rows).transpose() / scale));
            Some(tonus_tests::triangle(rank, &row_major(&root)))
        });
        Self {
            dofs: demos.dofs.len(),
            rank,
            loading: row_major(&loading),
            roots: roots.collect(),
            means: means.iter().map(|m| m.as_slice().to_vec()).collect(),
            residual: vec![0.0; demos.dofs.len()],
        }
    }

    pub(crate) fn narrow(&self) -> Model<f32> {
        let cast = |values: &Vec<f64>| values.iter().map(|v| f32::of(*v)).collect::<Vec<f32>>();
        Model {
            dofs: self.dofs,
            rank: self.rank,
            loading: cast(&self.loading),
            means: self.means.iter().map(cast).collect(),
            roots: self.roots.iter().map(|r| r.as_ref().map(cast)).collect(),
            residual: cast(&self.residual),
        }
    }
}

fn centre(weights: &DMatrix<f64>, labels: &[usize], means: &[DVector<f64>]) -> DMatrix<f64> {
    let mut centred = weights.clone();
    for (n, mut row) in centred.row_iter_mut().enumerate() {
        row -= means[labels[n]].transpose();
    }
    centred
}

/// `centred = coordinates * loading^T` with `loading loading^T = centred^T centred / divisor`: thin SVD
/// with every DoF scaled to unit spread, the scale folded back into the loading.
fn factor(
    centred: &DMatrix<f64>,
    dofs: usize,
    rank: usize,
    divisor: usize,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut scaled = centred.clone();
    let scales: Vec<f64> = (0..dofs)
        .map(|d| {
            let mut block = scaled.columns_mut(d * BASIS, BASIS);
            let scale = (block.norm_squared() / block.len() as f64).sqrt();
            block /= scale;
            scale
        })
        .collect();
    let svd = scaled.transpose().svd(true, true);
    let divisor = (divisor as f64).sqrt();
    let mut loading = svd.u.unwrap().columns(0, rank).into_owned();
    for (j, mut column) in loading.column_iter_mut().enumerate() {
        column *= svd.singular_values[j] / divisor;
    }
    for (i, mut row) in loading.row_iter_mut().enumerate() {
        row *= scales[i / BASIS];
    }
    let coordinates = svd.v_t.unwrap().rows(0, rank).transpose() * divisor;
    (loading, coordinates)
}

fn row_major(matrix: &DMatrix<f64>) -> Vec<f64> {
    matrix.transpose().as_slice().to_vec()
}

//! All methods on the same data: one row each.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

use super::dmp::Dmp;
use super::hidden_markov::HiddenMarkov;
use super::mixture_regression::MixtureRegression;
use super::nearest::Nearest;
use super::{
    Answer, BaselineError, Observed, Path, Primitives, Protocol, Roles, labels_of, marginals,
    single_gaussian, without_semg,
};
use crate::demonstration::Demonstration;

/// Every so many samples of a recording are compared: neighbours say the same.
const STRIDE: usize = 4;

/// How well one method does. What a method cannot answer is none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The method.
    pub method: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// Share of the test movements recognised.
    pub accuracy: Option<f64>,
    /// Mean of minus the log probability given to the right label, nats.
    pub log_loss: Option<f64>,
    /// Median distance between predicted and recorded end of the robot's path, metres.
    pub end_point_error_m: Option<f64>,
    /// Median of the root mean square distance along the robot's path, metres.
    pub path_rmse_m: Option<f64>,
    /// Mean root mean square error of the robot's stiffness over its range in the demonstrations.
    pub stiffness_nrmse: Option<f64>,
    /// Share of recorded values inside their pointwise 95 % interval, all DoFs alike.
    pub coverage_95: Option<f64>,
}

/// Everything learnt.
struct Learnt {
    primitives: Primitives,
    single: Primitives,
    mixture: MixtureRegression,
    markov: HiddenMarkov,
    nearest: Nearest,
    dmp: Option<Dmp>,
}

/// Each method, as the table names it.
#[derive(Debug, Clone, Copy)]
enum Method {
    Primitives,
    WithoutSemg,
    SingleGaussian,
    Marginals,
    MixtureRegression,
    HiddenMarkov,
    Nearest,
    Dmp,
}

impl Method {
    const ALL: [Self; 8] = [
        Self::Primitives,
        Self::WithoutSemg,
        Self::SingleGaussian,
        Self::Marginals,
        Self::MixtureRegression,
        Self::HiddenMarkov,
        Self::Nearest,
        Self::Dmp,
    ];

    fn name(self) -> (&'static str, &'static str) {
        match self {
            Self::Primitives => ("mixture of ProMPs", "Guan, Wang and Yang; this program"),
            Self::WithoutSemg => ("mixture of ProMPs without sEMG", "Maeda 2017"),
            Self::SingleGaussian => ("one Gaussian ProMP over all skills", "Paraschos 2013"),
            Self::Marginals => ("product of time marginals", "eq. 19 instant by instant"),
            Self::MixtureRegression => ("GMM, Gaussian mixture regression", "Calinon 2007"),
            Self::HiddenMarkov => (
                "hidden semi-Markov model, Gaussian regression",
                "Zeestraten 2016; Zeng 2020",
            ),
            Self::Nearest => ("nearest demonstration by DTW", "Sakoe and Chiba 1978"),
            Self::Dmp => (
                "DMP, goals set by hand, skill told",
                "Ijspeert 2013; Yang 2018",
            ),
        }
    }
}

impl Learnt {
    fn from(train: &[Demonstration], protocol: &Protocol) -> Result<Self, BaselineError> {
        let dofs = protocol.dofs();
        let dmp = protocol.roles.map(|roles| Dmp::learn(train, dofs, roles));
        Ok(Self {
            primitives: Primitives::learn(train, &protocol.valid)?,
            single: single_gaussian::learn(train, &protocol.valid)?,
            mixture: MixtureRegression::learn(train, dofs)?,
            markov: HiddenMarkov::learn(train, dofs)?,
            nearest: Nearest::learn(train, dofs)?,
            dmp: dmp.transpose()?,
        })
    }

    fn answer(
        &self,
        method: Method,
        observed: &Observed,
        phases: &[f64],
        label: &str,
    ) -> Result<Answer, BaselineError> {
        match method {
            Method::Primitives => self.primitives.answer(observed, phases),
            Method::WithoutSemg => without_semg::answer(&self.primitives, observed, phases),
            Method::SingleGaussian => single_gaussian::answer(&self.single, observed, phases),
            Method::Marginals => marginals::answer(&self.primitives, observed, phases),
            Method::MixtureRegression => self.mixture.answer(observed, phases),
            Method::HiddenMarkov => self.markov.answer(observed, phases),
            Method::Nearest => self.nearest.answer(observed, phases),
            Method::Dmp => match &self.dmp {
                Some(dmp) => dmp.answer(observed, phases, label),
                None => Ok(Answer::default()),
            },
        }
    }
}

/// Learns every method from `train` and asks it about every movement of `test`, all of them about the same noisy
/// observations. Without [`Protocol::roles`] only recognition is compared.
///
/// # Errors
/// [`BaselineError`].
pub fn compare(
    train: &[Demonstration],
    test: &[Demonstration],
    protocol: &Protocol,
) -> Result<Vec<Row>, BaselineError> {
    let mut table = Table::new(protocol);
    table.add(train, test)?;
    Ok(table.rows())
}

/// The same where every `folds`th demonstration in turn is tested on what is learnt from the others.
///
/// # Errors
/// [`BaselineError`].
pub fn cross_validate(
    demonstrations: &[Demonstration],
    folds: usize,
    protocol: &Protocol,
) -> Result<Vec<Row>, BaselineError> {
    if folds < 2 {
        return Err(BaselineError::Protocol {
            what: "too few folds",
            wanted: "at least 2",
        });
    }
    let mut table = Table::new(protocol);
    for fold in 0..folds {
        let part = |tested: bool| -> Vec<Demonstration> {
            let all = demonstrations.iter().enumerate();
            let of_part = all.filter(|(index, _)| (index % folds == fold) == tested);
            of_part.map(|(_, one)| one.clone()).collect()
        };
        table.add(&part(false), &part(true))?;
    }
    Ok(table.rows())
}

/// Scores so far.
struct Table<'p> {
    protocol: &'p Protocol,
    noise: ChaCha8Rng,
    scores: Vec<Score>,
    /// Whether there was ever more than one label to choose from.
    several: bool,
}

impl<'p> Table<'p> {
    fn new(protocol: &'p Protocol) -> Self {
        Self {
            protocol,
            noise: ChaCha8Rng::seed_from_u64(protocol.seed),
            scores: vec![Score::default(); Method::ALL.len()],
            several: false,
        }
    }

    fn add(
        &mut self,
        train: &[Demonstration],
        test: &[Demonstration],
    ) -> Result<(), BaselineError> {
        let protocol = self.protocol;
        check(test, protocol)?;
        let learnt = Learnt::from(train, protocol)?;
        let (labels, _) = labels_of(train);
        self.several |= labels.len() > 1;
        let ranges = protocol.roles.map(|roles| ranges(train, &roles));
        for movement in test {
            let observed = observe(movement, protocol, &mut self.noise);
            let phases: Vec<f64> = match protocol.roles {
                Some(_) => compared(movement.phases(), movement),
                None => Vec::new(),
            };
            let label = labels.iter().position(|l| l == movement.label());
            for (method, score) in Method::ALL.into_iter().zip(&mut self.scores) {
                let answer = learnt.answer(method, &observed, &phases, movement.label())?;
                score.recognised(&answer, label);
                if let (Some(roles), Some(ranges)) = (&protocol.roles, &ranges) {
                    score.predicted(&answer.paths, movement, (roles, ranges));
                }
            }
        }
        Ok(())
    }

    fn rows(&self) -> Vec<Row> {
        let rows = Method::ALL.into_iter().zip(&self.scores);
        rows.map(|(method, score)| score.row(method, self.several))
            .collect()
    }
}

fn check(test: &[Demonstration], protocol: &Protocol) -> Result<(), BaselineError> {
    let dofs = protocol.dofs().len();
    let refuse = |what, wanted| Err(BaselineError::Protocol { what, wanted });
    if test.is_empty() {
        return Err(BaselineError::None("test on"));
    }
    if let Some(one) = test.iter().find(|one| one.values().len() != dofs) {
        return Err(BaselineError::Dofs {
            label: one.label().to_owned(),
            expected: dofs,
            got: one.values().len(),
        });
    }
    let increase = protocol.phases.windows(2).all(|pair| pair[0] < pair[1]);
    let within = protocol.phases.iter().all(|p| (0.0..=1.0).contains(p));
    if !(increase && within) {
        return refuse(
            "phases out of order or range",
            "increasing ones from 0 to 1",
        );
    }
    let roles = protocol.roles.iter().flat_map(|roles| {
        let all = [roles.hand, roles.robot, roles.robot_stiffness];
        all.into_iter().flatten()
    });
    if protocol
        .observed
        .iter()
        .copied()
        .chain(roles)
        .any(|dof| dof >= dofs)
    {
        return refuse("a DoF that there is not", "indices of the protocol's DoFs");
    }
    let numbers = [protocol.sigma_m, protocol.sigma_share];
    if !numbers.iter().all(|n| n.is_finite() && *n > 0.0) {
        return refuse("a sigma that is no size", "finite numbers above 0");
    }
    if !(protocol.noise_m.is_finite() && protocol.noise_m >= 0.0) {
        return refuse("a noise that is no length", "a finite number from 0");
    }
    Ok(())
}

fn observe(movement: &Demonstration, protocol: &Protocol, noise: &mut ChaCha8Rng) -> Observed {
    let mut values = vec![Vec::new(); protocol.observed.len()];
    let mut std = values.clone();
    for &phase in &protocol.phases {
        for (i, &dof) in protocol.observed.iter().enumerate() {
            // Checked: the movement has the DoF.
            let mut value = movement.value_at(dof, phase).unwrap_or(f64::NAN);
            let told = if protocol.dofs()[dof].is_position() {
                let normal: f64 = StandardNormal.sample(noise);
                value += protocol.noise_m * normal;
                libm::hypot(protocol.sigma_m, protocol.noise_m)
            } else {
                protocol.sigma_share * value.abs()
            };
            values[i].push(value);
            std[i].push(told);
        }
    }
    Observed {
        dofs: protocol.observed.clone(),
        phases: protocol.phases.clone(),
        values,
        std,
    }
}

/// Every [`STRIDE`]th of the values at the samples of `movement`, the last among them.
fn compared(values: impl Iterator<Item = f64>, movement: &Demonstration) -> Vec<f64> {
    let first = (movement.t_s().len() - 1) % STRIDE;
    values.skip(first).step_by(STRIDE).collect()
}

/// Range of each robot stiffness in the demonstrations.
fn ranges(train: &[Demonstration], roles: &Roles) -> [f64; 3] {
    roles.robot_stiffness.map(|dof| {
        let values = train.iter().flat_map(|one| &one.values()[dof]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (low.min(v), high.max(v))
        });
        high - low
    })
}

/// What came of all movements.
#[derive(Debug, Clone, Default)]
struct Score {
    right: Vec<bool>,
    log_probability: Vec<f64>,
    end_point_m: Vec<f64>,
    path_m: Vec<f64>,
    stiffness: Vec<f64>,
    inside: usize,
    outside: usize,
}

impl Score {
    fn recognised(&mut self, answer: &Answer, label: Option<usize>) {
        if let Some(recognised) = answer.recognised {
            self.right.push(Some(recognised) == label);
        }
        if let Some(log_posterior) = &answer.log_posterior {
            let own = label.and_then(|label| log_posterior.get(label));
            self.log_probability
                .push(own.copied().unwrap_or(f64::NEG_INFINITY));
        }
    }

    fn predicted(
        &mut self,
        paths: &[Option<Path>],
        movement: &Demonstration,
        (roles, ranges): (&Roles, &[f64; 3]),
    ) {
        let truth = |dof: usize| compared(movement.values()[dof].iter().copied(), movement);
        let off = |dof: usize| -> Option<Vec<f64>> {
            let path = paths.get(dof)?.as_ref()?;
            Some(
                path.mean
                    .iter()
                    .zip(truth(dof))
                    .map(|(m, t)| m - t)
                    .collect(),
            )
        };
        if let [Some(x), Some(y), Some(z)] = roles.robot.map(off) {
            let distance = |i: usize| libm::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
            let distances: Vec<f64> = (0..x.len()).map(distance).collect();
            self.end_point_m.extend(distances.last());
            self.path_m.push(root_mean_square(&distances));
        }
        if let [Some(x), Some(y), Some(z)] = roles.robot_stiffness.map(off) {
            let shares = [x, y, z]
                .iter()
                .zip(ranges)
                .map(|(k, range)| root_mean_square(k) / range)
                .sum::<f64>();
            self.stiffness.push(shares / 3.0);
        }
        for (dof, path) in paths.iter().enumerate() {
            let Some(interval) = path.as_ref().and_then(|path| path.interval_95.as_ref()) else {
                continue;
            };
            for ((low, high), value) in interval.iter().zip(truth(dof)) {
                if (*low..=*high).contains(&value) {
                    self.inside += 1;
                } else {
                    self.outside += 1;
                }
            }
        }
    }

    fn row(&self, method: Method, several: bool) -> Row {
        let (method, source) = method.name();
        let right: Vec<f64> = self.right.iter().map(|r| f64::from(u8::from(*r))).collect();
        let loss: Vec<f64> = self.log_probability.iter().map(|l| -l).collect();
        let judged = self.inside + self.outside;
        Row {
            method,
            source,
            // With one label there is nothing to recognise.
            accuracy: mean(&right).filter(|_| several),
            log_loss: mean(&loss).filter(|_| several),
            end_point_error_m: median(&self.end_point_m),
            path_rmse_m: median(&self.path_m),
            stiffness_nrmse: mean(&self.stiffness),
            coverage_95: (judged > 0).then(|| self.inside as f64 / judged as f64),
        }
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    let upper = *sorted.get(half)?;
    Some(if sorted.len() % 2 == 1 {
        upper
    } else {
        0.5 * (sorted[half - 1] + upper)
    })
}

fn root_mean_square(values: &[f64]) -> f64 {
    libm::sqrt(values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64)
}

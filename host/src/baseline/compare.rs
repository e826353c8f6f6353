//! All methods on the same data: one row each.

mod score;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

use self::score::{Score, compared, ranges};
use super::dmp::Dmp;
use super::hidden_markov::HiddenMarkov;
use super::mixture_regression::MixtureRegression;
use super::nearest::Nearest;
use super::{
    Answer, BaselineError, Observed, Primitives, Protocol, labels_of, marginals, single_gaussian,
    without_semg,
};
use crate::demonstration::Demonstration;

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

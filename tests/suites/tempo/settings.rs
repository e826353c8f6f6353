//! What is decided before learning, and the shares of the settings in a mixture, on one person alone.

use std::fmt::{Display, Formatter};

use rayon::prelude::*;
use tonus::model::stacking::{self, LAPLACE};
use tonus::model::tempo::TempoConfig;
use tonus::model::{Dof, Hyperparameters, Model, learn};
use tonus_shared::onset::OnsetConfig;
use tonus_shared::promp::Basis;

use super::detector;
use super::play::{Following, Said, play};
use super::recordings::Action;

const FUNCTIONS: [usize; 3] = [8, 12, 20];
const PLACEMENTS_M: [f64; 3] = [0.1, 0.2, 0.3];
const SIGMAS_M: [f64; 4] = [0.01, 0.02, 0.05, 0.1];
const RIDGE: f64 = 1e-1;
pub(crate) const INTERVAL_S: f64 = 0.1;
/// What a skill whose hypotheses were all dropped is taken to have: the floor, nats.
pub(crate) const DROPPED: f64 = -25.0;

/// What is learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Form {
    functions: usize,
    placement_m: f64,
}

/// What is learnt, and the noise that is assumed on each observation, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Setting {
    form: Form,
    sigma_m: f64,
}

impl Display for Setting {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Form {
            functions,
            placement_m,
        } = self.form;
        let sigma_m = self.sigma_m;
        write!(
            f,
            "K {functions}, placement {placement_m} m, sigma {sigma_m} m"
        )
    }
}

impl Form {
    fn all() -> Vec<Self> {
        let placed = |functions| {
            PLACEMENTS_M.map(|placement_m| Self {
                functions,
                placement_m,
            })
        };
        FUNCTIONS.into_iter().flat_map(placed).collect()
    }

    fn learn(&self, of: &[&Action<'_>]) -> Model {
        let demonstrations: Vec<_> = of.iter().map(|a| a.demonstration.clone()).collect();
        let basis = Basis::gaussian(self.functions).expect("a basis");
        let dofs = ["x", "y", "z"].map(Dof::position).to_vec();
        let hyperparameters = Hyperparameters {
            ridge: RIDGE,
            placement_m: self.placement_m,
            ..Hyperparameters::new(dofs, basis)
        };
        learn(&demonstrations, &hyperparameters.check().expect("in range")).expect("a model")
    }

    fn settings(self) -> [Setting; SIGMAS_M.len()] {
        SIGMAS_M.map(|sigma_m| Setting {
            form: self,
            sigma_m,
        })
    }
}

/// The detector as the program has it, and its error on one person: late by, standard deviation, s.
#[derive(Clone, Copy, Debug)]
struct Detecting {
    onset: OnsetConfig,
    late_s: f64,
    spread_s: f64,
}

impl Detecting {
    fn of(person: &[Action<'_>]) -> Self {
        let onset = OnsetConfig::default();
        let (late_s, spread_s) = detector::error(person, &onset);
        Self {
            onset,
            late_s,
            spread_s,
        }
    }

    fn following(&self, setting: &Setting) -> Following {
        Following {
            tempo: TempoConfig {
                durations: 7,
                onset_late_s: self.late_s,
                onset_std_s: self.spread_s,
                lead_s: 0.0,
                ..TempoConfig::default()
            },
            onset: self.onset,
            interval_s: INTERVAL_S,
            sigma_m: setting.sigma_m,
        }
    }
}

/// Settings, each with its log probability of the true action, for every action and fraction, learnt without the
/// action's run.
fn forecasts(person: &[Action<'_>], detecting: &Detecting) -> Vec<(Setting, Vec<f64>)> {
    let trial = |index: usize| person[index].demonstration.trial();
    let mut firsts: Vec<usize> = (0..person.len()).collect();
    firsts.dedup_by_key(|index| trial(*index));
    let forms = Form::all();
    let of_form = |form| firsts.iter().map(move |first| (form, *first));
    let jobs: Vec<_> = forms.iter().flat_map(of_form).collect();
    let without = |&(form, first): &(&Form, usize)| -> Vec<Vec<f64>> {
        let out = |index: &usize| trial(*index) == trial(first);
        let others = (0..person.len()).filter(|index| !out(index));
        let others: Vec<_> = others.map(|index| &person[index]).collect();
        let model = form.learn(&others);
        let of = |setting: &Setting| {
            let following = detecting.following(setting);
            let out = (0..person.len()).filter(out);
            let said = out.flat_map(|index| {
                let action = &person[index];
                let said = play(&model, &following, action, index as u64 + 1);
                let truth = model.skill(action.demonstration.label()).expect("a skill");
                said.map(|said| said.log_posterior[truth].clamp(DROPPED, 0.0))
            });
            said.collect()
        };
        form.settings().iter().map(of).collect()
    };
    let done: Vec<_> = jobs.par_iter().map(without).collect();
    let runs_joined = |(form, runs): (&Form, &[Vec<Vec<f64>>])| {
        let joined = |index: usize| runs.iter().flat_map(|run| run[index].clone()).collect();
        let settings = form.settings().into_iter().enumerate();
        let settings = settings.map(|(index, setting)| (setting, joined(index)));
        settings.collect::<Vec<_>>()
    };
    let runs = done.chunks(firsts.len());
    forms.iter().zip(runs).flat_map(runs_joined).collect()
}

/// A recogniser that is a mixture of several, learnt from all that one person did.
pub(crate) struct Mixture {
    detecting: Detecting,
    /// Largest first.
    pub(crate) shares: Vec<(Setting, f64)>,
    /// Mean log-loss inside, with a run left out: of the best setting alone, and of the mixture.
    pub(crate) single: (Setting, f64),
    pub(crate) mixed_loss: f64,
    models: Vec<Model>,
}

impl Mixture {
    /// The shares of least log-loss, one run left out in turn.
    pub(crate) fn of(person: &[Action<'_>]) -> Self {
        let detecting = Detecting::of(person);
        let (settings, logs): (Vec<_>, Vec<_>) = forecasts(person, &detecting).into_iter().unzip();
        let mean_loss = |logs: &Vec<f64>| -logs.iter().sum::<f64>() / logs.len() as f64;
        let single = settings.iter().copied().zip(logs.iter().map(mean_loss));
        let single = single.min_by(|one, other| one.1.total_cmp(&other.1));
        let shares = stacking::shares(&logs, LAPLACE).expect("shares");
        let mixed = (0..logs[0].len()).map(|i| {
            let terms = shares.iter().zip(&logs).map(|(w, of)| w * of[i].exp());
            terms.sum::<f64>().ln()
        });
        let mixed_loss = mean_loss(&mixed.collect());
        let mut shares: Vec<_> = settings.into_iter().zip(shares).collect();
        shares.retain(|(_, share)| *share > 0.0);
        shares.sort_by(|one, other| other.1.total_cmp(&one.1));
        let all: Vec<_> = person.iter().collect();
        let models = shares.iter().map(|(setting, _)| setting.form.learn(&all));
        Self {
            detecting,
            single: single.expect("the grid is not empty"),
            mixed_loss,
            models: models.collect(),
            shares,
        }
    }

    /// The labels, in the order of what is said of them.
    pub(crate) fn labels(&self) -> &[String] {
        self.models[0].labels()
    }

    /// As [`super::play::play`]: the mixture's posterior, and the intervals of the setting with the largest share.
    pub(crate) fn play(&self, action: &Action<'_>, seed: u64) -> [Said; 3] {
        let settings = self.models.iter().zip(&self.shares);
        let each: Vec<[Said; 3]> = settings
            .map(|(model, (setting, _))| {
                assert_eq!(model.labels(), self.labels());
                play(model, &self.detecting.following(setting), action, seed)
            })
            .collect();
        let shares: Vec<f64> = self.shares.iter().map(|(_, share)| *share).collect();
        std::array::from_fn(|part| {
            let posteriors = each.iter().map(|said| said[part].log_posterior.clone());
            let posteriors: Vec<_> = posteriors.collect();
            Said {
                log_posterior: stacking::mixed(&shares, &posteriors).expect("a mixture"),
                ..each[0][part]
            }
        })
    }
}

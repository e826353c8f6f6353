//! Whether posteriors over real movements mean what they say, early and late in the movement.
//!
//! Three recordings, all held out: pick and place (one run left out within each person, and each person from the
//! other), digits and reach to grasp (a part of the performances left out in turn). The assumed noise, the placement and the temperature are chosen on the rest
//! alone, by leaving out parts of that in turn.
//! **The duration is an oracle**: the first 20 % is of a duration that nobody knows yet.
#![allow(missing_docs, reason = "test suite")]

use std::collections::BTreeSet;

use tonus::demonstration::Demonstration;
use tonus::model::calibration::{
    Early, Forecast, Reliability, Temperature, brier, decide, log_loss,
};
use tonus::model::evaluate::{Protocol, evaluate};
use tonus::model::{Dof, Hyperparameters, Predictive, Valid, learn};
use tonus_shared::promp::Basis;
use tonus_tests::motion;

const FRACTIONS: [f64; 4] = [0.2, 0.3, 0.5, 1.0];
const CONFIDENCE: f64 = 0.9;

/// What is tried on the training part.
struct Grid {
    dofs: &'static [&'static str],
    functions: &'static [usize],
    sigmas_m: &'static [f64],
    placement_m: &'static [f64],
    predictive: Predictive,
    /// Parts that the training part is divided into for choosing.
    parts: usize,
}

impl Grid {
    fn learners(&self) -> Vec<Valid> {
        let dofs: Vec<Dof> = self.dofs.iter().copied().map(Dof::position).collect();
        let pairs = self.functions.iter().flat_map(|&functions| {
            let placements = self.placement_m.iter();
            placements.map(move |&placement_m| (functions, placement_m))
        });
        let one = |(functions, placement_m): (usize, f64)| {
            let given = Hyperparameters {
                placement_m,
                predictive: self.predictive,
                ..Hyperparameters::new(dofs.clone(), Basis::gaussian(functions).unwrap())
            };
            given.check().unwrap()
        };
        pairs.map(one).collect()
    }
}

fn protocol(fraction: f64, sigma_m: f64) -> Protocol {
    Protocol {
        fraction,
        sigma_m,
        ..Protocol::default()
    }
}

type Forecasts = Vec<Forecast>;

/// Forecasts of `tested` for each fraction and assumed noise: `[fraction][noise]`.
fn forecasts(
    learned: &[Demonstration],
    tested: &[Demonstration],
    valid: &Valid,
    sigmas_m: &[f64],
) -> Vec<Vec<Forecasts>> {
    let model = learn(learned, valid).unwrap();
    let at = |fraction: f64, sigma_m: f64| -> Forecasts {
        let evaluation = evaluate(&model, tested, &protocol(fraction, sigma_m)).unwrap();
        evaluation
            .outcomes
            .iter()
            .map(|o| o.forecast().unwrap())
            .collect()
    };
    let rows = FRACTIONS.map(|fraction| {
        sigmas_m
            .iter()
            .map(|&sigma_m| at(fraction, sigma_m))
            .collect()
    });
    rows.to_vec()
}

/// Trials, in `parts` parts.
fn part(all: &[Demonstration], parts: usize) -> Vec<usize> {
    let trials: BTreeSet<&str> = all.iter().map(Demonstration::trial).collect();
    // Of fewer trials than parts each is a part, so that none is empty.
    let parts = parts.min(trials.len());
    let of = |d: &Demonstration| trials.iter().position(|t| *t == d.trial()).unwrap() % parts;
    all.iter().map(of).collect()
}

fn without(
    all: &[Demonstration],
    parts: &[usize],
    out: usize,
) -> (Vec<Demonstration>, Vec<Demonstration>) {
    let pairs = all.iter().cloned().zip(parts);
    let (out, rest): (Vec<_>, Vec<_>) = pairs.partition(|(_, part)| **part == out);
    let bare = |list: Vec<(Demonstration, &usize)>| list.into_iter().map(|(d, _)| d).collect();
    (bare(out), bare(rest))
}

/// What was forecast of the held out at each of the fractions, without and with the temperature.
#[derive(Default)]
struct Held {
    raw: [Forecasts; 4],
    tempered: [Forecasts; 4],
    decisions: Vec<(Option<tonus::model::calibration::Decision>, usize)>,
}

/// Learner and noise of the least log-loss, summed over the fractions. Each at its own temperature: a noise that is
/// right but for that is not passed over.
fn chosen(inner: &[Vec<Vec<Forecasts>>], noises: usize) -> (usize, usize) {
    let pairs = (0..inner.len()).flat_map(|learner| (0..noises).map(move |noise| (learner, noise)));
    let loss = |&(learner, noise): &(usize, usize)| -> f64 {
        let at = inner[learner].iter().map(|fraction| {
            let forecasts = &fraction[noise];
            let temperature = Temperature::fit(forecasts).unwrap();
            let mended: Forecasts = forecasts.iter().map(|f| temperature.softened(f)).collect();
            log_loss(&mended).unwrap()
        });
        at.sum()
    };
    let scored = pairs.map(|pair| (loss(&pair), pair));
    scored.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
}

/// Chooses on `training` alone, forecasts `tested`.
fn hold_out(training: &[Demonstration], tested: &[Demonstration], grid: &Grid, held: &mut Held) {
    let parts = part(training, grid.parts);
    let learners = grid.learners();
    // [learner][fraction][noise]
    let mut inner: Vec<Vec<Vec<Forecasts>>> =
        vec![vec![vec![Vec::new(); grid.sigmas_m.len()]; FRACTIONS.len()]; learners.len()];
    let last = parts.iter().copied().max().unwrap();
    for out in 0..=last {
        let (out, rest) = without(training, &parts, out);
        for (learner, inner) in learners.iter().zip(&mut inner) {
            let made = forecasts(&rest, &out, learner, grid.sigmas_m);
            for (inner, made) in inner.iter_mut().flatten().zip(made.into_iter().flatten()) {
                inner.extend(made);
            }
        }
    }
    let (learner, noise) = chosen(&inner, grid.sigmas_m.len());
    let model = learn(training, &learners[learner]).unwrap();
    let mut streams = vec![Vec::new(); tested.len()];
    for (index, &fraction) in FRACTIONS.iter().enumerate() {
        let temperature = Temperature::fit(&inner[learner][index][noise]).unwrap();
        let protocol = protocol(fraction, grid.sigmas_m[noise]);
        let evaluation = evaluate(&model, tested, &protocol).unwrap();
        for (outcome, stream) in evaluation.outcomes.iter().zip(&mut streams) {
            let raw = outcome.forecast().unwrap();
            let tempered = temperature.softened(&raw);
            stream.push((fraction, tempered.log_posterior().to_vec(), raw.truth()));
            held.raw[index].push(raw);
            held.tempered[index].push(tempered);
        }
    }
    for (stream, movement) in streams.into_iter().zip(tested) {
        let truth = stream[0].2;
        let timed = stream
            .into_iter()
            .map(|(fraction, logs, _)| (fraction * movement.duration_s(), logs));
        held.decisions
            .push((decide(timed, CONFIDENCE).unwrap(), truth));
    }
}

fn in_turn(all: &[Demonstration], folds: usize, grid: &Grid, held: &mut Held) {
    let parts = part(all, folds);
    let last = parts.iter().copied().max().unwrap();
    for out in 0..=last {
        let (out, rest) = without(all, &parts, out);
        hold_out(&rest, &out, grid, held);
    }
}

fn pick_and_place(predictive: Predictive) -> Vec<(&'static str, Held)> {
    let all = motion::pick_and_place();
    let (one, two): (Vec<_>, Vec<_>) = all
        .into_iter()
        .partition(|d| d.trial().starts_with("subject1"));
    let grid = Grid {
        dofs: &["x", "y", "z"],
        functions: &[12],
        sigmas_m: &[0.01, 0.02, 0.05, 0.1],
        placement_m: &[0.0, 0.1],
        predictive,
        parts: 6,
    };
    let mut within = Held::default();
    in_turn(&one, 9, &grid, &mut within);
    in_turn(&two, 6, &grid, &mut within);
    let mut across = Held::default();
    hold_out(&one, &two, &grid, &mut across);
    hold_out(&two, &one, &grid, &mut across);
    vec![
        ("pick and place, within a person", within),
        ("pick and place, across people", across),
    ]
}

fn digits(predictive: Predictive) -> Vec<(&'static str, Held)> {
    let grid = Grid {
        dofs: &["x", "y", "z"],
        functions: &[12],
        sigmas_m: &[0.002, 0.005, 0.01, 0.02],
        placement_m: &[0.0],
        predictive,
        parts: 5,
    };
    let mut held = Held::default();
    in_turn(&motion::digits(), 6, &grid, &mut held);
    vec![("digits", held)]
}

fn reach_to_grasp(predictive: Predictive) -> Vec<(&'static str, Held)> {
    let grid = Grid {
        dofs: &["x", "y", "z", "aperture"],
        functions: &[8],
        sigmas_m: &[0.005, 0.01, 0.03, 0.1],
        placement_m: &[0.0],
        predictive,
        parts: 6,
    };
    let mut held = Held::default();
    let all = motion::reach_to_grasp();
    in_turn(&all, 34, &grid, &mut held);
    vec![("reach to grasp", held)]
}

fn line(forecasts: &[Forecast]) -> String {
    let diagram = Reliability::adaptive(forecasts).unwrap();
    let right = forecasts
        .iter()
        .filter(|f| f.answer().0 == f.truth())
        .count();
    format!(
        "ECE {:.3} (by chance {:.3}), log-loss {:.3}, Brier {:.3}, {right} of {}",
        diagram.expected_calibration_error(),
        diagram.by_chance(),
        log_loss(forecasts).unwrap(),
        brier(forecasts).unwrap(),
        forecasts.len()
    )
}

fn all(predictive: Predictive) -> Vec<(&'static str, Held)> {
    let mut sets = pick_and_place(predictive);
    sets.extend(digits(predictive));
    sets.extend(reach_to_grasp(predictive));
    sets
}

#[test]
fn posteriors_over_real_movements_mean_what_they_say() {
    for (name, predictive) in [
        ("Student-t", Predictive::LeaveOneOut),
        ("plug-in Gaussian", Predictive::PlugIn),
    ] {
        let sets = all(predictive);
        println!("{name}");
        for (index, fraction) in FRACTIONS.iter().enumerate() {
            for (set, held) in &sets {
                println!(
                    "  {fraction} {set}: raw {} | tempered {}",
                    line(&held.raw[index]),
                    line(&held.tempered[index])
                );
            }
            let pooled = |of: fn(&Held) -> &[Forecasts; 4]| -> Forecasts {
                sets.iter()
                    .flat_map(|(_, held)| of(held)[index].iter().cloned())
                    .collect()
            };
            println!(
                "  {fraction} pooled: raw {}",
                line(&pooled(|held| &held.raw))
            );
            let tempered = pooled(|held| &held.tempered);
            println!("  {fraction} pooled: tempered {}", line(&tempered));
            for bin in Reliability::adaptive(&tempered).unwrap().bins() {
                println!(
                    "      {:>3} answers of confidence {:.3}: {:.3} right",
                    bin.count, bin.confidence, bin.accuracy
                );
            }
        }
        for (set, held) in &sets {
            let early = Early::of(&held.decisions);
            println!("  {set}: decided at {CONFIDENCE}: {early:?}");
        }
    }
}

/// The values of `golden/calibration.py`, which computes them with numpy in its own way.
#[test]
fn measures_are_those_of_numpy() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../golden/calibration.json")).unwrap();
    let number = |key: &str| golden[key].as_f64().unwrap();
    let list = |value: &serde_json::Value| -> Vec<f64> {
        value
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap())
            .collect()
    };
    let posteriors = golden["log_posterior"].as_array().unwrap();
    let truths = golden["truth"].as_array().unwrap();
    let one = |(posterior, truth): (&serde_json::Value, &serde_json::Value)| {
        let truth = usize::try_from(truth.as_u64().unwrap()).unwrap();
        Forecast::new(list(posterior), truth).unwrap()
    };
    let forecasts: Forecasts = posteriors.iter().zip(truths).map(one).collect();
    let bins = usize::try_from(golden["bins"].as_u64().unwrap()).unwrap();
    let error = Reliability::of(&forecasts, bins)
        .unwrap()
        .expected_calibration_error();
    let close = |got: f64, key: &str, tolerance: f64| {
        let expected = number(key);
        assert!(
            (got - expected).abs() < tolerance,
            "{key}: {got}, numpy {expected}"
        );
    };
    close(error, "expected_calibration_error", 1e-12);
    close(log_loss(&forecasts).unwrap(), "log_loss", 1e-12);
    close(brier(&forecasts).unwrap(), "brier", 1e-12);
    // The grid finds a minimum of a flat bottom to the root of the rounding.
    close(
        Temperature::fit(&forecasts).unwrap().get(),
        "temperature",
        1e-6,
    );
}

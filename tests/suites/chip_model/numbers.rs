//! The chip's numbers against the host's, and what a lower rank costs.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus::model::View;
use tonus::model::image::Export;
use tonus::model::reduce::{ReduceError, Reduced};
use tonus_shared::Real;
use tonus_shared::image::{ModelImage, WEARABLE};
use tonus_shared::promp::{
    Bank, Belief, Hypothesis, Latent, Observed, Quantity, Row, Skill, Trajectory, bank_len,
    belief_len, trajectory_scratch_len,
};

use super::simulated::{GAUSSIAN, MODEL, export};

const DOFS: [usize; 6] = [0, 1, 2, 3, 4, 5];
const DURATION_S: f64 = 2.0;
const TEMPI: usize = 8;
/// Observations of a movement of mean duration, one every 0.1 s.
const INSTANTS: usize = 20;

/// Eight tempi of each skill over what storage it takes.
fn bank<'a, T: Real>(
    latent: Latent<'a, T>,
    skills: &'a [Skill<'a, T>],
) -> Bank<'a, T, Vec<Hypothesis<T>>, Vec<T>> {
    let count = TEMPI * skills.len();
    let storage = vec![T::zero(); bank_len(count, latent.basis().count(), latent.rank())];
    let slots = vec![Hypothesis::default(); count];
    let mut bank = Bank::new(latent, skills, slots, storage, None).unwrap();
    for index in 0..count {
        let hypothesis = Hypothesis {
            skill: index % skills.len(),
            duration_s: T::of(f64::from(1.6_f32 + 0.1 * (index / skills.len()) as f32)),
            ..Hypothesis::default()
        };
        bank.add(hypothesis, &[]).unwrap();
    }
    bank
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A movement drawn from a skill: its latent coordinates, `S n`.
fn drawn(view: &View<'_>, skill: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let rank = view.latent.rank();
    let root = view.skills[skill].root().unwrap();
    let mut z = vec![0.0; rank];
    let mut at = 0;
    for column in 0..rank {
        let n = normal(rng);
        for entry in &mut z[column..] {
            *entry += root[at] * n;
            at += 1;
        }
    }
    z
}

/// `psi^T (mu + L z)`.
fn value(view: &View<'_>, skill: usize, z: &[f64], row: &Row<f64>) -> f64 {
    let (mut psi, mut a) = (
        vec![0.0; view.latent.basis().count()],
        vec![0.0; view.latent.rank()],
    );
    view.latent.row(row, &mut psi, &mut a).unwrap();
    let offset = view.skills[skill]
        .offset(view.latent.basis(), row, &psi)
        .unwrap();
    offset + a.iter().zip(z).map(|(a, z)| a * z).sum::<f64>()
}

fn noise_std(dof: usize) -> f64 {
    if dof < 3 { 0.0015 } else { 0.05 }
}

/// One noisy number of a movement: exactly what the chip is given, in both.
fn seen(
    view: &View<'_>,
    (skill, z): (usize, &[f64]),
    index: usize,
    rng: &mut ChaCha8Rng,
) -> (Observed<f32>, Observed<f64>) {
    let dof = index % 6;
    let time_s = ((index / 6) as f32) * 0.012;
    let phase = (f64::from(time_s) / DURATION_S).min(1.0);
    let value =
        (value(view, skill, z, &Row::position(dof, phase)) + noise_std(dof) * normal(rng)) as f32;
    let variance = (noise_std(dof) * noise_std(dof)) as f32;
    let quantity = Quantity::Position;
    let on_chip = Observed {
        dof,
        quantity,
        time_s,
        value,
        variance,
    };
    let on_host = Observed {
        dof,
        quantity,
        time_s: f64::from(time_s),
        value: f64::from(value),
        variance: f64::from(variance),
    };
    (on_chip, on_host)
}

#[test]
fn a_thousand_observations_on_the_chip_are_the_host_s() {
    let exported = export(16).image(&MODEL).unwrap();
    let words: Vec<u32> = exported
        .bytes
        .chunks_exact(4)
        .map(|b| u32::from_ne_bytes(b.try_into().unwrap()))
        .collect();
    let image = ModelImage::parse(bytemuck::cast_slice(&words), &WEARABLE).unwrap();
    let view = exported.reduced.view().unwrap();
    assert_eq!(image.latent().rank(), 16);
    let (mut worst, mut worst_spread, mut worst_log) = (0.0_f64, 0.0_f64, 0.0_f64);
    for skill in 0..3 {
        let mut rng = ChaCha8Rng::seed_from_u64(100 + skill as u64);
        let z = drawn(&view, skill, &mut rng);
        let mut chip = bank(image.latent(), image.skills());
        let mut host = bank(view.latent, &view.skills);
        for index in 0..1000 {
            let (on_chip, on_host) = seen(&view, (skill, &z), index, &mut rng);
            chip.observe(&on_chip).unwrap();
            host.observe(&on_host).unwrap();
        }
        let mut on_chip = [0.0_f32; 3];
        let mut on_host = [0.0_f64; 3];
        chip.log_posterior(&mut on_chip).unwrap();
        host.log_posterior(&mut on_host).unwrap();
        for (chip, host) in on_chip.iter().zip(on_host) {
            worst_log = worst_log.max((f64::from(*chip).exp() - host.exp()).abs());
        }
        let mut narrow = vec![0.0_f32; trajectory_scratch_len(20, 16)];
        let mut wide = vec![0.0_f64; trajectory_scratch_len(20, 16)];
        for index in 0..chip.hypotheses().len() {
            for (dof, step) in DOFS
                .into_iter()
                .flat_map(|dof| (0..=20).map(move |step| (dof, step)))
            {
                let phase = step as f32 / 20.0;
                let trajectory = chip.trajectory(index).unwrap();
                let got = trajectory
                    .moments(&Row::position(dof, phase), &mut narrow)
                    .unwrap();
                let trajectory = host.trajectory(index).unwrap();
                let row = Row::position(dof, f64::from(phase));
                let expected = trajectory.moments(&row, &mut wide).unwrap();
                let std = expected.variance.sqrt();
                worst = worst.max((f64::from(got.mean) - expected.mean).abs() / std);
                worst_spread = worst_spread.max((f64::from(got.variance).sqrt() / std - 1.0).abs());
            }
        }
    }
    println!(
        "24 hypotheses, 1000 observations, r = 16: worst mean {worst:.1e} posterior standard deviations, worst \
         standard deviation {worst_spread:.1e} of itself, worst probability {worst_log:.1e}"
    );
    assert!(worst < 1e-3, "{worst}");
    assert!(worst_spread < 1e-3 && worst_log < 1e-3);
}

#[test]
fn at_full_rank_it_is_the_same_distribution() {
    let full = MODEL.view().unwrap();
    let same = Reduced::of(&MODEL, &DOFS, usize::MAX, 20).unwrap();
    let view = same.view().unwrap();
    assert!((same.kept() - 1.0).abs() < 1e-12);
    let covariance = |view: &View<'_>, skill: usize, one: &Row<f64>, other: &Row<f64>| {
        let mut scratch = vec![0.0; trajectory_scratch_len(20, view.latent.rank())];
        let prior = Trajectory::prior(view.latent, view.skills[skill]).unwrap();
        let mean = prior.moments(one, &mut scratch).unwrap().mean;
        (mean, prior.covariance(one, other, &mut scratch).unwrap())
    };
    for skill in 0..3 {
        for (one, other) in [(0, 0), (0, 4), (2, 5), (3, 3)] {
            let rows = (Row::position(one, 0.3), Row::position(other, 0.8));
            let scale = MODEL.parts().scale[one] * MODEL.parts().scale[other];
            let (mean, expected) = covariance(&full, skill, &rows.0, &rows.1);
            let (got_mean, got) = covariance(&view, skill, &rows.0, &rows.1);
            assert!((got_mean - mean).abs() < 1e-12);
            assert!(
                (got - expected).abs() < 1e-9 * scale,
                "{got} for {expected}"
            );
        }
        let (got, expected) = (&view.skills[skill], &full.skills[skill]);
        for (got, expected) in got
            .residual_variance()
            .iter()
            .zip(expected.residual_variance())
        {
            assert!((got / expected - 1.0).abs() < 1e-9, "{got} for {expected}");
        }
    }
}

/// Of movements drawn from the full model and observed ten times a second, how often the 95 % interval holds the movement
/// at 15 phases of 6 DoFs; `returned` is whether what the rank cuts off goes to the noise.
fn coverage(view: &View<'_>, returned: bool) -> f64 {
    let full = GAUSSIAN.view().unwrap();
    let rank = view.latent.rank();
    let (mut psi, mut a) = (vec![0.0; 20], vec![0.0; rank]);
    let mut scratch = vec![0.0; trajectory_scratch_len(20, rank)];
    let (mut covered, mut total) = (0, 0);
    for draw in 0..120 {
        let mut rng = ChaCha8Rng::seed_from_u64(7000 + draw);
        let skill = (draw % 3) as usize;
        let z = drawn(&full, skill, &mut rng);
        let storage = vec![0.0; belief_len(rank)];
        let mut belief = Belief::new(&view.skills[skill], storage).unwrap();
        for (step, dof) in (0..INSTANTS).flat_map(|step| DOFS.map(|dof| (step, dof))) {
            let row = Row::position(dof, step as f64 / (INSTANTS - 1) as f64);
            let sensor = noise_std(dof).powi(2);
            let white = full.skills[skill].residual_variance()[dof];
            let seen = value(&full, skill, &z, &row) + (sensor + white).sqrt() * normal(&mut rng);
            view.latent.row(&row, &mut psi, &mut a).unwrap();
            let reduced = &view.skills[skill];
            let offset = reduced.offset(view.latent.basis(), &row, &psi).unwrap();
            let residual = if returned {
                reduced.residual_variance()[dof]
            } else {
                white
            };
            belief
                .condition(&a, offset, seen, sensor + residual)
                .unwrap();
        }
        let after = Trajectory::posterior(view.latent, view.skills[skill], &belief).unwrap();
        for (dof, step) in DOFS
            .into_iter()
            .flat_map(|dof| (0..15).map(move |step| (dof, step)))
        {
            let row = Row::position(dof, (f64::from(step) + 0.5) / 15.0);
            let said = after.moments(&row, &mut scratch).unwrap();
            let off = (value(&full, skill, &z, &row) - said.mean).abs();
            covered += u32::from(off <= 1.96 * said.variance.sqrt());
            total += 1;
        }
    }
    f64::from(covered) / f64::from(total)
}

/// What the chip does not know it should not claim to know. At rank 16 a twelfth of this model's variance is cut off, and
/// the interval of what is kept cannot hold all of it: the floor is what was found, 0.95 is not reached.
#[test]
fn intervals_of_a_lower_rank_cover_the_full_model_s_movements() {
    let mut all = Vec::new();
    for rank in [9, 16, 22, usize::MAX] {
        let reduced = Reduced::of(&GAUSSIAN, &DOFS, rank, INSTANTS).unwrap();
        let view = reduced.view().unwrap();
        let [bare, returned] = [false, true].map(|returned| coverage(&view, returned));
        let (rank, kept) = (view.latent.rank(), reduced.kept());
        println!(
            "r = {rank}: {kept:.3} of the variance kept, 95 % intervals cover {returned:.3}, {bare:.3} if nothing is returned"
        );
        all.push((bare, returned));
    }
    let (_, exact) = all[3];
    assert!((exact - 0.95).abs() < 0.02, "{exact}");
    for (bare, returned) in &all[..3] {
        assert!(returned > bare, "{returned} after {bare}");
    }
    let (_, chip) = all[1];
    assert!(chip >= 0.83, "{chip}");
}

#[test]
fn what_cannot_be_exported_is_named() {
    let text = |change: &dyn Fn(&mut Export)| {
        let mut export = export(16);
        change(&mut export);
        export.image(&MODEL).unwrap_err().to_string()
    };
    assert!(text(&|e| e.rank = 17).contains("the model's rank are 17, there is room for 16"));
    assert!(text(&|e| e.rank = 0).contains("rank is 0"));
    assert!(text(&|e| e.capacity.skills = 2).contains("skills are 3, there is room for 2"));
    assert!(text(&|e| e.stiffnesses[1] = "no".into()).contains("no DoF `no`, it has x, y, z"));
    assert!(text(&|e| e.stiffnesses[1] = "kx".into()).contains("stiffness along axis 0"));
    assert!(text(&|e| e.stiffnesses[1] = "x".into()).contains("stiffness along axis 1"));
    assert!(text(&|e| e.interval_s = 0.0).contains("interval is 0 s"));
    assert!(text(&|e| e.position_sigma_m = 1e60).contains("no f32"));
    assert!(text(&|e| e.lead_s = -1.0).contains("the lead is -1"));
    assert_eq!(
        Reduced::of(&MODEL, &[0, 0], 4, 10),
        Err(ReduceError::Dof { dof: 0, dofs: 6 })
    );
    let alone = Export {
        positions: None,
        ..export(16)
    }
    .image(&MODEL)
    .unwrap();
    assert_eq!(alone.reduced.dofs(), [3, 4, 5]);
}

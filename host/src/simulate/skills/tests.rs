//! Paths have the distribution that is stated, and hands move as hands do.

use super::*;
use rand::SeedableRng;

#[test]
fn sampled_paths_have_the_stated_mean_and_covariance() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let phases = [0.0, 0.1, 0.22, 0.4, 0.5, 0.63, 0.77, 1.0];
    const RUNS: usize = 20_000;
    for skill in Skill::ALL {
        let mut deviations = vec![[[0.0; 3]; 8]; RUNS];
        for run in &mut deviations {
            let latent = skill.sample(&mut rng);
            for (deviation, s) in run.iter_mut().zip(phases) {
                let (at, mean) = (skill.position_m(&latent, s), skill.mean_m(s));
                *deviation = std::array::from_fn(|axis| at[axis] - mean[axis]);
            }
        }
        for (i, s) in phases.into_iter().enumerate() {
            for (j, t) in phases.into_iter().enumerate() {
                for axis in 0..3 {
                    let truth = |s, t| skill.covariance_m2(s, t)[axis];
                    let sample: f64 = deviations
                        .iter()
                        .map(|run| run[i][axis] * run[j][axis])
                        .sum::<f64>()
                        / RUNS as f64;
                    // Standard error of a sample covariance: sqrt((c_ii c_jj + c_ij^2) / n); five of them.
                    let error =
                        ((truth(s, s) * truth(t, t) + truth(s, t).powi(2)) / RUNS as f64).sqrt();
                    assert!(
                        (sample - truth(s, t)).abs() <= 5.0 * error + 1e-15,
                        "{skill:?} {s} {t} {axis}"
                    );
                }
            }
            for axis in 0..3 {
                let mean: f64 =
                    deviations.iter().map(|run| run[i][axis]).sum::<f64>() / RUNS as f64;
                assert!(
                    mean.abs()
                        <= 5.0 * (skill.covariance_m2(s, s)[axis] / RUNS as f64).sqrt() + 1e-12
                );
            }
        }
    }
}

#[test]
fn lifts_differ_by_the_grasp_height_alone() {
    for s in [0.0, 0.2, 0.45, 0.7, 1.0] {
        let [filter, book, bottle] = Skill::LIFTS.map(|skill| skill.mean_m(s));
        let reached = minimum_jerk(s / 0.45);
        for (upper, lower) in [(filter, book), (book, bottle)] {
            assert!((upper[2] - lower[2] - 0.008 * reached).abs() < 1e-15);
            assert_eq!(upper[..2], lower[..2]);
        }
        for t in [0.1, 0.5, 0.9] {
            assert_eq!(
                Skill::LiftFilter.covariance_m2(s, t),
                Skill::LiftBottle.covariance_m2(s, t)
            );
        }
    }
}

#[test]
fn hands_move_smoothly_and_stay_within_reach() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for skill in Skill::ALL {
        for _ in 0..2000 {
            let latent = skill.sample(&mut rng);
            let mut last = skill.position_m(&latent, 0.0);
            for ms in 1..=2000 {
                let at = skill.position_m(&latent, f64::from(ms) / 2000.0);
                let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
                let step = norm(std::array::from_fn(|axis| at[axis] - last[axis]));
                assert!(step < 0.0015, "{skill:?} moves faster than 1.5 m/s");
                assert!((0.25..0.62).contains(&norm(at)), "{skill:?} at {at:?}");
                last = at;
            }
        }
    }
}

#[test]
fn a_hand_over_ends_where_it_was_sent() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    for y in [0.05, 0.2, 0.33] {
        let latent = hand_over_to(y, &mut rng);
        assert!((Skill::HandOver.position_m(&latent, 1.0)[1] - y).abs() < 1e-12);
        assert_eq!(
            goal_m(Skill::HandOver, &latent),
            Skill::HandOver.position_m(&latent, 1.0)
        );
    }
}

#[test]
fn the_minimum_jerk_step_rests_at_both_ends() {
    assert_eq!(
        [
            minimum_jerk(-1.0),
            minimum_jerk(0.0),
            minimum_jerk(1.0),
            minimum_jerk(2.0)
        ],
        [0.0, 0.0, 1.0, 1.0]
    );
    assert!((minimum_jerk(0.5) - 0.5).abs() < 1e-15);
    // Peak speed 15/8 at the middle.
    assert!(((minimum_jerk(0.5 + 1e-5) - minimum_jerk(0.5 - 1e-5)) / 2e-5 - 1.875).abs() < 1e-6);
    assert!(minimum_jerk(1e-3) < 1.1e-8);
}

//! What may come next, while the hand rests.

use tonus_shared::promp::{Bank, Hypothesis, Latent, Observed, Skill, bank_len};

use super::RecogniseError;

/// Log posterior of the skills, given the newest of `kept` for each DoF at the start of a movement. One observation
/// each: those of a hand at rest say the same again and again, and their deviations are not independent.
pub(super) fn log_posterior(
    latent: Latent<'_, f64>,
    skills: &[Skill<'_, f64>],
    kept: &[Observed<f64>],
) -> Result<Vec<f64>, RecogniseError> {
    let mut out: Vec<f64> = skills.iter().map(Skill::log_prior).collect();
    let newest = (0..latent.dofs()).filter_map(|dof| kept.iter().rfind(|seen| seen.dof == dof));
    let newest: Vec<_> = newest.collect();
    let Some(latest_s) = newest.iter().map(|seen| seen.time_s).reduce(f64::max) else {
        return Ok(out);
    };
    let storage = vec![0.0; bank_len(skills.len(), latent.basis().count(), latent.rank())];
    let slots = vec![Hypothesis::default(); skills.len()];
    let mut bank = Bank::new(latent, skills, slots, storage, None)?;
    for skill in 0..skills.len() {
        // Not begun: the phase is zero for all that was kept.
        let hypothesis = Hypothesis {
            skill,
            onset_s: latest_s,
            ..Hypothesis::default()
        };
        bank.add(hypothesis, &[])?;
    }
    for seen in newest {
        bank.observe(seen)?;
    }
    bank.log_posterior(&mut out)?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use tonus_shared::promp::{Basis, Quantity};

    use super::*;

    #[test]
    fn the_newest_place_of_a_hand_at_rest_says_what_may_come() {
        // One DoF whose every basis weight is 0.3 z: at each phase the movement is mean + 0.3 z.
        let basis = Basis::gaussian(8).unwrap();
        let (loading, means) = (vec![0.3; 8], [vec![0.0; 8], vec![1.0; 8]]);
        let latent = Latent::new(basis, 1, 1, &loading).unwrap();
        let prior = [0.25_f64, 0.75];
        let skill = |q: usize| Skill::new(&latent, &means[q], None, &[0.01], prior[q].ln());
        let skills = [skill(0).unwrap(), skill(1).unwrap()];
        let before = log_posterior(latent, &skills, &[]).unwrap();
        assert_eq!(before, [prior[0].ln(), prior[1].ln()]);
        let seen = |time_s, value| Observed {
            dof: 0,
            quantity: Quantity::Position,
            time_s,
            value,
            variance: 0.02,
        };
        let kept = [seen(0.0, 5.0), seen(0.1, 0.4)];
        let posterior = log_posterior(latent, &skills, &kept).unwrap();
        // Bayes' rule for two Gaussians of variance 0.3^2 + 0.01 + 0.02 at 0 and 1.
        let density = |mean: f64| (-0.5 * (0.4 - mean).powi(2) / 0.12).exp();
        let joint = [prior[0] * density(0.0), prior[1] * density(1.0)];
        for (said, joint_q) in posterior.iter().zip(joint) {
            assert!((said.exp() - joint_q / (joint[0] + joint[1])).abs() < 1e-12);
        }
    }
}

//! The same path, followed otherwise: backwards, or at constant speed.

use super::Demonstration;

/// Least share of the time in the measure of progress along a path: somebody who stands still gets on in it.
const TIME_SHARE: f64 = 1e-6;

impl Demonstration {
    /// The movement performed backwards: last value first.
    #[must_use]
    pub fn backwards(&self) -> Self {
        let ends_s = self.t_s[0] + self.t_s[self.t_s.len() - 1];
        let mut turned = self.clone();
        for series in &mut turned.values {
            series.reverse();
        }
        for present in &mut turned.present {
            present.reverse();
        }
        turned.t_s = self.t_s.iter().rev().map(|t| ends_s - t).collect();
        turned
    }

    /// The movement performed in the same time at constant speed along its path, so that its phase is the share of the
    /// path that lies behind: how fast somebody was where does not matter any more. A path's length is over the DoFs of
    /// these numbers, which need one unit. It takes the whole movement to know it. A DoF that is none has no length.
    #[must_use]
    pub fn at_constant_speed(&self, dofs: &[usize]) -> Self {
        let mut length = vec![0.0; self.t_s.len()];
        for sample in 1..length.len() {
            let step = dofs.iter().filter_map(|&dof| self.values.get(dof));
            let step = step.map(|series| series[sample] - series[sample - 1]);
            let squares: f64 = step.map(|step| step * step).sum();
            length[sample] = length[sample - 1] + libm::sqrt(squares);
        }
        let total = length[length.len() - 1];
        if !(total.is_finite() && total > 0.0) {
            return self.clone();
        }
        let (start_s, duration_s) = (self.t_s[0], self.duration_s());
        let mut even = self.clone();
        for (time_s, length) in even.t_s.iter_mut().zip(&length) {
            let along =
                TIME_SHARE * (*time_s - start_s) + (1.0 - TIME_SHARE) * duration_s * length / total;
            *time_s = start_s + along;
        }
        even
    }
}

#[cfg(test)]
mod tests {
    use super::Demonstration;

    fn hook() -> Demonstration {
        // Three along x, then four along y, with a stand still between.
        let t_s = vec![1.0, 2.0, 4.0, 5.0];
        let values = vec![vec![0.0, 3.0, 3.0, 3.0], vec![0.0, 0.0, 0.0, 4.0]];
        Demonstration::new("hook", "1", "hook.csv", t_s, values).unwrap()
    }

    #[test]
    fn backwards_ends_where_it_began() {
        let back = hook().backwards();
        assert_eq!(back.t_s(), [1.0, 2.0, 4.0, 5.0]);
        assert_eq!(back.values()[1], [4.0, 0.0, 0.0, 0.0]);
        assert_eq!(back.backwards(), hook());
    }

    #[test]
    fn the_phase_at_constant_speed_is_the_share_of_the_path() {
        let even = hook().at_constant_speed(&[0, 1]);
        let expected = [0.0, 3.0 / 7.0, 3.0 / 7.0, 1.0];
        for (phase, expected) in even.phases().zip(expected) {
            assert!((phase - expected).abs() < 1e-6, "{phase} {expected}");
        }
        assert!(even.t_s().windows(2).all(|pair| pair[0] < pair[1]));
        // Of x alone, all of the path is in the first second.
        let x = hook().at_constant_speed(&[0]);
        assert!((x.t_s()[1] - 5.0).abs() < 1e-5, "{:?}", x.t_s());
    }

    #[test]
    fn a_path_without_length_is_left_alone() {
        let still = Demonstration::new(
            "still",
            "1",
            "still.csv",
            vec![0.0, 1.0],
            vec![vec![2.0; 2]],
        );
        let still = still.unwrap();
        assert_eq!(still.at_constant_speed(&[0]), still);
        assert_eq!(still.at_constant_speed(&[7]), still);
    }
}

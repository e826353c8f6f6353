//! The same path, followed otherwise: backwards, at constant speed, or told by its length instead of the time.

use super::{Demonstration, DemonstrationError};

/// Least share of the time in the measure of progress along a path: somebody who stands still gets on in it.
const TIME_SHARE: f64 = 1e-6;

/// The length of a path whose points come in one after the other, in their unit: what a movement's progress is measured by
/// where nobody knows its speed.
#[derive(Clone, Debug)]
pub struct PathLength {
    least: f64,
    counted: Option<[f64; 3]>,
    length: f64,
}

impl PathLength {
    /// Of no point yet. Ways shorter than `least` do not count until they have led so far away: a hand at rest trembles,
    /// and its tracker errs.
    #[must_use]
    pub const fn new(least: f64) -> Self {
        Self {
            least,
            counted: None,
            length: 0.0,
        }
    }

    /// Takes the next point and gives the length up to the last that counts; one that is not finite does not.
    pub fn step(&mut self, point: [f64; 3]) -> f64 {
        let counted = self.counted.get_or_insert(point);
        let squares = counted
            .iter()
            .zip(point)
            .map(|(from, to)| (to - from).powi(2));
        let way = libm::sqrt(squares.sum());
        if way >= self.least && way.is_finite() {
            *counted = point;
            self.length += way;
        }
        self.length
    }
}

impl Demonstration {
    /// The movement with the length of its path, from zero, in place of the time: how fast somebody was does not matter any
    /// more, and other than the share of the path ([`Demonstration::at_constant_speed`]) it is known while the movement goes
    /// on. The path is that of three DoFs of one unit; samples that do not count ([`PathLength::new`]) are left out. A DoF
    /// that is none has no length.
    ///
    /// # Errors
    /// A path with fewer than two samples that count.
    pub fn by_path_length(&self, dofs: [usize; 3], least: f64) -> Result<Self, DemonstrationError> {
        let mut path = PathLength::new(least);
        let (mut lengths, mut counted) = (Vec::new(), Vec::new());
        for sample in 0..self.t_s.len() {
            let mut point = [0.0; 3];
            for (value, &dof) in point.iter_mut().zip(&dofs) {
                *value = self.values.get(dof).map_or(0.0, |series| series[sample]);
            }
            let length = path.step(point);
            if lengths.last().is_none_or(|last| length > *last) {
                lengths.push(length);
                counted.push(sample);
            }
        }
        if lengths.len() < 2 {
            return Err(DemonstrationError::TooShort {
                samples: lengths.len(),
            });
        }
        let mut by_path = self.clone();
        for series in &mut by_path.values {
            *series = counted.iter().map(|&sample| series[sample]).collect();
        }
        for present in &mut by_path.present {
            *present = counted.iter().map(|&sample| present[sample]).collect();
        }
        by_path.t_s = lengths;
        Ok(by_path)
    }

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
    use super::{Demonstration, DemonstrationError, PathLength};

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

    #[test]
    fn a_tremor_is_no_way_and_a_slow_start_is_one() {
        let mut path = PathLength::new(0.01);
        for tremor in [0.0, 0.004, -0.004, 0.009, 0.0] {
            assert_eq!(path.step([tremor, 0.0, 0.0]), 0.0);
        }
        // In steps of 4 mm, of which every third counts.
        let lengths: Vec<f64> = (1..=6)
            .map(|step| path.step([0.004 * f64::from(step), 0.0, 0.0]))
            .collect();
        let expected = [0.0, 0.0, 0.012, 0.012, 0.012, 0.024];
        for (length, expected) in lengths.iter().zip(expected) {
            assert!((length - expected).abs() < 1e-12, "{length} {expected}");
        }
        assert_eq!(path.step([f64::NAN; 3]), lengths[5]);
    }

    #[test]
    fn by_its_length_a_path_does_not_know_its_speed() {
        let by_path = hook_in_space().by_path_length([0, 1, 2], 0.01).unwrap();
        // The stand still is no sample any more.
        assert_eq!(by_path.t_s(), [0.0, 3.0, 7.0]);
        assert_eq!(by_path.values()[0], [0.0, 3.0, 3.0]);
        assert_eq!(by_path.values()[1], [0.0, 0.0, 4.0]);
        let slower = hook_in_space();
        let t_s = slower.t_s().iter().map(|t| t * t).collect();
        let slower = Demonstration::new("hook", "1", "hook.csv", t_s, slower.values().to_vec());
        assert_eq!(
            slower.unwrap().by_path_length([0, 1, 2], 0.01).unwrap(),
            by_path
        );
    }

    #[test]
    fn a_path_that_is_none_is_refused() {
        let still = Demonstration::new(
            "still",
            "1",
            "still.csv",
            vec![0.0, 1.0],
            vec![vec![2.0; 2]; 3],
        );
        let still = still.unwrap();
        for dofs in [[0, 1, 2], [7, 8, 9]] {
            let refused = still.by_path_length(dofs, 0.01);
            assert_eq!(refused, Err(DemonstrationError::TooShort { samples: 1 }));
        }
    }

    fn hook_in_space() -> Demonstration {
        let mut values = hook().values().to_vec();
        values.push(vec![0.0; 4]);
        Demonstration::new("hook", "1", "hook.csv", hook().t_s().to_vec(), values).unwrap()
    }
}

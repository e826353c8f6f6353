//! What a calibration asks of a person, in order.

use tonus_shared::stiffness::{ArmPosture, GRAVITY_M_S2, PostureError, Segments};

/// Weights that load the hand, kg: one that hangs from it, one whose string runs sideways over a pulley. Light enough that
/// a relaxed arm bends by some ten degrees, heavy enough that it does.
const HANGING_KG: f64 = 0.5;
const SIDEWAYS_KG: f64 = 0.3;
/// The forces on the hand, shoulder frame, N: none first, which the others are compared with.
const FORCES_N: [[f64; 3]; 3] = [
    [0.0; 3],
    [0.0, 0.0, -HANGING_KG * GRAVITY_M_S2],
    [0.0, SIDEWAYS_KG * GRAVITY_M_S2, 0.0],
];
/// How firmly the muscles are held meanwhile, share of the maximum: three levels show the curve of eq. 8.
const EFFORTS: [f64; 3] = [0.1, 0.3, 0.6];
/// Postures, shoulder flexion and elbow, rad: near the body and reached out. Sideways one posture shows only the sum of
/// what the two turns of the upper arm give way; two with different elbows tell them apart.
const POSTURES_RAD: [[f64; 2]; 2] = [[0.1, 2.0], [0.7, 0.8]];

/// What a person is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task {
    /// Nothing in particular.
    Free,
    /// Let the arm hang and all muscles go.
    Rest,
    /// Contract all muscles with all strength.
    Contract,
    /// Bend the elbow against a weight, biceps alone.
    Flex,
    /// Stretch the elbow against a weight, triceps alone.
    Extend,
    /// Hold the hand still while a known force pulls at it.
    Hold(Hold),
}

/// A hold with or without a load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// About where to hold the hand, shoulder frame, m.
    pub hand_m: [f64; 3],
    /// The force on it, shoulder frame, N; zero for none.
    pub force_n: [f64; 3],
    /// Share of the maximum voluntary contraction to keep in all muscles.
    pub effort: f64,
    /// Holds of one place and effort: the first of them is without a load.
    pub group: usize,
}

impl Hold {
    /// Whether a force pulls at the hand.
    #[must_use]
    pub fn loaded(&self) -> bool {
        self.force_n != [0.0; 3]
    }
}

/// All tasks of a calibration of this arm.
pub(super) fn plan(segments: &Segments<f64>) -> Result<Vec<Task>, PostureError> {
    let mut tasks = vec![Task::Rest, Task::Contract, Task::Flex, Task::Extend];
    let mut group = 0;
    for [flexion, elbow] in POSTURES_RAD {
        let posture = ArmPosture::from_angles([flexion, 0.0, 0.0, elbow])?;
        let hand_m = posture.hand_position(segments).into();
        for effort in EFFORTS {
            for force_n in FORCES_N {
                tasks.push(Task::Hold(Hold {
                    hand_m,
                    force_n,
                    effort,
                    group,
                }));
            }
            group += 1;
        }
    }
    Ok(tasks)
}

impl Task {
    /// How it is called where steps are shown.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Task::Free => "result",
            Task::Rest => "rest",
            Task::Contract => "contract",
            Task::Flex => "fit_flex",
            Task::Extend => "fit_extend",
            Task::Hold(_) => "load",
        }
    }

    /// What to do, for people.
    #[must_use]
    pub fn instruction(&self) -> String {
        match self {
            Task::Free => "Nothing more to do: use what was measured, or cancel.".into(),
            Task::Rest => "Let the arm hang and all muscles go, until the bar is full.".into(),
            Task::Contract => {
                "Tense biceps and triceps against each other with all your strength, until the bar is full.".into()
            }
            Task::Flex => {
                "Upper arm hanging, elbow at a right angle, forearm forward, a weight of about 2 kg in the hand: hold it up, triceps loose.".into()
            }
            Task::Extend => {
                "Elbow at a right angle: press the hand down on the table as hard as 2 kg weigh, biceps loose.".into()
            }
            Task::Hold(hold) => hold.instruction(),
        }
    }

    /// Seconds to leave for getting there, and to measure.
    pub(super) fn seconds(&self) -> (f64, f64) {
        match self {
            Task::Free => (0.0, 0.0),
            Task::Rest => (1.0, 4.0),
            Task::Contract => (0.5, 4.0),
            Task::Flex | Task::Extend => (1.0, 3.0),
            Task::Hold(_) => (1.5, 2.0),
        }
    }
}

impl Hold {
    fn instruction(&self) -> String {
        let [forward, _, up] = self.hand_m;
        let place = format!(
            "Hold the hand still {:.0} cm in front of the shoulder and {:.0} cm below it, elbow down, all muscles tensed to \
             {:.0} % of their maximum",
            100.0 * forward,
            -100.0 * up,
            100.0 * self.effort
        );
        let [_, left, upward] = self.force_n;
        let load = if upward < 0.0 {
            format!("with a weight of {HANGING_KG} kg hanging from the hand")
        } else if left > 0.0 {
            format!("while a string over a pulley pulls it to the left with {SIDEWAYS_KG} kg")
        } else {
            "without a load".into()
        };
        let meaning = if self.loaded() {
            " Let the hand give way: do not pull back to where it was."
        } else {
            ""
        };
        format!("{place}, {load}.{meaning}")
    }
}

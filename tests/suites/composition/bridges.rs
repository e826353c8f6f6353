//! The bridge from where a DoF is to where its skill goes, and the ramp from one skill to the next.

use tonus_shared::Real;
use tonus_shared::promp::{
    Bridge, ComposeError, Row, State, Trajectory, hand_over, trajectory_scratch_len,
};

use crate::random::{BASIS, DURATION_S, RANK, Space, near};

const START: f64 = 0.25;
const OVERLAP: f64 = 0.5;

fn state<T: Real>(position: f64, velocity: f64) -> State<T> {
    State {
        position: T::of(position),
        velocity: T::of(velocity),
    }
}

struct Joined<'a, T> {
    trajectory: Trajectory<'a, T>,
    bridge: Bridge<T>,
    scratch: Vec<T>,
}

impl<'a, T: Real> Joined<'a, T> {
    fn new(space: &'a Space<T>, present: State<T>) -> Self {
        let trajectory = Trajectory::prior(space.latent(), space.skill(0)).unwrap();
        let mut scratch = vec![T::zero(); trajectory_scratch_len(BASIS, RANK)];
        let span = (T::of(START), T::of(OVERLAP));
        let duration_s = T::of(DURATION_S);
        let bridge = Bridge::new(&trajectory, 1, span, duration_s, present, &mut scratch);
        Self {
            trajectory,
            bridge: bridge.unwrap(),
            scratch,
        }
    }

    fn alone(&mut self, row: Row<T>) -> T {
        let moments = self.trajectory.moments(&row, &mut self.scratch);
        moments.unwrap().mean
    }

    /// Position and velocity, bridge included.
    fn at(&mut self, phase: f64) -> (f64, f64) {
        let (phase, duration_s) = (T::of(phase), T::of(DURATION_S));
        let position = self.alone(Row::position(1, phase)) + self.bridge.position(phase);
        let velocity = self.alone(Row::velocity(1, phase, duration_s))
            + self.bridge.velocity(phase, duration_s);
        (position.widen(), velocity.widen())
    }
}

fn met<T: Real>(tolerance: f64) {
    for seed in 1..=8 {
        let space = Space::<T>::random(seed, 1);
        let mut joined = Joined::new(&space, state(0.75, -1.25));
        let (position, velocity) = joined.at(START);
        near(T::of(position), 0.75, tolerance);
        near(T::of(velocity), -1.25, tolerance);
        // From the end of the overlap on, and before the start, the skill alone.
        for phase in [0.0, 0.125, START + OVERLAP, 0.875, 1.0] {
            let phase = T::of(phase);
            assert_eq!(joined.bridge.position(phase), T::zero());
            assert_eq!(joined.bridge.velocity(phase, T::of(DURATION_S)), T::zero());
        }
    }
}

#[test]
fn the_start_is_met_and_the_skill_goes_on_alone() {
    met::<f64>(1e-14);
    met::<f32>(1e-6);
}

/// By central differences of the position, through the overlap and across its end, where acceleration is
/// continuous too.
#[test]
fn the_velocity_is_the_slope_and_acceleration_does_not_jump() {
    const STEP: f64 = 1e-5;
    const FINE: f64 = 1e-6;
    for seed in 1..=8 {
        let space = Space::<f64>::random(seed, 1);
        let mut joined = Joined::new(&space, state(0.75, -1.25));
        for phase in [0.2501, 0.3, 0.5, 0.7499, 0.75, 0.9] {
            let rise = joined.at(phase + STEP).0 - joined.at(phase - STEP).0;
            let slope = rise / (2.0 * STEP) / DURATION_S;
            near(joined.at(phase).1, slope, 1e-6);
        }
        // The jerk does jump: its part in a step this small is far below the tolerance.
        let mut rise = |from: f64| joined.at(from + FINE).1 - joined.at(from).1;
        let end = START + OVERLAP;
        let (before, after) = (rise(end - 2.0 * FINE), rise(end + FINE));
        near(before / FINE, after / FINE, 0.02);
    }
}

#[test]
fn nothing_is_bridged_where_the_skill_already_is() {
    let space = Space::<f64>::random(5, 1);
    let mut joined = Joined::new(&space, state(0.0, 0.0));
    let row = Row::velocity(1, START, DURATION_S);
    let (position, velocity) = (joined.alone(Row::position(1, START)), joined.alone(row));
    let joined = Joined::new(&space, State { position, velocity });
    for phase in [0.25, 0.4, 0.6] {
        near(joined.bridge.position(phase), 0.0, 1e-15);
    }
}

/// Closed form: `6 u^5 - 15 u^4 + 10 u^3` and its symmetry.
fn ramp<T: Real>(tolerance: f64) {
    let share = |phase: f64| hand_over(T::of(phase), T::of(0.25), T::of(0.5)).unwrap();
    for (phase, u) in [(0.375, 0.25), (0.5, 0.5), (0.625, 0.75), (0.3125, 0.125)] {
        let u: f64 = u;
        let expected = 10.0 * u.powi(3) - 15.0 * u.powi(4) + 6.0 * u.powi(5);
        near(share(phase), expected, tolerance);
        near(share(1.0 - phase), 1.0 - expected, tolerance);
    }
    for (phase, expected) in [(-1.0, 0.0), (0.25, 0.0), (0.75, 1.0), (2.0, 1.0)] {
        assert_eq!(share(phase), T::of(expected));
    }
    let shares: Vec<_> = (0..=64).map(|i| share(f64::from(i) / 64.0)).collect();
    assert!(shares.windows(2).all(|pair| pair[0] <= pair[1]));
}

#[test]
fn the_ramp_is_the_quintic() {
    ramp::<f64>(1e-15);
    ramp::<f32>(1e-6);
}

#[test]
fn overlaps_and_states_that_cannot_be_are_refused() {
    for overlap in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        let refused = hand_over(0.5, 0.25, overlap).unwrap_err();
        assert!(matches!(refused, ComposeError::Overlap { .. }), "{refused}");
    }
    assert!(matches!(
        hand_over(f64::NAN, 0.25, 0.5).unwrap_err(),
        ComposeError::Row(_)
    ));
    let space = Space::<f64>::random(1, 1);
    let trajectory = Trajectory::prior(space.latent(), space.skill(0)).unwrap();
    let mut scratch = vec![0.0; trajectory_scratch_len(BASIS, RANK)];
    let mut bridge = |dof, span, present| {
        Bridge::new(&trajectory, dof, span, DURATION_S, present, &mut scratch).unwrap_err()
    };
    let lost = bridge(0, (0.0, 0.5), state(f64::NAN, 0.0));
    assert!(matches!(lost, ComposeError::State { .. }), "{lost}");
    let jumping = bridge(0, (0.0, 0.0), state(0.0, 0.0));
    assert!(matches!(jumping, ComposeError::Overlap { .. }), "{jumping}");
    let unknown = bridge(9, (0.0, 0.5), state(0.0, 0.0));
    assert!(matches!(unknown, ComposeError::Row(_)), "{unknown}");
}

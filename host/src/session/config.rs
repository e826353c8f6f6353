//! What a session is told once.

/// How the session observes, decides and commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SessionConfig {
    /// Observations of each sensor in one movement, one in each of so many equal parts. More is not better: what
    /// a sensor gets wrong at one instant it gets wrong a hundredth of a second later.
    pub observations: u32,
    /// Standard deviation of the tracker's white error, metres.
    pub position_sigma_m: f64,
    /// Standard deviation of a stiffness estimate as a share of it.
    pub stiffness_sigma: f64,
    /// Whether stiffness is observed at all.
    pub use_semg: bool,
    /// Posterior probability at which a skill counts as decided on.
    pub decide_at: f64,
    /// Observations of each sensor before anything is decided.
    pub decide_after: u32,
    /// The robot holds while the standard deviation of where it should be, between and within the skills,
    /// exceeds this on any axis, metres.
    pub act_within_m: f64,
    /// Where the robot waits, its base frame, metres.
    pub home_m: [f64; 3],
    /// How stiff it is while it waits, N/m.
    pub home_stiffness_n_per_m: [f64; 3],
    /// Damping ratio of every command.
    pub damping_ratio: f64,
}

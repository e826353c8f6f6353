//! Probabilistic movement primitives (ProMPs) in latent form: what a skill is, what an observation
//! does to it, which skill is being performed, and what the rest of the movement will be.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | DoF | one signal of the model: a hand coordinate (m), a stiffness (N/m), a robot coordinate |
//! | phase `s` | progress through the movement, 0 at its start, 1 at its end |
//! | basis | `K` functions `psi(s)` of phase; a DoF is `y_d(s) = psi(s)^T w_d` (eq. 1) |
//! | weights `w` | `D * K` numbers, DoF-major (`w[d * K + k]`), that draw one whole movement |
//! | skill | a Gaussian over weights, learned from demonstrations (eq. 2) |
//! | loading `L` | `D*K x r`: the `r` directions in which the demonstrations differ |
//! | latent `z` | `r` coordinates along the loading: `w = mu + L z` |
//! | directions | where a skill varies in few, a loading `M` of its own and fewer coordinates: `w = mu + M u`, `M M^T = L P0 L^T` |
//! | freedom `nu` | degrees of freedom of a Student-t with the skill's mean and covariance; none: Gaussian |
//! | belief | mean, triangle `S` and shares `d` of the covariance `P = S diag(d) S^T` of `z` after some observations |
//! | row `a` | `L_d^T psi(s)`: how one observed number depends on `z` |
//!
//! `N` demonstrations give a weight covariance of rank `r <= N - 1`, far below `D * K`. With
//! `Sigma = L L^T` everything after learning happens in `z`, exactly: no `D*K x D*K` matrix, no
//! inverse ([`Belief::condition`]).
//!
//! # Rooms
//!
//! [`Basis`] -> [`Latent`] and [`Row`] -> [`Skill`] -> [`Belief`] -> [`Trajectory`], [`Mixture`]; [`Bank`] where
//! duration and onset are not known.
//! All skills of a [`Mixture`] share one loading, so the row is computed once for all of them; each
//! has its own mean and its own initial root, a triangle ([`triangular_root`] makes one of any other). [`via_point`], [`Bridge`] and [`Blend`] compose movements.
//!
//! # Memory
//!
//! Nothing here allocates: constants are borrowed slices (flash), state is storage that the caller
//! hands over (an array on the chip, a vector on the host), at least as long as [`belief_len`],
//! [`mixture_len`], [`bank_len`] or [`trajectory_scratch_len`] say. For `D = 12`, `K = 30`, `r = 29` in `f32`:
//!
//! | | numbers | bytes |
//! |---|---|---|
//! | loading ([`loading_len`]) | `D*K*r` = 10440 | 41760 constant |
//! | one skill's mean, root, residual | `D*K + r (r + 1) / 2 + D` = 807 | 3228 constant |
//! | one belief | `r (r + 1) / 2 + 3r + 10` = 532 | 2128 RAM |
//! | row scratch of a mixture | `K + r` = 59 | 236 RAM |

mod bank;
mod basis;
mod belief;
mod compose;
mod error;
mod evidence;
mod grid;
mod hypothesis;
mod latent;
mod linear;
mod mixture;
mod novelty;
mod row;
mod skill;
mod trajectory;
mod triangle;

pub use bank::{Bank, BankError, Dropped, bank_len};
pub use basis::{Basis, Family};
pub use belief::{Belief, Innovation, belief_len};
pub use compose::{
    Active, Blend, Bridge, ComposeError, Signal, State, blend_len, hand_over, via_len, via_point,
};
pub use error::{BasisError, ConditionError, ModelError, RowError};
pub use grid::Grid;
pub use hypothesis::{Hypothesis, Observed};
pub use latent::{Latent, loading_len};
pub use mixture::{Mixture, Observation, mixture_len};
pub use novelty::{Known, Novelty, Watch, WatchError, triangle_len, watch_len};
pub use row::{Order, Quantity, Row};
pub use skill::{Skill, directions, own_loading};
pub use trajectory::{Moments, Trajectory, curves_scratch_len, trajectory_scratch_len};
pub use triangle::{root_len, triangular_root};

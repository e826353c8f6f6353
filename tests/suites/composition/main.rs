//! Composition: via-points, a start at the present state, hand-over, and several skills at once, against
//! closed forms and dense algebra; in both scalars.
#![allow(
    clippy::unwrap_used,
    reason = "a test's helpers may stop it; clippy exempts test functions only"
)]

mod blends;
mod bridges;
mod command_line;
mod plans;
mod random;
mod via_points;

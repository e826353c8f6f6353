//! Probabilistic movement primitives: bases, exact inference, recognition, against closed forms, dense
//! algebra, and the reference values of an independent implementation.
#![allow(
    clippy::unwrap_used,
    reason = "a test's helpers may stop it; clippy exempts test functions only"
)]

#[path = "promp/adversarial.rs"]
mod adversarial;
#[path = "promp/bases.rs"]
mod bases;
#[path = "promp/closed_form.rs"]
mod closed_form;
#[path = "promp/dense.rs"]
mod dense;
#[path = "promp/directions.rs"]
mod directions;
#[path = "promp/learn.rs"]
mod learn;
#[path = "promp/reference.rs"]
mod reference;
#[path = "promp/shapes.rs"]
mod shapes;
#[path = "promp/student.rs"]
mod student;

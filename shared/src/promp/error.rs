//! What can be wrong with a basis, a model, a row and an observation.

use thiserror::Error;

/// A basis that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum BasisError {
    /// No basis function at all.
    #[error("a basis needs at least one function")]
    Empty,
    /// A Fourier basis is a constant and pairs of sine and cosine.
    #[error(
        "a Fourier basis is a constant and pairs of sine and cosine: its count must be odd, not {count}"
    )]
    EvenFourier {
        /// The count that was asked for.
        count: usize,
    },
    /// A Gaussian width outside what both scalars can carry.
    #[error("the Gaussian width must be finite and at least {min} (phase squared), not {width}")]
    Width {
        /// The least width, phase squared.
        min: f64,
        /// The width that was asked for.
        width: f64,
    },
}

/// A model or its storage with the wrong shape or with numbers that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ModelError {
    /// A dimension is zero.
    #[error("the model needs at least one {what}")]
    Empty {
        /// The dimension: DoF, rank or skill.
        what: &'static str,
    },
    /// The shape's number of elements overflows.
    #[error("a model of {dofs} DoFs, {basis} basis functions and rank {rank} is too large")]
    TooLarge {
        /// Degrees of freedom.
        dofs: usize,
        /// Basis functions per DoF.
        basis: usize,
        /// Rank.
        rank: usize,
    },
    /// A slice of the wrong length.
    #[error("{what} has {got} numbers where the shape needs {expected}")]
    Length {
        /// Which slice.
        what: &'static str,
        /// Its length by the shape.
        expected: usize,
        /// Its length.
        got: usize,
    },
    /// Storage too short.
    #[error("{what} holds {got} numbers and needs at least {needed}")]
    Storage {
        /// Which storage.
        what: &'static str,
        /// The least length.
        needed: usize,
        /// The length handed over.
        got: usize,
    },
    /// A number of the model is NaN or infinite.
    #[error("{what}[{index}] is {value}: a model holds finite numbers only")]
    NonFinite {
        /// Which slice.
        what: &'static str,
        /// Where in it.
        index: usize,
        /// The number.
        value: f64,
    },
    /// A residual variance below zero.
    #[error("the residual variance of DoF {dof} is {value}: it cannot be negative")]
    NegativeVariance {
        /// The DoF.
        dof: usize,
        /// The variance.
        value: f64,
    },
    /// Degrees of freedom at which a Student-t has no covariance.
    #[error(
        "{freedom} degrees of freedom leave a Student-t no covariance: give a finite number above 2"
    )]
    Freedom {
        /// The degrees of freedom that were asked for.
        freedom: f64,
    },
    /// A root so large that the variance it stands for overflows the scalar.
    #[error(
        "row {row} of the root stands for a variance that the scalar cannot hold: rescale the loading"
    )]
    RootOverflow {
        /// The row of the root.
        row: usize,
    },
    /// A floor that every hypothesis would be below.
    #[error("the floor is {floor_nats} nats below the best: give a positive number")]
    Floor {
        /// The floor, nats.
        floor_nats: f64,
    },
}

/// A row (one DoF, position or velocity, at one phase) that the model cannot have.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum RowError {
    /// No such DoF.
    #[error("DoF {dof} was named, the model has {dofs} (0 to {})", dofs - 1)]
    Dof {
        /// The DoF named.
        dof: usize,
        /// How many there are.
        dofs: usize,
    },
    /// A phase that is NaN or infinite.
    #[error("the phase is {phase}: give a finite number, 0 at the start and 1 at the end")]
    Phase {
        /// The phase.
        phase: f64,
    },
    /// A duration that is not a positive finite number.
    #[error("the movement's duration is {duration_s} s: give a positive finite number")]
    Duration {
        /// The duration, seconds.
        duration_s: f64,
    },
    /// The row or what the model says about it exceeds the scalar.
    #[error(
        "DoF {dof} at phase {phase} overflows the scalar: check the loading's units and the duration"
    )]
    Overflow {
        /// The DoF.
        dof: usize,
        /// The phase.
        phase: f64,
    },
    /// A buffer of the wrong length.
    #[error("the {what} buffer has {got} numbers and needs {expected}")]
    Buffer {
        /// Which buffer.
        what: &'static str,
        /// The length it needs.
        expected: usize,
        /// Its length.
        got: usize,
    },
}

/// An observation that was refused; the beliefs are as they were before it.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ConditionError {
    /// The row is not one of this model.
    #[error(transparent)]
    Row(#[from] RowError),
    /// A noise variance that is not a positive finite number.
    #[error(
        "the noise variance is {variance}: give a positive finite number (an exact observation does not exist)"
    )]
    Variance {
        /// The variance.
        variance: f64,
    },
    /// The observed value is NaN or infinite.
    #[error("the observed value is {value}: drop the sample or repair its source")]
    Value {
        /// The value.
        value: f64,
    },
    /// The numbers are finite, their products are not.
    #[error(
        "conditioning on {value} (predicted {predicted}) overflows the scalar: check units and noise variance"
    )]
    Overflow {
        /// The value observed.
        value: f64,
        /// The value predicted.
        predicted: f64,
    },
}

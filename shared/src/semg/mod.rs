//! From raw sEMG to envelopes, activation and signal quality.
//!
//! Words: a *section* is one second-order filter, a *cascade* several in a row; *conditioning* takes
//! offset, drift and hum away; the *envelope* is the smoothed magnitude of what is left; *activation*
//! is the normalised envelope summed over muscles.
//!
//! ```text
//! design (f64) -> biquad (T) -> chain: conditioner -> notch -> rectifier -> smoother -> activation
//!                                                                        \-> bursts
//! counts -> quality
//! ```
//!
//! Filters are designed in `f64` from the sample rate and run in `T`. Coefficients live apart from
//! state: one [`Chain`](chain::Chain) serves every channel, each channel owns a
//! [`ChainState`](chain::ChainState).

pub mod activation;
pub mod biquad;
pub mod bursts;
pub mod chain;
pub mod design;
pub mod quality;
pub mod smoother;

/// A sample that a filter refuses: not finite, or so large that the filter would overflow.
///
/// Whoever returns it has reset the state it owns, so that the next good sample starts afresh.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "sample {value} is not finite or overflows the filter; the next finite sample starts the filter anew"
)]
pub struct NonFinite {
    /// The refused sample.
    pub value: f64,
}

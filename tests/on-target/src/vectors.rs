//! What `tests/examples/vectors.rs` wrote.
#![allow(
    clippy::excessive_precision,
    clippy::unreadable_literal,
    reason = "as computed"
)]

include!(env!("TONUS_VECTORS"));

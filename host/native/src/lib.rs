//! Libraries of others, loaded at run time.
//!
//! The only place on the host where unsafe code stands; each block says why it is sound. What leaves this crate is safe,
//! whatever its user does with it. A library itself is trusted as a program is that one starts: it runs in this process.

pub mod leapc;
pub mod lsl;

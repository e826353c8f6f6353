//! A simulated person who wears the wearable and moves before a hand tracker: seeded, in virtual time.
//!
//! ```text
//! skills (hand path, a stated Gaussian) --+--> tracker -------------------> host
//!   |                                     |
//!   +--> muscle (activation) --> emg (counts) --> shared pipeline --> link --> host
//! ```
//!
//! [`rig`] connects all of it and [`demonstrations`] records from it; [`scripted`] is the robot's part, and
//! [`operator`] the person's second pass in which they show it.
//! [`difficulty`] holds the simulator to its word: how well the best possible recogniser does on the
//! simulator's own true densities.

pub mod demonstrations;
pub mod difficulty;
pub mod emg;
pub mod muscle;
pub mod operator;
pub mod person;
pub mod puppet;
pub mod rig;
pub mod scripted;
pub mod signals;
pub mod skills;
pub mod teleoperation;
pub mod tracker;
pub mod wearer;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A generator of its own for each named purpose of one seed, so that a change to one part of the
/// simulation leaves the others' numbers alone.
fn seeded(seed: u64, purpose: &str) -> ChaCha8Rng {
    // FNV-1a of the name picks one of ChaCha's 2^64 independent streams.
    let stream = purpose
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

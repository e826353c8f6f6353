//! What a session is told as it happens.

use tonus_shared::wire::Frame;

/// Everything that can happen to a session.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// A frame of the wearable came through.
    Frame(&'a Frame),
    /// The tracker saw the hand at this place (shoulder frame, metres) at this time.
    Hand {
        /// When the picture was taken, microseconds.
        exposed_us: u64,
        /// Position, metres.
        position_m: [f64; 3],
    },
    /// A movement begins; a session that infers it does not listen.
    Began {
        /// When, microseconds.
        at_us: u64,
        /// How long it will take, microseconds; not zero.
        duration_us: u64,
    },
    /// The movement is over, the robot goes home.
    Ended,
}

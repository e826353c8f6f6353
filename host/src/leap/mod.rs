//! The hand that a Leap Motion controller sees, over the WebSocket of its service (protocol 6 down to 1) or through the
//! library LeapC.
//!
//! The old service (Orion) speaks the WebSocket's at `ws://127.0.0.1:6437/v6.json`; newer ones (Gemini and later) do
//! through the bridge UltraleapTrackingWebSocket, and all through LeapC, where it is installed. Frames are in millimetres and microseconds of the service's clock; out of here come
//! metres and host time. Axes are the tracker's: x to the right, y up from it, z to the person.
//!
//! **A hand is never stale.** Its age is counted from the instant at which the picture was taken, by the frame's time
//! stamp through [`crate::clock`], never from its arrival: frames that a service repeats, holds back or sends in a
//! burst show nothing. After a start of the service a quarter of a second passes before the first hand is given, because the
//! first frames may have waited and nothing says how long. A lag of the service of more than 10 ms counts as age, however long
//! it lasts. What no host can tell from a live hand is a recording played at its own pace, or a lag that was there from the
//! first frame on; LeapC shows the latter, because its clock is read whenever a frame comes.

mod age;
mod client;
mod follower;
mod frame;
mod library;
mod line;
mod loss;
mod origin;
mod service;
mod socket;

pub use client::{Backoff, Config, Leap, Update};
pub use follower::{Counts, Follower, Message, Protocol, Refusal, Sight, Wanted};
pub use frame::{Content, Frame, FrameError, Hand, MAX_BYTES, Side, parse};
pub use loss::Loss;
pub use origin::{Origin, OriginError};
pub use service::{Service, ServiceError};

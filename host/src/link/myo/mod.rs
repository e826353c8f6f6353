//! The Myo armband, which nobody makes any more and many have: eight channels of sEMG at 200 Hz over Bluetooth LE.
//!
//! Identifiers and layouts: Thalmic Labs, `myohw.h` (github.com/thalmiclabs/myo-bluetooth, c79c1a5). That header calls
//! all values big-endian; the armband sends them little-endian, as its other clients read them.

mod armband;
mod attitude;
mod pace;
mod packet;

pub use armband::{Armband, CHANNELS, MUSCLES, MyoError, RATE_HZ};
pub use packet::{Imu, PacketError, SAMPLES, imu, semg};

/// What every identifier of the armband is made from.
const fn id(short: u16) -> u128 {
    0xd506_0000_a904_deb9_4748_2c7f_4a12_4842 | (short as u128) << 96
}

/// Its control service; advertised, so a host finds it by this.
pub const SERVICE: u128 = id(0x0001);
/// Commands. A host writes.
pub const COMMAND: u128 = id(0x0401);
/// Attitude, acceleration, turning. Notifies.
pub const IMU: u128 = id(0x0402);
/// sEMG: packets go round these four in this order. Notify.
pub const SEMG: [u128; 4] = [id(0x0105), id(0x0205), id(0x0305), id(0x0405)];

/// Command: never fall asleep.
pub const NEVER_SLEEP: [u8; 3] = [0x09, 1, 1];
/// Command: send sEMG without hum (mode 2), attitude (1) and gestures (1), until told otherwise.
pub const STREAM_ALL: [u8; 5] = [0x01, 3, 2, 1, 1];

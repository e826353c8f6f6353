//! The identifiers under which the wearable offers its packets over Bluetooth LE, and who may use each.
//!
//! Both ends take them from here: the wearable builds its attribute table from them and the host looks for them.
//! Written as Bluetooth prints them; over the air they go least significant byte first. A value is one frame
//! (see `docs/wire.md`). "Notifies" means that the wearable sends and a host subscribes.
//!
//! Everything of [`SERVICE`] needs an authenticated link; battery and device information are readable without.

/// The service that holds every characteristic of the wearable; advertised, so a host finds it by this.
pub const SERVICE: u128 = 0xa058_2890_5ca6_433e_ad68_db88_37ae_d19e;

/// Stream packets. Notifies.
pub const STREAM: u128 = 0xa058_2891_5ca6_433e_ad68_db88_37ae_d19e;

/// Raw sEMG packets, while switched on. Notifies.
pub const RAW_SEMG: u128 = 0xa058_2892_5ca6_433e_ad68_db88_37ae_d19e;

/// Orientation packets. Notifies.
pub const ORIENTATION: u128 = 0xa058_2893_5ca6_433e_ad68_db88_37ae_d19e;

/// Hand position packets. A host writes without response.
pub const HAND_POSITION: u128 = 0xa058_2894_5ca6_433e_ad68_db88_37ae_d19e;

/// Control packets. A host writes.
pub const CONTROL: u128 = 0xa058_2895_5ca6_433e_ad68_db88_37ae_d19e;

/// The calibration packet. A host reads the one in use, and writes another.
pub const CALIBRATION: u128 = 0xa058_2896_5ca6_433e_ad68_db88_37ae_d19e;

/// Model upload packets. A host writes, the pieces without response.
pub const MODEL_UPLOAD: u128 = 0xa058_2897_5ca6_433e_ad68_db88_37ae_d19e;

/// Inference packets. Notifies.
pub const INFERENCE: u128 = 0xa058_2898_5ca6_433e_ad68_db88_37ae_d19e;

/// Configuration, status, replies, model state, last words and answers to pings. Notifies.
pub const REPORTS: u128 = 0xa058_2899_5ca6_433e_ad68_db88_37ae_d19e;

/// Requests to compare clocks. A host writes without response; the answer is among the reports.
pub const PING: u128 = 0xa058_289a_5ca6_433e_ad68_db88_37ae_d19e;

/// Battery service (Bluetooth SIG, Assigned Numbers 3.4.1).
pub const BATTERY_SERVICE: u16 = 0x180f;

/// Battery level, u8, percent (Assigned Numbers 3.8.1). A host reads, or is notified.
pub const BATTERY_LEVEL: u16 = 0x2a19;

/// Device information service (Assigned Numbers 3.4.1).
pub const DEVICE_INFORMATION_SERVICE: u16 = 0x180a;

/// Name of the manufacturer, UTF-8. A host reads.
pub const MANUFACTURER_NAME: u16 = 0x2a29;

/// Name of the board, UTF-8. A host reads.
pub const MODEL_NUMBER: u16 = 0x2a24;

/// Version of the firmware, UTF-8. A host reads.
pub const FIRMWARE_REVISION: u16 = 0x2a26;

/// The advertised name.
pub const DEVICE_NAME: &str = "Tonus";

//! The 128-bit identifiers under which the wearable offers its packets over Bluetooth LE.
//!
//! Both ends take them from here: the wearable builds its attribute table from them and the host
//! looks for them. Written as Bluetooth prints them; over the air they go least significant byte first.

/// The service that holds every characteristic of the wearable; advertised, so a host finds it by this.
pub const SERVICE: u128 = 0xa058_2890_5ca6_433e_ad68_db88_37ae_d19e;

/// Stream packets: the wearable notifies, a host subscribes over an authenticated link.
pub const STREAM: u128 = 0xa058_2891_5ca6_433e_ad68_db88_37ae_d19e;

/// Raw sEMG packets: the wearable notifies.
pub const RAW: u128 = 0xa058_2892_5ca6_433e_ad68_db88_37ae_d19e;

/// Orientation packets: the wearable notifies.
pub const ORIENTATION: u128 = 0xa058_2893_5ca6_433e_ad68_db88_37ae_d19e;

/// Hand position packets: a host writes without response.
pub const HAND: u128 = 0xa058_2894_5ca6_433e_ad68_db88_37ae_d19e;

/// Control packets: a host writes.
pub const CONTROL: u128 = 0xa058_2895_5ca6_433e_ad68_db88_37ae_d19e;

/// Calibration packets: a host reads and writes.
pub const CALIBRATION: u128 = 0xa058_2896_5ca6_433e_ad68_db88_37ae_d19e;

/// Model upload packets: a host writes, with or without response.
pub const MODEL: u128 = 0xa058_2897_5ca6_433e_ad68_db88_37ae_d19e;

/// Inference packets: the wearable notifies.
pub const INFERENCE: u128 = 0xa058_2898_5ca6_433e_ad68_db88_37ae_d19e;

/// Everything else that the wearable tells: configuration, status, replies. It notifies.
pub const REPORTS: u128 = 0xa058_2899_5ca6_433e_ad68_db88_37ae_d19e;

/// Ping requests: a host writes without response.
pub const PING: u128 = 0xa058_289a_5ca6_433e_ad68_db88_37ae_d19e;

/// The advertised name.
pub const DEVICE_NAME: &str = "Tonus";

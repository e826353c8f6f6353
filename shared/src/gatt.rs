//! The 128-bit identifiers under which the wearable offers its packets over Bluetooth LE.
//!
//! Both ends take them from here: the wearable builds its attribute table from them and the host
//! looks for them. Written as Bluetooth prints them; over the air they go least significant byte first.

/// The service that holds every characteristic of the wearable; advertised, so a host finds it by this.
pub const SERVICE: u128 = 0xa058_2890_5ca6_433e_ad68_db88_37ae_d19e;

/// Stream packets: the wearable notifies, a host subscribes over an authenticated link.
pub const STREAM: u128 = 0xa058_2891_5ca6_433e_ad68_db88_37ae_d19e;

/// The advertised name.
pub const DEVICE_NAME: &str = "Tonus";

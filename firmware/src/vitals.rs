//! How the wearable fares: what each task knows of its own part, gathered for the status packets.

use core::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, Ordering};

use tonus_shared::{
    pipeline::Health,
    wire::{ResetReason, StatusFlags},
};

use crate::battery::Battery;

/// Written by any task, read by the signal path.
pub struct Vitals {
    flags: AtomicU8,
    /// mV; 0: not measured.
    battery_mv: AtomicU16,
    battery_percent: AtomicU8,
    links: AtomicU16,
    lost_scans: AtomicU32,
}

impl Vitals {
    /// Of a wearable that has just started: nothing is known to be wrong.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            flags: AtomicU8::new(0),
            battery_mv: AtomicU16::new(0),
            battery_percent: AtomicU8::new(100),
            links: AtomicU16::new(0),
            lost_scans: AtomicU32::new(0),
        }
    }

    /// Says that something is wrong, or no longer is.
    pub fn set(&self, flag: StatusFlags, on: bool) {
        if on {
            self.flags.fetch_or(flag.bits(), Ordering::Relaxed);
        } else {
            self.flags.fetch_and(!flag.bits(), Ordering::Relaxed);
        }
    }

    /// The voltage of this battery, mV.
    pub fn set_battery(&self, battery: &Battery, battery_mv: u16) {
        let percent = battery.percent(battery_mv);
        self.battery_mv.store(battery_mv, Ordering::Relaxed);
        self.battery_percent.store(percent, Ordering::Relaxed);
        self.set(StatusFlags::LOW_BATTERY, percent < Battery::LOW_PERCENT);
    }

    /// The battery's charge, per cent; full until it was measured.
    #[must_use]
    pub const fn battery_percent(&self) -> &AtomicU8 {
        &self.battery_percent
    }

    /// A host connected.
    pub fn linked(&self) {
        self.links.fetch_add(1, Ordering::Relaxed);
    }

    /// Scans were taken and overwritten before anybody looked.
    pub fn lost_scans(&self, scans: u32) {
        self.lost_scans.fetch_add(scans, Ordering::Relaxed);
    }

    /// All of it, and what never changes: why the wearable started.
    #[must_use]
    pub fn health(&self, reset_reason: ResetReason) -> Health {
        let battery_mv = self.battery_mv.load(Ordering::Relaxed);
        Health {
            battery_mv: (battery_mv > 0).then_some(battery_mv),
            reset_reason,
            flags: StatusFlags::from_bits(self.flags.load(Ordering::Relaxed)),
            overruns: self.lost_scans.load(Ordering::Relaxed),
            links: self.links.load(Ordering::Relaxed),
            ..Health::default()
        }
    }
}

impl Default for Vitals {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_come_and_go_one_by_one_and_counts_add_up() {
        let vitals = Vitals::new();
        assert_eq!(
            vitals.health(ResetReason::Unknown),
            Health::default(),
            "nothing is known to be wrong"
        );
        vitals.set(StatusFlags::NO_MODEL, true);
        vitals.set(StatusFlags::FRONT_END_FAILED, true);
        vitals.set(StatusFlags::NO_MODEL, true);
        vitals.set(StatusFlags::FRONT_END_FAILED, false);
        vitals.set_battery(&Battery::COIN_CELL, 3_012);
        vitals.lost_scans(3);
        vitals.lost_scans(4);
        vitals.linked();
        let expected = Health {
            battery_mv: Some(3_012),
            reset_reason: ResetReason::Watchdog,
            flags: StatusFlags::NO_MODEL,
            overruns: 7,
            links: 1,
            ..Health::default()
        };
        assert_eq!(vitals.health(ResetReason::Watchdog), expected);
    }

    #[test]
    fn a_battery_that_is_nearly_empty_is_flagged_until_it_is_charged() {
        let vitals = Vitals::new();
        let flagged = || {
            let flags = vitals.health(ResetReason::Unknown).flags;
            flags.contains(StatusFlags::LOW_BATTERY)
        };
        vitals.set_battery(&Battery::LITHIUM_POLYMER, 3_500);
        assert!(flagged());
        assert_eq!(vitals.battery_percent().load(Ordering::Relaxed), 6);
        vitals.set_battery(&Battery::LITHIUM_POLYMER, 3_800);
        assert!(!flagged());
    }
}

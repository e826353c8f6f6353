//! Why the chip started, from the bits of its register RESETREAS.

use tonus_shared::wire::ResetReason;

/// Bits that are set by each kind of reset (nRF52840 product specification, POWER, RESETREAS), the graver first: several
/// accumulate until they are cleared. Bits 16 to 20 are wakes from System OFF.
const REASONS: [(u32, ResetReason); 5] = [
    (1 << 3, ResetReason::Lockup),
    (1 << 1, ResetReason::Watchdog),
    (1 << 2, ResetReason::Software),
    (1 << 0, ResetReason::Pin),
    (0x1f << 16, ResetReason::Wake),
];

/// The gravest reason in `resetreas`; none at all means that power came on or browned out.
#[must_use]
pub fn reason(resetreas: u32) -> ResetReason {
    let found = REASONS.iter().find(|(bits, _)| resetreas & bits != 0);
    match found {
        Some((_, reason)) => *reason,
        None if resetreas == 0 => ResetReason::PowerOn,
        None => ResetReason::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_has_its_reason_and_the_gravest_wins() {
        for (resetreas, expected) in [
            (0, ResetReason::PowerOn),
            (0x1, ResetReason::Pin),
            (0x2, ResetReason::Watchdog),
            (0x4, ResetReason::Software),
            (0x8, ResetReason::Lockup),
            (0x1_0000, ResetReason::Wake),
            (0x10_0000, ResetReason::Wake),
            (0x7, ResetReason::Watchdog),
            (0xc, ResetReason::Lockup),
            (0x8000_0000, ResetReason::Unknown),
        ] {
            assert_eq!(reason(resetreas), expected, "{resetreas:#x}");
        }
    }
}

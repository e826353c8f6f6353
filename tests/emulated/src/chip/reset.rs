//! Why the chip starts again, and what each reason leaves alone (PS 5.3, "Reset behavior").

/// Why the chip starts (PS 5.3, register RESETREAS).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// The power came back: only the flash is as it was.
    Power,
    /// Someone pressed the reset button.
    Pin,
    /// The watchdog was not fed.
    Watchdog,
    /// The image asked for it.
    Software,
    /// A fault while a fault was being handled.
    Lockup,
}

impl Reset {
    /// The bit in RESETREAS; none says that the power came.
    #[must_use]
    pub const fn reason(self) -> u32 {
        match self {
            Self::Power => 0,
            Self::Pin => 1,
            Self::Watchdog => 1 << 1,
            Self::Software => 1 << 2,
            Self::Lockup => 1 << 3,
        }
    }

    /// Whether the watchdog goes on with what it was told, and GPREGRET keeps its values.
    #[must_use]
    pub const fn spares_watchdog(self) -> bool {
        matches!(self, Self::Software | Self::Lockup)
    }

    /// Whether RAM holds what it held. The specification promises it for resets by software and lockup; after the
    /// button and the watchdog it says that RAM is not reset but may be damaged, which is not modelled.
    #[must_use]
    pub const fn spares_ram(self) -> bool {
        !matches!(self, Self::Power)
    }
}

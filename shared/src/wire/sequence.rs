//! What became of a sender's packets, from their boot ids and sequence numbers.

/// How far back a late packet is still told from a repeated one, packets.
const MEMORY: u32 = 64;

/// What one packet's number says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// The first of a sender, or the first after it restarted.
    NewBoot,
    /// Ahead of all before it, with `lost` numbers skipped (none, when all goes well).
    Newer {
        /// Numbers between the newest so far and this one.
        lost: u32,
    },
    /// Behind a newer one, not seen before: it was counted lost and is now counted late.
    Late,
    /// Seen already.
    Duplicate,
    /// Of an earlier boot, or too far behind to tell late from repeated.
    Stale,
}

impl Arrival {
    /// Whether the packet holds newer data than all before it: what control may use.
    #[must_use]
    pub const fn is_newest(self) -> bool {
        matches!(self, Self::NewBoot | Self::Newer { .. })
    }
}

/// Totals over all boots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SequenceCounts {
    /// Packets that came in order.
    pub received: u64,
    /// Numbers skipped and not seen since.
    pub lost: u64,
    /// Packets that came behind a newer one.
    pub late: u64,
    /// Packets that came again.
    pub duplicate: u64,
    /// Packets too old to place.
    pub stale: u64,
    /// Boots seen.
    pub boots: u64,
}

/// Follows one sender. Numbers wrap from `u32::MAX` to 0; a step of less than half the range ahead
/// counts as newer.
#[derive(Clone, Copy, Debug, Default)]
pub struct SequenceTracker {
    newest: Option<Newest>,
    previous_boot: Option<u32>,
    counts: SequenceCounts,
}

#[derive(Clone, Copy, Debug)]
struct Newest {
    boot_id: u32,
    sequence: u32,
    /// Bit k: the packet k before the newest has come.
    seen: u64,
    /// How many numbers before the newest belong to what was tracked, at most `MEMORY - 1`.
    span: u32,
}

impl SequenceTracker {
    /// Nothing seen yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Places one packet and counts it.
    pub fn observe(&mut self, boot_id: u32, sequence: u32) -> Arrival {
        let arrival = match &mut self.newest {
            Some(newest) if newest.boot_id == boot_id => newest.place(sequence),
            _ if self.previous_boot == Some(boot_id) => Arrival::Stale,
            _ => {
                self.previous_boot = self.newest.map(|newest| newest.boot_id);
                self.newest = Some(Newest {
                    boot_id,
                    sequence,
                    seen: 1,
                    span: 0,
                });
                Arrival::NewBoot
            }
        };
        let counts = &mut self.counts;
        match arrival {
            Arrival::NewBoot => {
                counts.boots += 1;
                counts.received += 1;
            }
            Arrival::Newer { lost } => {
                counts.received += 1;
                counts.lost += u64::from(lost);
            }
            Arrival::Late => {
                counts.late += 1;
                counts.lost -= 1;
            }
            Arrival::Duplicate => counts.duplicate += 1,
            Arrival::Stale => counts.stale += 1,
        }
        arrival
    }

    /// Totals so far.
    #[must_use]
    pub fn counts(&self) -> SequenceCounts {
        self.counts
    }
}

impl Newest {
    fn place(&mut self, sequence: u32) -> Arrival {
        let ahead = sequence.wrapping_sub(self.sequence);
        if ahead == 0 {
            return Arrival::Duplicate;
        }
        if ahead <= u32::MAX / 2 {
            self.seen = if ahead < MEMORY {
                self.seen << ahead
            } else {
                0
            } | 1;
            self.span = self.span.saturating_add(ahead).min(MEMORY - 1);
            self.sequence = sequence;
            return Arrival::Newer { lost: ahead - 1 };
        }
        let behind = self.sequence.wrapping_sub(sequence);
        if behind > self.span {
            return Arrival::Stale;
        }
        let bit = 1_u64 << behind;
        if self.seen & bit != 0 {
            return Arrival::Duplicate;
        }
        self.seen |= bit;
        Arrival::Late
    }
}

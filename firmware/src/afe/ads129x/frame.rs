//! One conversion of all channels as it comes over the bus.
//!
//! ```text
//! 1100 | LOFF_STATP, channel 8 first | LOFF_STATN | GPIO 4..1 | channel 1, 24 bits | channel 2 | ...
//! ```
//! Two's complement, most significant bit first (SBAS459, "Data output pin", "Data format").

use super::Ads129xError;

/// Bytes of the longest frame: status and eight channels.
pub(super) const MAX_BYTES: usize = 3 * (1 + 8);
/// What the status word begins with.
const HEADER: u8 = 0b1100;

/// The counts of one conversion and the lead-off comparators at that moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conversion<const C: usize> {
    /// Counts, sign-extended.
    pub counts: [i32; C],
    /// Whether an electrode of the channel is off.
    pub lead_off: [bool; C],
}

/// Takes a frame apart. `sensed` has a bit for each channel whose lead-off bits are valid.
///
/// A frame whose bits slipped against the clock does not begin with 1100 and is refused whole.
pub(super) fn decode<const C: usize>(
    bytes: &[u8],
    sensed: u8,
) -> Result<Conversion<C>, Ads129xError> {
    let length = bytes.len();
    let ([a, b, c], channels) = match bytes.split_first_chunk::<3>() {
        Some((status, channels)) if channels.len() == 3 * C => (*status, channels),
        _ => {
            return Err(Ads129xError::FrameLength {
                expected: 3 * (1 + C),
                got: length,
            });
        }
    };
    if a >> 4 != HEADER {
        return Err(Ads129xError::Header { got: a >> 4 });
    }
    let positive = a << 4 | b >> 4;
    let negative = b << 4 | c >> 4;
    let off = (positive | negative) & sensed;
    let (words, _) = channels.as_chunks::<3>();
    let mut counts = [0; C];
    for (count, [high, middle, low]) in counts.iter_mut().zip(words) {
        *count = i32::from_be_bytes([*high, *middle, *low, 0]) >> 8;
    }
    Ok(Conversion {
        counts,
        lead_off: core::array::from_fn(|channel| off >> channel & 1 == 1),
    })
}

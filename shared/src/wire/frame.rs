//! A whole frame: header, packet, checksum.

use crc::{CRC_32_ISO_HDLC, Crc};

use super::bytes::{Reader, Writer};
use super::error::WireError;
use super::layout;
use super::packet::Packet;
use super::table::{CRC_BYTES, HEADER_BYTES, Kind, VERSION, row, whole};

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// What every frame begins with; version and kind come from the protocol and the packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Random number that the sender drew when it started: a new one means a restart.
    pub boot_id: u32,
    /// Counts every frame of the sender, whatever its kind; wraps.
    pub sequence: u32,
    /// Device clock of the wearable, us, of the newest measurement in the packet.
    pub device_us: u64,
}

/// A frame that passed every check.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Who sent it, and when.
    pub header: Header,
    /// What it carries.
    pub packet: Packet,
}

/// Writes a frame at the start of `out` and gives its length in bytes.
///
/// # Errors
/// `NonFinite` and `OutOfRange` if the packet holds what it may not, `BufferTooSmall` if `out` is
/// shorter than the frame ([`super::MAX_FRAME_BYTES`] always suffices). `out` is untouched then.
pub fn encode(header: &Header, packet: &Packet, out: &mut [u8]) -> Result<usize, WireError> {
    packet.check()?;
    let needed = whole(layout::payload_bytes(packet));
    let too_small = WireError::BufferTooSmall {
        needed,
        got: out.len(),
    };
    let frame = out.get_mut(..needed).ok_or(too_small)?;
    let (body, checksum) = frame.split_last_chunk_mut::<CRC_BYTES>().ok_or(too_small)?;
    let mut writer = Writer::new(body);
    writer.u8(VERSION);
    writer.u8(packet.kind() as u8);
    writer.u32(header.boot_id);
    writer.u32(header.sequence);
    writer.u64(header.device_us);
    layout::put(packet, &mut writer);
    debug_assert_eq!(
        writer.written() + CRC_BYTES,
        needed,
        "table and layout agree"
    );
    *checksum = CRC.checksum(body).to_le_bytes();
    Ok(needed)
}

/// Reads one whole frame.
///
/// Version and kind are looked at before the checksum, so that a frame of another version says so
/// whatever its layout.
///
/// # Errors
/// Every [`WireError`] but `BufferTooSmall`; nothing of a refused frame is to be used.
pub fn decode(bytes: &[u8]) -> Result<Frame, WireError> {
    let too_short = WireError::TooShort {
        needed: whole(0),
        got: bytes.len(),
    };
    if let Some(version) = bytes.first().filter(|version| **version != VERSION) {
        return Err(WireError::UnknownVersion { got: *version });
    }
    if bytes.len() < whole(0) {
        return Err(too_short);
    }
    let (body, checksum) = bytes.split_last_chunk::<CRC_BYTES>().ok_or(too_short)?;
    let mut reader = Reader::new(body);
    let _version = reader.u8()?;
    let number = reader.u8()?;
    let kind = Kind::from_number(number).ok_or(WireError::UnknownKind { got: number })?;
    let length = body.len() - HEADER_BYTES;
    let allowed = row(kind).payload_min..=row(kind).payload_max;
    if !allowed.contains(&length) {
        return Err(WireError::WrongLength {
            kind,
            expected: whole(length.clamp(*allowed.start(), *allowed.end())),
            got: bytes.len(),
        });
    }
    let (expected, got) = (CRC.checksum(body), u32::from_le_bytes(*checksum));
    if expected != got {
        return Err(WireError::BadCrc { expected, got });
    }
    let header = Header {
        boot_id: reader.u32()?,
        sequence: reader.u32()?,
        device_us: reader.u64()?,
    };
    let packet = layout::take(kind, &mut reader, length)?;
    packet.check()?;
    Ok(Frame { header, packet })
}

impl Frame {
    /// [`encode`] of this frame's header and packet.
    ///
    /// # Errors
    /// As [`encode`].
    pub fn encode(&self, out: &mut [u8]) -> Result<usize, WireError> {
        encode(&self.header, &self.packet, out)
    }
}

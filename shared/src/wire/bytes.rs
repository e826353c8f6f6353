//! Little-endian cursors over a checked slice; neither can panic.

use super::error::WireError;

/// Writes fields one after another. The caller has checked that all of them fit; a field that does
/// not is left out and shows as a short [`Writer::written`].
pub(super) struct Writer<'a> {
    left: &'a mut [u8],
    written: usize,
}

impl<'a> Writer<'a> {
    pub(super) fn new(out: &'a mut [u8]) -> Self {
        Self {
            left: out,
            written: 0,
        }
    }

    pub(super) fn written(&self) -> usize {
        self.written
    }

    pub(super) fn bytes<const N: usize>(&mut self, bytes: [u8; N]) {
        let left = core::mem::take(&mut self.left);
        if let Some((head, tail)) = left.split_first_chunk_mut::<N>() {
            *head = bytes;
            self.left = tail;
            self.written += N;
        }
    }

    /// A list whose length the packet tells elsewhere.
    pub(super) fn slice(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.u8(*byte);
        }
    }

    pub(super) fn u8(&mut self, value: u8) {
        self.bytes([value]);
    }

    pub(super) fn u16(&mut self, value: u16) {
        self.bytes(value.to_le_bytes());
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.bytes(value.to_le_bytes());
    }

    pub(super) fn u64(&mut self, value: u64) {
        self.bytes(value.to_le_bytes());
    }

    pub(super) fn i32(&mut self, value: i32) {
        self.bytes(value.to_le_bytes());
    }

    /// The low three bytes: exact for the 24-bit counts that the range check lets through.
    pub(super) fn i24(&mut self, value: i32) {
        let [a, b, c, _] = value.to_le_bytes();
        self.bytes([a, b, c]);
    }

    pub(super) fn f32(&mut self, value: f32) {
        self.bytes(value.to_le_bytes());
    }

    pub(super) fn f32s<const N: usize>(&mut self, values: [f32; N]) {
        for value in values {
            self.f32(value);
        }
    }
}

/// Reads fields one after another.
pub(super) struct Reader<'a> {
    left: &'a [u8],
    whole: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self {
            left: bytes,
            whole: bytes.len(),
        }
    }

    pub(super) fn bytes<const N: usize>(&mut self) -> Result<[u8; N], WireError> {
        let (head, tail) = self
            .left
            .split_first_chunk::<N>()
            .ok_or(WireError::TooShort {
                needed: self.whole - self.left.len() + N,
                got: self.whole,
            })?;
        self.left = tail;
        Ok(*head)
    }

    /// All that is left.
    pub(super) fn rest(&mut self) -> &'a [u8] {
        core::mem::take(&mut self.left)
    }

    pub(super) fn u8(&mut self) -> Result<u8, WireError> {
        self.bytes().map(|[byte]| byte)
    }

    pub(super) fn u16(&mut self) -> Result<u16, WireError> {
        self.bytes().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Result<u32, WireError> {
        self.bytes().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Result<u64, WireError> {
        self.bytes().map(u64::from_le_bytes)
    }

    pub(super) fn i32(&mut self) -> Result<i32, WireError> {
        self.bytes().map(i32::from_le_bytes)
    }

    /// Three bytes, sign extended.
    pub(super) fn i24(&mut self) -> Result<i32, WireError> {
        self.bytes()
            .map(|[a, b, c]| i32::from_le_bytes([0, a, b, c]) >> 8)
    }

    pub(super) fn f32(&mut self) -> Result<f32, WireError> {
        self.bytes().map(f32::from_le_bytes)
    }

    pub(super) fn f32s<const N: usize>(&mut self) -> Result<[f32; N], WireError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f32()?;
        }
        Ok(values)
    }
}

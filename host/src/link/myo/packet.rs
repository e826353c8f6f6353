//! What the armband sends, byte by byte.

use thiserror::Error;

use super::armband::CHANNELS;

/// Samples of all channels in one packet of sEMG, the older one first.
pub const SAMPLES: usize = 2;
/// Bytes of a packet of sEMG, and of one of attitude.
const SEMG_BYTES: usize = SAMPLES * CHANNELS;
const IMU_BYTES: usize = 20;
/// Counts per one of a quaternion, per g, and per degree a second.
const QUATERNION: f32 = 16_384.0;
const ACCELERATION: f32 = 2_048.0;
const TURNING: f32 = 16.0;
/// A quaternion shorter than this is none: the armband has not begun to measure.
const SHORTEST: f32 = 0.5;

/// A packet that is none.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum PacketError {
    /// Not so many bytes.
    #[error("a packet of {what} has {expected} bytes, this one {got}: not a Myo's")]
    Length {
        /// Which sort.
        what: &'static str,
        /// Bytes that it has.
        expected: usize,
        /// Bytes that came.
        got: usize,
    },
    /// No attitude.
    #[error("a quaternion of norm {norm}: the armband does not measure yet")]
    Quaternion {
        /// Its norm.
        norm: f32,
    },
}

/// How the armband lies and moves, in its own frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imu {
    /// Attitude, unit quaternion x, y, z, w, from the armband to a frame with a vertical of its own choice of heading.
    pub xyzw: [f32; 4],
    /// Acceleration, g.
    pub acceleration_g: [f32; 3],
    /// Turning, degrees a second.
    pub turning_deg_per_s: [f32; 3],
}

/// The two samples of a packet of sEMG, counts of all channels.
///
/// # Errors
/// [`PacketError::Length`].
pub fn semg(bytes: &[u8]) -> Result<[[i8; CHANNELS]; SAMPLES], PacketError> {
    let bytes: &[u8; SEMG_BYTES] = bytes.try_into().map_err(|_| PacketError::Length {
        what: "sEMG",
        expected: SEMG_BYTES,
        got: bytes.len(),
    })?;
    Ok(std::array::from_fn(|sample| {
        std::array::from_fn(|channel| bytes[sample * CHANNELS + channel].cast_signed())
    }))
}

/// A packet of attitude: quaternion w, x, y, z, acceleration and turning, ten numbers of 16 bits.
///
/// # Errors
/// [`PacketError`].
pub fn imu(bytes: &[u8]) -> Result<Imu, PacketError> {
    let bytes: &[u8; IMU_BYTES] = bytes.try_into().map_err(|_| PacketError::Length {
        what: "attitude",
        expected: IMU_BYTES,
        got: bytes.len(),
    })?;
    let number = |at: usize| f32::from(i16::from_le_bytes([bytes[2 * at], bytes[2 * at + 1]]));
    let raw = [1, 2, 3, 0].map(|at| number(at) / QUATERNION);
    let norm = raw.iter().map(|part| part * part).sum::<f32>().sqrt();
    if norm < SHORTEST {
        return Err(PacketError::Quaternion { norm });
    }
    Ok(Imu {
        xyzw: raw.map(|part| part / norm),
        acceleration_g: [4, 5, 6].map(|at| number(at) / ACCELERATION),
        turning_deg_per_s: [7, 8, 9].map(|at| number(at) / TURNING),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literal_bytes_are_two_samples_of_eight_signed_counts() {
        let bytes = [0, 1, 127, 128, 255, 254, 16, 240, 9, 8, 7, 6, 5, 4, 3, 2];
        let expected = [[0, 1, 127, -128, -1, -2, 16, -16], [9, 8, 7, 6, 5, 4, 3, 2]];
        assert_eq!(semg(&bytes), Ok(expected));
        let short = PacketError::Length {
            what: "sEMG",
            expected: 16,
            got: 15,
        };
        assert_eq!(semg(&bytes[..15]), Err(short));
    }

    #[test]
    fn literal_bytes_are_an_attitude_in_little_endian() {
        // w = 0x2d41 / 16384 = 0.7071, y = -w; 1 g = 0x0800 upwards; 90 degrees a second = 0x05a0 about x.
        let mut bytes = [0; 20];
        bytes[..8].copy_from_slice(&[0x41, 0x2d, 0, 0, 0xbf, 0xd2, 0, 0]);
        bytes[12..16].copy_from_slice(&[0x00, 0x08, 0xa0, 0x05]);
        let imu = imu(&bytes).unwrap();
        let half = std::f32::consts::FRAC_1_SQRT_2;
        for (part, expected) in imu.xyzw.iter().zip([0.0, -half, 0.0, half]) {
            assert!((part - expected).abs() < 1e-6, "{imu:?}");
        }
        assert_eq!(imu.acceleration_g, [0.0, 0.0, 1.0]);
        assert_eq!(imu.turning_deg_per_s, [90.0, 0.0, 0.0]);
        assert_eq!(
            super::imu(&[0; 20]),
            Err(PacketError::Quaternion { norm: 0.0 })
        );
        assert!(super::imu(&bytes[1..]).is_err());
    }
}

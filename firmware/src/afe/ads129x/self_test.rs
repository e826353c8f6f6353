//! The chip measures itself: noise with shorted inputs, then its own test signal.
//!
//! The test signal is a square wave of `± V_REF / 2400` (1 mV) at `f_CLK / 2^20`; the converter's rate comes from the
//! same clock, so that a period is exactly 512 scans at 1 kHz and 1024 at 2 kHz. Correlated with two square waves
//! of that period, a quarter period apart, over whole periods,
//!
//! ```text
//! |I| + |Q| = A n      A amplitude, n scans, whatever the phase;   offsets cancel
//! ```
//!
//! A wave of half or twice the frequency correlates to nothing, so the amplitude vouches for the frequency too.

use embedded_hal::digital::OutputPin;
use embedded_hal_async::{delay::DelayNs, spi::SpiDevice};

use super::{Ads129x, Ads129xError, Gain, Input, Rate, Settings, settings::REFERENCE_V};
use crate::afe::DataReady;
use core::convert::Infallible;

/// Amplitude of the test signal, V (SBAS459, CONFIG2: `1 x -(VREFP - VREFN) / 2400`).
const TEST_V: f32 = (REFERENCE_V / 2400.0) as f32;
/// The sheet gives the signal 2 %, and reference and gain another 0.7 %.
const TEST_TOLERANCE: f32 = 0.05;
/// Most noise of a sound channel, V RMS. The sheet's 4 uV peak to peak at 150 Hz and gain 6 are 0.6 uV RMS,
/// 1.1 uV in the 524 Hz of 2 kHz; a missing bypass capacitor or a coupled clock gives tens.
const NOISE_LIMIT_V: f32 = 3e-6;
/// Scans after a start whose filter still remembers the switching of the input.
const SETTLING_SCANS: u32 = 8;

/// What a channel measured of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfTest<const C: usize> {
    /// Amplitude of the test signal, V; zero for a channel that is off.
    pub amplitude_v: [f32; C],
    /// Noise with shorted inputs, V RMS; zero for a channel that is off.
    pub noise_v: [f32; C],
}

/// Why the self-test failed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum SelfTestError {
    /// The converter could not be read.
    #[error(transparent)]
    Converter(#[from] Ads129xError),
    /// The test signal is not as high as it should be.
    #[error(
        "channel {channel}: test signal of {got_v} V instead of {expected_v} V: check the reference"
    )]
    Amplitude {
        /// Channel, from 1.
        channel: usize,
        /// As the sheet says, V.
        expected_v: f32,
        /// Measured, V.
        got_v: f32,
    },
    /// A channel is noisier than the chip.
    #[error(
        "channel {channel}: noise of {got_v} V RMS with shorted inputs, above {limit_v} V: check supply and decoupling"
    )]
    Noise {
        /// Channel, from 1.
        channel: usize,
        /// Most that passes, V.
        limit_v: f32,
        /// Measured, V RMS.
        got_v: f32,
    },
}

/// Scans of one period of the test signal: `2^20 t_CLK` over `2^11` or `2^10`.
const fn period_scans(rate: Rate) -> u32 {
    match rate {
        Rate::Hz1000 => 512,
        Rate::Hz2000 => 1024,
    }
}

impl<const C: usize, S, R, T, D> Ads129x<C, S, R, T, D>
where
    S: SpiDevice,
    R: OutputPin<Error = Infallible>,
    T: OutputPin<Error = Infallible>,
    D: DelayNs,
{
    /// Measures noise and test signal of every channel that is not off, 2 s; then the chip is set up as before.
    ///
    /// # Errors
    /// [`SelfTestError`] names the first channel that fails; the chip then stays on its internal input until
    /// [`Self::initialise`].
    pub async fn self_test(
        &mut self,
        edges: &mut impl DataReady,
    ) -> Result<SelfTest<C>, SelfTestError> {
        let scans = period_scans(self.settings.rate);
        let shorted = self.settings.inward(Input::Shorted);
        let mut noise = [Noise::default(); C];
        self.measure(edges, &shorted, scans, |_, counts| {
            for (noise, count) in noise.iter_mut().zip(counts) {
                noise.add(*count);
            }
        })
        .await?;
        let test = self.settings.inward(Input::Test);
        let mut waves = [Wave::default(); C];
        self.measure(edges, &test, scans, |scan, counts| {
            for (wave, count) in waves.iter_mut().zip(counts) {
                wave.add(scan, scans, *count);
            }
        })
        .await?;
        let measured = SelfTest {
            amplitude_v: waves.map(|wave| wave.amplitude_v(scans)),
            noise_v: noise.map(|noise| noise.rms_v()),
        };
        judge(&self.settings, &measured)?;
        self.initialise().await?;
        Ok(measured)
    }

    async fn measure(
        &mut self,
        edges: &mut impl DataReady,
        settings: &Settings<C>,
        scans: u32,
        mut take: impl FnMut(u32, &[i32; C]),
    ) -> Result<(), Ads129xError> {
        self.configure(settings).await?;
        for _ in 0..SETTLING_SCANS {
            self.next_sensed(edges, 0).await?;
        }
        for scan in 0..scans {
            let (_, conversion) = self.next_sensed(edges, 0).await?;
            take(scan, &conversion.counts);
        }
        Ok(())
    }
}

fn judge<const C: usize>(
    settings: &Settings<C>,
    measured: &SelfTest<C>,
) -> Result<(), SelfTestError> {
    let values = measured.amplitude_v.iter().zip(&measured.noise_v);
    for ((channel, input), (amplitude_v, noise_v)) in (1..).zip(&settings.inputs).zip(values) {
        if *input == Input::Off {
            continue;
        }
        if *noise_v > NOISE_LIMIT_V {
            return Err(SelfTestError::Noise {
                channel,
                limit_v: NOISE_LIMIT_V,
                got_v: *noise_v,
            });
        }
        if (amplitude_v - TEST_V).abs() > TEST_TOLERANCE * TEST_V {
            return Err(SelfTestError::Amplitude {
                channel,
                expected_v: TEST_V,
                got_v: *amplitude_v,
            });
        }
    }
    Ok(())
}

/// Volts per count at gain 6, at which the self-test measures.
fn step_v() -> f32 {
    Gain::X6.step_v() as f32
}

/// Sums of differences from the first count: 1024 squares of 25 bits fit 64.
#[derive(Clone, Copy, Default)]
struct Noise {
    first: Option<i32>,
    scans: i64,
    sum: i64,
    squares: i64,
}

impl Noise {
    fn add(&mut self, count: i32) {
        let difference = i64::from(count) - i64::from(*self.first.get_or_insert(count));
        self.scans += 1;
        self.sum += difference;
        self.squares += difference * difference;
    }

    fn rms_v(&self) -> f32 {
        let n = self.scans.max(1) as f32;
        let mean = self.sum as f32 / n;
        libm::sqrtf((self.squares as f32 / n - mean * mean).max(0.0)) * step_v()
    }
}

/// Correlation with a square wave, and with the same a quarter period later.
#[derive(Clone, Copy, Default)]
struct Wave {
    in_phase: i64,
    quadrature: i64,
}

impl Wave {
    fn add(&mut self, scan: u32, period: u32, count: i32) {
        let quarter = scan % period / (period / 4);
        let count = i64::from(count);
        self.in_phase += if quarter < 2 { count } else { -count };
        self.quadrature += if quarter == 1 || quarter == 2 {
            count
        } else {
            -count
        };
    }

    fn amplitude_v(&self, scans: u32) -> f32 {
        let sum = self.in_phase.abs() + self.quadrature.abs();
        sum as f32 / scans as f32 * step_v()
    }
}

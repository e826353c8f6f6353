//! Reads the attitude sensor for ever, and mends what fails.

use embedded_hal_async::{delay::DelayNs, i2c::I2c};

use super::{Imu, ImuError, Motion, RATE_HZ};

/// Between two readings.
const PERIOD_US: u32 = 1_000_000 / RATE_HZ;
/// Readings without a new measurement after which the sensor is set up again: 0.1 s.
const STALLED_POLLS: u32 = RATE_HZ / 10;
/// Faults in a row after which the sensor counts as failed.
const ATTEMPTS: u32 = 5;
/// Good measurements after which faults before them are forgotten.
const HEALTHY: u32 = 20;
/// Between a fault and the next attempt.
const SOON_MS: u32 = 10;
/// Between attempts of a sensor that failed.
const LATER_MS: u32 = 1_000;

/// What comes from the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImuEvent {
    /// A measurement.
    Motion {
        /// What was measured.
        motion: Motion,
        /// Device time at which it was read, us: at most one period after it was measured.
        acquired_us: u64,
    },
    /// Something went wrong; it is being mended.
    Fault(ImuError),
    /// Mending did not help five times in a row. It is tried, and told, every second.
    Failed(ImuError),
}

/// Sets the sensor up and reads it [`RATE_HZ`] times a second for ever; `now_us` is the device clock.
pub async fn sample<B: I2c, D: DelayNs>(
    imu: &mut Imu<B, D>,
    delay: &mut impl DelayNs,
    mut now_us: impl FnMut() -> u64,
    mut sink: impl FnMut(ImuEvent),
) -> ! {
    let mut faults = 0_u32;
    loop {
        let error = match imu.initialise().await {
            Ok(()) => poll(imu, delay, &mut now_us, &mut faults, &mut sink).await,
            Err(error) => error,
        };
        faults = faults.saturating_add(1);
        if faults < ATTEMPTS {
            sink(ImuEvent::Fault(error));
            delay.delay_ms(SOON_MS).await;
        } else {
            sink(ImuEvent::Failed(error));
            delay.delay_ms(LATER_MS).await;
        }
    }
}

/// Reads until the sensor has to be set up again, and says why.
async fn poll<B: I2c, D: DelayNs>(
    imu: &mut Imu<B, D>,
    delay: &mut impl DelayNs,
    now_us: &mut impl FnMut() -> u64,
    faults: &mut u32,
    sink: &mut impl FnMut(ImuEvent),
) -> ImuError {
    let (mut good, mut silent) = (0_u32, 0_u32);
    loop {
        delay.delay_us(PERIOD_US).await;
        let motion = match imu.measure().await {
            Ok(Some(motion)) => motion,
            Ok(None) if silent + 1 < STALLED_POLLS => {
                silent += 1;
                continue;
            }
            Ok(None) => {
                return ImuError::Stalled {
                    polls: STALLED_POLLS,
                };
            }
            Err(error) => return error,
        };
        silent = 0;
        good = good.saturating_add(1);
        if good == HEALTHY {
            *faults = 0;
        }
        sink(ImuEvent::Motion {
            motion,
            acquired_us: now_us(),
        });
    }
}

#[cfg(test)]
mod tests;

//! The attitude sensor: measurements to attitudes for the signal path.

use embassy_nrf::twim::{self, Twim};
use embassy_time::{Delay, Instant};
use tonus_firmware::imu::{self, Imu, ImuEvent, attitude::Attitude};
use tonus_shared::wire::StatusFlags;

use crate::{
    ATTITUDE, VITALS,
    board::{self, Irqs},
    watchdog::Handle,
};

/// Longest transfer out of the chip's RAM: a register's address and its value.
const TRANSFER_BYTES: usize = 2;

/// Of the attitudes, every so many-th is passed on: 104 a second, as often as the stream.
const EVERY: u32 = 2;

/// Measures for ever.
#[embassy_executor::task]
pub(crate) async fn follow(parts: board::AttitudeSensor, mut handle: Handle) {
    let mut buffer = [0; TRANSFER_BYTES];
    let mut config = twim::Config::default();
    config.frequency = twim::Frequency::K400;
    let bus = Twim::new(
        parts.bus,
        Irqs,
        parts.data,
        parts.clock,
        config,
        &mut buffer,
    );
    let mut sensor = Imu::new(bus, Delay, board::ATTITUDE_MODEL, board::ATTITUDE_ADDRESS);
    let Ok(mut attitude) = Attitude::new(board::MOUNTING, imu::RATE_HZ as f32) else {
        defmt::error!("the sensor's mounting is no rotation");
        return;
    };
    let mut measured = 0_u32;
    let now_us = || Instant::now().as_micros();
    imu::sample(&mut sensor, &mut Delay, now_us, |event| {
        handle.pet();
        let failed = match event {
            ImuEvent::Motion {
                motion,
                acquired_us,
            } => {
                // What is no number is no attitude: the one before stands, and ages.
                let attitude = attitude.push(&motion, acquired_us);
                measured = measured.wrapping_add(1);
                if let Ok(Some(xyzw)) = attitude
                    && measured.is_multiple_of(EVERY)
                {
                    ATTITUDE.signal((xyzw, acquired_us));
                }
                false
            }
            ImuEvent::Fault(error) => {
                defmt::warn!("attitude sensor: {}", error);
                return;
            }
            ImuEvent::Failed(error) => {
                defmt::error!("attitude sensor: {}", error);
                true
            }
        };
        VITALS.set(StatusFlags::ATTITUDE_SENSOR_FAILED, failed);
    })
    .await
}

use std::future::pending;

use embassy_futures::{block_on, poll_once};
use embedded_hal::i2c::{ErrorKind, ErrorType, NoAcknowledgeSource, Operation};
use embedded_hal_mock::eh1::{
    delay::{CheckedDelay, NoopDelay, Transaction as Wait},
    i2c::{Mock, Transaction},
};

use super::*;

fn read(register: u8, value: u8) -> Transaction {
    Transaction::write_read(0x6a, vec![register], vec![value])
}

fn write(register: u8, value: u8) -> Transaction {
    Transaction::write(0x6a, vec![register, value])
}

fn initialise(model: Model, traffic: &[Transaction]) -> Result<(), ImuError> {
    let mut bus = Mock::new(traffic);
    let mut imu = Imu::new(bus.clone(), NoopDelay::new(), model, Address::Low);
    let outcome = block_on(imu.initialise());
    bus.done();
    outcome
}

/// Bytes from the register tables of both datasheets.
fn sound(id: u8) -> Vec<Transaction> {
    vec![
        read(0x0f, id),
        write(0x12, 0x01),
        read(0x12, 0x05), // Still in reset; IF_INC is set by default.
        read(0x12, 0x04),
        write(0x12, 0x44),
        read(0x12, 0x44),
        write(0x10, 0x58),
        read(0x10, 0x58),
        write(0x11, 0x58),
        read(0x11, 0x58),
    ]
}

#[test]
fn both_chips_are_set_up_with_these_bytes() {
    assert_eq!(initialise(Model::Lsm6dso, &sound(0x6c)), Ok(()));
    assert_eq!(initialise(Model::Lsm6ds3trC, &sound(0x6a)), Ok(()));
}

#[test]
fn it_waits_for_the_boot_and_the_reset() {
    let mut bus = Mock::new(&sound(0x6c));
    let mut delay = CheckedDelay::new(&[
        Wait::async_delay_ms(20),
        Wait::async_delay_us(100),
        Wait::async_delay_us(100),
    ]);
    let mut imu = Imu::new(bus.clone(), delay.clone(), Model::Lsm6dso, Address::Low);
    assert_eq!(block_on(imu.initialise()), Ok(()));
    bus.done();
    delay.done();
}

#[test]
fn the_other_chip_is_refused() {
    let expected = ImuError::WrongId {
        expected: 0x6a,
        got: 0x6c,
    };
    assert_eq!(
        initialise(Model::Lsm6ds3trC, &[read(0x0f, 0x6c)]),
        Err(expected)
    );
}

#[test]
fn a_register_that_does_not_hold_and_a_reset_that_does_not_end() {
    let mut traffic = sound(0x6c);
    traffic.truncate(7);
    traffic.push(read(0x10, 0x50));
    let expected = ImuError::ReadBack {
        register: 0x10,
        expected: 0x58,
        got: 0x50,
    };
    assert_eq!(initialise(Model::Lsm6dso, &traffic), Err(expected));

    let mut traffic = vec![read(0x0f, 0x6c), write(0x12, 0x01)];
    traffic.extend(vec![read(0x12, 0x05); 10]);
    assert_eq!(initialise(Model::Lsm6dso, &traffic), Err(ImuError::InReset));
}

fn measure(burst: &[u8; 16]) -> Result<Option<Motion>, ImuError> {
    let mut bus = Mock::new(&[Transaction::write_read(0x6b, vec![0x1e], burst.to_vec())]);
    let mut imu = Imu::new(bus.clone(), NoopDelay::new(), Model::Lsm6dso, Address::High);
    let outcome = block_on(imu.measure());
    bus.done();
    outcome
}

#[test]
fn literal_codes_in_one_burst() {
    // STATUS, empty, temperature, rates 1000h, F000h, 7FFFh, accelerations 2004h, DFFCh, 8000h.
    let burst = [
        0x07, 0x00, 0x12, 0x34, 0x00, 0x10, 0x00, 0xf0, 0xff, 0x7f, 0x04, 0x20, 0xfc, 0xdf, 0x00,
        0x80,
    ];
    let motion = measure(&burst).unwrap().unwrap();
    // 4096 x 35 mdps = 143.36 deg/s = 2.502104 rad/s; 32767 x 35 mdps = 1146.845 deg/s = 20.016222 rad/s.
    let rates = [2.502_104, -2.502_104, 20.016_22];
    for (got, expected) in motion.rate_rad_s.iter().zip(rates) {
        assert!((got - expected).abs() < 2e-5, "{got} rad/s");
    }
    // 8196 x 0.122 mg = 0.999912 g = 9.805787 m/s2; -32768 x 0.122 mg = -3.997696 g = -39.204006 m/s2.
    let accelerations = [9.805_787, -9.805_787, -39.204_01];
    for (got, expected) in motion.acceleration_m_s2.iter().zip(accelerations) {
        assert!((got - expected).abs() < 2e-5, "{got} m/s2");
    }
}

#[test]
fn nothing_new_is_no_measurement() {
    for status in [0x00, 0x01, 0x02, 0x04] {
        let mut burst = [0x55; 16];
        burst[0] = status;
        assert_eq!(measure(&burst), Ok(None));
    }
}

#[test]
fn a_bus_error_is_passed_on_and_the_sensor_can_be_set_up_again() {
    let missing = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    let burst = Transaction::write_read(0x6a, vec![0x1e], vec![0; 16]);
    let mut traffic = vec![burst.with_error(missing)];
    traffic.extend(sound(0x6c));
    let mut bus = Mock::new(&traffic);
    let mut imu = Imu::new(bus.clone(), NoopDelay::new(), Model::Lsm6dso, Address::Low);
    assert_eq!(block_on(imu.measure()), Err(ImuError::I2c(missing)));
    assert_eq!(block_on(imu.initialise()), Ok(()));
    bus.done();
}

/// A bus whose clock line is held low.
struct Held;

impl ErrorType for Held {
    type Error = ErrorKind;
}

impl I2c for Held {
    async fn transaction(
        &mut self,
        _address: u8,
        _operations: &mut [Operation<'_>],
    ) -> Result<(), ErrorKind> {
        pending().await
    }
}

#[test]
fn a_held_bus_is_given_up() {
    let mut imu = Imu::new(Held, NoopDelay::new(), Model::Lsm6dso, Address::Low);
    let stuck = Err(ImuError::I2cStuck { limit_us: 5_000 });
    assert_eq!(block_on(imu.measure()), stuck);
    let mut held = Held;
    assert!(poll_once(held.read(0x6a, &mut [0])).is_pending());
}

use std::{
    cell::{Cell, RefCell},
    future::{Future, pending},
    pin::pin,
    rc::Rc,
    task::{Context, Waker},
};

use embassy_futures::yield_now;
use embedded_hal::i2c::{ErrorKind, ErrorType, Operation};

use super::super::{Address, Model};
use super::*;

#[derive(Clone, Copy, PartialEq)]
enum Trouble {
    None,
    NoAnswer,
    Hangs,
    Silent,
}

/// A sensor, its bus and the time.
#[derive(Clone)]
struct Sensor {
    now_us: Rc<Cell<u64>>,
    trouble: Rc<Cell<Trouble>>,
    registers: Rc<RefCell<[u8; 0x40]>>,
}

impl Sensor {
    fn new() -> Self {
        let sensor = Self {
            now_us: Rc::default(),
            trouble: Rc::new(Cell::new(Trouble::None)),
            registers: Rc::new(RefCell::new([0; 0x40])),
        };
        sensor.registers.borrow_mut()[0x0f] = 0x6a;
        sensor
    }
}

impl DelayNs for Sensor {
    async fn delay_ns(&mut self, ns: u32) {
        self.now_us.set(self.now_us.get() + u64::from(ns / 1_000));
        yield_now().await;
    }
}

impl ErrorType for Sensor {
    type Error = ErrorKind;
}

impl I2c for Sensor {
    async fn transaction(
        &mut self,
        _address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), ErrorKind> {
        match self.trouble.get() {
            Trouble::NoAnswer => return Err(ErrorKind::Bus),
            Trouble::Hangs => pending().await,
            Trouble::None | Trouble::Silent => {}
        }
        let mut registers = self.registers.borrow_mut();
        // Both sensors run: acceleration of 2000h along z, 1 g and a little.
        let running = registers[0x10] == 0x58 && registers[0x11] == 0x58;
        let new = running && self.trouble.get() == Trouble::None;
        registers[0x1e] = if new { 0x03 } else { 0x00 };
        registers[0x2d] = 0x20;
        match operations {
            [Operation::Write([register, value])] => {
                registers[usize::from(*register)] = if *register == 0x12 && *value == 0x01 {
                    0x04
                } else {
                    *value
                };
            }
            [Operation::Write([register]), Operation::Read(values)] => {
                let first = usize::from(*register);
                values.copy_from_slice(&registers[first..first + values.len()]);
            }
            other => panic!("not simulated: {other:?}"),
        }
        Ok(())
    }
}

/// Runs through troubles, each until its time in ms.
fn sampled(steps: &[(u64, Trouble)]) -> Vec<(u64, ImuEvent)> {
    let sensor = Sensor::new();
    let mut imu = Imu::new(
        sensor.clone(),
        sensor.clone(),
        Model::Lsm6ds3trC,
        Address::Low,
    );
    let mut delay = sensor.clone();
    let now_us = || sensor.now_us.get();
    let seen = RefCell::new(Vec::new());
    {
        let sink = |event| seen.borrow_mut().push((now_us(), event));
        let mut task = pin!(sample(&mut imu, &mut delay, now_us, sink));
        let mut context = Context::from_waker(Waker::noop());
        for (until_ms, trouble) in steps {
            sensor.trouble.set(*trouble);
            while now_us() < until_ms * 1_000 {
                assert!(task.as_mut().poll(&mut context).is_pending());
            }
        }
    }
    seen.into_inner()
}

fn split(seen: &[(u64, ImuEvent)]) -> (usize, Vec<ImuEvent>) {
    let troubles = seen
        .iter()
        .filter(|(_, event)| !matches!(event, ImuEvent::Motion { .. }));
    let troubles: Vec<_> = troubles.map(|(_, event)| *event).collect();
    (seen.len() - troubles.len(), troubles)
}

#[test]
fn a_sound_sensor_is_read_208_times_a_second() {
    let seen = sampled(&[(1_000, Trouble::None)]);
    let (motions, troubles) = split(&seen);
    assert_eq!(troubles, []);
    assert!((200..=208).contains(&motions), "{motions}");
    for (now_us, event) in seen {
        let ImuEvent::Motion {
            motion,
            acquired_us,
        } = event
        else {
            unreachable!();
        };
        assert_eq!(acquired_us, now_us);
        // 8192 x 0.122 mg = 0.999424 g.
        assert!((motion.acceleration_m_s2[2] - 9.801).abs() < 1e-3);
    }
}

#[test]
fn troubles_are_told_mended_and_given_up_in_time() {
    let cases = [
        (Trouble::NoAnswer, ImuError::I2c(ErrorKind::Bus)),
        (Trouble::Hangs, ImuError::I2cStuck { limit_us: 5_000 }),
        (Trouble::Silent, ImuError::Stalled { polls: 20 }),
    ];
    for (trouble, error) in cases {
        // Short: mended.
        let seen = sampled(&[(500, Trouble::None), (610, trouble), (1_500, Trouble::None)]);
        let (motions, troubles) = split(&seen);
        assert!(!troubles.is_empty() && troubles.len() < 5, "{troubles:?}");
        assert!(troubles.iter().all(|told| *told == ImuEvent::Fault(error)));
        assert!((220..300).contains(&motions), "{motions}");
        // Long: failed, told every second, and back at its end.
        let seen = sampled(&[
            (500, Trouble::None),
            (5_000, trouble),
            (7_000, Trouble::None),
        ]);
        let (_, troubles) = split(&seen);
        let (soon, later) = troubles.split_at(4);
        assert_eq!(soon, [ImuEvent::Fault(error); 4]);
        assert!((3..=5).contains(&later.len()), "{later:?}");
        assert!(later.iter().all(|told| *told == ImuEvent::Failed(error)));
        let last = seen.last().unwrap();
        assert!(last.0 > 6_990_000 && matches!(last.1, ImuEvent::Motion { .. }));
    }
}

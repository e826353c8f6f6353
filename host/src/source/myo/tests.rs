use std::time::Duration;

use tonus_shared::wire::{Packet, decode};

use super::*;
use crate::link::ble::{AskPasskey, Found, Notified, Parameters};
use crate::live::{Inputs, SessionClock};

/// An armband on a relaxed arm that hangs, x up and the logo (z) forward: half a turn about the axis between them.
/// Every 10 ms it notifies of one or the other.
struct Hanging {
    notified: u32,
    since: tokio::time::Instant,
}

const HALF: [u8; 2] = [0x41, 0x2d];
const ONE_G: [u8; 2] = [0x00, 0x08];

fn attitude() -> Vec<u8> {
    let mut bytes = vec![0; 20];
    bytes[2..4].copy_from_slice(&HALF);
    bytes[6..8].copy_from_slice(&HALF);
    bytes[8..10].copy_from_slice(&ONE_G);
    bytes
}

impl Central for Hanging {
    async fn scan(
        &mut self,
        _: Duration,
        _: &dyn Fn(&Found) -> bool,
    ) -> Result<Vec<Found>, BleError> {
        Ok(vec![Found {
            id: "01:02".to_owned(),
            name: Some("My Myo".to_owned()),
            services: vec![myo::SERVICE],
            rssi_dbm: Some(-50),
        }])
    }
    async fn connect(&mut self, _: &Found) -> Result<(), BleError> {
        Ok(())
    }
    async fn parameters(&mut self) -> Result<Parameters, BleError> {
        Ok(Parameters {
            mtu: 23,
            interval_us: None,
        })
    }
    async fn pair(&mut self, _: &AskPasskey) -> Result<(), BleError> {
        Ok(())
    }
    async fn subscribe(&mut self, _: u128) -> Result<(), BleError> {
        Ok(())
    }
    async fn write(&mut self, _: u128, _: &[u8], _: bool) -> Result<(), BleError> {
        Ok(())
    }
    async fn notified(&mut self) -> Result<Notified, BleError> {
        // Whoever stops waiting and begins again waits no longer.
        tokio::time::sleep_until(self.since + Duration::from_millis(5) * self.notified).await;
        self.notified += 1;
        let (characteristic, value) = match self.notified % 2 {
            0 => (myo::IMU, attitude()),
            _ => (myo::SEMG[self.notified as usize / 2 % 4], vec![0; 16]),
        };
        Ok(Notified {
            characteristic,
            value,
        })
    }
    async fn leave(&mut self) {}
}

/// Attitudes that come within this time.
fn attitudes(inputs: &Inputs, limit: Duration) -> Vec<[f32; 4]> {
    let (begun, mut all) = (Instant::now(), Vec::new());
    while begun.elapsed() < limit {
        let timed = inputs.next(Duration::from_millis(20));
        if let Some(Input::Frame(bytes)) = timed.map(|timed| timed.input)
            && let Packet::Orientation(told) = decode(&bytes).unwrap().packet
        {
            all.push(told.xyzw);
        }
    }
    all
}

#[test]
fn the_step_in_which_the_elbow_is_bent_shows_how_the_armband_sits() {
    let inputs = Inputs::new(SessionClock::start());
    let (port, plug) = inputs.port();
    let running = std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .build()
            .unwrap();
        let mut armband = Armband::new(7).unwrap();
        runtime.block_on(async {
            let since = tokio::time::Instant::now();
            let mut hanging = Hanging { notified: 0, since };
            over(&mut hanging, &mut armband, &port).await;
        });
    });
    plug.ask(Request::Prompt(Prompt::Rest));
    assert_eq!(
        attitudes(&inputs, Duration::from_millis(2_500)),
        [[0.0; 4]; 0]
    );
    // What is asked for next ends it.
    plug.ask(Request::Prompt(Prompt::Flex));
    assert_eq!(
        attitudes(&inputs, Duration::from_millis(500)),
        [[0.0; 4]; 0]
    );
    plug.ask(Request::Prompt(Prompt::Extend));
    assert_eq!(
        attitudes(&inputs, Duration::from_millis(2_500)),
        [[0.0; 4]; 0]
    );
    plug.ask(Request::Prompt(Prompt::Flex));
    let came = attitudes(&inputs, Duration::from_millis(3_500));
    plug.stop();
    running.join().unwrap();
    assert!(came.len() > 20, "{}", came.len());
    for [x, y, z, w] in came {
        assert!(
            x.hypot(y).hypot(z) < 1e-3 && (w.abs() - 1.0).abs() < 1e-6,
            "{x} {y} {z} {w}"
        );
    }
}

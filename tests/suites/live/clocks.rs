//! The wearable's clock in session time, as the page shows it, against the truth of the simulation.

use std::collections::VecDeque;

use tonus::link::simulated::LinkConditions;
use tonus::live::{Act, Input, View};
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::virtually::Someone;
use tonus_shared::wire::{Packet, SequenceTracker, decode};

use crate::world::run;

#[derive(Default)]
struct Compared {
    /// Device times of the stream packets that came in order.
    devices_us: VecDeque<u64>,
    sequence: SequenceTracker,
    errors_us: Vec<f64>,
    rate_ppm: f64,
    pending: Vec<(u64, f64)>,
}

impl Someone for Compared {
    fn input(&mut self, _at_us: u64, input: &Input) {
        let Input::Frame(bytes) = input else { return };
        let Ok(frame) = decode(bytes) else { return };
        let header = frame.header;
        let newest = self
            .sequence
            .observe(header.boot_id, header.sequence)
            .is_newest();
        if newest && matches!(frame.packet, Packet::Stream(_)) {
            self.devices_us.push_back(header.device_us);
        }
    }

    fn look(&mut self, view: &View) -> Vec<Act> {
        for at_s in &view.trace.t_s {
            let device_us = self
                .devices_us
                .pop_front()
                .expect("one for each sample shown");
            self.pending.push((device_us, *at_s));
        }
        self.rate_ppm = view.clock.as_ref().map_or(0.0, |clock| clock.rate_ppm);
        Vec::new()
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        for (device_us, at_s) in self.pending.drain(..) {
            if now_us > 30_000_000 {
                let truly_us = devices.truly_us(device_us);
                self.errors_us.push(at_s * 1e6 - truly_us as f64);
            }
        }
    }
}

#[test]
fn clocks_agree_to_a_millisecond_after_half_a_minute() {
    for (seed, drift_ppm) in [(1, 100.0), (2, -100.0), (3, 20.0)] {
        let devices = SimulatedConfig {
            seed,
            drift_ppm,
            link: LinkConditions {
                loss: 0.05,
                // Two connection intervals of 7.5 ms.
                jitter_us: 15_000,
                ..LinkConditions::default()
            },
            ..SimulatedConfig::default()
        };
        let compared = run(devices, Compared::default(), 60);
        let mut sizes: Vec<f64> = compared.errors_us.iter().map(|us| us.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let p95_us = sizes[sizes.len() * 95 / 100];
        println!(
            "{drift_ppm} ppm: found {:.1}, p95 {p95_us:.0} us of {}",
            compared.rate_ppm,
            sizes.len()
        );
        assert!(sizes.len() > 2_000);
        assert!(p95_us <= 1_000.0, "{p95_us} us at {drift_ppm} ppm");
        assert!((compared.rate_ppm - drift_ppm).abs() < 20.0);
    }
}

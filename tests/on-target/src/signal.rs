//! The wearable's signal path.

use core::hint::black_box;

use tonus_shared::pipeline::{
    ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Pipeline, PipelineConfig,
};
use tonus_shared::sample::{AdcScale, Scan};
use tonus_shared::semg::chain::ChainConfig;
use tonus_shared::stiffness::ArmStiffness;
use tonus_shared::wire::Muscle::{BicepsLong, BicepsShort, TricepsLateral, TricepsLong};

use crate::count::Counter;

const RATE_HZ: u32 = 1000;

/// A scan between two packets, and a whole second with all its packets.
pub(crate) fn count(counter: &mut Counter) {
    let mut pipeline = Pipeline::new(&PipelineConfig {
        boot_id: 1,
        firmware_hash: [0; 8],
        adc: AdcScale::new(1e-7, 0, -(1 << 23), (1 << 23) - 1).unwrap(),
        chain: ChainConfig::at_rate(f64::from(RATE_HZ)),
        channels: [BicepsShort, TricepsLateral, BicepsLong, TricepsLong].map(|muscle| {
            ChannelConfig {
                muscle,
                rest_v: 0.0,
                mvc_v: 1e-3,
            }
        }),
        activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
        arm: ArmStiffness::illustrative(),
        raw: false,
    })
    .unwrap();
    let (mut least, mut sum) = (u64::MAX, 0);
    for index in 0..RATE_HZ {
        let scan = Scan {
            index,
            acquired_us: u64::from(index) * 1_000_000 / u64::from(RATE_HZ),
            counts: [(index as i32 * 37) % 4000 - 2000; 4],
        };
        let ((), instructions) = counter.instructions(|| {
            pipeline.push_scan(black_box(&scan)).unwrap();
            while let Some(frame) = pipeline.next_frame() {
                black_box(&frame);
            }
        });
        least = least.min(instructions);
        sum += instructions;
    }
    counter.say("scan_4_channels_without_packet", least);
    counter.say("second_of_4_channels_with_packets", sum);
}

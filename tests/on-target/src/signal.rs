//! The wearable's signal path.

use core::hint::black_box;

use tonus_shared::pipeline::{
    ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Pipeline, PipelineConfig,
};
use tonus_shared::sample::{AdcScale, Scan};
use tonus_shared::semg::chain::{ChainConfig, NotchConfig};
use tonus_shared::semg::design::Mains;
use tonus_shared::stiffness::ArmStiffness;
use tonus_shared::wire::Muscle::{BicepsLong, BicepsShort, TricepsLateral, TricepsLong};

use crate::count::Counter;

const RATE_HZ: u32 = 1000;

/// High-pass, notch, rectifier, low-pass, quality and activation of a scan between two packets, the mean of a second
/// (the ends of its quality blocks included); and the second with all its packets.
#[inline(never)]
pub(crate) fn count(counter: &mut Counter) {
    let mut pipeline = Pipeline::new(&PipelineConfig {
        boot_id: 1,
        firmware_hash: [0; 8],
        adc: AdcScale::new(1e-7, 0, -(1 << 23), (1 << 23) - 1).unwrap(),
        chain: ChainConfig {
            notch: Some(NotchConfig {
                mains: Mains::Hz50,
                q: 30.0,
            }),
            ..ChainConfig::at_rate(f64::from(RATE_HZ))
        },
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
    let (mut quiet, mut quiet_scans, mut sum) = (0, 0, 0);
    for index in 0..RATE_HZ {
        let scan = Scan {
            index,
            acquired_us: u64::from(index) * 1_000_000 / u64::from(RATE_HZ),
            counts: [0, 1, 2, 3].map(|channel| (index as i32 * 37 + 500 * channel) % 4000 - 2000),
        };
        let ((), pushed) = counter.instructions(|| {
            pipeline.push_scan(black_box(&scan)).unwrap();
        });
        let (packets, taken) = counter.instructions(|| {
            let mut packets = 0;
            while let Some(frame) = pipeline.next_frame() {
                black_box(&frame);
                packets += 1;
            }
            packets
        });
        if packets == 0 {
            (quiet, quiet_scans) = (quiet + pushed, quiet_scans + 1);
        }
        sum += pushed + taken;
    }
    counter.say("scan_4_channels_mean_without_packet", quiet / quiet_scans);
    counter.say("second_of_4_channels_with_packets", sum);
}

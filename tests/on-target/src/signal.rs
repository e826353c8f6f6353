//! The wearable's signal path.

use core::hint::black_box;

use tonus_shared::pipeline::{
    ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Pipeline, PipelineConfig,
};
use tonus_shared::sample::{AdcScale, Scan};
use tonus_shared::semg::activation::{Activation, ActivationState};
use tonus_shared::semg::chain::{Chain, ChainConfig, ChainState, NotchConfig};
use tonus_shared::semg::design::Mains;
use tonus_shared::semg::quality::{QualityMonitor, QualityState};
use tonus_shared::stiffness::ArmStiffness;
use tonus_shared::wire::Muscle::{BicepsLong, BicepsShort, TricepsLateral, TricepsLong};

use crate::count::Counter;

const RATE_HZ: u32 = 1000;

fn config() -> PipelineConfig<4> {
    PipelineConfig {
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
    }
}

fn scan(index: u32) -> Scan<4> {
    Scan {
        index,
        acquired_us: u64::from(index) * 1_000_000 / u64::from(RATE_HZ),
        counts: [0, 1, 2, 3].map(|channel| (index as i32 * 37 + 500 * channel) % 4000 - 2000),
    }
}

#[inline(never)]
pub(crate) fn count(counter: &mut Counter) {
    scans(counter);
    packets(counter);
}

/// High-pass, notch, rectifier, low-pass, quality and activation of a scan: the mean of a second, with the ends of its
/// quality blocks.
#[inline(never)]
fn scans(counter: &mut Counter) {
    let config = config();
    let chain = Chain::<f32>::design(&config.chain).unwrap();
    let monitor = QualityMonitor::new(f64::from(RATE_HZ), config.adc).unwrap();
    let activation = Activation::new([true; 4], 151).unwrap();
    let (mut states, mut qualities) = ([ChainState::new(); 4], [QualityState::new(); 4]);
    let mut window = ActivationState::new();
    let volts_per_count = config.adc.volts_per_count() as f32;
    let mut sum = 0;
    for index in 0..RATE_HZ {
        let scan = scan(index);
        let (_, instructions) = counter.instructions(|| {
            let counts = black_box(&scan).counts;
            for (quality, count) in qualities.iter_mut().zip(&counts) {
                black_box(monitor.step(quality, *count, false));
            }
            let volts = counts.map(|count| count as f32 * volts_per_count);
            let envelopes = chain.step_all(states.each_mut(), volts);
            let envelopes = envelopes.map(|envelope| envelope.unwrap());
            activation.step(&mut window, &envelopes).unwrap()
        });
        sum += instructions;
    }
    counter.say("scan_4_channels", sum / u64::from(RATE_HZ));
}

/// All that the pipeline does with a scan between two packets, the mean; and a second with all its packets.
#[inline(never)]
fn packets(counter: &mut Counter) {
    let mut pipeline = Pipeline::new(&config()).unwrap();
    let (mut quiet, mut quiet_scans, mut sum) = (0, 0, 0);
    for index in 0..RATE_HZ {
        let scan = scan(index);
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
    counter.say(
        "pipeline_scan_4_channels_without_packet",
        quiet / quiet_scans,
    );
    counter.say("pipeline_second_4_channels", sum);
}

//! What the golden frames hold, as packets.

use tonus_shared::wire::{
    Configuration, HandPosition, Inference, Muscle, Orientation, Packet, Ping, RawSemg,
    ResetReason, SkillPosterior, Status, StatusFlags,
};
use tonus_tests::frames::{golden_management, golden_stream, quality};

/// The packets that the golden script wrote, in its order.
pub(super) fn golden_packets() -> Vec<Packet> {
    let [first, second] = golden_configurations().map(Packet::Configuration);
    vec![
        first,
        second,
        golden_stream(),
        Packet::RawSemg(RawSemg {
            first_index: 0xFFFF_FFFE,
            channels: 3,
            counts: [0, 1, -1, 8_388_607, -8_388_608, 1_000]
                .into_iter()
                .collect(),
        }),
        Packet::RawSemg(RawSemg {
            first_index: 9,
            channels: 8,
            counts: (0..72).map(|n| 1_000 * n - 36_000).collect(),
        }),
        Packet::Orientation(Orientation {
            xyzw: [0.5, -0.5, 0.5, -0.5],
        }),
        Packet::HandPosition(HandPosition {
            position_m: Some([0.25, -0.4, 0.125]),
        }),
        Packet::HandPosition(HandPosition { position_m: None }),
        Packet::Ping(Ping::Request {
            id: 77,
            requested_us: 123_456_789_012,
        }),
        Packet::Ping(Ping::Reply {
            id: 77,
            requested_us: 123_456_789_012,
            received_us: 5_000_000,
            replied_us: 5_000_250,
        }),
        golden_inference(),
    ]
    .into_iter()
    .chain(golden_statuses().map(Packet::Status))
    .chain(golden_management())
    .collect()
}

fn golden_configurations() -> [Configuration; 2] {
    use Muscle::{Absent, BicepsLong, BicepsShort, Other, TricepsLateral, TricepsLong};
    [
        Configuration {
            semg_hz: 1111.11,
            stream_hz: 100.0,
            volts_per_count: 2.5e-6,
            offset_counts: -7,
            chain_delay_us: 63_500,
            channels: 4,
            muscles: [
                BicepsShort,
                BicepsLong,
                TricepsLateral,
                TricepsLong,
                Absent,
                Absent,
                Absent,
                Absent,
            ],
            mains_hz: Some(50),
            raw: true,
            firmware_hash: [0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7],
        },
        Configuration {
            semg_hz: 200.0,
            stream_hz: 100.0,
            volts_per_count: 1.0,
            offset_counts: 0,
            chain_delay_us: 85_000,
            channels: 8,
            muscles: [
                Other,
                Other,
                Other,
                Other,
                BicepsShort,
                BicepsLong,
                TricepsLateral,
                TricepsLong,
            ],
            mains_hz: None,
            raw: false,
            firmware_hash: [0; 8],
        },
    ]
}

fn golden_inference() -> Packet {
    let top = [(2, -0.0625), (0, -2.75)].map(|(skill, log_posterior)| SkillPosterior {
        skill,
        log_posterior,
    });
    Packet::Inference(Inference {
        skills: 3,
        top: top.into_iter().collect(),
        phase: 0.375,
        stiffness_n_per_m: [410.0, 380.5, 120.25],
    })
}

pub(super) fn golden_statuses() -> [Status; 2] {
    [
        Status {
            uptime_s: 3_600,
            battery_mv: Some(3_987),
            reset_reason: ResetReason::Watchdog,
            overruns: 1,
            gaps: 2,
            missed_scans: 30,
            refused: 4,
            dropped_packets: 5,
            quality: quality([0, 1, 2, 4, 8, 15, 0, 0]),
            flags: StatusFlags::LOW_BATTERY
                .with(StatusFlags::LAST_WORDS_WAIT, true)
                .with(StatusFlags::FRONT_END_FAILED, false)
                .with(StatusFlags::NO_MODEL, true),
            dropped_hypotheses: 70_000,
            refused_requests: 8,
            links: 513,
            lost_reports: 9,
        },
        Status {
            uptime_s: 1,
            battery_mv: None,
            reset_reason: ResetReason::Unknown,
            overruns: 0,
            gaps: 0,
            missed_scans: 0,
            refused: 0,
            dropped_packets: 0,
            quality: quality([0; 8]),
            flags: StatusFlags::default(),
            dropped_hypotheses: 0,
            refused_requests: 0,
            links: 0,
            lost_reports: 0,
        },
    ]
}

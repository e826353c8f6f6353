//! Any packet that may be sent.

use proptest::array::{uniform3, uniform4, uniform8};
use proptest::prelude::*;
use tonus_shared::wire::{
    ActiveModel, Calibration, Configuration, Control, HandPosition, Inference, LastWords,
    ModelState, ModelUpload, Muscle, Orientation, Packet, Ping, RawSemg, Reception, Refusal, Reply,
    ResetReason, SkillPosterior, Status, StatusFlags, Stream, StreamFlags, TABLE,
};
use tonus_tests::frames::quality;

fn used_slots<T: Copy + Default>(channels: u8, mut slots: [T; 8]) -> [T; 8] {
    slots[usize::from(channels)..].fill(T::default());
    slots
}

pub(super) fn any_stream() -> impl Strategy<Value = Packet> {
    (
        1_u8..=8,
        any::<u32>(),
        uniform8(0_f32..1e3),
        (0_f32..4e3, 1_f32..1e3),
        uniform3(1e-3_f32..1e6),
        uniform8(0_u8..16).prop_map(quality),
        0_u16..256,
    )
        .prop_map(
            |(
                channels,
                describes_before_us,
                envelopes,
                factors,
                stiffness_n_per_m,
                quality,
                flags,
            )| {
                Packet::Stream(Stream {
                    describes_before_us,
                    envelopes: used_slots(channels, envelopes),
                    activation: factors.0,
                    co_contraction: factors.1,
                    stiffness_n_per_m,
                    quality: used_slots(channels, quality),
                    channels,
                    flags: StreamFlags::from_bits(flags),
                })
            },
        )
}

fn any_muscle() -> impl Strategy<Value = Muscle> {
    prop_oneof![
        Just(Muscle::BicepsShort),
        Just(Muscle::BicepsLong),
        Just(Muscle::TricepsLateral),
        Just(Muscle::TricepsLong),
        Just(Muscle::Other),
    ]
}

pub(super) fn any_calibration() -> impl Strategy<Value = Packet> {
    (
        (1_u8..=8, uniform8(any_muscle()), any::<u32>()),
        prop_oneof![Just(None), Just(Some(50)), Just(Some(60))],
        (uniform8(0_f32..1.0), uniform8(0_f32..1.0)),
        (1e-3_f32..1e5, 1e-6_f32..10.0, 0_f32..1e3, 1e-6_f32..1e6),
        (uniform4(1e-6_f32..1e3), 1e-3_f32..1e3, 1e-3_f32..10.0),
    )
        .prop_map(|(map, mains_hz, (rest_v, mvc_v), curve, body)| {
            let (channels, muscles, revision) = map;
            let (semg_hz, activation_window_s, l1, l2) = curve;
            let (rest_stiffness_nm_per_rad, body_mass_kg, body_height_m) = body;
            Packet::Calibration(Calibration {
                revision,
                channels,
                muscles: used_slots(channels, muscles),
                mains_hz,
                semg_hz,
                rest_v: used_slots(channels, rest_v),
                mvc_v: used_slots(channels, mvc_v),
                activation_window_s,
                l1,
                l2,
                rest_stiffness_nm_per_rad,
                body_mass_kg,
                body_height_m,
            })
        })
}

pub(super) fn any_upload() -> impl Strategy<Value = Packet> {
    let begin = (1_u32.., any::<[u8; 32]>()).prop_map(|(total_bytes, sha256)| ModelUpload::Begin {
        total_bytes,
        sha256,
    });
    let bytes = proptest::collection::vec(any::<u8>(), 1..=216);
    let piece = (0..=u32::MAX - 216, bytes).prop_map(|(offset_bytes, bytes)| ModelUpload::Piece {
        offset_bytes,
        bytes: bytes.into_iter().collect(),
    });
    let end = prop_oneof![Just(ModelUpload::Finish), Just(ModelUpload::Abandon)];
    prop_oneof![begin, piece, end].prop_map(Packet::ModelUpload)
}

pub(super) fn any_model_state() -> impl Strategy<Value = Packet> {
    let active =
        (any::<[u8; 8]>(), uniform4(1_u8..)).prop_map(|(hash, [skills, dofs, functions, rank])| {
            ActiveModel {
                hash,
                skills,
                dofs,
                functions,
                rank,
            }
        });
    let receiving = (any::<[u8; 8]>(), any::<[u32; 2]>());
    (
        proptest::option::of(active),
        proptest::option::of(receiving),
        1_u32..,
    )
        .prop_map(|(active, receiving, capacity_bytes)| {
            let receiving = receiving.map(|(hash, [received, total])| {
                let total_bytes = total % capacity_bytes + 1;
                Reception {
                    hash,
                    received_bytes: received % total_bytes,
                    total_bytes,
                }
            });
            Packet::ModelState(ModelState {
                active,
                receiving,
                capacity_bytes,
            })
        })
}

pub(super) fn any_answer() -> impl Strategy<Value = Packet> {
    let control = prop_oneof![
        any::<bool>().prop_map(Control::Raw),
        Just(Control::SendCalibration),
        Just(Control::SendModelState),
        any::<u32>().prop_map(|boot_id| Control::Restart { boot_id }),
        Just(Control::SendLastWords),
        Just(Control::FaceForward),
    ];
    let outcome = prop_oneof![
        Just(Ok(())),
        Just(Err(Refusal::Malformed)),
        Just(Err(Refusal::WrongState)),
        Just(Err(Refusal::TooLarge)),
        Just(Err(Refusal::HashMismatch)),
        Just(Err(Refusal::StorageFailed)),
        Just(Err(Refusal::NotFitting)),
        Just(Err(Refusal::Busy)),
    ];
    let reply = (0..TABLE.len(), any::<[u32; 2]>(), outcome).prop_map(
        |(row, [sequence, detail], outcome)| Reply {
            answered: TABLE[row].kind,
            sequence,
            outcome,
            detail,
        },
    );
    // A message of any length, cut wherever 128 bytes end.
    let words = any::<String>().prop_map(|text| LastWords::from_bytes(text.repeat(3).as_bytes()));
    prop_oneof![
        control.prop_map(Packet::Control),
        reply.prop_map(Packet::Reply),
        words.prop_map(Packet::LastWords),
    ]
}

pub(super) fn any_configuration() -> impl Strategy<Value = Packet> {
    (
        (1_u8..=8, uniform8(any_muscle())),
        (1_f32..1e5, 1_f32..1e4, 1e-9_f32..1.0),
        (any::<i32>(), any::<u32>()),
        (
            prop_oneof![Just(None), Just(Some(50)), Just(Some(60))],
            any::<bool>(),
            any::<[u8; 8]>(),
        ),
    )
        .prop_map(
            |(
                (channels, muscles),
                hz,
                (offset_counts, chain_delay_us),
                (mains_hz, raw, firmware_hash),
            )| {
                Packet::Configuration(Configuration {
                    semg_hz: hz.0,
                    stream_hz: hz.1,
                    volts_per_count: hz.2,
                    offset_counts,
                    chain_delay_us,
                    channels,
                    muscles: used_slots(channels, muscles),
                    mains_hz,
                    raw,
                    firmware_hash,
                })
            },
        )
}

pub(super) fn any_raw() -> impl Strategy<Value = Packet> {
    (1_u8..=8)
        .prop_flat_map(|channels| (Just(channels), 1..=72 / usize::from(channels), any::<u32>()))
        .prop_flat_map(|(channels, scans, first_index)| {
            let count = usize::from(channels) * scans;
            proptest::collection::vec(-(1 << 23)..1 << 23, count).prop_map(move |counts| {
                Packet::RawSemg(RawSemg {
                    first_index,
                    channels,
                    counts: counts.into_iter().collect(),
                })
            })
        })
}

pub(super) fn any_inference() -> impl Strategy<Value = Packet> {
    (1_u8..=255)
        .prop_flat_map(|skills| {
            let entry = (0..skills, -1e6_f32..=0.0);
            let most = usize::from(skills.min(4));
            (
                Just(skills),
                proptest::collection::vec(entry, 1..=most),
                0_f32..=1.0,
                uniform3(1e-3_f32..1e6),
            )
        })
        .prop_map(|(skills, mut top, phase, stiffness_n_per_m)| {
            top.sort_by(|a, b| b.1.total_cmp(&a.1));
            let entries = top
                .into_iter()
                .map(|(skill, log_posterior)| SkillPosterior {
                    skill,
                    log_posterior,
                });
            Packet::Inference(Inference {
                skills,
                top: entries.collect(),
                phase,
                stiffness_n_per_m,
            })
        })
}

pub(super) fn any_small() -> impl Strategy<Value = Packet> {
    let unit = uniform4(-1_f32..1.0)
        .prop_filter("a direction", |q| {
            q.iter().map(|x| x * x).sum::<f32>() > 0.01
        })
        .prop_map(|q| {
            let norm = q.iter().map(|x| x * x).sum::<f32>().sqrt();
            Packet::Orientation(Orientation {
                xyzw: q.map(|x| x / norm),
            })
        });
    let hand = proptest::option::of(uniform3(-3_f32..=3.0))
        .prop_map(|position_m| Packet::HandPosition(HandPosition { position_m }));
    let request = (any::<u32>(), any::<u64>())
        .prop_map(|(id, requested_us)| Packet::Ping(Ping::Request { id, requested_us }));
    let reply = (any::<u32>(), any::<u64>(), any::<u64>(), any::<u64>()).prop_map(
        |(id, requested_us, a, b)| {
            Packet::Ping(Ping::Reply {
                id,
                requested_us,
                received_us: a.min(b),
                replied_us: a.max(b),
            })
        },
    );
    let status = (
        any::<[u32; 9]>(),
        proptest::option::of(1_u16..),
        uniform8(0_u8..16).prop_map(quality),
        (0_u8..64, any::<u16>()),
    )
        .prop_map(|(n, battery_mv, quality, (flags, links))| {
            Packet::Status(Status {
                uptime_s: n[0],
                battery_mv,
                reset_reason: ResetReason::Lockup,
                overruns: n[1],
                gaps: n[2],
                missed_scans: n[3],
                refused: n[4],
                dropped_packets: n[5],
                quality,
                flags: StatusFlags::from_bits(flags),
                dropped_hypotheses: n[6],
                refused_requests: n[7],
                links,
                lost_reports: n[8],
            })
        });
    prop_oneof![unit, hand, request, reply, status]
}

//! What the golden frames hold, as the decoder beside the page must print it.

use serde_json::{Value, json};
use tonus_tests::frames::golden_calibrations;

/// What `docs/wire_decode.py` must print for each golden frame, header aside.
pub(super) fn golden_json() -> Vec<Value> {
    let exact = |value: f32| Value::from(f64::from(value));
    vec![
        json!({"kind": "configuration", "semg_hz": exact(1111.11), "stream_hz": 100.0,
            "volts_per_count": exact(2.5e-6), "offset_counts": -7, "chain_delay_us": 63_500,
            "muscles": ["biceps_short", "biceps_long", "triceps_lateral", "triceps_long"],
            "mains_hz": 50, "raw": true, "firmware_hash": "a0a1a2a3a4a5a6a7"}),
        json!({"kind": "configuration", "semg_hz": 200.0, "stream_hz": 100.0,
            "volts_per_count": 1.0, "offset_counts": 0, "chain_delay_us": 85_000,
            "muscles": ["other", "other", "other", "other",
                "biceps_short", "biceps_long", "triceps_lateral", "triceps_long"],
            "mains_hz": null, "raw": false, "firmware_hash": "0000000000000000"}),
        json!({"kind": "stream", "describes_us": 1_108_152_157_446_u64 - 78_500,
            "envelopes": [exact(0.1), 0.25, exact(0.001), 1.0], "activation": 0.5,
            "co_contraction": 1.75, "stiffness_n_per_m": [310.5, 222.25, 95.125],
            "quality": [0, 1, 2, 0], "flags": ["hand_seen", "gap", "near_singular"]}),
        json!({"kind": "raw_semg", "first_index": 4_294_967_294_u32,
            "scans": [[0, 1, -1], [8_388_607, -8_388_608, 1_000]]}),
        json!({"kind": "raw_semg", "first_index": 9, "scans": (0..9)
            .map(|scan| (0..8).map(|at| 1_000 * (8 * scan + at) - 36_000).collect())
            .collect::<Vec<Vec<i32>>>()}),
        json!({"kind": "orientation", "xyzw": [0.5, -0.5, 0.5, -0.5]}),
        json!({"kind": "hand_position", "position_m": [0.25, exact(-0.4), 0.125]}),
        json!({"kind": "hand_position", "position_m": null}),
        json!({"kind": "ping", "role": "request", "id": 77, "requested_us": 123_456_789_012_u64}),
        json!({"kind": "ping", "role": "reply", "id": 77, "requested_us": 123_456_789_012_u64,
            "received_us": 5_000_000, "replied_us": 5_000_250}),
        json!({"kind": "inference", "skills": 3, "top": [[2, -0.0625], [0, -2.75]], "phase": 0.375,
            "stiffness_n_per_m": [410.0, 380.5, 120.25]}),
        json!({"kind": "status", "uptime_s": 3_600, "battery_mv": 3_987, "reset_reason": "watchdog",
            "overruns": 1, "gaps": 2, "missed_scans": 30, "refused": 4, "dropped_packets": 5,
            "quality": [0, 1, 2, 4, 8, 15, 0, 0],
            "flags": ["low_battery", "last_words_wait", "no_model"], "dropped_hypotheses": 70_000,
            "refused_requests": 8, "links": 513, "lost_reports": 9}),
        json!({"kind": "status", "uptime_s": 1, "battery_mv": null, "reset_reason": "unknown",
            "overruns": 0, "gaps": 0, "missed_scans": 0, "refused": 0, "dropped_packets": 0,
            "quality": [0, 0, 0, 0, 0, 0, 0, 0], "flags": [], "dropped_hypotheses": 0,
            "refused_requests": 0, "links": 0, "lost_reports": 0}),
    ]
    .into_iter()
    .chain(golden_management_json())
    .collect()
}

/// The same for the packets that set the wearable up.
fn golden_management_json() -> Vec<Value> {
    let exact = |value: f32| Value::from(f64::from(value));
    let levels = |values: [f32; 4]| values.map(exact);
    let bytes_hex = |bytes: std::ops::Range<u8>| bytes.map(|byte| format!("{byte:02x}"));
    let [first, second] = golden_calibrations();
    vec![
        json!({"kind": "control", "command": "raw", "value": 1}),
        json!({"kind": "control", "command": "send_calibration", "value": 0}),
        json!({"kind": "control", "command": "send_model_state", "value": 0}),
        json!({"kind": "control", "command": "restart", "value": 0xFEDC_BA98_u32}),
        json!({"kind": "control", "command": "send_last_words", "value": 0}),
        json!({"kind": "control", "command": "face_forward", "value": 0}),
        json!({"kind": "calibration", "revision": first.revision,
            "muscles": ["biceps_short", "biceps_long", "triceps_lateral", "triceps_long"],
            "mains_hz": 60, "semg_hz": 1000.0, "rest_v": levels([1e-5, 2e-5, 0.0, 4e-6]),
            "mvc_v": levels([5e-4, 6e-4, 7e-4, 8e-4]), "activation_window_s": exact(0.025), "l1": 0.75, "l2": 1.5,
            "rest_stiffness_nm_per_rad": [13.0, 13.5, 12.0, 11.5], "body_mass_kg": 62.5, "body_height_m": 1.625}),
        json!({"kind": "calibration", "revision": second.revision,
            "muscles": ["other", "other", "biceps_short", "biceps_short", "biceps_long", "triceps_lateral",
                "triceps_long", "triceps_long"],
            "mains_hz": null, "semg_hz": 2000.0, "rest_v": vec![0.125; 8], "mvc_v": vec![1.0; 8],
            "activation_window_s": 0.5, "l1": 0.0, "l2": 2.25,
            "rest_stiffness_nm_per_rad": [1.0, 2.0, 3.0, 4.0], "body_mass_kg": 20.0, "body_height_m": 2.5}),
        json!({"kind": "model_upload", "step": "begin", "total_bytes": 90_001,
            "sha256": bytes_hex(0x40..0x60).collect::<String>()}),
        json!({"kind": "model_upload", "step": "piece", "offset_bytes": 66_288, "bytes": "0001feff80"}),
        json!({"kind": "model_upload", "step": "piece", "offset_bytes": 0,
            "bytes": bytes_hex(0..216).collect::<String>()}),
        json!({"kind": "model_upload", "step": "finish"}),
        json!({"kind": "model_upload", "step": "abandon"}),
        json!({"kind": "model_state", "active": {"hash": "0102030405060708", "skills": 3, "dofs": 12,
                "functions": 30, "rank": 16},
            "receiving": {"hash": "8182838485868788", "received_bytes": 4_320, "total_bytes": 90_001},
            "capacity_bytes": 163_840}),
        json!({"kind": "model_state", "active": null, "receiving": null, "capacity_bytes": 163_840}),
        json!({"kind": "reply", "answered": "model_upload", "answered_sequence": 0x0506_0708, "outcome": "done",
            "reason": null, "detail": 4_320}),
        json!({"kind": "reply", "answered": "calibration", "answered_sequence": 7, "outcome": "refused",
            "reason": "out_of_range", "detail": 0}),
        json!({"kind": "last_words", "words": "main.rs:7: Größe 3 > 2 ⚠"}),
        json!({"kind": "last_words", "words": "x".repeat(128)}),
        json!({"kind": "last_words", "words": ""}),
    ]
}

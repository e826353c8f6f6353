//! The same file read by another: the `mcap` package of Python.

use std::process::Command;

use tonus::recording::{Recorder, recover};

use crate::child::{self, CONFIGURATION};

/// Checks every checksum, and says what is there.
const SCRIPT: &str = r#"
import json, sys
from mcap.reader import make_reader
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    summary = reader.get_summary()
    topics, frames, palms = {}, [], []
    for schema, channel, message in reader.iter_messages(log_time_order=True):
        kind = [schema.name if schema else None, channel.message_encoding]
        topics.setdefault(channel.topic, [0, *kind])[0] += 1
        if channel.topic == "/wearable/frame":
            frames.append([message.log_time, message.data.hex()])
        if channel.topic == "/tracker/palm":
            palms.append(json.loads(message.data))
        if schema:
            assert schema.encoding == "jsonschema" and json.loads(schema.data)["type"] == "object"
            json.loads(message.data)
    metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    attachments = {record.name: len(record.data) for record in reader.iter_attachments()}
    print(json.dumps({
        "profile": reader.get_header().profile, "topics": topics, "frames": frames[:2], "palm": palms[1],
        "metadata": metadata, "attachments": attachments, "messages": summary.statistics.message_count,
    }))
"#;

fn read_by_python(path: &std::path::Path) -> serde_json::Value {
    let output = Command::new("python3")
        .args(["-c", SCRIPT])
        .arg(path)
        .output()
        .expect("python3 is needed for this test");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn python_reads_what_was_recorded_and_what_was_recovered() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole.mcap");
    let recorder = Recorder::create(&path, &child::opening()).unwrap();
    for number in 0..800 {
        recorder.note(child::entry(number, number * 1000));
    }
    recorder.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let cut = folder.path().join("cut.mcap");
    // Without its index, which takes the last few thousand bytes.
    std::fs::write(&cut, &bytes[..bytes.len() - 200]).unwrap();
    let mended = folder.path().join("mended.mcap");
    let recovered = recover(&cut, &mended).unwrap();
    assert!(!recovered.was_closed);

    for path in [path, mended] {
        let seen = read_by_python(&path);
        assert_eq!(seen["profile"], "tonus");
        assert_eq!(seen["messages"], 800);
        let topics = &seen["topics"];
        let each = |topic: &str| topics[topic].clone();
        assert_eq!(
            each("/tracker/palm"),
            serde_json::json!([100, "foxglove.PoseInFrame", "json"])
        );
        assert_eq!(
            each("/robot/seen"),
            serde_json::json!([100, "foxglove.PoseInFrame", "json"])
        );
        assert_eq!(
            each("/wearable/frame"),
            serde_json::json!([300, null, "tonus-frame"])
        );
        assert_eq!(
            each("/person/act"),
            serde_json::json!([100, "tonus.Act", "json"])
        );
        // The frame of entry 5: its number, then filling; nanoseconds.
        let frame = format!("0500000000000000{}", "5a".repeat(81));
        assert_eq!(seen["frames"][0], serde_json::json!([5_000_000, frame]));
        // The palm of entry 9, at 9 ms less 9 us.
        assert_eq!(
            seen["palm"]["timestamp"],
            serde_json::json!({ "sec": 0, "nsec": 8_991_000 })
        );
        assert_eq!(
            seen["palm"]["pose"]["position"],
            serde_json::json!({ "x": 3.0, "y": -3.0, "z": 0.25 })
        );
        let metadata = &seen["metadata"]["tonus"];
        assert_eq!(metadata["started_unix_us"], "1790000000000000");
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(metadata["subject"].as_str().unwrap())
                .unwrap()["name"],
            "p01"
        );
        assert_eq!(
            seen["attachments"],
            serde_json::json!({ "configuration.toml": CONFIGURATION.len(), "model.safetensors": 20_000 })
        );
    }
}

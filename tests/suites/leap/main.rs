//! The hand tracker's client: recorded frames, a service that misbehaves in every way it can, and garbage.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test suite")]

mod aged;
mod library;
mod messages;
mod recorded;
mod served;
mod service;

use serde_json::{Value, json};

/// A frame of protocol 6 with these hands: number, side, height of the palm in millimetres.
fn frame(id: i64, timestamp_us: u64, hands: &[(i64, &str, f64)]) -> String {
    let hands: Vec<Value> = hands
        .iter()
        .map(|(id, side, height_mm)| json!({ "id": id, "type": side, "palmPosition": [10.0, height_mm, -20.0] }))
        .collect();
    json!({ "id": id, "timestamp": timestamp_us, "hands": hands }).to_string()
}

const VERSION: &str = r#"{"version":6}"#;

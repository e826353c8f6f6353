//! A long run: nothing grows.

use tonus::live::{Act, View};
use tonus::source::simulated::SimulatedConfig;
use tonus::studio::virtually::Someone;

use crate::world::run;

/// Asks for a movement every ten seconds, forgets every demonstration, and looks at the memory.
#[derive(Default)]
struct Long {
    asked_us: u64,
    recorded: u64,
    /// Resident bytes, once a virtual minute.
    resident: Vec<u64>,
    largest_trace: usize,
    most_messages: usize,
}

impl Someone for Long {
    fn look(&mut self, view: &View) -> Vec<Act> {
        let minute = view.at_us / 60_000_000;
        if minute > self.resident.len() as u64 {
            self.resident.push(resident_bytes());
        }
        self.largest_trace = self.largest_trace.max(view.trace.raw_t_s.len());
        self.most_messages = self.most_messages.max(view.messages.len());
        if let Some(kept) = view.demonstrations.first() {
            self.recorded += 1;
            return vec![Act::Discard { id: kept.id }];
        }
        if view.recording.is_some() {
            let over = view.at_us > self.asked_us + 5_000_000;
            return over.then_some(Act::Stop).into_iter().collect();
        }
        if view.at_us < self.asked_us + 10_000_000 {
            return Vec::new();
        }
        self.asked_us = view.at_us;
        let label = "lift_book".to_owned();
        vec![Act::Record { label }]
    }
}

fn resident_bytes() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: u64 = text.split_whitespace().nth(1).unwrap().parse().unwrap();
    pages * 4096
}

/// An hour.
#[test]
fn memory_is_flat_and_no_queue_grows() {
    let minutes = 60;
    let long = run(
        SimulatedConfig::default(),
        Long::default(),
        minutes * 60 + 1,
    );
    let resident = &long.resident;
    let [early, late] = [resident[2], resident[resident.len() - 1]];
    println!(
        "{minutes} min: {} demonstrations, {} kB at 3 min, {} kB at the end",
        long.recorded,
        early / 1024,
        late / 1024
    );
    assert!(long.recorded > 5 * minutes);
    // Other tests share the process; a leak of a byte for each scan alone would be 3.6 MB in an hour.
    assert!(late < early + 16 * 1024 * 1024, "{early} to {late} bytes");
    // A view comes every 40 ms: forty scans, and what a lost packet holds back.
    assert!(long.largest_trace <= 400, "{}", long.largest_trace);
    assert!(long.most_messages <= 30);
}

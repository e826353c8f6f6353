//! A stream that pylsl sends, in the wearable's place.

use std::time::{Duration, Instant};

use tonus::live::{Input, Inputs, LinkEvent, Request, SessionClock};
use tonus::source::lsl;
use tonus_native::lsl::Lsl;
use tonus_shared::wire::{Control, Header, MAX_FRAME_BYTES, Packet, decode, encode};

/// Four channels, not in the wearable's order; sample n holds n mod 1000, and twice, thrice and four times as much.
const SEND: &str = r#"
import pylsl, time
info = pylsl.StreamInfo("bench", "EMG", 4, 1000, "float32", "bench-1")
channels = info.desc().append_child("channels")
for label in ("triceps long", "triceps lateral", "biceps long", "biceps short"):
    channel = channels.append_child("channel")
    channel.append_child_value("label", label)
    channel.append_child_value("unit", "microvolts")
outlet = pylsl.StreamOutlet(info)
start, sent = pylsl.local_clock(), 0
while True:
    while sent < (pylsl.local_clock() - start) * 1000:
        at = sent % 1000
        outlet.push_sample([4.0 * at, 3.0 * at, 2.0 * at, 1.0 * at], start + sent / 1000)
        sent += 1
    time.sleep(0.004)
"#;

#[test]
fn a_stream_takes_the_wearables_place_and_comes_back_after_a_restart() {
    crate::inside(
        "inlet::a_stream_takes_the_wearables_place_and_comes_back_after_a_restart",
        listen,
    );
}

fn raw_on() -> Request {
    let mut bytes = [0; MAX_FRAME_BYTES];
    let header = Header {
        boot_id: 1,
        sequence: 0,
        device_us: 0,
    };
    let control = Packet::Control(Control::Raw(true));
    let length = encode(&header, &control, &mut bytes).expect("encodes");
    Request::Frame(bytes[..length].to_vec())
}

fn listen(lsl: Lsl) {
    drop(lsl);
    let inputs = Inputs::new(SessionClock::start());
    let (port, plug) = inputs.port();
    let running = std::thread::spawn(move || lsl::run(&port, Some("bench"), 9));
    let next = |what: &str, wanted: &mut dyn FnMut(&Input) -> bool| {
        let began = Instant::now();
        loop {
            assert!(began.elapsed() < Duration::from_secs(40), "no {what}");
            if let Some(timed) = inputs.next(Duration::from_millis(100))
                && wanted(&timed.input)
            {
                return;
            }
        }
    };
    next(
        "word that nobody sends",
        &mut |input| matches!(input, Input::Link(LinkEvent::Down { reason }) if reason.contains("no stream of type='EMG'")),
    );
    for _ in 0..2 {
        let mut sender = crate::python(SEND);
        next(
            "stream",
            &mut |input| matches!(input, Input::Link(LinkEvent::Up { name, .. }) if name.contains("bench (4 channels, 1000 Hz)")),
        );
        plug.ask(raw_on());
        let (mut scans, mut streams) = (Vec::new(), 0);
        next("second of raw sEMG and stiffness", &mut |input| {
            let Input::Frame(bytes) = input else {
                return false;
            };
            match decode(bytes).expect("a sound frame").packet {
                Packet::RawSemg(raw) => scans.extend(raw.counts.chunks(4).map(<[i32]>::to_vec)),
                Packet::Stream(_) => streams += 1,
                _ => {}
            }
            scans.len() > 1000 && streams > 100
        });
        for pair in scans.windows(2) {
            // Microvolts are 20 counts each; the biceps' short head is the stream's last channel.
            let number = pair[0][0] / 20;
            assert_eq!(
                pair[0],
                [20 * number, 40 * number, 60 * number, 80 * number]
            );
            assert_eq!(pair[1][0] / 20, (number + 1) % 1000, "a sample is missing");
        }
        sender.kill().expect("runs");
        sender.wait().expect("ended");
        next("word that it ended", &mut |input| {
            matches!(input, Input::Link(LinkEvent::Down { .. }))
        });
    }
    plug.stop();
    running.join().expect("no panic");
}

//! A wearable on a serial port (a pseudo-terminal), unplugged and plugged in again.

use std::os::fd::AsRawFd;
use std::path::Path;
use std::time::{Duration, Instant};

use serial2::SerialPort;
use tonus::live::{Input, Inputs, LinkEvent, Request, SessionClock};
use tonus::source::serial;
use tonus_shared::wire::cobs::{MAX_BLOCK_BYTES, Unframer, enclose};
use tonus_shared::wire::{Control, Packet};
use tonus_tests::frames::{HEADER, bytes_of, golden_stream};

use super::{PATIENCE, until};

/// Plugs a wearable in: its end, and the host's, which must stay open. `name` leads to it.
fn plug_in(name: &Path) -> (SerialPort, SerialPort) {
    let (wearable, host) = SerialPort::pair().unwrap();
    let terminal = std::fs::read_link(format!("/proc/self/fd/{}", host.as_raw_fd())).unwrap();
    let _absent = std::fs::remove_file(name);
    std::os::unix::fs::symlink(terminal, name).unwrap();
    (wearable, host)
}

fn block(frame: &[u8]) -> Vec<u8> {
    let mut block = [0; MAX_BLOCK_BYTES];
    let length = enclose(frame, &mut block).unwrap();
    block[..length].to_vec()
}

/// The next frame that the host sends.
fn sent(wearable: &mut SerialPort) -> Vec<u8> {
    wearable
        .set_read_timeout(Duration::from_millis(100))
        .unwrap();
    let mut unframer: Unframer = Unframer::new();
    let end = Instant::now() + PATIENCE;
    while Instant::now() < end {
        let mut byte = [0];
        if wearable.read(&mut byte).is_ok_and(|count| count == 1)
            && let Ok(Some(frame)) = unframer.push(byte[0])
        {
            return frame.to_vec();
        }
    }
    panic!("the host sends nothing");
}

#[test]
fn frames_come_requests_go_and_a_port_plugged_in_again_is_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("wearable");
    let inputs = Inputs::new(SessionClock::start());
    let (port, plug) = inputs.port();
    let at = name.clone();
    let running = std::thread::spawn(move || serial::run(&port, &at));

    let down = until(&inputs, |input| matches!(input, Input::Link(_)));
    let Input::Link(LinkEvent::Down { reason }) = &down[0].input else {
        panic!("nothing is plugged in: {down:?}");
    };
    assert!(reason.contains("check the name"), "{reason}");

    let frame = bytes_of(&HEADER, &golden_stream()).unwrap();
    let request = bytes_of(&HEADER, &Packet::Control(Control::SendCalibration)).unwrap();
    for _ in 0..2 {
        let (mut wearable, host) = plug_in(&name);
        // Asked while nobody was there: for nobody.
        plug.ask(Request::Frame(
            bytes_of(&HEADER, &Packet::Control(Control::SendLastWords)).unwrap(),
        ));
        std::thread::sleep(Duration::from_millis(20));
        wearable.write_all(&block(&frame)).unwrap();
        let came = until(&inputs, |input| matches!(input, Input::Frame(_)));
        let up = LinkEvent::Up {
            name: name.display().to_string(),
            mtu: None,
            interval_us: None,
        };
        let [.., before, last] = came.as_slice() else {
            panic!("{came:?}");
        };
        assert_eq!(before.input, Input::Link(up));
        assert_eq!(last.input, Input::Frame(frame.clone()));
        plug.ask(Request::Frame(request.clone()));
        while sent(&mut wearable) != request {}

        drop((wearable, host));
        let ended = until(&inputs, |input| {
            matches!(input, Input::Link(LinkEvent::Down { .. }))
        });
        let Some(Input::Link(LinkEvent::Down { reason })) = ended.last().map(|timed| &timed.input)
        else {
            panic!("{ended:?}");
        };
        assert!(reason.contains("connect it again"), "{reason}");
    }
    plug.stop();
    running.join().unwrap();
}

#[test]
fn a_port_that_says_nothing_is_no_link() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("modem");
    let (wearable, _host) = plug_in(&name);
    wearable.write_all(b"AT\0OK\0").unwrap();
    let inputs = Inputs::new(SessionClock::start());
    let (port, plug) = inputs.port();
    let running = std::thread::spawn(move || serial::run(&port, &name));
    let came = until(&inputs, |input| matches!(input, Input::Link(_)));
    let Some(Input::Link(LinkEvent::Down { reason })) = came.last().map(|timed| &timed.input)
    else {
        panic!("{came:?}");
    };
    assert!(reason.contains("no frame comes"), "{reason}");
    plug.stop();
    running.join().unwrap();
}

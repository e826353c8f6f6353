//! The hand of a Leap service, in session time.

use std::net::TcpListener;
use std::time::{Duration, Instant};

use tonus::leap::{Backoff, Config, Origin, Service, Side, Wanted};
use tonus::live::{Input, Inputs, Prompt, Request, SessionClock, TrackerEvent};
use tonus::source::hand;
use tungstenite::{Message, accept};

use super::until;

/// Right hands whose palm rises by 1 mm a frame, every 9 ms of the service's clock, for so many frames; then the end.
fn serve(listener: &TcpListener, frames: u32) {
    let (stream, _) = listener.accept().unwrap();
    let mut socket = accept(stream).unwrap();
    socket.send(Message::text(r#"{"version":6}"#)).unwrap();
    let began = Instant::now();
    for k in 0..frames {
        std::thread::sleep((Duration::from_millis(9) * k).saturating_sub(began.elapsed()));
        let text = format!(
            r#"{{"id":{k},"timestamp":{},"hands":[{{"id":1,"type":"right","palmPosition":[10,{},-30]}}]}}"#,
            1_000_000 + u64::from(k) * 9_000,
            100 + k
        );
        if socket.send(Message::text(text)).is_err() {
            return;
        }
    }
}

/// How the right hand is followed that this service shows.
fn right_hand_of(listener: &TcpListener) -> Config {
    Config {
        origin: Origin::Service(Service {
            host: "127.0.0.1".to_owned(),
            port: listener.local_addr().unwrap().port(),
        }),
        wanted: Wanted::Only(Side::Right),
        transport_us: 0,
        backoff: Backoff::default(),
    }
}

#[test]
fn pictures_carry_the_session_time_at_which_they_were_taken_and_a_lost_service_is_told() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let config = right_hand_of(&listener);
    let service = std::thread::spawn(move || {
        serve(&listener, 150);
        serve(&listener, 150);
    });
    let inputs = Inputs::new(SessionClock::start());
    // A session that is under way when the tracker is asked for.
    std::thread::sleep(Duration::from_millis(300));
    let (port, plug) = inputs.port();
    let running = std::thread::spawn(move || hand::run(&port, config));
    for _ in 0..2 {
        let came = until(&inputs, |input| matches!(input, Input::Hand(Some(_))));
        let up = |input: &Input| matches!(input, Input::Tracker(TrackerEvent::Up { name }) if name.ends_with("protocol 6"));
        assert!(came.iter().any(|timed| up(&timed.input)), "{came:?}");
        let last = came.last().unwrap();
        let Input::Hand(Some(seen)) = last.input else {
            panic!("{last:?}");
        };
        let [x, y, z] = seen.position_m;
        assert!((x - 0.01).abs() < 1e-9 && (z + 0.03).abs() < 1e-9 && (0.1..0.25).contains(&y));
        // By the session's clock: taken before it came, and not more than the hand's age limit before.
        assert!(
            seen.exposed_us <= last.at_us && last.at_us - seen.exposed_us < 100_000,
            "{last:?}"
        );
        assert!(seen.exposed_us > 300_000, "{last:?}");
        until(&inputs, |input| {
            matches!(input, Input::Tracker(TrackerEvent::Down { .. }))
        });
    }
    plug.stop();
    running.join().unwrap();
    service.join().unwrap();
}

#[test]
fn a_library_that_is_not_there_is_told_with_what_to_do() {
    let config = Config {
        origin: Origin::LeapC(Some("/nowhere/libLeapC.so".into())),
        wanted: Wanted::Either,
        transport_us: 0,
        backoff: Backoff::default(),
    };
    let inputs = Inputs::new(SessionClock::start());
    let (port, plug) = inputs.port();
    let running = std::thread::spawn(move || hand::run(&port, config));
    let down = |input: &Input| matches!(input, Input::Tracker(TrackerEvent::Down { .. }));
    // It is tried again, as whatever else is not there.
    for _ in 0..2 {
        let came = until(&inputs, down);
        let Input::Tracker(TrackerEvent::Down { reason }) = &came.last().unwrap().input else {
            panic!("{came:?}");
        };
        for part in [
            "/nowhere/libLeapC.so",
            "install",
            "TONUS_LEAPC",
            "ws://127.0.0.1:6437",
        ] {
            assert!(reason.contains(part), "{reason}");
        }
    }
    plug.stop();
    running.join().unwrap();
}

#[test]
fn the_other_hand_is_followed_while_it_touches_the_shoulder() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let config = right_hand_of(&listener);
    let service = std::thread::spawn(move || {
        let (stream, _) = listener.accept().unwrap();
        let mut socket = accept(stream).unwrap();
        socket.send(Message::text(r#"{"version":6}"#)).unwrap();
        let began = Instant::now();
        for k in 0..1_000_u32 {
            std::thread::sleep((Duration::from_millis(9) * k).saturating_sub(began.elapsed()));
            let text = format!(
                r#"{{"id":{k},"timestamp":{},"hands":[{{"id":1,"type":"right","palmPosition":[100,200,0]}},{{"id":2,"type":"left","palmPosition":[-100,200,0]}}]}}"#,
                1_000_000 + u64::from(k) * 9_000
            );
            if socket.send(Message::text(text)).is_err() {
                return;
            }
        }
    });
    let inputs = Inputs::new(SessionClock::start());
    std::thread::sleep(Duration::from_millis(300));
    let (port, plug) = inputs.port();
    let running = std::thread::spawn(move || hand::run(&port, config));
    let at = |x: f64| move |input: &Input| matches!(input, Input::Hand(Some(seen)) if (seen.position_m[0] - x).abs() < 1e-9);
    until(&inputs, at(0.1));
    plug.ask(Request::Prompt(Prompt::TouchShoulder));
    until(&inputs, at(-0.1));
    plug.ask(Request::Prompt(Prompt::Rest));
    until(&inputs, at(0.1));
    plug.stop();
    running.join().unwrap();
    service.join().unwrap();
}

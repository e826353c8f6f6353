//! Over sockets: whatever the service does, the client goes on and gives no stale hand.

use std::io::{Read as _, Write as _};
use std::net::TcpListener;
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::Value;
use tonus::leap::{Loss, Protocol, Refusal, Service, Update};
use tungstenite::Message;
use tungstenite::protocol::CloseFrame;
use tungstenite::protocol::frame::coding::CloseCode;

use super::service::{Client, client, connected, seen, serve, updates};
use super::{VERSION, frame};

/// Long enough for every service below on a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// A right hand in frames that count from `first`, for so many of them.
fn live(client: &mut Client, first: i64, frames: i64) {
    let offset_us = first.cast_unsigned() * 9_000;
    client.play(|k, at_us| {
        let text = || frame(first + k, offset_us + at_us, &[(1, "right", 200.0)]);
        (k < frames).then(text)
    });
}

fn fine(listener: &TcpListener, first: i64) {
    let mut client = Client::accept(listener);
    client.say(VERSION);
    live(&mut client, first, 150);
}

/// Some hands in the end, after whatever came before.
fn recovers(script: impl FnOnce(&TcpListener) + Send + 'static) -> Vec<Update> {
    let (mut leap, service) = serve(move |listener| {
        script(listener);
        fine(listener, 0);
    });
    let all = updates(&mut leap, PATIENCE, |all| seen(all) >= 20);
    assert!(seen(&all) >= 20, "{:?} {:?}", leap.counts(), all.last());
    drop(leap);
    service.join().unwrap();
    all
}

fn lost(all: &[Update]) -> Vec<&Loss> {
    all.iter()
        .filter_map(|update| match update {
            Update::Lost(loss) => Some(loss),
            _ => None,
        })
        .collect()
}

#[test]
fn a_service_that_restarts_is_found_again_and_its_hand_is_a_new_one() {
    let (mut leap, service) = serve(|listener| {
        fine(listener, 5_000);
        fine(listener, 0);
    });
    let before = updates(&mut leap, PATIENCE, |all| {
        seen(all) > 0 && !lost(all).is_empty()
    });
    assert!(leap.hand().is_none(), "the connection is gone");
    let after = updates(&mut leap, PATIENCE, |all| seen(all) > 0);
    service.join().unwrap();
    assert_eq!((connected(&before), connected(&after)), (1, 1));
    let new = |all: &[Update]| {
        all.iter().find_map(|update| match update {
            Update::Seen(sight) => Some(sight.new_hand),
            _ => None,
        })
    };
    assert_eq!((new(&before), new(&after)), (Some(true), Some(true)));
}

#[test]
fn a_service_that_freezes_shows_no_hand_until_it_goes_on() {
    let (mut leap, service) = serve(|listener| {
        let mut client = Client::accept(listener);
        client.say(VERSION);
        client.play(|k, at_us| {
            // Frame 60 for half a second, between live ones.
            let shown = if (60..115).contains(&k) { 60 } else { k };
            let at_us = if shown == k { at_us } else { 60 * 9_000 };
            (k < 180).then(|| frame(shown, at_us, &[(1, "right", 200.0)]))
        });
    });
    let all = updates(&mut leap, PATIENCE, |all| {
        matches!(all.last(), Some(Update::Lost(_)))
    });
    service.join().unwrap();
    let frames: Vec<i64> = all
        .iter()
        .filter_map(|update| match update {
            Update::Seen(sight) => Some(sight.frame_id),
            _ => None,
        })
        .collect();
    assert!(
        frames.iter().all(|id| *id <= 60 || *id >= 115),
        "{frames:?}"
    );
    assert!(frames.iter().any(|id| *id >= 115), "{frames:?}");
    let repeated = |update: &&Update| matches!(update, Update::Refused(Refusal::Repeated { .. }));
    assert_eq!(all.iter().filter(repeated).count(), 54);
}

#[test]
fn garbage_is_passed_over() {
    let (mut leap, service) = serve(|listener| {
        let mut client = Client::accept(listener);
        client.say(VERSION);
        client.play(|k, at_us| {
            let good = || frame(k, at_us, &[(1, "right", 200.0)]);
            let text = match k % 5 {
                1 => "{".to_owned(),
                2 => "[".repeat(200_000),
                3 => format!(
                    r#"{{"id":{k},"timestamp":{at_us},"hands":[{{"palmPosition":[1e99,0,0]}}]}}"#
                ),
                _ => good(),
            };
            (k < 150).then_some(text)
        });
        client.socket.send(Message::binary(vec![0; 1_000])).unwrap();
    });
    let all = updates(&mut leap, PATIENCE, |all| {
        matches!(all.last(), Some(Update::Lost(_)))
    });
    service.join().unwrap();
    assert_eq!((connected(&all), lost(&all).len()), (1, 1));
    assert_eq!(leap.counts().malformed, 90);
    assert!(seen(&all) > 20, "{:?}", leap.counts());
}

#[test]
fn a_frame_of_ten_megabytes_is_not_read() {
    let all = recovers(|listener| {
        let mut client = Client::accept(listener);
        client.say(VERSION);
        // The client hangs up in the middle of it.
        client.say("x".repeat(10_000_000));
    });
    assert!(matches!(lost(&all)[..], [Loss::Ended(_)]), "{all:?}");
}

#[test]
fn what_is_no_websocket_is_left_again() {
    let all = recovers(|listener| {
        // Closes at once; answers in another protocol; says nothing; sends letter by letter.
        drop(listener.accept().unwrap());
        let (mut other, _) = listener.accept().unwrap();
        let _ = other.read(&mut [0; 1_024]);
        let _ = other.write_all(b"220 mail.example ESMTP\r\n\r\n");
        drop(other);
        let (silent, _) = listener.accept().unwrap();
        let (mut slow, _) = listener.accept().unwrap();
        let headers = "X-Wait: longer\r\n".repeat(20);
        let answer = format!("HTTP/1.1 101 Switching Protocols\r\n{headers}");
        for byte in answer.bytes() {
            if slow.write_all(&[byte]).is_err() {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        drop(silent);
    });
    let lost = lost(&all);
    assert!(
        matches!(
            lost[..],
            [
                Loss::Handshake { .. },
                Loss::Handshake { .. },
                Loss::NoAnswer { .. },
                Loss::NoAnswer { .. }
            ]
        ),
        "{lost:?}"
    );
}

#[test]
fn broken_frames_of_the_websocket_end_the_connection_only() {
    let all = recovers(|listener| {
        let mut client = Client::accept(listener);
        client.say(VERSION);
        // Reserved bits, an unknown kind, a length beyond all reason.
        let _ = client
            .socket
            .get_mut()
            .write_all(&[0xFF, 0x7F, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF]);
        std::thread::sleep(Duration::from_millis(50));
    });
    assert!(matches!(lost(&all)[..], [Loss::Ended(_)]), "{all:?}");
}

#[test]
fn a_connection_without_a_word_is_given_up() {
    let began = Instant::now();
    let all = recovers(|listener| {
        let client = Client::accept(listener);
        std::thread::sleep(Duration::from_millis(3_300));
        drop(client);
    });
    assert!(matches!(lost(&all)[..], [Loss::Silent]), "{all:?}");
    assert!(began.elapsed() >= Duration::from_secs(3));
}

#[test]
fn versions_go_down_until_one_is_spoken() {
    let refuse = |listener: &TcpListener, path: &str| {
        let mut client = Client::accept(listener);
        assert_eq!(client.path, path);
        let away = CloseFrame {
            code: CloseCode::Away,
            reason: "".into(),
        };
        client.socket.close(Some(away)).unwrap();
        while client.socket.read().is_ok() {}
    };
    let (mut leap, service) = serve(move |listener| {
        refuse(listener, "/v6.json");
        refuse(listener, "/v5.json");
        let mut client = Client::accept(listener);
        assert_eq!(client.path, "/v4.json");
        client.say(r#"{"version":4}"#);
        for expected in [r#"{"background":true}"#, r#"{"focused":true}"#] {
            assert_eq!(client.socket.read().unwrap(), Message::text(expected));
        }
    });
    let all = updates(&mut leap, PATIENCE, |all| connected(all) > 0);
    assert!(
        matches!(
            all.last(),
            Some(Update::Connected {
                protocol: Protocol::WebSocket(4)
            })
        ),
        "{all:?}"
    );
    service.join().unwrap();
}

#[test]
fn protocol_6_is_greeted_byte_for_byte() {
    let (mut leap, service) = serve(|listener| {
        let mut client = Client::accept(listener);
        client.say(r#"{"serviceVersion":"2.3.1+33747","version":6}"#);
        for expected in [
            r#"{"background":true}"#,
            r#"{"focused":true}"#,
            r#"{"optimizeHMD":false}"#,
        ] {
            assert_eq!(client.socket.read().unwrap(), Message::text(expected));
        }
    });
    updates(&mut leap, PATIENCE, |all| connected(all) > 0);
    service.join().unwrap();
}

#[test]
fn a_service_of_protocol_3_is_kept_alive_and_tells_no_side() {
    let (mut leap, service) = serve(|listener| {
        let mut client = Client::accept(listener);
        client.say(r#"{"version":3}"#);
        client.play(|k, at_us| {
            let hand = r#"{"id":1,"palmPosition":[0,200,0]}"#;
            let text = format!(r#"{{"id":{k},"timestamp":{at_us},"hands":[{hand}]}}"#);
            (k < 100).then_some(text)
        });
        for _ in 0..3 {
            let beat = client.socket.read().unwrap();
            assert_eq!(beat, Message::text(r#"{"heartbeat":true}"#));
        }
    });
    let all = updates(&mut leap, PATIENCE, |all| {
        matches!(all.last(), Some(Update::Lost(_)))
    });
    service.join().unwrap();
    assert!(
        matches!(
            all[0],
            Update::Connected {
                protocol: Protocol::WebSocket(3)
            }
        ),
        "{:?}",
        all[0]
    );
    let unseen = all.iter().any(|update| matches!(update, Update::Unseen));
    assert!(unseen && seen(&all) == 0, "{:?}", leap.counts());
}

#[test]
fn a_protocol_that_is_not_known_is_said_to_be() {
    let all = recovers(|listener| {
        let mut client = Client::accept(listener);
        client.say(r#"{"version":7}"#);
        let _ = client.socket.read();
    });
    let refused = |loss: &&Loss| matches!(loss, Loss::Version(Refusal::Version { got: 7 }));
    assert!(lost(&all).iter().any(refused), "{all:?}");
}

#[test]
fn nobody_there_is_tried_again_without_haste() {
    // A port that was just free.
    let port = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .port();
    let mut leap = client(Service {
        host: "127.0.0.1".to_owned(),
        port,
    });
    let all = updates(&mut leap, Duration::from_secs(1), |_| false);
    assert!(!all.is_empty() && all.len() <= 14, "{}", all.len());
    for update in &all {
        let Update::Lost(loss @ Loss::Connect { .. }) = update else {
            panic!("{update:?}");
        };
        assert!(loss.to_string().contains("start it"), "{loss}");
    }
}

#[test]
fn the_program_prints_the_hand() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("ws://{}", listener.local_addr().unwrap());
    let service = std::thread::spawn(move || fine(&listener, 0));
    let output = Command::new(tonus_tests::program())
        .args(["hand", "--leap", &url, "--seconds", "1.5", "--json"])
        .output()
        .unwrap();
    service.join().unwrap();
    assert!(output.status.success(), "{output:?}");
    let lines: Vec<Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines[0]["connected"]["protocol"], 6);
    let hands: Vec<&Value> = lines
        .iter()
        .filter(|line| line["side"] == "right")
        .collect();
    assert!(hands.len() > 20, "{lines:?}");
    assert!(hands.iter().all(|hand| hand["palm_m"][1] == 0.2));
    let counted = &lines.last().unwrap()["counts"]["seen"];
    assert_eq!(counted, &Value::from(hands.len()));
}

#[test]
fn the_program_says_what_to_do_when_nobody_is_there() {
    let port = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .port();
    let hand = |url: &str| {
        Command::new(tonus_tests::program())
            .args(["hand", "--leap", url, "--seconds", "0.4"])
            .output()
            .unwrap()
    };
    let output = hand(&format!("ws://127.0.0.1:{port}"));
    assert_eq!(output.status.code(), Some(1));
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(errors.contains("UltraleapTrackingWebSocket"), "{errors}");
    assert_eq!(hand("http://127.0.0.1").status.code(), Some(2));
}

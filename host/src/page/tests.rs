use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket};

use super::Page;
use crate::live::{Act, DemonstrationView, Trace, View};

/// Longest wait for anything here.
const PATIENCE: Duration = Duration::from_secs(10);

fn page() -> (Page, Receiver<Act>) {
    let (sender, acts) = channel();
    let page = Page::serve(
        0,
        move |act| sender.send(act).map_err(|_| "nobody takes it".to_owned()),
        |_| Ok(()),
    )
    .unwrap();
    (page, acts)
}

/// `127.0.0.1:PORT` and the token.
fn parts(page: &Page) -> (String, String) {
    let (address, token) = page.url().split_once("/#").unwrap();
    (
        address.strip_prefix("http://").unwrap().to_owned(),
        token.to_owned(),
    )
}

/// Status and whole answer of a request with these headers.
fn request(page: &Page, line: &str, headers: &[(&str, &str)]) -> (u16, String) {
    let mut stream = TcpStream::connect(parts(page).0).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let headers: String = headers
        .iter()
        .map(|(name, value)| format!("{name}: {value}\r\n"))
        .collect();
    write!(
        stream,
        "{line} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n"
    )
    .unwrap();
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    let answer = String::from_utf8_lossy(&bytes).into_owned();
    let status = answer.split(' ').nth(1).unwrap().parse().unwrap();
    (status, answer)
}

fn look_with(
    page: &Page,
    protocol: &str,
    origin: Option<&str>,
) -> Result<WebSocket<TcpStream>, u16> {
    let (address, _) = parts(page);
    let mut request = format!("ws://{address}/socket")
        .into_client_request()
        .unwrap();
    let headers = request.headers_mut();
    headers.insert(
        "Sec-WebSocket-Protocol",
        HeaderValue::from_str(protocol).unwrap(),
    );
    if let Some(origin) = origin {
        headers.insert("Origin", HeaderValue::from_str(origin).unwrap());
    }
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    match tungstenite::client(request, stream) {
        Ok((socket, _)) => Ok(socket),
        Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
            Err(answer.status().as_u16())
        }
        Err(error) => panic!("{error}"),
    }
}

fn look(page: &Page) -> WebSocket<TcpStream> {
    let (address, token) = parts(page);
    look_with(
        page,
        &format!("tonus, {token}"),
        Some(&format!("http://{address}")),
    )
    .unwrap()
}

fn hear(socket: &mut WebSocket<TcpStream>) -> Value {
    loop {
        if let Message::Text(text) = socket.read().unwrap() {
            return serde_json::from_str(&text).unwrap();
        }
    }
}

fn say(socket: &mut WebSocket<TcpStream>, what: &Value) {
    socket.send(Message::text(what.to_string())).unwrap();
}

fn until(mut holds: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        if holds() {
            return true;
        }
        std::thread::yield_now();
    }
    false
}

/// A view with one stream sample and two raw scans, all of this number.
fn numbered(number: u16) -> View {
    let value = f32::from(number);
    View {
        at_us: u64::from(number),
        trace: Trace {
            t_s: vec![f64::from(number)],
            envelopes: vec![vec![value]; 2],
            stiffness_n_per_m: vec![vec![value]; 3],
            raw_t_s: vec![f64::from(number), f64::from(number) + 0.5],
            raw_uv: vec![vec![value; 2]; 2],
        },
        ..View::default()
    }
}

#[test]
fn only_this_very_page_is_answered() {
    let (page, _acts) = page();
    let (address, _) = parts(&page);
    let port = address.rsplit_once(':').unwrap().1;
    let localhost = format!("localhost:{port}");
    let own = format!("http://{address}");
    for (headers, expected) in [
        (vec![("Host", address.as_str())], 200),
        (vec![("Host", localhost.as_str())], 200),
        (
            vec![("Host", address.as_str()), ("Origin", own.as_str())],
            200,
        ),
        (vec![("Host", "tonus.example")], 403),
        (vec![("Host", "127.0.0.1")], 403),
        (vec![("Host", "127.0.0.1:1")], 403),
        (
            vec![
                ("Host", address.as_str()),
                ("Origin", "http://tonus.example"),
            ],
            403,
        ),
        (
            vec![("Host", address.as_str()), ("Origin", "http://127.0.0.1:1")],
            403,
        ),
        (vec![("Host", address.as_str()), ("Origin", "null")], 403),
        (
            vec![("Host", address.as_str()), ("Host", "tonus.example")],
            400,
        ),
    ] {
        let (status, answer) = request(&page, "GET /", &headers);
        assert_eq!(status, expected, "{headers:?}");
        let answer = answer.to_lowercase();
        assert!(answer.contains("content-security-policy: default-src 'none'"));
        assert!(!answer.contains("unsafe-inline"));
        assert!(!answer.contains("access-control-allow"));
    }
    let host = [("Host", address.as_str())];
    assert_eq!(request(&page, "POST /", &host).0, 405);
    assert_eq!(request(&page, "GET /../Cargo.toml", &host).0, 404);
    assert_eq!(request(&page, "GET /nothing.js", &host).0, 404);
}

#[test]
fn views_and_acts_need_the_token() {
    let (page, acts) = page();
    let (address, token) = parts(&page);
    let own = format!("http://{address}");
    let wrong = token.replace(|_: char| true, "0");
    for protocol in [
        "tonus",
        "tonus, ",
        &wrong,
        &format!("tonus, {wrong}"),
        &token,
    ] {
        assert_eq!(
            look_with(&page, protocol, Some(&own)).unwrap_err(),
            401,
            "{protocol}"
        );
    }
    let right = format!("tonus, {token}");
    let foreign = Some("http://tonus.example");
    assert_eq!(look_with(&page, &right, foreign).unwrap_err(), 403);
    assert_eq!(page.viewers(), 0);
    let mut socket = look_with(&page, &right, None).unwrap();
    say(&mut socket, &json!({"act": "record", "label": "lift_book"}));
    let label = "lift_book".to_owned();
    assert_eq!(acts.recv_timeout(PATIENCE).unwrap(), Act::Record { label });
}

#[test]
fn two_pages_have_two_ports_and_two_tokens() {
    let (one, _acts) = page();
    let port = parts(&one).0.rsplit_once(':').unwrap().1.parse().unwrap();
    let other = Page::serve(port, |_| Ok(()), |_| Ok(())).unwrap();
    assert_ne!(parts(&one).0, parts(&other).0);
    assert_ne!(parts(&one).1, parts(&other).1);
    assert_eq!(parts(&one).1.len(), 32);
}

#[test]
fn a_browser_sees_every_sample_once_and_the_newest_view() {
    let (page, _acts) = page();
    page.show(&numbered(1));
    let mut socket = look(&page);
    let mut times = Vec::new();
    let mut raw = Vec::new();
    let mut shown = 1;
    while times.len() < 60 {
        let sent = hear(&mut socket);
        say(&mut socket, &json!({"seen": sent["number"]}));
        let trace: Trace = serde_json::from_value(sent["view"]["trace"].clone()).unwrap();
        assert_eq!(sent["view"]["at_us"].as_f64(), trace.t_s.last().copied());
        assert_eq!(trace.envelopes.len(), 2);
        assert!(
            trace
                .envelopes
                .iter()
                .all(|row| row.len() == trace.t_s.len())
        );
        assert!(
            trace
                .raw_uv
                .iter()
                .all(|row| row.len() == trace.raw_t_s.len())
        );
        times.extend(trace.t_s);
        raw.extend(trace.raw_uv[1].iter().copied());
        for _ in 0..3 {
            shown += 1;
            page.show(&numbered(shown));
        }
    }
    let expected: Vec<f64> = (1..).map(f64::from).take(times.len()).collect();
    assert_eq!(times, expected);
    let expected: Vec<f32> = (1_u16..)
        .flat_map(|i| [f32::from(i); 2])
        .take(raw.len())
        .collect();
    assert_eq!(raw, expected);
}

#[test]
fn a_slow_browser_gets_two_views_and_then_the_newest() {
    let (page, _acts) = page();
    let mut socket = look(&page);
    page.show(&numbered(1));
    assert_eq!(hear(&mut socket)["number"], 1);
    page.show(&numbered(2));
    assert_eq!(hear(&mut socket)["number"], 2);
    // Time for ten more, if it were not for the two that nobody drew.
    for number in 3..=12 {
        page.show(&numbered(number));
        socket
            .get_ref()
            .set_read_timeout(Some(Duration::from_millis(60)))
            .unwrap();
        assert!(socket.read().is_err(), "a third view is on its way");
    }
    socket.get_ref().set_read_timeout(Some(PATIENCE)).unwrap();
    say(&mut socket, &json!({"seen": 2}));
    let sent = hear(&mut socket);
    assert_eq!(sent["number"], 12);
    assert_eq!(sent["view"]["trace"]["t_s"].as_array().unwrap().len(), 10);
}

#[test]
fn what_is_kept_for_a_browser_is_bounded() {
    let feed = super::feed::Feed::default();
    let shown = u16::try_from(super::feed::KEPT).unwrap() + 7;
    for number in 1..=shown {
        feed.show(&numbered(number));
    }
    let glimpse = feed.newer_than(0).unwrap();
    assert_eq!(glimpse.traces.len(), super::feed::KEPT);
    assert_eq!(glimpse.traces[0].t_s, [8.0]);
    assert!(feed.newer_than(u64::from(shown)).is_none());
}

#[test]
fn a_channel_that_comes_later_keeps_its_time() {
    let mut one = numbered(1).trace;
    one.envelopes.clear();
    let all = super::feed::joined(&[one.into(), numbered(2).trace.into()]);
    assert_eq!(all.t_s, [1.0, 2.0]);
    assert!(all.envelopes[0][0].is_nan());
    assert_eq!(all.envelopes[0][1], 2.0);
}

#[test]
fn demonstrations_are_sent_when_they_change() {
    let (page, _acts) = page();
    let mut socket = look(&page);
    let mut view = View::default();
    for (id, news) in [(1, true), (1, false), (2, true), (2, false)] {
        view.demonstrations = vec![DemonstrationView {
            id,
            ..DemonstrationView::default()
        }];
        page.show(&view);
        let sent = hear(&mut socket);
        say(&mut socket, &json!({"seen": sent["number"]}));
        assert_eq!(sent["demonstrations"].is_array(), news);
        assert_eq!(sent["view"]["demonstrations"], json!([]));
    }
}

#[test]
fn nonsense_is_answered_and_nothing_is_done() {
    let (page, acts) = page();
    let mut socket = look(&page);
    for (said, reason) in [
        ("{", "no JSON"),
        (r#"{"act": "fly"}"#, "unknown variant `fly`"),
        (r#"{"act": "record"}"#, "missing field `label`"),
        (
            r#"{"act": "record", "label": "a", "more": 1}"#,
            "unknown field `more`",
        ),
        (
            r#"{"act": "trim", "id": -1, "from_s": 0, "to_s": 1}"#,
            "invalid value: integer `-1`",
        ),
        (r#"{"seen": "one"}"#, "must be the number of a view"),
        ("[]", "nothing that can be done"),
    ] {
        socket.send(Message::text(said)).unwrap();
        let refused = hear(&mut socket)["refused"].as_str().unwrap().to_owned();
        assert!(refused.contains(reason), "{said}: {refused}");
    }
    socket.send(Message::binary(vec![1, 2])).unwrap();
    assert!(
        hear(&mut socket)["refused"]
            .as_str()
            .unwrap()
            .contains("binary")
    );
    say(&mut socket, &json!({"act": "disarm"}));
    assert_eq!(acts.recv_timeout(PATIENCE).unwrap(), Act::Disarm);
    // Longer than anything there is to say: the connection ends.
    socket.send(Message::text(" ".repeat(17 * 1024))).unwrap();
    assert!(until(|| socket.read().is_err()));
    assert!(until(|| page.viewers() == 0));
}

#[test]
fn a_passkey_goes_to_whoever_asks_and_why_not_is_told() {
    let (sender, typed) = channel();
    let page = Page::serve(
        0,
        |_| panic!("a passkey is no act"),
        move |text| {
            sender.send(text.to_owned()).unwrap();
            match text.len() {
                6 => Ok(()),
                got => Err(format!("6 digits, not {got}")),
            }
        },
    )
    .unwrap();
    let mut socket = look(&page);
    for (said, refused) in [
        (json!({"passkey": "48213"}), "6 digits, not 5"),
        (json!({"passkey": 48_213}), "must be a text of six digits"),
        (json!({"passkey": "048213", "act": "arm"}), ""),
        (json!({"act": "passkey"}), "unknown variant"),
    ] {
        say(&mut socket, &said);
        if !refused.is_empty() {
            let told = hear(&mut socket)["refused"].as_str().unwrap().to_owned();
            assert!(told.contains(refused) && !told.contains("48213"), "{told}");
        }
    }
    assert_eq!(typed.try_iter().collect::<Vec<_>>(), ["48213", "048213"]);
}

#[test]
fn an_act_is_taken_while_sending_is_stuck() {
    let (page, acts) = page();
    let mut socket = look(&page);
    // More than the connection holds, and nobody reads it.
    let mut view = View::default();
    view.demonstrations
        .resize_with(2_000, || DemonstrationView {
            speed_m_per_s: vec![0.1; 2_000],
            ..DemonstrationView::default()
        });
    page.show(&view);
    assert!(until(|| socket.get_ref().peek(&mut [0]).is_ok()));
    say(&mut socket, &json!({"act": "disarm"}));
    assert_eq!(acts.recv_timeout(PATIENCE).unwrap(), Act::Disarm);
}

#[test]
fn browsers_are_counted_and_limited() {
    let (page, _acts) = page();
    let mut sockets: Vec<_> = (0..8).map(|_| look(&page)).collect();
    assert_eq!(page.viewers(), 8);
    let right = format!("tonus, {}", parts(&page).1);
    assert_eq!(look_with(&page, &right, None).unwrap_err(), 503);
    sockets.truncate(3);
    assert!(until(|| page.viewers() == 3));
}

#[test]
fn a_page_that_is_dropped_is_gone() {
    let (page, _acts) = page();
    let address = parts(&page).0;
    let mut socket = look(&page);
    drop(page);
    assert!(socket.read().is_err());
    assert!(TcpStream::connect(address).is_err());
}

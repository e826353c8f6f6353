//! What is read and what is refused.

use proptest::prelude::*;
use tonus::leap::{
    Content, Follower, FrameError, MAX_BYTES, Message, Protocol, Refusal, Side, Wanted, parse,
};
use tonus_tests::seeded;

use super::frame;

fn hands(list: &str) -> String {
    format!(r#"{{"id":1,"timestamp":2,"hands":[{list}]}}"#)
}

#[test]
fn sizes_depth_and_counts_have_their_limits() {
    let padded = |length: usize| {
        let text = r#"{"version":6,"serviceVersion":""#.to_owned();
        let rest = length - text.len() - 2;
        text + &"x".repeat(rest) + "\"}"
    };
    assert_eq!(parse(&padded(MAX_BYTES)), Ok(Content::Version(6)));
    let got = MAX_BYTES + 1;
    assert_eq!(parse(&padded(got)), Err(FrameError::TooLarge { got }));

    let nested = |depth: usize| {
        let (open, close) = ("[".repeat(depth), "]".repeat(depth));
        format!(r#"{{"version":6,"x":{open}{close}}}"#)
    };
    assert_eq!(parse(&nested(11)), Ok(Content::Version(6)));
    assert_eq!(parse(&nested(12)), Err(FrameError::TooDeep));
    assert_eq!(parse(&"[".repeat(100_000)), Err(FrameError::TooDeep));
    // Brackets within strings nest nothing.
    let quoted = format!(r#"{{"version":6,"x":"\"{}"}}"#, "[{,".repeat(20_000));
    assert_eq!(parse(&quoted), Ok(Content::Version(6)));

    let many = format!(r#"{{"version":6,"x":[0{}]}}"#, ",0".repeat(20_000));
    assert_eq!(parse(&many), Err(FrameError::TooMany));
    let hand = r#"{"id":1,"palmPosition":[0,0,0]}"#;
    let eight = [hand; 8].join(",");
    assert!(matches!(parse(&hands(&eight)), Ok(Content::Frame(frame)) if frame.hands.len() == 8));
    let nine = [hand; 9].join(",");
    assert!(matches!(
        parse(&hands(&nine)),
        Err(FrameError::Malformed(_))
    ));
}

#[test]
fn what_no_hand_can_be_is_refused_by_name() {
    for (fields, named) in [
        (r#""palmPosition":[0,5001,0]"#, "palmPosition"),
        (
            r#""palmPosition":[0,0,0],"palmVelocity":[0,0,-50001]"#,
            "palmVelocity",
        ),
        (
            r#""palmPosition":[0,0,0],"palmNormal":[0,1.02,0]"#,
            "palmNormal",
        ),
        (
            r#""palmPosition":[0,0,0],"direction":[-1.02,0,0]"#,
            "direction",
        ),
        (
            r#""palmPosition":[0,0,0],"grabStrength":1.02"#,
            "grabStrength",
        ),
        (
            r#""palmPosition":[0,0,0],"pinchStrength":-0.02"#,
            "pinchStrength",
        ),
        (r#""palmPosition":[0,0,0],"confidence":-1"#, "confidence"),
    ] {
        let refused = parse(&hands(&format!(r#"{{"id":1,{fields}}}"#)));
        assert!(
            matches!(refused, Err(FrameError::OutOfRange { field, .. }) if field == named),
            "{fields}: {refused:?}"
        );
    }
}

#[test]
fn what_is_no_message_is_refused() {
    for text in [
        "",
        "null",
        "[]",
        "7",
        "{",
        "hello",
        r#"{"version":-1}"#,
        r#"{"version":6,"version":6}"#,
        r#"{"id":1,"timestamp":2,"hands":7}"#,
        r#"{"id":1,"timestamp":-2,"hands":[]}"#,
        r#"{"id":1,"timestamp":2,"hands":[{"id":1}]}"#,
        r#"{"id":1,"timestamp":2,"hands":[{"id":1,"palmPosition":[1,2]}]}"#,
        r#"{"id":1,"timestamp":2,"hands":[{"id":1,"palmPosition":[1,2,1e999]}]}"#,
        r#"{"id":1,"timestamp":2,"hands":[{"id":1,"palmPosition":[1,2,NaN]}]}"#,
    ] {
        assert!(
            matches!(parse(text), Err(FrameError::Malformed(_))),
            "{text}: {:?}",
            parse(text)
        );
    }
    for (text, lacks) in [
        ("{}", "hands"),
        (r#"{"timestamp":2,"hands":[]}"#, "id"),
        (r#"{"id":1,"hands":[]}"#, "timestamp"),
    ] {
        let refused = Err(FrameError::Incomplete { missing: lacks });
        assert_eq!(parse(text), refused);
    }
}

#[test]
fn versions_that_are_known() {
    for version in 1..=6_u8 {
        let mut follower = Follower::new(Wanted::Either, 0);
        let text = format!(r#"{{"version":{version},"serviceVersion":"2.3.1"}}"#);
        assert_eq!(
            follower.take(&text, 0),
            Ok(Message::Protocol(Protocol::WebSocket(version)))
        );
    }
    for got in [0, 7, 300] {
        let mut follower = Follower::new(Wanted::Either, 0);
        let refused = follower.take(&format!(r#"{{"version":{got}}}"#), 0);
        assert_eq!(refused, Err(Refusal::Version { got }));
        let frame = follower.take(&frame(1, 1, &[]), 0);
        assert_eq!(frame, Err(Refusal::NoVersion));
    }
}

proptest! {
    #![proptest_config(seeded(256))]

    #[test]
    fn any_text_is_read_or_refused(text in ".{0,400}") {
        let _ = parse(&text);
    }

    #[test]
    fn a_frame_cut_or_changed_anywhere_never_gives_an_impossible_hand(
        at in 0_usize..200, byte in 0_u8..128, cut: bool,
    ) {
        let mut bytes = frame(8, 80_000, &[(4, "right", 180.0), (5, "left", 170.0)]).into_bytes();
        let at = at % bytes.len();
        if cut { bytes.truncate(at) } else { bytes[at] = byte }
        let text = String::from_utf8(bytes).unwrap();
        if let Ok(Content::Frame(read)) = parse(&text) {
            for hand in read.hands {
                prop_assert!(hand.palm_m.iter().all(|v| v.abs() <= 5.0));
                prop_assert!(hand.side != Some(Side::Left) || hand.id <= 9);
            }
        }
    }
}

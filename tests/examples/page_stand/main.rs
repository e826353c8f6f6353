//! Serves the page with a scripted program behind it, for tests of the page alone and for working on it: `cargo run -p
//! tonus-tests --example page_stand [-- --channels 8 --pairs 1]`: the wearable asks for its passkey so many times. Nothing is measured or learnt here; only what is shown follows what is
//! done, as in `tonus run`.

mod calibration;
mod motion;
mod pairing;
mod stand;
mod teaching;

use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use tonus::link::ble::{Passkeys, passkey};
use tonus::page::Page;

/// Between two views, as the engine's.
const STEP: Duration = Duration::from_millis(20);

fn main() {
    let (mut channels, mut pairs) = (4, 0);
    let mut given = std::env::args().skip(1);
    while let Some(option) = given.next() {
        match (
            option.as_str(),
            given.next().and_then(|value| value.parse().ok()),
        ) {
            ("--channels", Some(count)) => channels = count,
            ("--pairs", Some(count)) => pairs = count,
            _ => panic!("page_stand [--channels N] [--pairs N]"),
        }
    }
    let (sender, acts) = channel();
    let passkeys = Passkeys::new(true);
    let asking = passkeys.clone();
    let give = move |typed: &str| {
        let given = passkey(typed).and_then(|passkey| asking.give(passkey));
        given.map_err(|not_taken| not_taken.to_string())
    };
    let page = Page::serve(
        0,
        move |act| sender.send(act).map_err(|_| "nobody takes it".to_owned()),
        give,
    )
    .expect("a page");
    println!("{}", page.url());
    let start = Instant::now();
    let mut stand = stand::Stand::new(channels);
    let mut pairing = pairing::Pairing::begin(passkeys, pairs);
    for step in 1_u32.. {
        let due = STEP * step;
        std::thread::sleep(due.saturating_sub(start.elapsed()));
        for act in acts.try_iter() {
            stand.act(act);
        }
        let mut view = stand.view(u64::try_from(due.as_micros()).expect("less than an age"));
        pairing.link(&mut view.link);
        page.show(&view);
    }
}

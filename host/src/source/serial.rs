//! The wearable on a serial port: unplugged and plugged in again it goes on.

use std::path::Path;
use std::time::{Duration, Instant};

use tonus_shared::wire::decode;

use crate::link::serial::{SerialError, SerialLink};
use crate::live::{Input, LinkEvent, Port, Request};

use super::Backoff;

/// How long a frame is waited for before requests are looked at.
const LOOK: Duration = Duration::from_millis(2);
/// After so long without a frame nobody is taken to be at the other end.
const SILENCE: Duration = Duration::from_secs(3);
/// How often a wait looks whether the program ends.
const NAP: Duration = Duration::from_millis(50);

/// Runs the wearable on this port, until the program ends.
pub fn run(port: &Port, name: &Path) {
    let mut backoff = Backoff::new();
    while !port.stopping() {
        let ended = SerialLink::open(name).and_then(|mut link| {
            backoff.worked();
            serve(&mut link, name, port)
        });
        let Err(error) = ended else { return };
        let reason = match error {
            SerialError::Unplugged { .. } => {
                format!("{}: unplugged: connect it again", name.display())
            }
            error => error.to_string(),
        };
        port.input(Input::Link(LinkEvent::Down { reason }));
        let until = Instant::now() + backoff.failed();
        while Instant::now() < until && !port.stopping() {
            std::thread::sleep(NAP);
        }
    }
}

/// Until the program ends, or the line does.
fn serve(link: &mut SerialLink, name: &Path, port: &Port) -> Result<(), SerialError> {
    let (mut up, mut heard) = (None, Instant::now());
    while !port.stopping() {
        if let Some(frame) = link.receive(LOOK)? {
            // A port that opens says nothing; a frame does.
            if decode(&frame).is_ok() {
                heard = Instant::now();
                if up != Some(true) {
                    tell_up(name, port);
                    up = Some(true);
                }
            }
            port.input(Input::Frame(frame));
        }
        while let Some(request) = port.request(Duration::ZERO) {
            if let Request::Frame(bytes) = request {
                link.send(&bytes)?;
            }
        }
        if heard.elapsed() > SILENCE && up != Some(false) {
            up = Some(false);
            port.input(Input::Link(LinkEvent::Down {
                reason: format!(
                    "{}: open, but no frame comes: check that it is the wearable's port, and that the wearable runs the wired image",
                    name.display()
                ),
            }));
        }
    }
    Ok(())
}

/// Tells that the link is up. What was asked while it was down is forgotten: it was meant for then.
fn tell_up(name: &Path, port: &Port) {
    while port.request(Duration::ZERO).is_some() {}
    port.input(Input::Link(LinkEvent::Up {
        name: name.display().to_string(),
        mtu: None,
        interval_us: None,
    }));
}

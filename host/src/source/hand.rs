//! The hand that a Leap Motion controller sees.

use std::time::{Duration, Instant};

use crate::leap::{Config, Leap, Protocol, Update};
use crate::live::{HandSeen, Input, Port, Prompt, Request, TrackerEvent};

/// How long a frame is waited for before it is looked whether the program ends.
const LOOK: Duration = Duration::from_millis(50);

/// Follows the hand, until the program ends; [`Leap`] connects again by itself.
pub fn run(port: &Port, config: Config) {
    let at = config.origin.to_string();
    let Some(started) = Instant::now().checked_sub(Duration::from_micros(port.now_us())) else {
        // The program started before the system did.
        return port.input(Input::Tracker(TrackerEvent::Down {
            reason: "the system's clock makes no sense: restart the program".to_owned(),
        }));
    };
    let wanted = config.wanted;
    let mut leap = Leap::new(config, started);
    while !port.stopping() {
        while let Some(request) = port.request(Duration::ZERO) {
            if let Request::Prompt(prompt) = request {
                let other = prompt == Prompt::TouchShoulder;
                leap.want(if other { wanted.other() } else { wanted });
            }
        }
        match leap.receive(LOOK) {
            None | Some(Update::Refused(_)) => {}
            Some(Update::Connected { protocol }) => {
                let name = match protocol {
                    Protocol::WebSocket(_) => format!("Leap service at {at}, {protocol}"),
                    Protocol::LeapC => format!("Leap service through {at}"),
                };
                port.input(Input::Tracker(TrackerEvent::Up { name }));
            }
            Some(Update::Lost(loss)) => {
                port.input(Input::Hand(None));
                port.input(Input::Tracker(TrackerEvent::Down {
                    reason: loss.to_string(),
                }));
            }
            Some(Update::Unseen) => port.input(Input::Hand(None)),
            Some(Update::Seen(sight)) => port.input(Input::Hand(Some(HandSeen {
                exposed_us: sight.exposed_us,
                position_m: sight.hand.palm_m,
            }))),
        }
    }
}

//! A recording in the place of devices: what wearable, tracker and robot gave then happens again, at its own pace or faster.
//!
//! What people did then is left out: today somebody else presses the buttons. [`crate::studio::play`] is for running a
//! recording as it ran.

use std::path::Path;
use std::time::Duration;

use crate::live::{HandSeen, Input, LinkEvent, Port, RobotSeen, Timed};
use crate::recording::{ReadError, Reading};

/// Shorter than any device's period.
const NAP: Duration = Duration::from_millis(1);

/// Opens a recording; [`run`] gives it out.
///
/// # Errors
/// [`ReadError`] names the file and what is wrong with it.
pub fn open(file: &Path) -> Result<Reading, ReadError> {
    Reading::open(file)
}

/// Gives out a recording as fast as it was, by the session's clock, until it or the program ends.
pub fn run(reading: Reading, port: &Port) {
    let mut first_us = None;
    let began_us = port.now_us();
    for timed in reading.inputs() {
        let timed = match timed {
            Ok(timed) => timed,
            Err(error) => return end(port, format!("the recording ends here: {error}")),
        };
        let first_us = *first_us.get_or_insert(timed.at_us);
        let due_us = began_us + timed.at_us.saturating_sub(first_us);
        let Some(input) = moved(timed, due_us) else {
            continue;
        };
        while port.now_us() < due_us {
            if port.stopping() {
                return;
            }
            // A recording answers no requests.
            while port.request(Duration::ZERO).is_some() {}
            std::thread::sleep(NAP);
        }
        port.input_at(due_us, input);
    }
    end(port, "the recording is over".to_owned());
}

fn end(port: &Port, reason: String) {
    port.input(Input::Link(LinkEvent::Down { reason }));
}

/// What a device gave, as if it came at `due_us`; none for what it was not.
fn moved(timed: Timed, due_us: u64) -> Option<Input> {
    let moved_us = |then_us: u64| due_us.saturating_sub(timed.at_us.saturating_sub(then_us));
    match timed.input {
        input @ (Input::Link(_) | Input::Frame(_) | Input::Tracker(_) | Input::Hand(None)) => {
            Some(input)
        }
        Input::Hand(Some(hand)) => Some(Input::Hand(Some(HandSeen {
            exposed_us: moved_us(hand.exposed_us),
            ..hand
        }))),
        Input::Robot(robot) => Some(Input::Robot(RobotSeen {
            measured_us: moved_us(robot.measured_us),
            ..robot
        })),
        Input::Act(_) | Input::Learnt(_) | Input::Stalled { .. } => None,
    }
}

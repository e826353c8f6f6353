//! The host's own logic, as `tonus run` has it, and somebody in the engine's place who asks and counts.

use std::io::BufRead;
use std::sync::Arc;
use std::time::Duration;

use tonus::link::ble::{AskPasskey, Wanted};
use tonus::link::myo::Armband;
use tonus::live::{Input, Inputs, LinkEvent, Plug, Request, SessionClock};
use tonus::source;
use tonus_shared::wire::{Control, Packet};

use crate::{Failure, arrivals::Arrivals, central::AirCentral, requests};

/// How often to look for inputs.
const LOOK: Duration = Duration::from_millis(2);

/// Runs until it is killed.
pub(crate) async fn wearable(mut central: AirCentral, packets: u64) -> Result<(), Failure> {
    let inputs = Inputs::new(SessionClock::start());
    let (port, plug) = inputs.port();
    let ask: AskPasskey = Arc::new(|_| {
        println!("passkey?");
        std::io::stdin()
            .lock()
            .lines()
            .next()?
            .ok()?
            .trim()
            .parse()
            .ok()
    });
    let wanted = Wanted::wearable(None);
    let running = async {
        while !port.stopping() {
            source::wearable::over(&mut central, &wanted, &ask, &port).await;
        }
    };
    tokio::select! {
        () = running => Ok(()),
        ended = watch(&inputs, &plug, packets) => ended,
    }
}

/// In the engine's place: after each link's start a calibration and a ping, then counting.
async fn watch(inputs: &Inputs, plug: &Plug, packets: u64) -> Result<(), Failure> {
    let arrivals = Arrivals::new();
    let mut told = true;
    loop {
        tokio::time::sleep(LOOK).await;
        while let Some(timed) = inputs.next(Duration::ZERO) {
            match timed.input {
                Input::Link(LinkEvent::Up {
                    name,
                    mtu,
                    interval_us,
                }) => {
                    println!("up {name} mtu {mtu:?} interval {interval_us:?}");
                    arrivals.forget();
                    told = false;
                    ask(plug)?;
                }
                Input::Link(LinkEvent::Down { reason }) => println!("down {reason}"),
                Input::Frame(bytes) => arrivals.take(&bytes),
                _ => {}
            }
        }
        for packet in arrivals.reports() {
            match packet {
                Packet::Reply(reply) => println!("reply {:?} {:?}", reply.answered, reply.outcome),
                Packet::Ping(ping) => println!("ping {ping:?}"),
                _ => {}
            }
        }
        if !told && let Some(line) = arrivals.counted(packets) {
            println!("{line} dropped {}", plug.dropped().0);
            told = true;
        }
    }
}

fn ask(plug: &Plug) -> Result<(), Failure> {
    for (sequence, packet) in [
        (1, Packet::Calibration(requests::calibration())),
        (2, requests::ping()),
    ] {
        let frame = requests::frame(&requests::header(sequence), &packet)?;
        plug.ask(Request::Frame(frame));
    }
    Ok(())
}

/// A Myo in a wearable's place, until it is killed: raw sEMG is asked for, and every scan of it is told.
pub(crate) async fn myo(mut central: AirCentral) -> Result<(), Failure> {
    let inputs = Inputs::new(SessionClock::start());
    let (port, plug) = inputs.port();
    let mut armband = Armband::new(1)?;
    let running = async {
        while !port.stopping() {
            source::myo::over(&mut central, &mut armband, &port).await;
        }
    };
    tokio::select! {
        () = running => Ok(()),
        ended = scans(&inputs, &plug) => ended,
    }
}

async fn scans(inputs: &Inputs, plug: &Plug) -> Result<(), Failure> {
    let arrivals = Arrivals::new();
    loop {
        tokio::time::sleep(LOOK).await;
        while let Some(timed) = inputs.next(Duration::ZERO) {
            match timed.input {
                Input::Link(LinkEvent::Up { name, .. }) => {
                    println!("up {name}");
                    let raw = Packet::Control(Control::Raw(true));
                    let frame = requests::frame(&requests::header(1), &raw)?;
                    plug.ask(Request::Frame(frame));
                }
                Input::Link(LinkEvent::Down { reason }) => println!("down {reason}"),
                Input::Frame(bytes) => arrivals.take(&bytes),
                _ => {}
            }
        }
        for packet in arrivals.reports() {
            match packet {
                Packet::Reply(reply) => println!("reply {:?} {:?}", reply.answered, reply.outcome),
                Packet::RawSemg(raw) => {
                    for (scan, index) in raw
                        .counts
                        .chunks(raw.channels.into())
                        .zip(raw.first_index..)
                    {
                        println!("scan {index} {scan:?}");
                    }
                }
                _ => {}
            }
        }
    }
}

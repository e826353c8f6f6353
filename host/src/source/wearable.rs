//! The wearable over Bluetooth LE.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use crate::link::ble::platform::SystemCentral;
use crate::link::ble::{AskPasskey, BleError, Central, NOTIFYING, Wanted, check, open, place};
use crate::live::{Input, LinkEvent, Port, Request};

use super::Backoff;

/// How often to look for requests: they wait at most this long on top of a connection interval.
pub(super) const LOOK: Duration = Duration::from_millis(2);
/// How often to look whether the link still carries the stream.
const CHECK: Duration = Duration::from_secs(1);
/// A wearable sends a hundred frames a second; after so long without any the link is taken for dead.
pub(super) const SILENCE: Duration = Duration::from_secs(5);

/// Runs the wearable of this name (none: any) by the system's Bluetooth, until the program ends.
pub fn run(port: &Port, name: Option<String>, ask: &AskPasskey) {
    system(port, async |central| {
        over(central, &Wanted::wearable(name.clone()), ask, port).await;
    });
}

/// Runs something on the system's Bluetooth, until the program ends; without an adapter it waits for one.
pub(super) fn system(port: &Port, mut with: impl AsyncFnMut(&mut SystemCentral)) {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build();
    let runtime = match runtime {
        Ok(runtime) => runtime,
        Err(error) => {
            return down(port, format!("no thread for Bluetooth: {error}"));
        }
    };
    runtime.block_on(async {
        let mut backoff = Backoff::new();
        while !port.stopping() {
            match SystemCentral::new().await {
                Ok(mut central) => with(&mut central).await,
                Err(error) => {
                    down(port, error.to_string());
                    pause(port, backoff.failed()).await;
                }
            }
        }
    });
    // A person who is asked for a passkey may never answer.
    runtime.shutdown_background();
}

/// Runs a wearable over any Bluetooth, until the program ends or this Bluetooth fails.
pub async fn over<C: Central>(central: &mut C, wanted: &Wanted, ask: &AskPasskey, port: &Port) {
    again(central, port, async |central, backoff| {
        let (found, parameters) = open(central, wanted, ask).await?;
        backoff.worked();
        up(
            port,
            found.title(),
            Some(parameters.mtu),
            parameters.interval_us,
        );
        serve(central, port).await
    })
    .await;
}

/// Visits again and again, and says why each visit ended; until the program ends, or the system's Bluetooth fails, which
/// must be asked for anew then.
pub(super) async fn again<C: Central>(
    central: &mut C,
    port: &Port,
    mut visit: impl AsyncFnMut(&mut C, &mut Backoff) -> Result<Infallible, BleError>,
) {
    let mut backoff = Backoff::new();
    while !port.stopping() {
        let ended = tokio::select! {
            Err(error) = visit(central, &mut backoff) => Some(error),
            () = stopped(port) => None,
        };
        central.leave().await;
        if let Some(error) = ended {
            down(port, error.to_string());
            pause(port, backoff.failed()).await;
            if matches!(error, BleError::System { .. }) {
                return;
            }
        }
    }
}

async fn serve<C: Central>(central: &mut C, port: &Port) -> Result<Infallible, BleError> {
    let mut look = tokio::time::interval(LOOK);
    look.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let (mut heard, mut checked) = (Instant::now(), Instant::now());
    loop {
        tokio::select! {
            notified = central.notified() => {
                let notified = notified?;
                heard = Instant::now();
                if NOTIFYING.contains(&notified.characteristic) {
                    port.input(Input::Frame(notified.value));
                }
            }
            _ = look.tick() => {}
        }
        while let Some(request) = port.request(Duration::ZERO) {
            if let Request::Frame(bytes) = request {
                send(central, &bytes).await?;
            }
        }
        if heard.elapsed() > SILENCE {
            return Err(BleError::Silent {
                seconds: SILENCE.as_secs(),
            });
        }
        if checked.elapsed() > CHECK {
            checked = Instant::now();
            check(&central.parameters().await?)?;
        }
    }
}

/// Sends one request. One that the wearable does not take stays without a reply, which whoever asked waits for; a
/// link that is gone shows in what is waited for next.
async fn send<C: Central>(central: &mut C, bytes: &[u8]) -> Result<(), BleError> {
    let Some(place) = place(bytes) else {
        return Ok(());
    };
    let written = central
        .write(place.characteristic, bytes, place.confirmed)
        .await;
    match written {
        Err(error @ BleError::LinkLost) => Err(error),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Tells that the link is up. What was asked while it was down is forgotten: it was meant for then.
pub(super) fn up(port: &Port, name: String, mtu: Option<u16>, interval_us: Option<u32>) {
    while port.request(Duration::ZERO).is_some() {}
    port.input(Input::Link(LinkEvent::Up {
        name,
        mtu,
        interval_us,
    }));
}

pub(super) fn down(port: &Port, reason: String) {
    port.input(Input::Link(LinkEvent::Down { reason }));
}

/// Waits until the program ends.
pub(super) async fn stopped(port: &Port) {
    while !port.stopping() {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Waits, unless the program ends.
pub(super) async fn pause(port: &Port, wait: Duration) {
    tokio::select! {
        () = tokio::time::sleep(wait) => {}
        () = stopped(port) => {}
    }
}

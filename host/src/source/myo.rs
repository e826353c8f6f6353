//! The Myo armband.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use crate::link::ble::{BleError, Central, Wanted, find};
use crate::link::myo::{self, Armband};
use crate::live::{Input, Port, Prompt, Request};

use super::wearable::{LOOK, SILENCE, again, down, system, up};

/// Runs a Myo armband by the system's Bluetooth, until the program ends. `boot_id` tells this start from others.
pub fn run(port: &Port, boot_id: u32) {
    let mut armband = match Armband::new(boot_id) {
        Ok(armband) => armband,
        Err(error) => return down(port, error.to_string()),
    };
    system(port, async |central| {
        over(central, &mut armband, port).await
    });
}

/// Runs an armband over any Bluetooth, until the program ends or this Bluetooth fails. Its calibration outlasts the link.
pub async fn over<C: Central>(central: &mut C, armband: &mut Armband, port: &Port) {
    let wanted = Wanted {
        kind: "Myo armband",
        service: myo::SERVICE,
        name: None,
    };
    again(central, port, async |central, backoff| {
        let found = find(central, &wanted).await?;
        central.connect(&found).await?;
        for characteristic in myo::SEMG.into_iter().chain([myo::IMU]) {
            central.subscribe(characteristic).await?;
        }
        armband.connected();
        for command in [&myo::NEVER_SLEEP[..], &myo::STREAM_ALL[..]] {
            central.write(myo::COMMAND, command, true).await?;
        }
        backoff.worked();
        // Its packets fit any attribute, and the host makes the frames.
        let interval_us = central.parameters().await?.interval_us;
        up(port, found.title(), None, interval_us);
        serve(central, armband, port).await
    })
    .await;
}

async fn serve<C: Central>(
    central: &mut C,
    armband: &mut Armband,
    port: &Port,
) -> Result<Infallible, BleError> {
    let mut look = tokio::time::interval(LOOK);
    look.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let mut heard = Instant::now();
    let send = |bytes: &[u8]| port.input(Input::Frame(bytes.to_vec()));
    loop {
        tokio::select! {
            notified = central.notified() => {
                let notified = notified?;
                let taken = armband.take(notified.characteristic, &notified.value, port.now_us(), send);
                // What is no packet is as good as silence.
                if taken.is_ok() {
                    heard = Instant::now();
                }
            }
            _ = look.tick() => {}
        }
        while let Some(request) = port.request(Duration::ZERO) {
            match request {
                Request::Frame(bytes) => armband.request(&bytes, port.now_us(), send),
                // The elbow is bent forward, the upper arm hangs.
                Request::Prompt(Prompt::Flex) => armband.hangs(port.now_us()),
                Request::Prompt(_) => armband.moves(),
            }
        }
        if heard.elapsed() > SILENCE {
            return Err(BleError::Silent {
                seconds: SILENCE.as_secs(),
            });
        }
    }
}

#[cfg(test)]
mod tests;

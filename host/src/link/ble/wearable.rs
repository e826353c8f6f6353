//! The wearable at the other end: how to find it, what its link must offer, where its frames go.

use std::time::{Duration, Instant};

use tonus_shared::gatt;
use tonus_shared::wire::{Kind, MIN_ATT_MTU, ModelUpload, Packet, decode};

use super::{AskPasskey, BleError, Central, Found, Parameters};

/// How long to look for an advertiser.
pub(super) const SCAN: Duration = Duration::from_secs(10);
/// Longest connection interval over which the wearable streams, microseconds: a notification takes up to two.
pub(super) const INTERVAL_LIMIT_US: u32 = 20_000;
/// The wearable asks for its interval when it is connected; it is granted by then.
const SETTLING: Duration = Duration::from_secs(3);
/// How often to look whether it is.
const LOOK: Duration = Duration::from_millis(100);

/// Every characteristic that notifies.
pub const NOTIFYING: [u128; 5] = [
    gatt::REPORTS,
    gatt::STREAM,
    gatt::RAW_SEMG,
    gatt::ORIENTATION,
    gatt::INFERENCE,
];

/// Whom to connect to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// What it is, for people.
    pub kind: &'static str,
    /// The service that it advertises.
    pub service: u128,
    /// Its advertised name or its address; none for any.
    pub name: Option<String>,
}

/// Where a frame of the host goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// To this characteristic.
    pub characteristic: u128,
    /// Whether its taking is confirmed.
    pub confirmed: bool,
}

impl Wanted {
    /// A wearable of this name, or any.
    #[must_use]
    pub fn wearable(name: Option<String>) -> Self {
        Self {
            kind: "wearable",
            service: gatt::SERVICE,
            name,
        }
    }

    /// Whether it is what is looked for, apart from its name.
    fn is_kind(&self, found: &Found) -> bool {
        found.services.contains(&self.service)
    }

    fn is(&self, found: &Found) -> bool {
        let named = self.name.as_ref().is_none_or(|wanted| {
            found.name.as_ref() == Some(wanted) || found.id.eq_ignore_ascii_case(wanted)
        });
        named && self.is_kind(found)
    }
}

impl Found {
    /// For people.
    #[must_use]
    pub fn title(&self) -> String {
        let name = self.name.as_deref().unwrap_or("nameless");
        format!("{name} ({})", self.id)
    }
}

/// Looks for one; the strongest, where there are several.
///
/// # Errors
/// [`BleError::NotFound`], which names the others of its kind, and those of [`Central::scan`].
pub async fn find<C: Central>(central: &mut C, wanted: &Wanted) -> Result<Found, BleError> {
    let found = central.scan(SCAN, &|found| wanted.is(found)).await?;
    let strength = |found: &&Found| found.rssi_dbm.unwrap_or(i16::MIN);
    let best = found.iter().filter(|found| wanted.is(found));
    if let Some(best) = best.max_by_key(strength) {
        return Ok(best.clone());
    }
    let others = found.iter().filter(|found| wanted.is_kind(found));
    Err(BleError::NotFound {
        wanted: match &wanted.name {
            Some(name) => format!("{} named {name}", wanted.kind),
            None => wanted.kind.to_owned(),
        },
        others: others.map(Found::title).collect(),
    })
}

/// Finds a wearable, connects, refuses a link that is not good enough, pairs and subscribes to everything.
///
/// # Errors
/// [`BleError`] of the step that failed; the link is ended then.
pub async fn open<C: Central>(
    central: &mut C,
    wanted: &Wanted,
    ask: &AskPasskey,
) -> Result<(Found, Parameters), BleError> {
    let found = find(central, wanted).await?;
    let opened = enter(central, &found, ask).await;
    if opened.is_err() {
        central.leave().await;
    }
    Ok((found, opened?))
}

async fn enter<C: Central>(
    central: &mut C,
    found: &Found,
    ask: &AskPasskey,
) -> Result<Parameters, BleError> {
    central.connect(found).await?;
    // Before anybody is asked for digits.
    let parameters = settled(central).await?;
    // A wearable that is not in its pairing window, or has forgotten its key, hangs up on a stranger.
    central.pair(ask).await.map_err(|error| match error {
        BleError::LinkLost => BleError::PairingRefused {
            reason: "it ended the link".to_owned(),
        },
        error => error,
    })?;
    for characteristic in NOTIFYING {
        central.subscribe(characteristic).await?;
    }
    Ok(parameters)
}

/// Waits until the link is as the wearable asks for, and refuses one that does not become so.
async fn settled<C: Central>(central: &mut C) -> Result<Parameters, BleError> {
    let until = Instant::now() + SETTLING;
    loop {
        let parameters = central.parameters().await?;
        match check(&parameters) {
            Ok(()) => return Ok(parameters),
            // The MTU was asked for before; only the interval is still to come.
            Err(error @ BleError::Interval { .. }) if Instant::now() >= until => return Err(error),
            Err(BleError::Interval { .. }) => tokio::time::sleep(LOOK).await,
            Err(error) => return Err(error),
        }
    }
}

/// Whether the stream fits the link. An interval that nobody tells is not held against it: the age of samples is.
///
/// # Errors
/// [`BleError::Mtu`] and [`BleError::Interval`].
pub fn check(parameters: &Parameters) -> Result<(), BleError> {
    if parameters.mtu < MIN_ATT_MTU {
        return Err(BleError::Mtu {
            got: parameters.mtu,
        });
    }
    match parameters.interval_us {
        Some(got_us) if got_us > INTERVAL_LIMIT_US => Err(BleError::Interval { got_us }),
        _ => Ok(()),
    }
}

/// Where the bytes of a frame go; none for what is no frame, or none that a host sends.
#[must_use]
pub fn place(bytes: &[u8]) -> Option<Place> {
    let packet = decode(bytes).ok()?.packet;
    let (characteristic, confirmed) = match packet.kind() {
        Kind::HandPosition => (gatt::HAND_POSITION, false),
        Kind::Ping => (gatt::PING, false),
        Kind::Control => (gatt::CONTROL, true),
        Kind::Calibration => (gatt::CALIBRATION, true),
        // Many follow one another, and each is answered by a reply.
        Kind::ModelUpload => (
            gatt::MODEL_UPLOAD,
            !matches!(packet, Packet::ModelUpload(ModelUpload::Piece { .. })),
        ),
        _ => return None,
    };
    Some(Place {
        characteristic,
        confirmed,
    })
}

#[cfg(test)]
mod tests;

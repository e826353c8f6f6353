//! Bluetooth LE: the wearable's packets over an authenticated link, and over no other.
//!
//! The wearable has no keyboard: it shows a six-digit passkey and the host types it. A host with neither
//! display nor keyboard falls back to "Just Works", which encrypts without knowing whom it talks to; such a
//! link gets nothing and is dropped. A new host may pair only while the [`PairingWindow`] is open; one that
//! has paired comes back by its bond. Nothing that a host writes is looked at before its link is
//! authenticated, and all of it goes through the [`Inbox`].

mod attributes;
mod bonds;
mod guard;
mod kept;
mod link;
mod sending;
mod shown;
mod window;

pub use attributes::DeviceInformation;
pub use bonds::{BOND_BYTES, BondList, BondRecord, Bonds, BondsNotKept, MAX_BONDS};
pub use kept::KeptBonds;
pub use sending::Withheld;
pub use shown::Shown;
pub use window::{OPEN, PairingWindow};

use core::{cell::Cell, convert::Infallible, sync::atomic::AtomicU8};

use bt_hci::{
    cmd::le::{LeReadLocalSupportedFeatures, LeSetDataLength, LeSetPhy},
    controller::{ControllerCmdAsync, ControllerCmdSync},
};
use embassy_futures::select::{Either, select, select3};
use embassy_time::{Duration, Timer};
use tonus_shared::{gatt, wire::MAX_FRAME_BYTES};
use trouble_host::{
    Address, BleHostError, Controller, Error, HostResources, IoCapabilities, Stack,
    advertise::{
        AdStructure, Advertisement, AdvertisementParameters, BR_EDR_NOT_SUPPORTED,
        LE_GENERAL_DISCOVERABLE,
    },
    gatt::GattConnection,
    peripheral::Peripheral,
    prelude::DefaultPacketPool,
};

use crate::{inbox::Inbox, outbox::Outbox};
use attributes::{Attributes, Server};
use guard::Guarded;

const CONNECTIONS: usize = 1;
/// Connection-oriented channels: none is offered.
const CHANNELS: usize = 1;
const ADVERTISING_SETS: usize = 1;
/// The stack holds the key of a link that has not been judged yet beside those that are kept.
const KEYS: usize = MAX_BONDS + 1;
/// Time between a failure of the host stack and its next start.
const RESTART_PAUSE: Duration = Duration::from_millis(500);

type Pool = DefaultPacketPool;
type Hosts<'v> = Server<'v, Pool, KEYS>;
type Link<'stack, 'server> = GattConnection<'stack, 'server, Pool>;

/// What the person at the console may want to know.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Notice {
    /// A host may connect now.
    Advertising,
    /// A host tried to connect, and the link did not come about.
    LinkFailed(Error),
    /// A host connected; nothing is authenticated yet.
    Connected,
    /// Type these six digits at the host.
    Passkey(u32),
    /// A host paired with the passkey; the pairing window is closed again.
    Paired,
    /// The bond just made is lost at the next reset: the storage failed.
    BondNotKept,
    /// A host came back by its bond.
    Resumed,
    /// Pairing failed: a wrong passkey, legacy pairing, or the host gave up.
    PairingFailed(Error),
    /// The wearable dropped the link.
    Dropped(Dropped),
    /// Frames are not sent, for this reason, until further notice.
    Withheld(Withheld),
    /// The link does without this: the controller or the host did not grant it.
    NotGranted(Wish),
    /// A request of the host could not be answered.
    RequestFailed(Error),
    /// The host left, or was dropped.
    Disconnected,
    /// The host stack failed and starts anew.
    Restarted(Error),
}

/// Why the wearable dropped a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Dropped {
    /// A host asked to pair while the window was closed: press the button and try again.
    WindowClosed,
    /// The host paired without comparing a passkey.
    NoPasskey,
    /// The link stayed unauthenticated for too long and kept others out.
    Stranger,
}

/// What makes a link better, and is asked for after it is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Wish {
    /// Air packets of 251 bytes.
    DataLength,
    /// Two megabits per second.
    TwoMegabits,
    /// A connection interval of 15 ms.
    Interval,
}

/// What the radio shares with the rest of the wearable.
pub struct Ports<'a> {
    /// Frames to send.
    pub outbox: &'a Outbox,
    /// Frames that a host wrote.
    pub inbox: &'a Inbox,
    /// The calibration that a host reads.
    pub calibration: &'a Shown,
    /// Opened by the button.
    pub window: &'a PairingWindow,
    /// State of charge, percent.
    pub battery_percent: &'a AtomicU8,
    /// What a host may read without pairing.
    pub device: DeviceInformation,
}

/// Runs the radio for ever: advertises, pairs, notifies what appears in the outbox and fills the inbox.
///
/// `address` is the wearable's static random address. `report` is called in the radio's own task and must
/// be short. A failure of the host stack, which a stranger may be able to cause, starts it anew.
///
/// # Errors
/// When the controller itself fails; there is no way on but a reset.
pub async fn run<C>(
    controller: &C,
    address: Address,
    ports: &Ports<'_>,
    bonds: &mut impl Bonds,
    report: impl Fn(Notice),
) -> Result<Infallible, C::Error>
where
    C: Controller
        + ControllerCmdAsync<LeSetPhy>
        + ControllerCmdSync<LeSetDataLength>
        + ControllerCmdSync<LeReadLocalSupportedFeatures>,
{
    let mut kept = bonds.load().await;
    kept.retain(|record| record.bond().is_some());
    let phy_answers = Cell::new(true);
    loop {
        let served = serve(
            controller,
            address,
            ports,
            (&mut kept, bonds),
            &phy_answers,
            &report,
        );
        match served.await {
            Ok(never) => match never {},
            Err(BleHostError::Controller(error)) => return Err(error),
            Err(BleHostError::BleHost(error)) => report(Notice::Restarted(error)),
        }
        Timer::after(RESTART_PAUSE).await;
    }
}

/// One life of the host stack, with the bonds kept and where to keep them.
///
/// `phy_answers` outlives it: after a command that was not answered a controller may take no other.
async fn serve<C>(
    controller: &C,
    address: Address,
    ports: &Ports<'_>,
    (kept, bonds): (&mut BondList, &mut impl Bonds),
    phy_answers: &Cell<bool>,
    report: &impl Fn(Notice),
) -> Result<Infallible, BleHostError<C::Error>>
where
    C: Controller
        + ControllerCmdAsync<LeSetPhy>
        + ControllerCmdSync<LeSetDataLength>
        + ControllerCmdSync<LeReadLocalSupportedFeatures>,
{
    let mut resources: HostResources<Pool, CONNECTIONS, CHANNELS, ADVERTISING_SETS, KEYS> =
        HostResources::new();
    let stack = trouble_host::new(Guarded(controller), &mut resources)
        .set_random_address(address)
        .set_io_capabilities(IoCapabilities::DisplayOnly)
        .build();
    reconcile(&stack, kept)?;
    let mut calibration = [0; MAX_FRAME_BYTES];
    let (table, attributes) = Attributes::build(&ports.device, &mut calibration)?;
    let server = Hosts::new(table);
    let mut runner = stack.runner();
    let mut peripheral = stack.peripheral();
    let serving = async {
        loop {
            report(Notice::Advertising);
            let link = match advertise(&mut peripheral, &server).await? {
                Ok(link) => link,
                Err(error) => {
                    report(Notice::LinkFailed(error));
                    continue;
                }
            };
            report(Notice::Connected);
            ports.outbox.clear();
            let host = link::Host {
                link: &link,
                attributes: &attributes,
                ports,
                report,
            };
            select3(
                host.attend(&stack, kept, bonds),
                host.send(),
                host.ask(&stack, phy_answers),
            )
            .await;
            drop(link);
            reconcile(&stack, kept)?;
            report(Notice::Disconnected);
        }
    };
    match select(runner.run(), serving).await {
        Either::First(ended) => ended.and(Err(Error::InvalidState.into())),
        Either::Second(ended) => ended,
    }
}

/// Gives the stack the bonds that are kept and takes all others from it: a stranger that pairs under a
/// known host's address would otherwise leave its key in place of the host's.
fn reconcile<C: Controller>(stack: &Stack<'_, C, Pool>, kept: &BondList) -> Result<(), Error> {
    let mut missing = kept.clone();
    loop {
        let stray = stack.with_bond_information(|held| {
            missing.retain(|record| !held.iter().any(|bond| record.bond().as_ref() == Some(bond)));
            held.iter()
                .find(|bond| {
                    !kept
                        .iter()
                        .any(|record| record.bond().as_ref() == Some(*bond))
                })
                .map(|bond| bond.identity)
        });
        let Some(identity) = stray else { break };
        stack.remove_bond_information(identity)?;
    }
    for bond in missing.iter().filter_map(BondRecord::bond) {
        stack.add_bond_information(bond)?;
    }
    Ok(())
}

/// Advertises until a host connects. What went wrong with one host is the inner error; the next may try.
async fn advertise<'stack, 'server, C: Controller>(
    peripheral: &mut Peripheral<'stack, C, Pool>,
    server: &'server Hosts<'_>,
) -> Result<Result<Link<'stack, 'server>, Error>, BleHostError<C::Error>> {
    let mut data = [0; 31];
    let length = AdStructure::encode_slice(
        &[
            AdStructure::Flags(LE_GENERAL_DISCOVERABLE | BR_EDR_NOT_SUPPORTED),
            AdStructure::CompleteServiceUuids128(&[gatt::SERVICE.to_le_bytes()]),
            AdStructure::CompleteLocalName(gatt::DEVICE_NAME.as_bytes()),
        ],
        &mut data,
    )?;
    let advertiser = peripheral
        .advertise(
            &AdvertisementParameters::default(),
            Advertisement::ConnectableScannableUndirected {
                adv_data: &data[..length],
                scan_data: &[],
            },
        )
        .await?;
    let accepted = advertiser.accept().await;
    Ok(accepted.and_then(|connection| connection.with_attribute_server(server)))
}

#[cfg(test)]
mod tests;

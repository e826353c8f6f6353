//! Bluetooth LE: one service, whose data leave only over an authenticated link.
//!
//! The wearable has no keyboard: it shows a six-digit passkey and the host types it. A host with neither
//! display nor keyboard falls back to "Just Works", which encrypts without knowing whom it talks to; such a
//! link may neither read nor subscribe.

use bt_hci::{
    cmd::le::{LeConnUpdate, LeReadLocalSupportedFeatures},
    controller::{ControllerCmdAsync, ControllerCmdSync},
};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_time::{Duration, with_timeout};
use tonus_shared::{gatt, wire::MIN_ATT_MTU};
use trouble_host::{
    Address, BleHostError, Controller, Error, HostResources, IoCapabilities, Stack,
    advertise::{
        AdStructure, Advertisement, AdvertisementParameters, BR_EDR_NOT_SUPPORTED,
        LE_GENERAL_DISCOVERABLE,
    },
    attribute::{
        AttributeTable, Characteristic, CharacteristicProp, PermissionLevel, Service, Uuid,
    },
    connection::RequestedConnParams,
    gap::GapConfig,
    gatt::{GattConnection, GattConnectionEvent},
    peripheral::Peripheral,
    prelude::{AttributeServer, DefaultPacketPool},
};

use crate::outbox::{EncodedFrame, Outbox};

/// Longest connection interval that the stream is sent over: a notification may wait for just over two of them.
const INTERVAL_LIMIT: Duration = Duration::from_millis(20);
/// The connection interval asked for.
const INTERVAL_WANTED: Duration = Duration::from_millis(15);
/// No procedure of the controller is waited for longer than this.
const PROCEDURE_LIMIT: Duration = Duration::from_secs(2);
/// How often a silent link is checked, should its `Disconnected` event have been lost.
const LIVENESS_PERIOD: Duration = Duration::from_secs(1);

const CONNECTIONS: usize = 1;
/// Connection-oriented channels: none is offered.
const CHANNELS: usize = 1;
const ADVERTISING_SETS: usize = 1;
/// Hosts whose bond and subscription are remembered until reset.
const BONDS: usize = 4;
/// GAP service with name and appearance (5), GATT service (1), ours with its declaration, value and
/// subscription (4).
const ATTRIBUTES: usize = 10;

type Pool = DefaultPacketPool;
type Table<'v> = AttributeTable<'v, NoopRawMutex, ATTRIBUTES>;
type Server<'v> = AttributeServer<'v, NoopRawMutex, Pool, ATTRIBUTES, BONDS>;
type Link<'stack, 'server> = GattConnection<'stack, 'server, Pool>;

/// Why a frame stayed on the wearable.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Withheld {
    /// The host did not raise the attribute MTU; the frame would be cut short.
    MtuTooSmall {
        /// Bytes needed.
        needed: u16,
        /// Bytes negotiated.
        negotiated: u16,
    },
    /// Frames would arrive too old to act on.
    IntervalTooLong {
        /// Longest connection interval accepted, in microseconds.
        limit_us: u64,
        /// The link's interval in microseconds.
        actual_us: u64,
    },
    /// The stack refused it; on a link without authentication this is `INSUFFICIENT_AUTHENTICATION`.
    NotSent(Error),
}

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
    /// Pairing ended; `authenticated` is false for "Just Works", which gets no data.
    Paired {
        /// Whether a passkey was compared.
        authenticated: bool,
    },
    /// Pairing failed.
    PairingFailed(Error),
    /// Frames are not sent, for this reason, until further notice.
    Withheld(Withheld),
    /// The 15 ms connection interval could not be asked for.
    IntervalNotRequested,
    /// A request of the host could not be answered.
    RequestFailed(Error),
    /// The host left.
    Disconnected,
}

/// Runs the radio for ever: advertises, pairs, and notifies what appears in `outbox`.
///
/// `address` is the wearable's static random address. `report` is called in the radio's own task and must
/// be short.
///
/// # Errors
/// When the controller fails or the host stack cannot be set up; there is no way on but a reset.
pub async fn run<C>(
    controller: C,
    address: Address,
    outbox: &Outbox,
    report: impl Fn(Notice),
) -> Result<(), BleHostError<C::Error>>
where
    C: Controller
        + ControllerCmdAsync<LeConnUpdate>
        + ControllerCmdSync<LeReadLocalSupportedFeatures>,
{
    let mut resources: HostResources<Pool, CONNECTIONS, CHANNELS, ADVERTISING_SETS, BONDS> =
        HostResources::new();
    let stack = trouble_host::new(controller, &mut resources)
        .set_random_address(address)
        .set_io_capabilities(IoCapabilities::DisplayOnly)
        .build();
    let (table, stream) = attributes()?;
    let server = Server::new(table);
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
            outbox.clear();
            select(
                attend(&stack, &link, &report),
                send(&link, &stream, outbox, &report),
            )
            .await;
            report(Notice::Disconnected);
        }
    };
    match select(runner.run(), serving).await {
        Either::First(ended) | Either::Second(ended) => ended,
    }
}

/// The attribute table and the stream characteristic in it.
///
/// The value is never readable and a subscription needs an authenticated link: the stack checks the
/// latter again before every notification, so a remembered subscription does not open a new link.
fn attributes<'v>() -> Result<(Table<'v>, Characteristic<EncodedFrame>), Error> {
    let mut table = Table::new();
    GapConfig::default(gatt::DEVICE_NAME)
        .build(&mut table)
        .map_err(|_| Error::InvalidValue)?;
    let mut service = table.add_service(Service::new(uuid(gatt::SERVICE)));
    let stream = service
        .add_characteristic_small(
            uuid(gatt::STREAM),
            [CharacteristicProp::Notify],
            EncodedFrame::new(),
        )
        .cccd_permission(PermissionLevel::AuthenticationRequired)
        .build();
    service.build();
    Ok((table, stream))
}

/// Identifiers travel least significant byte first.
fn uuid(value: u128) -> Uuid {
    Uuid::new_long(value.to_le_bytes())
}

/// Advertises until a host connects. What went wrong with one host is the inner error; the next may try.
async fn advertise<'stack, 'server, C: Controller>(
    peripheral: &mut Peripheral<'stack, C, Pool>,
    server: &'server Server<'_>,
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

/// Answers the host until it leaves.
async fn attend<C>(stack: &Stack<'_, C, Pool>, link: &Link<'_, '_>, report: &impl Fn(Notice))
where
    C: Controller
        + ControllerCmdAsync<LeConnUpdate>
        + ControllerCmdSync<LeReadLocalSupportedFeatures>,
{
    let wanted = RequestedConnParams {
        min_connection_interval: INTERVAL_WANTED,
        max_connection_interval: INTERVAL_WANTED,
        max_latency: 0,
        min_event_length: Duration::from_secs(0),
        max_event_length: Duration::from_secs(0),
        supervision_timeout: Duration::from_millis(2000),
    };
    let asked = link.raw().update_connection_params(stack, &wanted);
    if !matches!(with_timeout(PROCEDURE_LIMIT, asked).await, Ok(Ok(()))) {
        report(Notice::IntervalNotRequested);
    }
    loop {
        let Ok(event) = with_timeout(LIVENESS_PERIOD, link.next()).await else {
            if link.raw().is_connected() {
                continue;
            }
            return;
        };
        match event {
            GattConnectionEvent::Disconnected { .. } => return,
            GattConnectionEvent::PassKeyDisplay(key) => report(Notice::Passkey(key.value())),
            GattConnectionEvent::PairingComplete { security_level, .. } => {
                report(Notice::Paired {
                    authenticated: security_level.authenticated(),
                });
            }
            GattConnectionEvent::PairingFailed(error) => report(Notice::PairingFailed(error)),
            GattConnectionEvent::Gatt { event } => match event.accept() {
                Ok(reply) => reply.send().await,
                Err(error) => report(Notice::RequestFailed(error)),
            },
            _ => {}
        }
    }
}

/// Notifies each newest frame; never returns. A reason to withhold is reported when it changes, not per frame.
async fn send(
    link: &Link<'_, '_>,
    stream: &Characteristic<EncodedFrame>,
    outbox: &Outbox,
    report: &impl Fn(Notice),
) {
    let mut last = Ok(());
    loop {
        let frame = outbox.take().await;
        if !stream.should_notify(link) {
            continue;
        }
        let interval = link.raw().params().conn_interval;
        let outcome = match admit(link.raw().att_mtu(), interval) {
            Ok(()) => stream
                .notify(link, &frame, false)
                .await
                .map_err(Withheld::NotSent),
            refused => refused,
        };
        if outcome != last {
            if let Err(reason) = &outcome {
                report(Notice::Withheld(reason.clone()));
            }
            last = outcome;
        }
    }
}

/// Whether a link carries frames whole and in time.
fn admit(att_mtu: u16, interval: Duration) -> Result<(), Withheld> {
    if att_mtu < MIN_ATT_MTU {
        return Err(Withheld::MtuTooSmall {
            needed: MIN_ATT_MTU,
            negotiated: att_mtu,
        });
    }
    if interval > INTERVAL_LIMIT {
        return Err(Withheld::IntervalTooLong {
            limit_us: INTERVAL_LIMIT.as_micros(),
            actual_us: interval.as_micros(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests;

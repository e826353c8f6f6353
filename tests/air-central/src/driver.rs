//! Owns trouble's stack for [`crate::central::AirCentral`].

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::fmt::Debug;

use bt_hci::param::BdAddr;
use embassy_futures::select::{Either, Either3, select, select3};
use embassy_sync::{blocking_mutex::raw::NoopRawMutex, signal::Signal};
use embassy_time::{Duration, with_timeout};
use tokio::sync::mpsc;
use tonus::link::ble::{AskPasskey, BleError, Found, Notified, Parameters};
use trouble_host::{
    Address, BleHostError, Error, Stack,
    attribute::{Characteristic, Uuid},
    connection::{ConnectConfig, Connection, ConnectionEvent, RequestedConnParams, ScanConfig},
    gatt::GattClient,
    prelude::EventHandler,
    scan::{LeAdvReportsIter, LeExtAdvReportsIter, Scanner},
};

use crate::central::{Command, LOOK};
use crate::{Failure, INTERVAL, Pool, Radio};

const SERVICES: usize = 8;
const CHARACTERISTICS: usize = 16;
/// How long an advertiser may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Turns notifications on (Bluetooth Core 5.4, volume 3, part G, 3.3.3.3).
const NOTIFY: [u8; 2] = [1, 0];
/// Kinds of advertising data (Bluetooth Assigned Numbers 2.3).
const SERVICES_128: [u8; 2] = [0x06, 0x07];
const NAMES: [u8; 2] = [0x08, 0x09];

type Client<'a> = GattClient<'a, Radio, Pool, SERVICES>;
type Commands = mpsc::UnboundedReceiver<Command>;
type Values = BTreeMap<u128, Characteristic<[u8]>>;

/// Who has been heard of.
#[derive(Default)]
pub(crate) struct Heard(RefCell<BTreeMap<String, Found>>);

impl Heard {
    fn of(&self, address: BdAddr, rssi: i8, data: &[u8]) {
        let bytes = address.into_inner();
        let parts: Vec<String> = bytes
            .iter()
            .rev()
            .map(|byte| format!("{byte:02X}"))
            .collect();
        let id = parts.join(":");
        let mut heard = self.0.borrow_mut();
        // What is advertised and what is answered to a scan come apart.
        let found = heard.entry(id.clone()).or_insert(Found {
            id,
            name: None,
            services: Vec::new(),
            rssi_dbm: Some(rssi.into()),
        });
        note(data, found);
    }
}

impl EventHandler for Heard {
    fn on_adv_reports(&self, reports: LeAdvReportsIter<'_>) {
        for report in reports.flatten() {
            self.of(report.addr, report.rssi, report.data);
        }
    }

    /// Bumble's controller reports in this way, however the scan was asked for.
    fn on_ext_adv_reports(&self, reports: LeExtAdvReportsIter<'_>) {
        for report in reports.flatten() {
            self.of(report.addr, report.rssi, report.data);
        }
    }
}

/// Notes the structures of advertising data: length, kind, bytes.
fn note(mut data: &[u8], found: &mut Found) {
    while let Some((&length, rest)) = data.split_first() {
        let Some((structure, rest)) = rest.split_at_checked(length.into()) else {
            return;
        };
        data = rest;
        let Some((kind, value)) = structure.split_first() else {
            return;
        };
        if SERVICES_128.contains(kind) {
            for uuid in value.as_chunks::<16>().0 {
                let uuid = u128::from_le_bytes(*uuid);
                if !found.services.contains(&uuid) {
                    found.services.push(uuid);
                }
            }
        } else if NAMES.contains(kind) {
            found.name = Some(String::from_utf8_lossy(value).into_owned());
        }
    }
}

/// Does what it is asked for, for ever.
pub(crate) async fn drive(
    stack: &Stack<'_, Radio, Pool>,
    heard: &Heard,
    interval: Duration,
    mut commands: Commands,
) -> Result<(), Failure> {
    while let Some(command) = commands.recv().await {
        match command {
            Command::Scan(to) => {
                heard.0.borrow_mut().clear();
                let mut central = stack.central();
                let mut scanner = Scanner::new(&mut central);
                let session = scanner.scan(&ScanConfig::default()).await?;
                tokio::time::sleep(LOOK).await;
                session.stop().await;
                let _asker_gone = to.send(heard.0.borrow().clone());
            }
            Command::Connect(address, to) => match connect(stack, address, interval).await {
                Err(error) => _ = to.send(Err(format!("{error}"))),
                Ok(link) => {
                    let ended = stay(stack, &link, to, &mut commands).await;
                    println!(
                        "link ended {}",
                        ended.map_or_else(|it| it.to_string(), |()| "left".to_owned())
                    );
                    link.disconnect();
                    while link.is_connected() {
                        tokio::time::sleep(LOOK / 10).await;
                    }
                }
            },
            // There is no link: whoever asks hears nothing, and takes it so.
            _ => {}
        }
    }
    Ok(())
}

async fn connect<'stack>(
    stack: &'stack Stack<'_, Radio, Pool>,
    address: Address,
    interval: Duration,
) -> Result<Connection<'stack, Pool>, Failure> {
    let mut central = stack.central();
    let config = ConnectConfig {
        scan_config: ScanConfig {
            filter_accept_list: &[address],
            ..ScanConfig::default()
        },
        connect_params: RequestedConnParams {
            min_connection_interval: interval,
            max_connection_interval: interval,
            ..RequestedConnParams::default()
        },
    };
    let link = with_timeout(PATIENCE, central.connect(&config)).await;
    Ok(link.map_err(|_| Failure::Stack(Error::Timeout))??)
}

/// From the connection to the end of the link.
async fn stay(
    stack: &Stack<'_, Radio, Pool>,
    link: &Connection<'_, Pool>,
    to: tokio::sync::oneshot::Sender<Result<mpsc::UnboundedReceiver<Notified>, String>>,
    commands: &mut Commands,
) -> Result<(), Failure> {
    let client = Client::new(stack, link).await?;
    let (arrived, arriving) = mpsc::unbounded_channel();
    let pairing = Pairing::default();
    let begun = async {
        let values = discover(&client).await?;
        let _asker_gone = to.send(Ok(arriving));
        let serving = Serving {
            link,
            client: &client,
            values: &values,
            pairing: &pairing,
        };
        match select(serving.listen(&arrived), serving.obey(commands)).await {
            Either::First(ended) | Either::Second(ended) => ended,
        }
    };
    match select3(client.task(), pairing.follow(stack, link), begun).await {
        Either3::First(ended) => Ok(ended?),
        Either3::Second(ended) | Either3::Third(ended) => ended,
    }
}

/// A pairing, from the wish to its end.
#[derive(Default)]
struct Pairing {
    /// Whom to ask for the digits.
    ask: RefCell<Option<AskPasskey>>,
    /// Whether digits were given.
    given: Cell<bool>,
    ended: Signal<NoopRawMutex, Result<(), BleError>>,
}

impl Pairing {
    /// Grants what the wearable asks of the link, and sees a pairing through.
    async fn follow(
        &self,
        stack: &Stack<'_, Radio, Pool>,
        link: &Connection<'_, Pool>,
    ) -> Result<(), Failure> {
        loop {
            match link.next().await {
                // A host that has chosen a longer interval keeps to it.
                ConnectionEvent::RequestConnectionParams(request)
                    if link.params().conn_interval > INTERVAL =>
                {
                    request.reject(stack).await?;
                }
                ConnectionEvent::RequestConnectionParams(request) => {
                    request.accept(None, stack).await?;
                }
                ConnectionEvent::PassKeyInput => self.type_in(link).await?,
                ConnectionEvent::PairingComplete { security_level, .. } => {
                    println!("paired {security_level:?}");
                    self.ended.signal(Ok(()));
                }
                ConnectionEvent::PairingFailed(error) => {
                    self.ended.signal(Err(self.failed(&error)))
                }
                ConnectionEvent::Disconnected { .. } => return Err(Failure::LinkLost),
                _ => {}
            }
        }
    }

    async fn type_in(&self, link: &Connection<'_, Pool>) -> Result<(), Failure> {
        let ask = self.ask.borrow().clone();
        let typed = tokio::task::spawn_blocking(move || ask.and_then(|ask| ask("the wearable")));
        match typed.await.ok().flatten() {
            Some(passkey) => {
                self.given.set(true);
                link.pass_key_input(passkey)?;
            }
            None => {
                link.pass_key_cancel()?;
                self.ended.signal(Err(BleError::NoPasskey));
            }
        }
        Ok(())
    }

    fn failed(&self, error: &Error) -> BleError {
        if self.given.get() {
            return BleError::WrongPasskey;
        }
        BleError::PairingRefused {
            reason: format!("{error:?}"),
        }
    }
}

/// A link in use.
struct Serving<'a, 'stack> {
    link: &'a Connection<'stack, Pool>,
    client: &'a Client<'stack>,
    values: &'a Values,
    pairing: &'a Pairing,
}

impl Serving<'_, '_> {
    async fn listen(&self, to: &mpsc::UnboundedSender<Notified>) -> Result<(), Failure> {
        let mut listener = self.client.listen_all()?;
        loop {
            let notification = listener.next().await;
            let of = |value: &&Characteristic<[u8]>| value.handle == notification.handle();
            let Some((characteristic, _)) = self.values.iter().find(|(_, value)| of(value)) else {
                continue;
            };
            let _asker_gone = to.send(Notified {
                characteristic: *characteristic,
                value: notification.as_ref().to_vec(),
            });
        }
    }

    async fn obey(&self, commands: &mut Commands) -> Result<(), Failure> {
        while let Some(command) = commands.recv().await {
            match command {
                Command::Scan(_) | Command::Connect(..) => {}
                Command::Parameters(to) => {
                    let interval = self.link.params().conn_interval.as_micros();
                    let _asker_gone = to.send(Parameters {
                        mtu: self.link.att_mtu(),
                        interval_us: u32::try_from(interval).ok(),
                    });
                }
                Command::Pair(ask, to) => _ = to.send(self.pair(ask).await?),
                Command::Subscribe(id, to) => {
                    let outcome = match self.value(id) {
                        Ok(value) => self.subscribe(value).await,
                        Err(missing) => Err(missing),
                    };
                    let _asker_gone = to.send(outcome);
                }
                Command::Write(id, bytes, confirmed, to) => {
                    let outcome = match self.value(id) {
                        Ok(value) => self.write(value, &bytes, confirmed).await,
                        Err(missing) => Err(missing),
                    };
                    let _asker_gone = to.send(outcome);
                }
                Command::Leave(to) => {
                    let _asker_gone = to.send(());
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    async fn pair(&self, ask: AskPasskey) -> Result<Result<(), BleError>, Failure> {
        if self.link.security_level()?.authenticated() {
            return Ok(Ok(()));
        }
        self.pairing.ask.replace(Some(ask));
        self.link.set_bondable(true)?;
        self.link.request_security()?;
        Ok(self.pairing.ended.wait().await)
    }

    fn value(&self, characteristic: u128) -> Result<&Characteristic<[u8]>, BleError> {
        let value = self.values.get(&characteristic);
        value.ok_or(BleError::Missing { characteristic })
    }

    async fn subscribe(&self, value: &Characteristic<[u8]>) -> Result<(), BleError> {
        let handle = value.cccd_handle.ok_or(BleError::System {
            doing: "subscribing",
            reason: "it does not notify".to_owned(),
        })?;
        judged(
            "subscribing",
            self.client.write_handle(handle, &NOTIFY).await,
        )
    }

    async fn write(
        &self,
        value: &Characteristic<[u8]>,
        bytes: &[u8],
        confirmed: bool,
    ) -> Result<(), BleError> {
        let client = self.client;
        let written = if confirmed {
            client.write_handle(value.handle, bytes).await
        } else {
            client
                .write_handle_without_response(value.handle, bytes)
                .await
        };
        judged("writing", written)
    }
}

fn judged<E: Debug>(
    doing: &'static str,
    outcome: Result<(), BleHostError<E>>,
) -> Result<(), BleError> {
    outcome.map_err(|error| match error {
        BleHostError::BleHost(Error::Disconnected) => BleError::LinkLost,
        error => BleError::System {
            doing,
            reason: format!("{error:?}"),
        },
    })
}

/// Every characteristic with an identifier of 128 bits.
async fn discover(client: &Client<'_>) -> Result<Values, Failure> {
    let mut values = Values::new();
    for service in client.services().await? {
        for value in client.characteristics::<CHARACTERISTICS>(&service).await? {
            if let Uuid::Uuid128(bytes) = value.uuid {
                values.insert(u128::from_le_bytes(bytes), value);
            }
        }
    }
    Ok(values)
}

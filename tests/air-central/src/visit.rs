//! One link to the wearable: finds its service, tries it, pairs, uses it.

use std::{fmt::Debug, path::Path};

use embassy_futures::select::{Either4, select4};
use embassy_sync::{blocking_mutex::raw::NoopRawMutex, signal::Signal};
use tokio::io::{AsyncBufReadExt, BufReader, stdin};
use tonus_shared::{gatt, wire::Packet};
use trouble_host::{
    BleHostError, Error, Stack,
    attribute::{Characteristic, Uuid},
    connection::{Connection, ConnectionEvent},
    gatt::GattClient,
};

use crate::{Failure, Pool, Radio, arrivals::Arrivals, bond, requests};

/// Services that the wearable has, at most.
const SERVICES: usize = 8;
/// Characteristics of its own service, at most.
const CHARACTERISTICS: usize = 16;
/// Turns notifications on (Bluetooth Core 5.4, volume 3, part G, 3.3.3.3).
const NOTIFY: [u8; 2] = [1, 0];

type Client<'a> = GattClient<'a, Radio, Pool, SERVICES>;
type Value = Characteristic<[u8]>;

pub(crate) struct Visit<'a, 'stack> {
    pub(crate) stack: &'a Stack<'stack, Radio, Pool>,
    pub(crate) link: &'a Connection<'a, Pool>,
    /// The bond is kept here.
    pub(crate) bond: &'a Path,
    /// Stream packets to count.
    pub(crate) packets: u64,
    /// Raised when a pairing has succeeded.
    pub(crate) paired: Signal<NoopRawMutex, ()>,
    pub(crate) arrivals: Arrivals,
}

/// The characteristics that this host uses.
struct Values {
    stream: Value,
    reports: Value,
    calibration: Value,
    ping: Value,
}

impl Visit<'_, '_> {
    /// Does everything once, and leaves.
    pub(crate) async fn run(&self, bonded: bool) -> Result<(), Failure> {
        // Asks for the largest MTU, and encrypts where there is a bond.
        let client = Client::new(self.stack, self.link).await?;
        println!("mtu {}", self.link.att_mtu());
        println!("security {:?}", self.link.security_level()?);
        let ended = select4(
            client.task(),
            self.follow(),
            self.listen(&client),
            self.script(&client, bonded),
        );
        match ended.await {
            Either4::First(ended) => ended?,
            Either4::Second(ended) | Either4::Third(ended) | Either4::Fourth(ended) => ended?,
        }
        self.link.disconnect();
        while !matches!(self.link.next().await, ConnectionEvent::Disconnected { .. }) {}
        println!("left");
        Ok(())
    }

    async fn script(&self, client: &Client<'_>, bonded: bool) -> Result<(), Failure> {
        let values = discover(client).await?;
        if !self.link.security_level()?.authenticated() {
            attempt(client, &values).await;
            if bonded {
                // The wearable does not know this key: nothing else is to be had.
                return Ok(());
            }
            self.link.set_bondable(true)?;
            self.link.request_security()?;
            self.paired.wait().await;
        }
        for value in [&values.reports, &values.stream] {
            client.write_handle(subscription(value)?, &NOTIFY).await?;
        }
        self.arrivals.forget();
        self.calibrate(client, &values).await?;
        self.ping(client, &values).await?;
        self.count().await;
        Ok(())
    }

    /// Grants what the wearable asks of the link, and sees a pairing through.
    async fn follow(&self) -> Result<(), Failure> {
        loop {
            match self.link.next().await {
                ConnectionEvent::RequestConnectionParams(request) => {
                    request.accept(None, self.stack).await?;
                }
                ConnectionEvent::PassKeyInput => {
                    println!("passkey?");
                    self.link.pass_key_input(passkey().await?)?;
                }
                ConnectionEvent::PairingComplete {
                    security_level,
                    bond,
                } => {
                    println!("paired {security_level:?}");
                    if let Some(bond) = bond {
                        bond::store(self.bond, &bond)?;
                    }
                    self.paired.signal(());
                }
                ConnectionEvent::PairingFailed(error) => return Err(error.into()),
                ConnectionEvent::Disconnected { .. } => return Err(Failure::LinkLost),
                _ => {}
            }
        }
    }

    async fn listen(&self, client: &Client<'_>) -> Result<(), Failure> {
        let mut listener = client.listen_all()?;
        loop {
            self.arrivals.take(listener.next().await.as_ref());
        }
    }

    /// Writes a calibration, waits for the answer to it and reads it back.
    async fn calibrate(&self, client: &Client<'_>, values: &Values) -> Result<(), Failure> {
        let (header, calibration) = (requests::header(1), requests::calibration());
        let frame = requests::frame(&header, &Packet::Calibration(calibration))?;
        client
            .write_handle(values.calibration.handle, &frame)
            .await?;
        let reply = self.arrivals.until(|seen| {
            seen.reports.iter().find_map(|packet| match packet {
                Packet::Reply(reply) if reply.sequence == header.sequence => Some(*reply),
                _ => None,
            })
        });
        let reply = reply.await;
        println!("reply {:?} {:?}", reply.answered, reply.outcome);
        let mut bytes = [0; 255];
        let length = client
            .read_handle(values.calibration.handle, &mut bytes)
            .await?;
        print!("calibration ");
        bytes[..length].iter().for_each(|byte| print!("{byte:02x}"));
        println!();
        Ok(())
    }

    async fn ping(&self, client: &Client<'_>, values: &Values) -> Result<(), Failure> {
        let frame = requests::frame(&requests::header(2), &requests::ping())?;
        client
            .write_handle_without_response(values.ping.handle, &frame)
            .await?;
        let answer = self.arrivals.until(|seen| {
            seen.reports.iter().find_map(|packet| match packet {
                Packet::Ping(ping) => Some(*ping),
                _ => None,
            })
        });
        println!("ping {:?}", answer.await);
        Ok(())
    }

    /// Waits for the stream packets asked for and tells what their numbers and times say.
    async fn count(&self) {
        let line = self.arrivals.until(|seen| seen.counted(self.packets));
        println!("{}", line.await);
    }
}

async fn discover(client: &Client<'_>) -> Result<Values, Failure> {
    let services = client.services_by_uuid(&Uuid::from(gatt::SERVICE)).await?;
    let [service] = services.as_slice() else {
        return Err(Failure::Services(services.len()));
    };
    let found = client.characteristics::<CHARACTERISTICS>(service).await?;
    println!("characteristics {}", found.len());
    let mut found: Vec<Value> = found.into_iter().collect();
    let mut of = |id: u128| {
        let place = found.iter().position(|it| it.uuid == Uuid::from(id));
        place
            .map(|place| found.swap_remove(place))
            .ok_or(Failure::Missing(id))
    };
    Ok(Values {
        stream: of(gatt::STREAM)?,
        reports: of(gatt::REPORTS)?,
        calibration: of(gatt::CALIBRATION)?,
        ping: of(gatt::PING)?,
    })
}

/// What a host may read, write and subscribe to once it is authenticated, tried before.
async fn attempt(client: &Client<'_>, values: &Values) {
    let read = client
        .read_handle(values.calibration.handle, &mut [0; 255])
        .await;
    tell("read", read.map(|_| ()));
    let written = client.write_handle(values.calibration.handle, &[0]).await;
    tell("write", written);
    for value in [&values.stream, &values.reports] {
        if let Ok(handle) = subscription(value) {
            tell("subscribe", client.write_handle(handle, &NOTIFY).await);
        }
    }
}

fn tell<E: Debug>(what: &str, outcome: Result<(), BleHostError<E>>) {
    match outcome {
        Ok(()) => println!("{what} granted"),
        Err(BleHostError::BleHost(Error::Att(code))) => {
            println!("{what} refused {:#04x}", code.to_u8());
        }
        Err(error) => println!("{what} failed {error:?}"),
    }
}

fn subscription(value: &Value) -> Result<u16, Failure> {
    value.cccd_handle.ok_or(Failure::Stack(Error::NotSupported))
}

/// The six digits that a person types.
async fn passkey() -> Result<u32, Failure> {
    let line = BufReader::new(stdin()).lines().next_line().await?;
    let line = line.unwrap_or_default();
    let digits = line.trim();
    let key = digits.parse().ok().filter(|_| digits.len() == 6);
    key.ok_or_else(|| Failure::Passkey(digits.to_owned()))
}

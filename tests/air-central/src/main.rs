//! A host for the wearable on the virtual radio, on the stack that the wearable runs too, in the other role.
//!
//! ```text
//! tonus-air-central 127.0.0.1:PORT --wearable C7:0A:70:5E:00:01 --bond FILE [--packets 300]
//! ```
//!
//! Without the file it pairs: it prints `passkey?` and reads the six digits from its standard input, and keeps the
//! bond in the file. With it, it comes back by the bond. Then it uses the wearable. It prints a line for everything that it sees;
//! whether that is right is judged by whoever started it.

mod arrivals;
mod bond;
mod requests;
mod visit;
#[path = "../../air/src/waker.rs"]
mod waker;

use std::{fmt::Debug, net::SocketAddr, path::PathBuf};

use arrivals::Arrivals;
use bt_hci::controller::ExternalController;
use bt_hci_serial::SerialTransport;
use embassy_futures::select::{Either, select};
use embassy_sync::{blocking_mutex::raw::NoopRawMutex, signal::Signal};
use embassy_time::Duration;
use embedded_io_adapters::tokio_1::FromTokio;
use tokio::net::{
    TcpStream,
    tcp::{OwnedReadHalf, OwnedWriteHalf},
};
use tonus_shared::wire::WireError;
use trouble_host::{
    Address, BleHostError, Error, HostResources, IoCapabilities,
    connection::{ConnectConfig, RequestedConnParams, ScanConfig},
    prelude::DefaultPacketPool,
};
use visit::Visit;

/// Commands in flight at most, as bt-hci's own examples have it.
const COMMANDS: usize = 10;
/// A static random address of its own.
const ADDRESS: [u8; 6] = [0x01, 0x00, 0x00, 0x00, 0x7e, 0xe1];
/// Fits the wearable, which sends nothing above 20 ms.
const INTERVAL: Duration = Duration::from_millis(15);
const PACKETS: u64 = 300;

type Pool = DefaultPacketPool;
type Radio = ExternalController<
    SerialTransport<NoopRawMutex, FromTokio<OwnedReadHalf>, FromTokio<OwnedWriteHalf>>,
    COMMANDS,
>;

#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(
        "usage: tonus-air-central 127.0.0.1:PORT --wearable ADDRESS --bond FILE [--packets {PACKETS}]: {0}"
    )]
    Usage(String),
    #[error("no virtual controller, console or file: {0}")]
    System(#[from] std::io::Error),
    #[error("the controller failed: {0}")]
    Controller(String),
    #[error("the host stack failed: {0:?}")]
    Stack(Error),
    #[error("a frame was not made: {0}")]
    Wire(#[from] WireError),
    #[error("the bond is {got} bytes long, not {expected}")]
    Bond { expected: usize, got: usize },
    #[error("{0:?} are no six digits")]
    Passkey(String),
    #[error("the wearable has {0}, expected one")]
    Services(usize),
    #[error("the wearable has no characteristic {0:x}")]
    Missing(u128),
    #[error("the link ended")]
    LinkLost,
}

impl<E: Debug> From<BleHostError<E>> for Failure {
    fn from(error: BleHostError<E>) -> Self {
        match error {
            BleHostError::Controller(error) => Self::Controller(format!("{error:?}")),
            BleHostError::BleHost(error) => Self::Stack(error),
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Stack(error)
    }
}

struct Options {
    controller: SocketAddr,
    wearable: Address,
    bond: PathBuf,
    packets: u64,
}

fn options(mut words: impl Iterator<Item = String>) -> Result<Options, Failure> {
    let missing = |what: &str| Failure::Usage(format!("{what} is missing"));
    let controller = words.next().ok_or_else(|| missing("the controller"))?;
    let controller = controller
        .parse()
        .map_err(|_| Failure::Usage(format!("{controller} is no address with port")))?;
    let (mut wearable, mut bond, mut packets) = (None, None, PACKETS);
    while let Some(word) = words.next() {
        let value = words.next().ok_or_else(|| missing(&word))?;
        let wrong = || Failure::Usage(format!("{value} is no {word}"));
        match word.as_str() {
            "--wearable" => wearable = Some(address(&value).ok_or_else(wrong)?),
            "--bond" => bond = Some(PathBuf::from(&value)),
            "--packets" => packets = value.parse().map_err(|_| wrong())?,
            other => return Err(Failure::Usage(format!("{other} is unknown"))),
        }
    }
    Ok(Options {
        controller,
        wearable: wearable.ok_or_else(|| missing("--wearable"))?,
        bond: bond.ok_or_else(|| missing("--bond"))?,
        packets,
    })
}

/// A random address as it is printed, most significant byte first.
fn address(text: &str) -> Option<Address> {
    let mut bytes = [0; 6];
    let mut parts = text.split(':');
    for byte in bytes.iter_mut().rev() {
        *byte = u8::from_str_radix(parts.next()?, 16).ok()?;
    }
    parts.next().is_none().then(|| Address::random(bytes))
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Failure> {
    let options = options(std::env::args().skip(1))?;
    waker::with_one_waker(run(options)).await
}

async fn run(options: Options) -> Result<(), Failure> {
    let bond = bond::load(&options.bond)?;
    let stream = TcpStream::connect(options.controller).await?;
    stream.set_nodelay(true)?;
    let (from, to) = stream.into_split();
    let controller: Radio = ExternalController::new(SerialTransport::new(
        FromTokio::new(from),
        FromTokio::new(to),
    ));
    let mut resources: HostResources<Pool, 1, 1> = HostResources::new();
    let stack = trouble_host::new(controller, &mut resources)
        .set_random_address(Address::random(ADDRESS))
        .set_io_capabilities(IoCapabilities::KeyboardOnly)
        .build();
    if let Some(bond) = bond.clone() {
        stack.add_bond_information(bond)?;
    }
    let mut runner = stack.runner();
    let visiting = async {
        let link = stack
            .central()
            .connect(&ConnectConfig {
                scan_config: ScanConfig {
                    filter_accept_list: &[options.wearable],
                    ..ScanConfig::default()
                },
                connect_params: RequestedConnParams {
                    min_connection_interval: INTERVAL,
                    max_connection_interval: INTERVAL,
                    ..RequestedConnParams::default()
                },
            })
            .await?;
        println!("connected");
        let visit = Visit {
            stack: &stack,
            link: &link,
            options: &options,
            paired: Signal::new(),
            arrivals: Arrivals::new(),
        };
        visit.run(bond.is_some()).await
    };
    match select(runner.run(), visiting).await {
        Either::First(ended) => Ok(ended?),
        Either::Second(ended) => ended,
    }
}

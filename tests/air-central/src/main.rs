//! A host for the wearable on the virtual radio, on the stack that the wearable runs too, in the other role.
//!
//! ```text
//! tonus-air-central 127.0.0.1:PORT --wearable C7:0A:70:5E:00:01 --bond FILE [--packets 300]
//! ```
//!
//! Without the file it pairs: it prints `passkey?` and reads the six digits from its standard input, and keeps the
//! bond in the file. With it, it comes back by the bond. Then it uses the wearable. It prints a line for everything that it sees;
//! whether that is right is judged by whoever started it.
//!
//! ```text
//! tonus-air-central 127.0.0.1:PORT --session wearable|myo [--packets 300] [--interval-ms 15]
//! ```
//!
//! The same radio under the host's own logic, as `tonus run` has it: it looks for a wearable, pairs, streams, and
//! looks for it again. It tells of every link, and after so many stream packets of one what their numbers say.

mod arrivals;
mod bond;
mod central;
mod driver;
mod options;
mod requests;
mod session;
mod visit;
#[path = "../../air/src/waker.rs"]
mod waker;

use std::{fmt::Debug, path::Path};

use arrivals::Arrivals;
use bt_hci::controller::ExternalController;
use bt_hci_serial::SerialTransport;
use central::AirCentral;
use driver::Heard;
use embassy_futures::select::{Either, Either3, select, select3};
use embassy_sync::{blocking_mutex::raw::NoopRawMutex, signal::Signal};
use embassy_time::Duration;
use embedded_io_adapters::tokio_1::FromTokio;
use options::{Options, Session, Task, address};
use tokio::net::{
    TcpStream,
    tcp::{OwnedReadHalf, OwnedWriteHalf},
};
use tonus_shared::wire::WireError;
use trouble_host::{
    Address, BleHostError, Error, HostResources, IoCapabilities, Stack,
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

type Pool = DefaultPacketPool;
type Radio = ExternalController<
    SerialTransport<NoopRawMutex, FromTokio<OwnedReadHalf>, FromTokio<OwnedWriteHalf>>,
    COMMANDS,
>;

#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(
        "usage: tonus-air-central 127.0.0.1:PORT (--wearable ADDRESS --bond FILE | --session wearable|myo [--interval-ms N]) [--packets N]: {0}"
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
    #[error(transparent)]
    Myo(#[from] tonus::link::myo::MyoError),
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

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Failure> {
    let options = options::options(std::env::args().skip(1))?;
    waker::with_one_waker(run(options)).await
}

async fn run(options: Options) -> Result<(), Failure> {
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
    match &options.task {
        Task::Visit(wearable, bond) => visit_once(&stack, &options, *wearable, bond).await,
        Task::Session(which) => serve(&stack, *which, &options).await,
    }
}

async fn visit_once(
    stack: &Stack<'_, Radio, Pool>,
    options: &Options,
    wearable: Address,
    file: &Path,
) -> Result<(), Failure> {
    let bond = bond::load(file)?;
    if let Some(bond) = bond.clone() {
        stack.add_bond_information(bond)?;
    }
    let mut runner = stack.runner();
    let visiting = async {
        let link = stack
            .central()
            .connect(&ConnectConfig {
                scan_config: ScanConfig {
                    filter_accept_list: &[wearable],
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
            stack,
            link: &link,
            bond: file,
            packets: options.packets,
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

async fn serve(
    stack: &Stack<'_, Radio, Pool>,
    which: Session,
    options: &Options,
) -> Result<(), Failure> {
    let (central, commands) = AirCentral::new();
    let heard = Heard::default();
    let mut runner = stack.runner();
    let session = async {
        match which {
            Session::Wearable => session::wearable(central, options.packets).await,
            Session::Myo => session::myo(central).await,
        }
    };
    let driving = driver::drive(stack, &heard, options.interval, commands);
    match select3(runner.run_with_handler(&heard), driving, session).await {
        Either3::First(ended) => Ok(ended?),
        Either3::Second(ended) | Either3::Third(ended) => ended,
    }
}

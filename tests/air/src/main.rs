//! The wearable's Bluetooth code as a Linux program: it speaks H4 over TCP to a virtual controller instead
//! of Nordic's radio, and is otherwise what the chip runs.
//!
//! ```text
//! tonus-air 127.0.0.1:PORT --flash FILE [--stream-hz 100] [--power-steps N]
//! ```
//!
//! Prints a line for every notice, and takes lines from its standard input: `press` is the pairing button,
//! `refused` asks for the number of frames refused. Ends with its input, or in the middle of the flash's word or page after `N`
//! others, as if its power had gone.

mod flash;
mod waker;
mod wearer;

use std::{net::SocketAddr, path::PathBuf};

use bt_hci::controller::ExternalController;
use bt_hci_serial::SerialTransport;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_time::Instant;
use embedded_io_adapters::tokio_1::FromTokio;
use flash::FileFlash;
use tokio::{
    io::{AsyncBufReadExt, BufReader, stdin},
    net::TcpStream,
};
use tonus_firmware::{
    battery::Battery,
    ble::{self, DeviceInformation, KeptBonds, Notice, PairingWindow, Ports, Shown},
    inbox::Inbox,
    keeper::Flash,
    outbox::Outbox,
    storage::{Storage, partitions::DK},
    vitals::Vitals,
};
use trouble_host::Address;
use wearer::Wearer;

/// Commands in flight at most, as bt-hci's own examples have it.
const COMMANDS: usize = 10;
/// A static random address; the host looks for the service, not for this.
const ADDRESS: [u8; 6] = [0x01, 0x00, 0x5e, 0x70, 0x0a, 0xc7];
const STREAM_HZ: u32 = 100;
/// Of a lithium polymer cell that is three quarters full.
const BATTERY_MV: u16 = 3_950;

#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(
        "usage: tonus-air 127.0.0.1:PORT --flash FILE [--stream-hz {STREAM_HZ}] [--power-steps N]: {0}"
    )]
    Usage(String),
    #[error("no virtual controller: {0}")]
    Link(#[from] std::io::Error),
    #[error("the controller failed: {0}")]
    Controller(String),
    #[error("the flash is not read: {0}")]
    Flash(String),
    #[error(transparent)]
    Wearer(#[from] wearer::WearerError),
}

struct Options {
    controller: SocketAddr,
    flash: PathBuf,
    stream_hz: u32,
    power_steps: Option<u32>,
}

fn options(mut words: impl Iterator<Item = String>) -> Result<Options, Failure> {
    let missing = |what: &str| Failure::Usage(format!("{what} is missing"));
    let controller = words.next().ok_or_else(|| missing("the address"))?;
    let controller = controller
        .parse()
        .map_err(|_| Failure::Usage(format!("{controller} is no address with port")))?;
    let (mut flash, mut stream_hz, mut power_steps) = (None, STREAM_HZ, None);
    while let Some(word) = words.next() {
        let value = words.next().ok_or_else(|| missing(&word))?;
        let number = || {
            let number = value.parse();
            number.map_err(|_| Failure::Usage(format!("{word} {value} is no number")))
        };
        match word.as_str() {
            "--flash" => flash = Some(PathBuf::from(&value)),
            "--stream-hz" => stream_hz = number()?,
            "--power-steps" => power_steps = Some(number()?),
            other => return Err(Failure::Usage(format!("{other} is unknown"))),
        }
    }
    Ok(Options {
        controller,
        flash: flash.ok_or_else(|| missing("--flash"))?,
        stream_hz,
        power_steps,
    })
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Failure> {
    let options = options(std::env::args().skip(1))?;
    waker::with_one_waker(run(options)).await
}

async fn run(options: Options) -> Result<(), Failure> {
    let stream = TcpStream::connect(options.controller).await?;
    stream.set_nodelay(true)?;
    let (from, to) = stream.into_split();
    let transport: SerialTransport<NoopRawMutex, _, _> =
        SerialTransport::new(FromTokio::new(from), FromTokio::new(to));
    let controller: ExternalController<_, COMMANDS> = ExternalController::new(transport);

    let (outbox, inbox) = (Outbox::new(), Inbox::new());
    let (calibration, window) = (Shown::new(), PairingWindow::new());
    let vitals = Vitals::new();
    vitals.set_battery(&Battery::LITHIUM_POLYMER, BATTERY_MV);
    let file = FileFlash::open(&options.flash, options.power_steps)?;
    let models = file.another()?;
    let storage = Storage::open(file, DK).await;
    let flash = Flash::new(storage.map_err(|error| Failure::Flash(error.to_string()))?);
    let ports = Ports {
        outbox: &outbox,
        inbox: &inbox,
        calibration: &calibration,
        window: &window,
        battery_percent: vitals.battery_percent(),
        device: DeviceInformation {
            manufacturer: "Tonus",
            model: "air",
            firmware: env!("CARGO_PKG_VERSION"),
        },
    };
    let mut bonds = KeptBonds(&flash);
    let report = |notice| {
        if notice == Notice::Connected {
            vitals.linked();
        }
        println!("notice {notice:?}");
    };
    let wearer = Wearer {
        boot_id: std::process::id(),
        outbox: &outbox,
        inbox: &inbox,
        shown: &calibration,
        flash: &flash,
        models: &models,
        vitals: &vitals,
    };
    tokio::select! {
        ended = ble::run(&controller, Address::random(ADDRESS), &ports, &mut bonds, report) => {
            let Err(error) = ended;
            Err(Failure::Controller(format!("{error:?}")))
        }
        ended = wearer.run(options.stream_hz) => {
            let Err(error) = ended;
            Err(error.into())
        }
        ended = obey(&window, &inbox) => Ok(ended?),
    }
}

/// Does what the lines of the standard input say, until it ends.
async fn obey(window: &PairingWindow, inbox: &Inbox) -> Result<(), std::io::Error> {
    let mut lines = BufReader::new(stdin()).lines();
    while let Some(line) = lines.next_line().await? {
        match line.trim() {
            "press" => {
                window.press(Instant::now());
                println!("pressed");
            }
            "refused" => println!("refused {}", inbox.refused()),
            other => println!("unknown command {other}"),
        }
    }
    Ok(())
}

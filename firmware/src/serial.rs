//! The transport `wired`: the board's serial port, and the task that serves it.

use embassy_embedded_hal::adapter::BlockingAsync;
use embassy_executor::{SpawnError, Spawner};
use embassy_futures::select::select;
use embassy_nrf::{
    buffered_uarte::BufferedUarte,
    nvmc::Nvmc,
    uarte::{Baudrate, Config},
};
use static_cell::StaticCell;
use tonus_firmware::{keeper::Flash, wired};
use tonus_shared::wire::{
    Calibration,
    cobs::{BAUD, MAX_BLOCK_BYTES},
};

use crate::{
    INBOX, OUTBOX, VITALS,
    board::{Irqs, Transport},
    watchdog::{self, Handle},
};

/// Room for what comes while the task does not run; even, because the driver halves it.
const RECEIVE_BYTES: usize = 512;
/// Room for one block: whoever writes the next one waits until the line has taken this one.
const SEND_BYTES: usize = MAX_BLOCK_BYTES;

/// The flash. The processor stands still while it is written: 41 us for a word, 85 ms for erasing a page.
pub(crate) type Nvm = BlockingAsync<Nvmc<'static>>;

/// Nothing can go wrong.
pub(crate) type StartError = core::convert::Infallible;

/// Nothing to do: a host on the line asks for the calibration by a packet.
pub(crate) const fn show(_: u32, _: &Calibration) {}

/// Opens the port at [`BAUD`].
#[allow(
    clippy::unused_async,
    reason = "the radio, which stands in the same place, has to wait"
)]
pub(crate) async fn open(
    parts: Transport,
    _: Spawner,
) -> Result<(BufferedUarte<'static>, Nvm), StartError> {
    static RECEIVED: StaticCell<[u8; RECEIVE_BYTES]> = StaticCell::new();
    static TO_SEND: StaticCell<[u8; SEND_BYTES]> = StaticCell::new();

    const { assert!(BAUD == 1_000_000, "the rate below is the host's") }
    let mut config = Config::default();
    config.baudrate = Baudrate::Baud1m;
    let port = BufferedUarte::new(
        parts.port,
        parts.byte_counter,
        parts.count,
        parts.restart,
        parts.restart_once,
        parts.from_host,
        parts.to_host,
        Irqs,
        config,
        RECEIVED.init([0; RECEIVE_BYTES]),
        TO_SEND.init([0; SEND_BYTES]),
    );
    Ok((port, BlockingAsync::new(Nvmc::new(parts.flash))))
}

/// Starts the task that sends what appears in the outbox and leaves what comes in the inbox.
///
/// # Errors
/// When it was started before.
pub(crate) fn serve(
    port: BufferedUarte<'static>,
    _: &'static Flash<Nvm>,
    handle: Handle,
    spawner: Spawner,
) -> Result<(), SpawnError> {
    spawner.spawn(run(port, handle)?);
    Ok(())
}

#[embassy_executor::task]
async fn run(port: BufferedUarte<'static>, handle: Handle) {
    let (reader, writer) = port.split();
    // A line is there as long as the wearable runs.
    VITALS.linked();
    let report = |dropped, counts| defmt::warn!("dropped: {}, so far {}", dropped, counts);
    let served = async {
        if let Err(error) = wired::run(reader, writer, &OUTBOX, &INBOX, report).await {
            defmt::error!("serial port stopped, the wearable restarts: {}", error);
        }
    };
    select(served, watchdog::beat(handle)).await;
}

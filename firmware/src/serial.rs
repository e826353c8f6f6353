//! The transport `wired`: the board's serial port, and the task that serves it.

use embassy_executor::{SpawnError, Spawner};
use embassy_nrf::{
    buffered_uarte::BufferedUarte,
    uarte::{Baudrate, Config},
};
use static_cell::StaticCell;
use tonus_firmware::{inbox::Inbox, outbox::Outbox, wired};
use tonus_shared::wire::{
    Calibration,
    cobs::{BAUD, MAX_BLOCK_BYTES},
};

use crate::board::{Irqs, Transport};

/// Room for what comes while the task does not run; even, because the driver halves it.
const RECEIVE_BYTES: usize = 512;
/// Room for one block: whoever writes the next one waits until the line has taken this one.
const SEND_BYTES: usize = MAX_BLOCK_BYTES;

/// Nothing to do: a host on the line asks for the calibration by a packet.
pub(crate) const fn show(_: u32, _: &Calibration) {}

/// Opens the port at [`BAUD`] and starts the task that sends what appears in the outbox and leaves what comes in the inbox.
///
/// # Errors
/// When the task was started before.
#[allow(
    clippy::unused_async,
    reason = "the radio, which stands in the same place, has to wait"
)]
pub(crate) async fn start(
    parts: Transport,
    spawner: Spawner,
    (outbox, inbox): (&'static Outbox, &'static Inbox),
) -> Result<(), SpawnError> {
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
    spawner.spawn(serve(port, outbox, inbox)?);
    Ok(())
}

#[embassy_executor::task]
async fn serve(port: BufferedUarte<'static>, outbox: &'static Outbox, inbox: &'static Inbox) {
    let (reader, writer) = port.split();
    let report = |dropped, counts| defmt::warn!("dropped: {}, so far {}", dropped, counts);
    if let Err(error) = wired::run(reader, writer, outbox, inbox, report).await {
        defmt::error!("serial port stopped, reset the wearable: {}", error);
    }
}

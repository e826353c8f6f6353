//! The wearable on an nRF52840: wires pins, clocks and a transport to the portable parts in the library.
//!
//! | runs in | task | waits for |
//! |---|---|---|
//! | [`ACQUISITION`] | front end | the converter |
//! | [`SIGNAL_PATH`] | signal path, attitude | scans, requests, words; the attitude sensor |
//! | thread | transport, keeper, recognition, battery | the link; jobs; stiffness and hands; time |
//!
//! Each but the last has a handle of the watchdog.
#![no_std]
#![no_main]

mod attitude;
#[cfg_attr(feature = "dk-ads129x", path = "board/dk.rs")]
#[cfg_attr(feature = "xiao-analog", path = "board/xiao.rs")]
mod board;
#[cfg_attr(feature = "dk-ads129x", path = "front_end/ads129x.rs")]
#[cfg_attr(feature = "xiao-analog", path = "front_end/analog.rs")]
mod front_end;
mod panic;
#[cfg(feature = "ble")]
mod radio;
#[cfg(feature = "wired")]
mod serial;
mod watchdog;

use core::slice;

use cortex_m::peripheral::SCB;
use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, SpawnError, Spawner};
use embassy_nrf::interrupt;
use embassy_time::{Duration, Instant};
#[cfg(feature = "ble")]
use radio as transport;
#[cfg(feature = "wired")]
use serial as transport;
use static_cell::{ConstStaticCell, StaticCell};
use tonus_firmware::{
    acquisition::{CHANNELS, EventQueue, MUSCLES, RATE_HZ},
    inbox::Inbox,
    keeper::{self, Flash, Keeper, Word, Words},
    outbox::Outbox,
    recognition,
    requests::{Desk, Jobs},
    signal_path::SignalPath,
    storage::{self, Storage},
    vitals::Vitals,
    wearable::{self, Attitude, Notice, Ports},
};
use tonus_shared::{
    pipeline,
    recognition::Storage as Hypotheses,
    wire::{Calibration, LastWords, StatusFlags},
};

/// Reads the converter, above all else that computes: a recalibration takes longer than a scan.
static ACQUISITION: InterruptExecutor = InterruptExecutor::new();

/// Runs the signal path above the thread: pairing computes on a curve for hundreds of milliseconds there,
/// many times the 1 ms in which a scan must be taken.
static SIGNAL_PATH: InterruptExecutor = InterruptExecutor::new();

/// From the front end to the signal path: what comes while filters are designed anew.
static EVENTS: EventQueue<CHANNELS, EVENTS_WAIT> = EventQueue::new();

/// Events that may wait: one for each millisecond of the longest computation between two scans, twice.
const EVENTS_WAIT: usize = 32;

/// From the attitude sensor to the signal path.
static ATTITUDE: Attitude = Attitude::new();

/// From the signal path to the transport.
static OUTBOX: Outbox = Outbox::new();

/// From the transport to the signal path.
static INBOX: Inbox = Inbox::new();

/// From the signal path to the keeper of the flash.
static JOBS: Jobs = Jobs::new();

/// From keeper and recognition to the signal path.
static WORDS: Words = Words::new();

/// From the signal path to recognition.
static RECOGNITION: recognition::Inbox = recognition::Inbox::new();

/// How every task fares.
static VITALS: Vitals = Vitals::new();

/// The flash, for keeper, recognition and bonds.
static FLASH: StaticCell<Flash<transport::Nvm>> = StaticCell::new();

/// What the last panic said.
static LAST_WORDS: StaticCell<LastWords> = StaticCell::new();

/// From a host's wish to restart to the restart: the answer leaves before.
const RESTART_AFTER: Duration = Duration::from_millis(100);

/// Why the wearable does not run.
#[derive(defmt::Format)]
enum StartError {
    /// The watchdog runs already, with settings of somebody else's.
    Watchdog,
    /// The transport does not start.
    Transport(transport::StartError),
    /// The flash cannot be read.
    Storage,
    /// The front end's constants, or the illustrative calibration, are impossible.
    FrontEnd,
    /// A task was started twice.
    Task(SpawnError),
}

impl From<SpawnError> for StartError {
    fn from(error: SpawnError) -> Self {
        Self::Task(error)
    }
}

#[interrupt]
#[allow(
    unsafe_code,
    reason = "the handler runs only after `start` has unmasked it, and nothing else calls the executor"
)]
unsafe fn EGU1_SWI1() {
    // SAFETY: `InterruptExecutor::start` initialised the executor before it unmasked this interrupt, and
    // this handler is the only caller.
    unsafe { ACQUISITION.on_interrupt() }
}

#[interrupt]
#[allow(
    unsafe_code,
    reason = "the handler runs only after `start` has unmasked it, and nothing else calls the executor"
)]
unsafe fn EGU2_SWI2() {
    // SAFETY: as above.
    unsafe { SIGNAL_PATH.on_interrupt() }
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let last_words = panic::take();
    if let Some(said) = &last_words {
        defmt::error!("before this start: {}", said.words.as_str());
    }
    if let Err(error) = start(spawner, last_words).await {
        // Nobody pets the watchdog now: it starts anew.
        defmt::error!("the wearable does not run: {}", error);
    }
}

async fn start(spawner: Spawner, last_words: Option<LastWords>) -> Result<(), StartError> {
    let board = board::take();
    let handles = watchdog::start(board.watchdog).ok_or(StartError::Watchdog)?;
    defmt::info!("started: {}", board.reset_reason);
    VITALS.set(StatusFlags::LAST_WORDS_WAIT, last_words.is_some());
    let last_words = LAST_WORDS.init(last_words.unwrap_or_default());

    let opened = transport::open(board.transport, spawner).await;
    let (link, nvm) = opened.map_err(StartError::Transport)?;
    let opened = Storage::open(nvm, board::LAYOUT).await;
    let mut storage = opened.map_err(|_| StartError::Storage)?;
    let calibration = calibration(&mut storage).await;
    let flash = &*FLASH.init(Flash::new(storage));

    let path = signal_path(board.boot_id, &calibration).ok_or(StartError::FrontEnd)?;
    let ports = Ports {
        events: &EVENTS,
        attitude: &ATTITUDE,
        inbox: &INBOX,
        words: &WORDS,
        vitals: &VITALS,
        reset_reason: board.reset_reason,
        desk: Desk {
            outbox: &OUTBOX,
            jobs: &JOBS,
            recognition: &RECOGNITION,
            last_words,
        },
    };
    let urgent = SIGNAL_PATH.start(board::SIGNAL_PATH_INTERRUPT);
    urgent.spawn(run(path, ports, handles.signal_path)?);
    urgent.spawn(attitude::follow(board.attitude, handles.attitude)?);
    let most_urgent = ACQUISITION.start(board::ACQUISITION_INTERRUPT);
    front_end::start(board.front_end, handles.acquisition, most_urgent, spawner)?;
    spawner.spawn(keep(flash, handles.keeper)?);
    spawner.spawn(recognise(flash, handles.recognition)?);
    transport::serve(link, flash, handles.transport, spawner)?;
    Ok(())
}

/// The calibration that was kept, or an illustrative one, and then the status says so.
async fn calibration(storage: &mut Storage<transport::Nvm>) -> Calibration {
    let kept = keeper::calibration(storage).await.unwrap_or_else(|error| {
        defmt::error!("calibrate anew: {}", error);
        None
    });
    VITALS.set(StatusFlags::NOT_CALIBRATED, kept.is_none());
    kept.unwrap_or_else(|| pipeline::illustrative(MUSCLES, RATE_HZ))
}

/// A signal path with the calibration that was kept, or if this board cannot work with it, with the illustrative one.
/// A function of its own, called before anything interrupts: the stack that it takes is free again when the tasks run.
#[inline(never)]
fn signal_path(
    boot_id: u32,
    calibration: &Calibration,
) -> Option<&'static mut SignalPath<CHANNELS>> {
    static PATH: StaticCell<SignalPath<CHANNELS>> = StaticCell::new();

    let board = front_end::wearable(boot_id).ok()?;
    let mut calibration = *calibration;
    if board.config::<CHANNELS>(&calibration, false).is_err() {
        // Of another board, or of another version's limits.
        defmt::error!("calibrate anew: the calibration that was kept does not fit this board");
        VITALS.set(StatusFlags::NOT_CALIBRATED, true);
        calibration = pipeline::illustrative(MUSCLES, RATE_HZ);
    }
    Some(PATH.init(SignalPath::new(board, &calibration).ok()?))
}

/// Runs in [`SIGNAL_PATH`], below every hardware interrupt and the converter, above all else.
#[embassy_executor::task]
async fn run(
    path: &'static mut SignalPath<CHANNELS>,
    ports: Ports<'static, CHANNELS, EVENTS_WAIT>,
    mut handle: watchdog::Handle,
) {
    let boot_id = path.boot_id();
    let mut restart_at: Option<Instant> = None;
    wearable::run(path, ports, now_us, |notice| match notice {
        Notice::Alive if restart_at.is_some_and(|at| at <= Instant::now()) => SCB::sys_reset(),
        Notice::Alive => handle.pet(),
        Notice::Asked(kind, sequence) => defmt::debug!("asked: {} {}", kind, sequence),
        Notice::Calibrated(calibration) => transport::show(boot_id, calibration),
        Notice::Stumbled(error) => defmt::warn!("front end: {}", error),
        Notice::Failed(error) => defmt::error!("front end: {}", error),
        Notice::NotSent(error) => defmt::error!("not sent: {}", error),
        Notice::Restart => restart_at = Some(Instant::now() + RESTART_AFTER),
    })
    .await;
}

/// Keeps what a host sends.
#[embassy_executor::task]
async fn keep(flash: &'static Flash<transport::Nvm>, mut handle: watchdog::Handle) {
    let keeper = Keeper {
        flash,
        mapped,
        recognition: &RECOGNITION,
        words: &WORDS,
    };
    keeper.run(&JOBS, || handle.pet()).await;
}

/// Recognises what the person does.
#[embassy_executor::task]
async fn recognise(flash: &'static Flash<transport::Nvm>, mut handle: watchdog::Handle) {
    static HYPOTHESES: ConstStaticCell<Hypotheses> = ConstStaticCell::new(Hypotheses::new());
    let model = async || {
        let model = flash.lock().await.model();
        model.map(mapped)
    };
    let say = |at_us, inference| {
        // One that finds no room is followed by a newer one.
        let _ = WORDS.try_send(Word::Infer(at_us, inference));
    };
    recognition::serve(
        model,
        HYPOTHESES.take(),
        &RECOGNITION,
        now_us,
        say,
        |notice| match notice {
            recognition::Notice::Alive => handle.pet(),
            recognition::Notice::Model(there) => VITALS.set(StatusFlags::NO_MODEL, !there),
            recognition::Notice::Refused(_) => {
                VITALS.set(StatusFlags::NO_MODEL, true);
                defmt::error!("the model that was kept is not for this build: upload it anew");
            }
        },
    )
    .await;
}

fn now_us() -> u64 {
    Instant::now().as_micros()
}

/// A model's bytes, where they lie.
#[allow(unsafe_code, reason = "the flash is memory that the processor reads")]
fn mapped(model: storage::Model) -> &'static [u8] {
    let length = model.length.min(board::LAYOUT.model_capacity()) as usize;
    let start = model.start as usize as *const u8;
    // SAFETY: the storage gives models within their slot of the flash, which is readable at its own addresses for ever.
    // Their bytes stay as they are until the upload after the one that replaced them begins, and the keeper lets none
    // begin before recognition, the one that holds this slice, has let go of it.
    unsafe { slice::from_raw_parts(start, length) }
}

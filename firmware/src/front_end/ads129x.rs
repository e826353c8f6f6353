//! Four sEMG channels through an ADS1294.

use embassy_executor::{SendSpawner, SpawnError, Spawner};
use embassy_nrf::{
    gpio::{Level, Output, OutputDrive, Pull},
    gpiote::{InputChannel, InputChannelPolarity},
    ppi::Ppi,
    saadc::{self, Saadc, VddhDiv5Input},
    spim::{self, Spim},
    timer::{self, Timer},
};
use embassy_time::{Delay, Duration, Instant, Ticker};
use embedded_hal_bus::spi::ExclusiveDevice;
use tonus_firmware::{
    acquisition::{self, CHANNELS, EdgeClock, PERIOD_US},
    afe::{
        DataReady, Edge,
        ads129x::{self, Ads129x, SelfTest, SelfTestError, Settings},
        saadc::millivolts,
    },
};
use tonus_shared::{pipeline, sample::AdcScaleError};

use crate::{
    EVENTS, VITALS,
    board::{self, Irqs},
    watchdog::Handle,
};

/// Ticks a microsecond of the timer that data-ready edges capture.
const TICKS_PER_US: u32 = 16;
/// The chip takes commands at no more: a byte must not be shorter than `4 t_CLK`.
const SPI: spim::Frequency = spim::Frequency::M4;
/// Between two looks at the battery.
const BATTERY: Duration = Duration::from_secs(10);

/// What the signal path must know of a wearable with this front end.
pub(crate) fn wearable(boot_id: u32) -> Result<pipeline::Board, AdcScaleError> {
    ads129x::board(boot_id, &SETTINGS)
}

/// How the chip is used.
const SETTINGS: Settings<CHANNELS> = Settings::surface_emg();

/// Starts to acquire, and to look at the battery.
pub(crate) fn start(
    parts: board::FrontEnd,
    handle: Handle,
    urgent: SendSpawner,
    thread: Spawner,
) -> Result<(), SpawnError> {
    thread.spawn(battery(parts.battery)?);
    urgent.spawn(acquire(parts.converter, handle)?);
    Ok(())
}

/// Reads the chip for ever.
#[embassy_executor::task]
async fn acquire(parts: board::Converter, mut handle: Handle) {
    let mut config = spim::Config::default();
    config.frequency = SPI;
    config.mode = spim::MODE_1;
    let bus = Spim::new(
        parts.spi,
        Irqs,
        parts.clock,
        parts.from_chip,
        parts.to_chip,
        config,
    );
    let output = |pin, level| Output::new(pin, level, OutputDrive::Standard);
    let select = output(parts.select, Level::High);
    let Ok(device) = ExclusiveDevice::new(bus, select, Delay);
    let reset = output(parts.reset, Level::High);
    let begin = output(parts.start, Level::Low);
    let mut converter = Ads129x::new(device, reset, begin, Delay, SETTINGS);

    let edges = InputChannel::new(
        parts.edge_channel,
        parts.data_ready,
        Pull::None,
        InputChannelPolarity::HiToLo,
    );
    let timer = Timer::new(parts.timer);
    timer.set_frequency(timer::Frequency::F16MHz);
    let capture = timer.cc(CAPTURED).task_capture();
    let mut link = Ppi::new_one_to_one(parts.capture, edges.event_in(), capture);
    link.enable();
    timer.start();
    let mut ready = Ready {
        edges,
        timer,
        newest: 0,
    };
    if parts.self_test {
        handle.pet();
        match self_test(&mut converter, &mut ready).await {
            Ok(measured) => defmt::info!(
                "self-test: test signal {} V, noise {} V RMS",
                measured.amplitude_v,
                measured.noise_v
            ),
            Err(error) => defmt::error!("self-test failed: {}", error),
        }
        handle.pet();
    }
    let mut clock = EdgeClock::new(PERIOD_US, TICKS_PER_US);
    acquisition::acquire(
        &mut converter,
        &mut ready,
        &mut Delay,
        &mut clock,
        |event| {
            handle.pet();
            EVENTS.put(event);
        },
    )
    .await
}

/// The chip measures its own noise and test signal, 2.4 s in all.
async fn self_test(
    converter: &mut Adc,
    ready: &mut Ready,
) -> Result<SelfTest<CHANNELS>, SelfTestError> {
    converter.power_up().await?;
    converter.self_test(ready).await
}

/// The chip behind its bus and lines.
type Adc = Ads129x<
    CHANNELS,
    ExclusiveDevice<Spim<'static>, Output<'static>, Delay>,
    Output<'static>,
    Output<'static>,
    Delay,
>;

/// Captured by the edge itself.
const CAPTURED: usize = 0;
/// Captured by the processor when it looks.
const SEEN: usize = 1;

/// The chip's data-ready line, and the timer that its edges capture.
struct Ready {
    edges: InputChannel<'static>,
    timer: Timer<'static>,
    /// The last edge that was seen.
    newest: u32,
}

impl DataReady for Ready {
    async fn edge(&mut self) -> Edge {
        // What is waited for counts from here on; what the timer captured before has come already.
        let next = self.edges.wait();
        if self.timer.cc(CAPTURED).read() == self.newest {
            next.await;
        }
        let captured = self.timer.cc(CAPTURED).read();
        self.newest = captured;
        Edge {
            captured,
            seen: self.timer.cc(SEEN).capture(),
            seen_us: Instant::now().as_micros(),
        }
    }

    fn clear(&mut self) {
        self.newest = self.timer.cc(CAPTURED).read();
    }
}

/// Looks at the battery now and then.
#[embassy_executor::task]
async fn battery(parts: board::BatteryInput) {
    let channel = saadc::ChannelConfig::single_ended(VddhDiv5Input);
    let mut converter = Saadc::new(parts.converter, Irqs, saadc::Config::default(), [channel]);
    converter.calibrate().await;
    let mut ticker = Ticker::every(BATTERY);
    loop {
        let mut counts = [0; 1];
        converter.sample(&mut counts).await;
        let battery_mv = millivolts(counts[0], board::BATTERY_DIVIDER);
        VITALS.set_battery(&board::BATTERY, battery_mv);
        ticker.next().await;
    }
}

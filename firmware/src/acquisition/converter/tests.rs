use std::pin::pin;

use embedded_hal::spi::ErrorKind;
use tonus_shared::{
    pipeline::{ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Pipeline, PipelineConfig},
    semg::{chain::ChainConfig, quality::Quality},
    stiffness::ArmStiffness,
    wire::{Muscle, Packet, Status, Stream},
};

use super::*;
use crate::afe::ads129x::{
    Gain, Register, Settings,
    chip::{CHANNELS, Chip, Faults},
};

type Seen = Vec<(u64, Event<CHANNELS>)>;

/// Until when (ms after the start), and what happens to the chip first.
type Step<'a> = (u64, &'a dyn Fn(&Chip));

/// Runs the task through the steps, from 3 s of device time on.
fn acquired(steps: &[Step<'_>]) -> Seen {
    let start_us = 3_000_000;
    let chip = Chip::new(start_us);
    chip.with(|state| state.input = noise_of_rest);
    let mut driver = chip.driver(Settings::surface_emg());
    let (mut edges, mut delay) = (chip.clone(), chip.clone());
    let mut clock = EdgeClock::new(1_000, 16);
    let mut seen = Seen::new();
    {
        let seen = std::cell::RefCell::new(&mut seen);
        let mut task = pin!(acquire(
            &mut driver,
            &mut edges,
            &mut delay,
            &mut clock,
            |event| seen.borrow_mut().push((chip.now_us() - start_us, event)),
        ));
        for (until_ms, change) in steps {
            change(&chip);
            chip.run_until(&mut task, start_us + until_ms * 1_000);
        }
    }
    seen
}

/// Some microvolts that never stand still: 100 counts are 4.8 uV.
fn noise_of_rest(conversion: u64, channel: usize) -> i32 {
    let hash = conversion.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (40 + channel);
    (hash % 200) as i32 - 100
}

fn nothing(_: &Chip) {}

fn mend(chip: &Chip) {
    chip.with(|chip| chip.faults = Faults::default());
}

fn break_with(faults: Faults) -> impl Fn(&Chip) {
    move |chip| chip.with(|chip| chip.faults = faults.clone())
}

fn scans(seen: &Seen) -> Vec<Scan<CHANNELS>> {
    seen.iter()
        .filter_map(|(_, event)| match event {
            Event::Scan { scan, .. } => Some(*scan),
            _ => None,
        })
        .collect()
}

fn faults(seen: &Seen) -> Vec<(u64, Event<CHANNELS>)> {
    seen.iter()
        .filter(|(_, event)| !matches!(event, Event::Scan { .. }))
        .copied()
        .collect()
}

/// Indices agree with times: a missed scan is a gap, never a shift. Gives the gaps, in scans.
fn gaps(scans: &[Scan<CHANNELS>]) -> Vec<u32> {
    let first = scans[0];
    for scan in scans {
        let periods = f64::from(scan.index - first.index);
        let elapsed_us = (scan.acquired_us - first.acquired_us) as f64;
        // A restarted converter has another phase.
        assert!(
            (elapsed_us - periods * 1_000.0).abs() <= 1_500.0,
            "{scan:?}"
        );
    }
    let jumps = scans.windows(2).map(|pair| pair[1].index - pair[0].index);
    jumps
        .filter(|jump| *jump != 1)
        .map(|jump| jump - 1)
        .collect()
}

/// What the signal path makes of it.
fn packets(seen: &Seen) -> (Vec<Stream>, Vec<Status>) {
    let mut pipeline = Pipeline::<CHANNELS>::new(&PipelineConfig {
        boot_id: 1,
        firmware_hash: [0; 8],
        adc: Gain::X6.scale().unwrap(),
        chain: ChainConfig::at_rate(1_000.0),
        channels: [
            Muscle::BicepsShort,
            Muscle::BicepsLong,
            Muscle::TricepsLateral,
            Muscle::TricepsLong,
        ]
        .map(|muscle| ChannelConfig {
            muscle,
            rest_v: 10e-6,
            mvc_v: 500e-6,
        }),
        activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
        arm: ArmStiffness::illustrative(),
        raw: false,
    })
    .unwrap();
    let (mut streams, mut statuses) = (Vec::new(), Vec::new());
    for (_, event) in seen {
        let Event::Scan { scan, lead_off } = event else {
            continue;
        };
        pipeline.set_lead_off(*lead_off);
        pipeline.push_scan(scan).unwrap();
        while let Some(frame) = pipeline.next_frame() {
            match frame.packet {
                Packet::Stream(stream) => streams.push(stream),
                Packet::Status(status) => statuses.push(status),
                _ => {}
            }
        }
    }
    (streams, statuses)
}

#[test]
fn a_sound_chip_gives_every_scan() {
    let seen = acquired(&[(5_000, &nothing)]);
    assert_eq!(faults(&seen), []);
    let scans = scans(&seen);
    assert_eq!(gaps(&scans), []);
    // 0.15 s of supply, 0.3 s of reference, 4.5 ms of filter, before the first.
    assert!((4_540..=4_546).contains(&scans.len()), "{}", scans.len());
    let (streams, _) = packets(&seen);
    let last = streams.last().unwrap();
    assert_eq!(last.quality[..CHANNELS], [Quality::GOOD; CHANNELS]);
}

#[test]
fn missed_edges_are_gaps_of_their_length() {
    let lose = |edges| move |chip: &Chip| chip.with(|chip| chip.faults.lost_edges = edges);
    let seen = acquired(&[
        (1_000, &nothing),
        (1_500, &lose(1)),
        (2_500, &lose(2)),
        (3_000, &nothing),
    ]);
    let silent = Ads129xError::NoEdge { limit_us: 2_100 };
    let told = faults(&seen);
    assert_eq!(told.len(), 1, "one lost edge needs no mending: {told:?}");
    assert_eq!(told[0].1, Event::Fault(silent));
    assert!(
        (1_500_000..1_504_000).contains(&told[0].0),
        "two periods: {told:?}"
    );
    let gaps = gaps(&scans(&seen));
    assert_eq!((gaps.len(), gaps[0]), (2, 1));
    // 2 ms of waiting, 10 ms before the attempt, 0.3 s of reference, 4.5 ms of filter.
    assert!((316..=320).contains(&gaps[1]), "{gaps:?}");
    let (_, statuses) = packets(&seen);
    let last = statuses.last().unwrap();
    assert_eq!((last.gaps, last.missed_scans), (2, gaps[0] + gaps[1]));
}

#[test]
fn a_chip_that_stays_silent_has_failed_and_comes_back() {
    let silent = break_with(Faults {
        no_edges: true,
        ..Faults::default()
    });
    let seen = acquired(&[(1_000, &nothing), (10_000, &silent), (12_500, &mend)]);
    let told = faults(&seen);
    let fault = Event::Fault(Ads129xError::NoEdge { limit_us: 2_100 });
    let later = Event::Fault(Ads129xError::NoEdge { limit_us: 8_000 });
    assert_eq!(told[0].1, fault);
    assert_eq!(
        told[1..4].iter().map(|told| told.1).collect::<Vec<_>>(),
        [later; 3]
    );
    let failed = Event::Failed(Ads129xError::NoEdge { limit_us: 8_000 });
    assert!(told[4..].iter().all(|told| told.1 == failed), "{told:?}");
    assert!(told[4].0 < 3_000_000, "failed within 2 s: {}", told[4].0);
    let between_us = told[6].0 - told[5].0;
    assert!((1_300_000..1_320_000).contains(&between_us), "{between_us}");
    let scans = scans(&seen);
    assert_eq!(gaps(&scans).len(), 1);
    let last_us = scans.last().unwrap().acquired_us;
    assert!(last_us > 3_000_000 + 12_490_000, "it runs again: {last_us}");
}

#[test]
fn a_dead_bus_never_hangs_the_task() {
    for (faults_of_bus, error) in [
        (
            Faults {
                spi_fails: true,
                ..Faults::default()
            },
            Ads129xError::Spi(ErrorKind::Other),
        ),
        (
            Faults {
                spi_hangs: true,
                ..Faults::default()
            },
            Ads129xError::SpiStuck { limit_us: 1_000 },
        ),
    ] {
        let seen = acquired(&[
            (1_000, &nothing),
            (5_000, &break_with(faults_of_bus)),
            (8_000, &mend),
        ]);
        let told = faults(&seen);
        let (soon, later) = told.split_at(4);
        assert!(
            soon.iter().all(|told| told.1 == Event::Fault(error)),
            "{told:?}"
        );
        assert!(
            later.iter().all(|told| told.1 == Event::Failed(error)),
            "{told:?}"
        );
        assert!((3..=5).contains(&later.len()), "once a second: {later:?}");
        let scans = scans(&seen);
        assert_eq!(gaps(&scans).len(), 1);
        assert!(scans.last().unwrap().acquired_us > 3_000_000 + 7_990_000);
    }
}

#[test]
fn slipped_bits_drop_the_scan_and_then_set_the_chip_up_again() {
    let slip = |slip| {
        move |chip: &Chip| {
            chip.with(|chip| chip.faults.slip = slip);
        }
    };
    // One frame, then good ones.
    let seen = acquired(&[(1_000, &nothing), (1_001, &slip(1)), (2_000, &slip(0))]);
    let header = Ads129xError::Header { got: 0b0110 };
    let told: Vec<_> = faults(&seen).into_iter().map(|told| told.1).collect();
    assert_eq!(told, [Event::Fault(header)]);
    assert_eq!(gaps(&scans(&seen)), [1]);

    // For good: no such count ever comes through.
    let before = scans(&acquired(&[(1_000, &nothing)])).len();
    let seen = acquired(&[(1_000, &nothing), (9_000, &slip(1))]);
    assert_eq!(scans(&seen).len(), before);
    let told: Vec<_> = faults(&seen).into_iter().map(|told| told.1).collect();
    assert_eq!(told[..4], [Event::Fault(header); 4]);
    assert_eq!(told.last(), Some(&Event::Failed(header)));
}

#[test]
fn a_brown_out_to_another_id_is_refused_until_the_chip_is_itself() {
    let brown_out = break_with(Faults {
        id: Some(0x00),
        no_edges: true,
        ..Faults::default()
    });
    let seen = acquired(&[(1_000, &nothing), (1_350, &brown_out), (3_000, &mend)]);
    let told: Vec<_> = faults(&seen).into_iter().map(|told| told.1).collect();
    let wrong = Ads129xError::WrongId {
        expected: 0x90,
        got: 0x00,
    };
    assert_eq!(
        told[0],
        Event::Fault(Ads129xError::NoEdge { limit_us: 2_100 })
    );
    assert!(
        told[1..].iter().all(|told| *told == Event::Fault(wrong)),
        "{told:?}"
    );
    assert!(told.len() >= 3);
    let scans = scans(&seen);
    assert_eq!(gaps(&scans).len(), 1);
    assert!(scans.last().unwrap().acquired_us > 3_000_000 + 2_990_000);
}

#[test]
fn a_register_that_stops_holding_is_named() {
    let stuck = break_with(Faults {
        stuck: Some((0x05, 0x81)),
        no_edges: true,
        ..Faults::default()
    });
    let seen = acquired(&[(1_000, &nothing), (3_000, &stuck)]);
    let read_back = Ads129xError::ReadBack {
        register: Register(0x05),
        expected: 0x00,
        got: 0x81,
    };
    assert!(
        faults(&seen)
            .iter()
            .any(|told| told.1 == Event::Fault(read_back))
    );
}

#[test]
fn saturated_and_lead_off_channels_get_their_quality_bits() {
    let saturate = |chip: &Chip| {
        chip.with(|chip| {
            chip.input = |conversion, channel| match channel {
                0 => 8_388_607,
                1 => -8_388_608,
                _ => noise_of_rest(conversion, channel),
            };
        });
    };
    // Negative electrode of channel 3.
    let lose = |chip: &Chip| chip.with(|chip| chip.lead_off = [0b0000, 0b0100]);
    let seen = acquired(&[(2_000, &nothing), (2_050, &saturate)]);
    let (streams, _) = packets(&seen);
    let quality = streams.last().unwrap().quality;
    assert!(quality[0].contains(Quality::SATURATED) && quality[1].contains(Quality::SATURATED));
    assert_eq!(quality[2..4], [Quality::GOOD; 2]);

    let seen = acquired(&[(2_000, &nothing), (2_050, &lose)]);
    let (streams, _) = packets(&seen);
    let quality = streams.last().unwrap().quality;
    let good = Quality::GOOD;
    assert_eq!(quality[..4], [good, good, Quality::LEAD_OFF, good]);
}

#[test]
fn a_gap_restarts_the_signal_path_and_says_so() {
    let lose = |chip: &Chip| chip.with(|chip| chip.faults.lost_edges = 2);
    let seen = acquired(&[(2_000, &nothing), (2_400, &lose)]);
    let (streams, _) = packets(&seen);
    let flags = streams.last().unwrap().flags;
    let gap = tonus_shared::wire::StreamFlags::GAP;
    assert!(flags.contains(gap), "{flags:?}");
}

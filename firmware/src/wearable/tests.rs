use std::{cell::RefCell, vec::Vec};

use embassy_futures::poll_once;
use tonus_shared::{
    pipeline::illustrative,
    sample::Scan,
    wire::{
        Control, Frame, Header, Inference, Kind, LastWords, Refusal, Reply, SkillPosterior, Status,
        decode,
    },
};

use super::*;
use crate::{
    acquisition::{CHANNELS, MUSCLES, RATE_HZ},
    afe::saadc,
    outbox::Outbox,
    recognition,
    requests::{Asked, Jobs},
};

const BOOT_ID: u32 = 0xB007;

struct Bench {
    events: EventQueue<CHANNELS, 8>,
    attitude: Attitude,
    inbox: Inbox,
    words: Words,
    vitals: Vitals,
    outbox: Outbox,
    jobs: Jobs,
    recognition: recognition::Inbox,
    last_words: LastWords,
}

/// What was told, in words.
type Told = RefCell<Vec<&'static str>>;

impl Bench {
    fn new() -> Self {
        Self {
            events: EventQueue::new(),
            attitude: Attitude::new(),
            inbox: Inbox::new(),
            words: Words::new(),
            vitals: Vitals::new(),
            outbox: Outbox::new(),
            jobs: Jobs::new(),
            recognition: recognition::Inbox::new(),
            last_words: LastWords::default(),
        }
    }

    /// Lets the loop run between every two `steps`, and gives all that was sent.
    fn run(&self, told: &Told, steps: u32, mut step: impl FnMut(&Self, u32)) -> Vec<Frame> {
        let calibration = illustrative(MUSCLES, RATE_HZ);
        let mut path = SignalPath::new(saadc::board(BOOT_ID).unwrap(), &calibration).unwrap();
        let ports = Ports {
            events: &self.events,
            attitude: &self.attitude,
            inbox: &self.inbox,
            words: &self.words,
            vitals: &self.vitals,
            reset_reason: ResetReason::Pin,
            desk: Desk {
                outbox: &self.outbox,
                jobs: &self.jobs,
                recognition: &self.recognition,
                last_words: &self.last_words,
            },
        };
        let tell = |notice: Notice<'_>| {
            told.borrow_mut().push(match notice {
                Notice::Alive | Notice::Asked(..) => return,
                Notice::Calibrated(_) => "calibrated",
                Notice::Stumbled(_) => "stumbled",
                Notice::Failed(_) => "failed",
                Notice::NotSent(_) => "not sent",
                Notice::Restart => "restart",
            });
        };
        let mut running = core::pin::pin!(run(&mut path, ports, || 77, tell));
        let mut frames = Vec::new();
        for number in 0..steps {
            step(self, number);
            assert!(poll_once(running.as_mut()).is_pending(), "it runs for ever");
            while poll_once(async { frames.push(decode(&self.outbox.take().await).unwrap()) })
                .is_ready()
            {}
        }
        frames
    }

    fn scan(&self, index: u32) {
        self.events.put(Event::Scan {
            scan: Scan {
                index,
                acquired_us: u64::from(index) * 1_000,
                counts: [1877; CHANNELS],
            },
            lead_off: [false, true, false, false],
        });
    }
}

fn last_status(frames: &[Frame]) -> Status {
    let status = |frame: &Frame| match frame.packet {
        Packet::Status(status) => Some(status),
        _ => None,
    };
    frames.iter().rev().find_map(status).unwrap()
}

fn frame(packet: Packet) -> Vec<u8> {
    let header = Header {
        boot_id: 1,
        sequence: 6,
        device_us: 0,
    };
    let mut bytes = [0; tonus_shared::wire::MAX_FRAME_BYTES];
    let length = tonus_shared::wire::encode(&header, &packet, &mut bytes).unwrap();
    bytes[..length].into()
}

#[test]
fn scans_become_packets_and_the_status_gathers_what_every_task_knows() {
    let (bench, told) = (Bench::new(), Told::default());
    bench.vitals.linked();
    bench.vitals.lost_scans(4);
    let frames = bench.run(&told, 2_100, |bench, number| {
        bench.scan(number);
        if number == 1_500 {
            // Nine events in a queue of eight.
            for extra in 0..8 {
                bench.scan(1_500 + extra);
            }
        }
    });
    let streams = frames
        .iter()
        .filter(|frame| matches!(frame.packet, Packet::Stream(_)))
        .count();
    assert_eq!(streams, 210);
    let status = last_status(&frames);
    assert_eq!((status.links, status.overruns), (1, 5));
    assert_eq!(status.reset_reason, ResetReason::Pin);
    let quality = status.quality.map(|quality| quality.bits());
    assert_eq!(quality, [2, 10, 2, 2, 0, 0, 0, 0], "flat; lead off");
    assert_eq!(*told.borrow(), ["calibrated"]);
}

#[test]
fn a_front_end_that_fails_is_flagged_until_it_gives_scans_and_requests_are_answered_meanwhile() {
    let (bench, told) = (Bench::new(), Told::default());
    let failure = Ads129xError::NoEdge { limit_us: 2_100 };
    let flagged = |bench: &Bench| {
        let flags = bench.vitals.health(ResetReason::Unknown).flags;
        flags.contains(StatusFlags::FRONT_END_FAILED)
    };
    let frames = bench.run(&told, 4, |bench, number| match number {
        0 => bench.events.put(Event::Fault(failure)),
        1 => {
            assert!(!flagged(bench), "a fault is not a failure");
            bench.events.put(Event::Failed(failure));
        }
        2 => {
            assert!(flagged(bench));
            let asked = frame(Packet::Control(Control::SendLastWords));
            let taken = bench
                .inbox
                .offer(embassy_time::Instant::MIN, Kind::Control, &asked);
            assert_eq!(taken, Ok(()));
        }
        _ => bench.scan(1),
    });
    assert!(!flagged(&bench));
    assert_eq!(*told.borrow(), ["calibrated", "stumbled", "failed"]);
    let kinds: Vec<Kind> = frames.iter().map(|frame| frame.packet.kind()).collect();
    assert_eq!(kinds[..2], [Kind::LastWords, Kind::Reply]);
}

#[test]
fn a_calibration_that_was_kept_is_used_and_answered_and_no_longer_missing() {
    let (bench, told) = (Bench::new(), Told::default());
    bench.vitals.set(StatusFlags::NOT_CALIBRATED, true);
    let mut wanted = illustrative(MUSCLES, RATE_HZ);
    wanted.revision = 5;
    let asked = Asked {
        kind: Kind::Calibration,
        sequence: 3,
    };
    let frames = bench.run(&told, 2, |bench, number| match number {
        0 => bench
            .words
            .try_send(Word::Calibrated(wanted, asked))
            .unwrap(),
        _ => {
            let read = frame(Packet::Control(Control::SendCalibration));
            bench
                .inbox
                .offer(embassy_time::Instant::MIN, Kind::Control, &read)
                .unwrap();
        }
    });
    let reply = Reply {
        answered: Kind::Calibration,
        sequence: 3,
        outcome: Ok(()),
        detail: 0,
    };
    assert_eq!(frames[0].packet, Packet::Reply(reply));
    assert_eq!(frames[1].packet, Packet::Calibration(wanted));
    let flags = bench.vitals.health(ResetReason::Unknown).flags;
    assert!(!flags.contains(StatusFlags::NOT_CALIBRATED));
    assert_eq!(*told.borrow(), ["calibrated", "calibrated"]);
}

#[test]
fn words_are_numbered_an_inference_by_its_own_time_and_a_restart_is_told() {
    let (bench, told) = (Bench::new(), Told::default());
    let inference = Inference {
        skills: 1,
        top: [SkillPosterior {
            skill: 0,
            log_posterior: 0.0,
        }]
        .into_iter()
        .collect(),
        phase: 0.5,
        stiffness_n_per_m: [300.0; 3],
    };
    let refused = Asked {
        kind: Kind::ModelUpload,
        sequence: 3,
    }
    .answered(Err(Refusal::HashMismatch), 0);
    let frames = bench.run(&told, 1, |bench, _| {
        let words = &bench.words;
        words.try_send(Word::Say(refused.clone())).unwrap();
        words.try_send(Word::Infer(55, inference.clone())).unwrap();
        let restart = frame(Packet::Control(Control::Restart { boot_id: BOOT_ID }));
        bench
            .inbox
            .offer(embassy_time::Instant::MIN, Kind::Control, &restart)
            .unwrap();
    });
    let seen = |packet: &Packet| {
        let found = frames.iter().find(|frame| frame.packet == *packet);
        found.map(|frame| frame.header.device_us)
    };
    assert_eq!(seen(&refused), Some(77), "the present");
    assert_eq!(seen(&Packet::Inference(inference)), Some(55));
    let sequence = frames.iter().map(|frame| frame.header.sequence);
    assert!(sequence.eq(0..3));
    assert_eq!(*told.borrow(), ["calibrated", "restart"]);
}

use super::*;

const BAD: LinkConditions = LinkConditions {
    loss: 0.05,
    duplicate: 0.02,
    reorder: 0.03,
    corrupt: 0.01,
    delay_us: 7_500,
    jitter_us: 7_500,
};

fn packet(number: u32) -> Vec<u8> {
    let mut bytes = vec![0xa5; 60];
    bytes[..4].copy_from_slice(&number.to_le_bytes());
    bytes
}

/// Sends `count` packets 10 ms apart and polls every millisecond until all are through.
fn run(conditions: LinkConditions, seed: u64, count: u32) -> (Vec<Delivery>, LinkCounters) {
    let mut link = SimulatedLink::new(conditions, seed).unwrap();
    let mut out = Vec::new();
    for ms in 0..u64::from(count) * 10 + 1000 {
        if ms % 10 == 0 && ms / 10 < u64::from(count) {
            link.push(&packet(u32::try_from(ms / 10).unwrap()), ms * 1000);
        }
        while let Some(delivery) = link.poll(ms * 1000) {
            assert!(delivery.at_us <= ms * 1000);
            out.push(delivery);
        }
    }
    assert!(link.poll(u64::MAX).is_none(), "nothing is left behind");
    (out, link.counters())
}

fn number(delivery: &Delivery) -> u32 {
    u32::from_le_bytes(delivery.bytes[..4].try_into().unwrap())
}

#[test]
fn a_clean_link_delivers_everything_in_order_and_in_time() {
    let (out, counters) = run(LinkConditions::default(), 3, 500);
    assert_eq!(
        out.iter().map(number).collect::<Vec<_>>(),
        (0..500).collect::<Vec<_>>()
    );
    for delivery in &out {
        let delay = delivery.at_us - u64::from(number(delivery)) * 10_000;
        assert!((7_500..=15_000).contains(&delay), "{delay}");
        assert_eq!(delivery.bytes, packet(number(delivery)));
    }
    assert_eq!(
        counters,
        LinkCounters {
            sent: 500,
            delivered: 500,
            ..LinkCounters::default()
        }
    );
}

#[test]
fn packets_are_conserved_and_fates_have_their_stated_rates() {
    let (out, c) = run(BAD, 11, 20_000);
    assert_eq!(c.sent, 20_000);
    assert_eq!(c.delivered + c.lost + c.overflowed, c.sent + c.duplicated);
    assert_eq!(out.len() as u64, c.delivered);
    // Binomial means; four standard deviations.
    for (count, p) in [
        (c.lost, 0.05),
        (c.duplicated, 0.02 * 0.95),
        (c.reordered, 0.03 * 0.95),
        (c.corrupted, 0.01 * 0.95),
    ] {
        let mean = 20_000.0 * p;
        assert!(
            (count as f64 - mean).abs() < 4.0 * (mean * (1.0 - p)).sqrt(),
            "{count} against {mean}"
        );
    }
    let changed = out.iter().filter(|d| d.bytes != packet(number(d))).count() as u64;
    assert!(
        changed <= 2 * c.corrupted,
        "no packet changes but the corrupted ones and their duplicates"
    );
}

#[test]
fn a_corrupted_packet_always_differs() {
    let mut link = SimulatedLink::new(
        LinkConditions {
            corrupt: 1.0,
            ..LinkConditions::default()
        },
        5,
    )
    .unwrap();
    for n in 0..1000 {
        link.push(&[n as u8], n * 10_000);
        assert_ne!(link.poll(u64::MAX).unwrap().bytes, [n as u8]);
    }
    link.push(&[], 10_000_000);
    assert_eq!(link.poll(u64::MAX).unwrap().bytes, [0_u8; 0]);
}

#[test]
fn overtaking_happens_only_when_asked_for() {
    let inversions = |out: &[Delivery]| {
        out.windows(2)
            .filter(|w| number(&w[1]) < number(&w[0]))
            .count()
    };
    let jittery = LinkConditions {
        jitter_us: 80_000,
        ..LinkConditions::default()
    };
    assert_eq!(inversions(&run(jittery, 2, 2000).0), 0);
    assert!(
        inversions(
            &run(
                LinkConditions {
                    reorder: 0.1,
                    ..jittery
                },
                2,
                2000
            )
            .0
        ) > 50
    );
}

#[test]
fn one_seed_gives_one_run_and_another_seed_another() {
    assert_eq!(run(BAD, 7, 2000), run(BAD, 7, 2000));
    assert_ne!(run(BAD, 7, 2000).0, run(BAD, 8, 2000).0);
}

#[test]
fn what_is_lost_does_not_depend_on_other_conditions() {
    let lossy = LinkConditions {
        loss: 0.1,
        ..LinkConditions::default()
    };
    let arrived = |conditions| {
        run(conditions, 9, 2000)
            .0
            .iter()
            .map(number)
            .collect::<std::collections::BTreeSet<_>>()
    };
    assert_eq!(
        arrived(lossy),
        arrived(LinkConditions {
            duplicate: 0.2,
            reorder: 0.2,
            ..lossy
        })
    );
}

#[test]
fn a_stalled_receiver_costs_the_oldest_packets() {
    let mut link = SimulatedLink::new(LinkConditions::default(), 1).unwrap();
    for n in 0..u32::try_from(CAPACITY).unwrap() + 10 {
        link.push(&packet(n), u64::from(n) * 10_000);
    }
    assert_eq!(link.counters().overflowed, 10);
    assert_eq!(number(&link.poll(u64::MAX).unwrap()), 10);
}

#[test]
fn what_is_no_probability_is_refused_by_name() {
    let error = SimulatedLink::new(
        LinkConditions {
            loss: 1.5,
            ..LinkConditions::default()
        },
        0,
    )
    .unwrap_err();
    assert_eq!(
        error,
        NotAProbability {
            name: "loss",
            value: 1.5
        }
    );
    assert!(
        SimulatedLink::new(
            LinkConditions {
                corrupt: f64::NAN,
                ..LinkConditions::default()
            },
            0
        )
        .is_err()
    );
}

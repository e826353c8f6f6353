//! What another calibration changes, and what a refused one does not.

use super::*;

#[test]
fn another_calibration_scales_the_envelopes_and_goes_on_numbering() {
    let mut four = Four::new();
    let before = four.run(2_000);
    let mut calibration = *four.path.calibration();
    calibration.revision = 7;
    calibration.mvc_v = calibration.mvc_v.map(|mvc_v| 2.0 * mvc_v);
    four.path.recalibrate(&calibration).unwrap();
    assert_eq!(four.path.calibration(), &calibration);
    let after = four.run(2_000);
    assert!(
        matches!(after[0].packet, Packet::Configuration(_)),
        "due at once"
    );
    let frames: Vec<Frame> = before.into_iter().chain(after.clone()).collect();
    let sequence = frames.iter().map(|frame| frame.header.sequence);
    assert!(sequence.eq(0..frames.len() as u32));
    // Mean magnitude of 100 counts, 439.5 uV: 279.8 uV. From (279.8 - 10) / 490 to (279.8 - 10) / 990.
    let [old, new] = [&frames[..frames.len() - after.len()], &after[..]]
        .map(|frames| *streams(frames).last().unwrap());
    assert!(
        (old.envelopes[3] - 0.5506).abs() < 0.01,
        "{}",
        old.envelopes[3]
    );
    assert!(
        (new.envelopes[3] - 0.2725).abs() < 0.01,
        "{}",
        new.envelopes[3]
    );
    assert_eq!(new.channels, 4);
    // While the filters settle the activation is held where it was, and nothing jumps.
    let stiffness: Vec<f32> = streams(&frames)
        .iter()
        .map(|stream| stream.stiffness_n_per_m[0])
        .collect();
    let step = stiffness
        .windows(2)
        .skip(60)
        .map(|pair| (pair[1] / pair[0] - 1.0).abs());
    assert!(step.fold(0.0, f32::max) < 0.05);
    let first = streams(&after)[0];
    assert!(
        first.flags.contains(StreamFlags::ACTIVATION_HELD)
            && !first.flags.contains(StreamFlags::GAP)
    );
    assert!(
        (first.activation - old.activation).abs() < 1e-3,
        "held at the last"
    );
    assert!(!new.flags.contains(StreamFlags::ACTIVATION_HELD), "settled");
}

#[test]
fn a_refused_calibration_leaves_the_old_one() {
    let mut four = Four::new();
    four.run(1_000);
    let good = *four.path.calibration();
    let mut undisturbed = Four::new();
    undisturbed.run(1_000);
    let wrong = [
        Calibration {
            channels: 1,
            ..good
        },
        Calibration {
            semg_hz: 2_000.0,
            ..good
        },
        Calibration {
            mains_hz: Some(55),
            ..good
        },
        Calibration {
            mvc_v: good.rest_v,
            ..good
        },
        Calibration {
            muscles: [Muscle::Other; 8],
            ..good
        },
        Calibration {
            activation_window_s: 9.0,
            ..good
        },
        Calibration { l2: 0.0, ..good },
        Calibration {
            l1: 5_000.0,
            ..good
        },
        Calibration {
            rest_stiffness_nm_per_rad: [1e-3; 4],
            ..good
        },
        Calibration {
            body_height_m: 175.0,
            ..good
        },
        Calibration {
            body_mass_kg: f32::NAN,
            ..good
        },
    ];
    for calibration in wrong {
        let refused = four.path.recalibrate(&calibration);
        assert!(refused.is_err(), "{calibration:?}");
        assert_eq!(four.path.calibration(), &good);
    }
    assert_eq!(
        four.run(1_000),
        undisturbed.run(1_000),
        "as if nobody had asked"
    );
}

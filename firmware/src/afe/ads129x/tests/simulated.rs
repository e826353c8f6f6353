//! The driver on a simulated chip, in virtual time.

use std::future::pending;

use embedded_hal::spi::ErrorKind;

use super::super::{
    chip::{Chip, Driver, Faults},
    *,
};

#[test]
fn a_register_that_does_not_hold_is_named() {
    let chip = Chip::new(0);
    let registers = [
        (0x01, 0x06, 0x85),
        (0x03, 0x4c, 0xcc),
        (0x04, 0x00, 0x03),
        (0x06, 0x80, 0x00),
        (0x10, 0x0e, 0x0f),
        (0x17, 0x00, 0x02),
    ];
    for (address, got, expected) in registers {
        chip.with(|chip| chip.faults.stuck = Some((address, got)));
        let outcome = chip.run(chip.driver(Settings::surface_emg()).power_up());
        let expected = Ads129xError::ReadBack {
            register: Register(address),
            expected,
            got,
        };
        assert_eq!(outcome, Err(expected));
        let said = expected.to_string();
        assert!(said.contains(&format!("{address:02X}h reads")), "{said}");
    }
}

/// A started driver on a simulated chip.
fn started(chip: &Chip) -> Driver {
    let mut driver = chip.driver(Settings::surface_emg());
    chip.run(driver.power_up()).unwrap();
    driver
}

#[test]
fn conversions_come_with_their_edge_and_nothing_else() {
    let chip = Chip::new(0);
    chip.with(|chip| {
        chip.input = |conversion, channel| conversion as i32 * 10 - 1_000_000 * channel as i32;
        chip.lead_off = [0b0010, 0b0000];
    });
    let mut driver = started(&chip);
    let mut edges = chip.clone();
    let mut last = None;
    for _ in 0..1_000 {
        let (edge, conversion) = chip.run(driver.next(&mut edges)).unwrap();
        let number = chip.with(|chip| chip.conversions) as i32;
        let counts = [0, 1, 2, 3].map(|channel| number * 10 - 1_000_000 * channel);
        assert_eq!(conversion.counts, counts);
        assert_eq!(conversion.lead_off, [false, true, false, false]);
        if let Some(last) = last.replace(edge.captured) {
            assert_eq!(edge.captured.wrapping_sub(last), 16_000);
        }
    }
}

#[test]
fn a_missing_edge_ends_the_wait_after_two_periods() {
    let chip = Chip::new(0);
    let mut driver = started(&chip);
    let mut edges = chip.clone();
    chip.run(driver.next(&mut edges)).unwrap();
    chip.with(|chip| chip.faults.no_edges = true);
    let before_us = chip.now_us();
    let outcome = chip.run(driver.next(&mut edges));
    assert_eq!(outcome, Err(Ads129xError::NoEdge { limit_us: 2_100 }));
    assert_eq!(chip.now_us() - before_us, 2_100);
}

#[test]
fn one_lost_edge_is_waited_over() {
    let chip = Chip::new(0);
    let mut driver = started(&chip);
    let mut edges = chip.clone();
    let (first, _) = chip.run(driver.next(&mut edges)).unwrap();
    chip.with(|chip| chip.faults.lost_edges = 1);
    let (second, _) = chip.run(driver.next(&mut edges)).unwrap();
    assert_eq!(second.captured.wrapping_sub(first.captured), 32_000);
}

#[test]
fn a_bus_that_fails_or_hangs_is_told_apart() {
    let chip = Chip::new(0);
    let mut driver = started(&chip);
    let mut edges = chip.clone();
    chip.with(|chip| chip.faults.spi_fails = true);
    let failed = Err(Ads129xError::Spi(ErrorKind::Other));
    assert_eq!(chip.run(driver.next(&mut edges)), failed);
    chip.with(|chip| {
        chip.faults = Faults {
            spi_hangs: true,
            ..Faults::default()
        };
    });
    let stuck = Ads129xError::SpiStuck { limit_us: 1_000 };
    assert_eq!(chip.run(driver.next(&mut edges)), Err(stuck));
    assert_eq!(chip.run(driver.power_up()), Err(stuck));
    chip.with(|chip| chip.faults = Faults::default());
    assert_eq!(chip.run(driver.initialise()), Ok(()), "and comes back");
}

#[test]
fn the_self_test_measures_what_the_sheet_says() {
    for rate in [Rate::Hz1000, Rate::Hz2000] {
        let chip = Chip::new(0);
        let mut settings = Settings::surface_emg();
        settings.rate = rate;
        settings.inputs[3] = Input::Off;
        let mut driver = chip.driver(settings);
        let mut edges = chip.clone();
        let measured = chip.run(driver.self_test(&mut edges)).unwrap();
        for channel in 0..3 {
            let amplitude_v = measured.amplitude_v[channel];
            assert!((amplitude_v - 1e-3).abs() < 1e-6, "{amplitude_v} V");
            // Five counts of 47.7 nV.
            let noise_v = measured.noise_v[channel];
            assert!((noise_v - 238.4e-9).abs() < 3e-9, "{noise_v} V");
        }
        assert_eq!((measured.amplitude_v[3], measured.noise_v[3]), (0.0, 0.0));
        // Back on the electrodes.
        chip.with(|chip| chip.input = |_, channel| channel as i32 + 7);
        let (_, conversion) = chip.run(driver.next(&mut edges)).unwrap();
        assert_eq!(conversion.counts, [7, 8, 9, 0]);
    }
}

#[test]
fn the_self_test_finds_a_wrong_reference_and_noise() {
    let chip = Chip::new(0);
    let mut driver = chip.driver(Settings::surface_emg());
    let mut edges = chip.clone();
    for reference in [0.0, 0.9, 1.1, 2.0] {
        chip.with(|chip| chip.faults.reference = Some(reference));
        let outcome = chip.run(driver.self_test(&mut edges));
        let Err(SelfTestError::Amplitude { channel, got_v, .. }) = outcome else {
            panic!("{outcome:?}");
        };
        assert_eq!(channel, 1);
        assert!((f64::from(got_v) - 1e-3 * reference).abs() < 1e-6);
    }
    chip.with(|chip| {
        chip.faults.reference = None;
        chip.faults.noise = 100;
    });
    let outcome = chip.run(driver.self_test(&mut edges));
    assert!(
        matches!(outcome, Err(SelfTestError::Noise { channel: 2, .. })),
        "{outcome:?}"
    );
    chip.with(|chip| chip.faults.no_edges = true);
    let outcome = chip.run(driver.self_test(&mut edges));
    let silent = Ads129xError::NoEdge { limit_us: 8_000 };
    assert_eq!(outcome, Err(SelfTestError::Converter(silent)));
}

#[test]
#[should_panic(expected = "what never comes")]
fn the_simulation_notices_a_hang() {
    Chip::new(0).run(pending::<()>());
}

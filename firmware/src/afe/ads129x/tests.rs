//! The chip's side of the bus, byte by byte from the sheet.

mod simulated;

use std::{cell::RefCell, convert::Infallible, rc::Rc};

use embassy_futures::block_on;
use embedded_hal::digital::{ErrorType, OutputPin};
use embedded_hal_mock::eh1::{
    delay::{CheckedDelay, Transaction as Wait},
    spi::{Mock, Transaction},
};

use super::*;

/// Writes its levels down.
#[derive(Clone)]
struct Pin(&'static str, Rc<RefCell<Vec<String>>>);

impl ErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.1.borrow_mut().push(format!("{} low", self.0));
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.1.borrow_mut().push(format!("{} high", self.0));
        Ok(())
    }
}

/// One chip select: `out` goes to the chip, `back` comes from it.
fn select_chip(out: &[u8], back: &[u8]) -> [Transaction<u8>; 4] {
    [
        Transaction::transaction_start(),
        Transaction::transfer_in_place(out.to_vec(), back.to_vec()),
        Transaction::delay(2_000),
        Transaction::transaction_end(),
    ]
}

/// Runs `initialise` against literal bytes and waits, and gives the levels of the pins.
fn initialise<const C: usize>(
    settings: Settings<C>,
    traffic: &[(&[u8], &[u8])],
    waits: &[Wait],
) -> (Result<(), Ads129xError>, Vec<String>) {
    let expected: Vec<_> = traffic
        .iter()
        .flat_map(|(out, back)| select_chip(out, back))
        .collect();
    let mut spi = Mock::new(&expected);
    let mut delay = CheckedDelay::new(waits);
    let levels = Rc::default();
    let mut driver: Ads129x<C, _, _, _, _> = Ads129x::new(
        spi.clone(),
        Pin("RESET", Rc::clone(&levels)),
        Pin("START", Rc::clone(&levels)),
        delay.clone(),
        settings,
    );
    let outcome = block_on(driver.initialise());
    spi.done();
    delay.done();
    drop(driver);
    (outcome, levels.take())
}

/// 2 t_CLK of reset, 18 t_CLK of recovery, start of the reference.
fn waits() -> [Wait; 3] {
    [
        Wait::async_delay_us(10),
        Wait::async_delay_us(20),
        Wait::async_delay_us(300_000),
    ]
}

#[test]
fn an_ads1294_is_set_up_with_these_bytes() {
    // SBAS459, "SPI command definitions" and "Register maps". RLD_STAT, CONFIG3 bit 0, reads as it likes.
    let traffic: [(&[u8], &[u8]); 14] = [
        (&[0x11], &[0x00]),
        (&[0x20, 0x00, 0x00], &[0x00, 0x00, 0x90]),
        (&[0x43, 0x00, 0xcc], &[0x00, 0x00, 0x00]),
        (&[0x41, 0x03, 0x85, 0x00, 0xcc, 0x03], &[0; 6]),
        (
            &[0x21, 0x03, 0, 0, 0, 0],
            &[0x00, 0x00, 0x85, 0x00, 0xcd, 0x03],
        ),
        (&[0x45, 0x03, 0x00, 0x00, 0x00, 0x00], &[0; 6]),
        (&[0x25, 0x03, 0, 0, 0, 0], &[0; 6]),
        (&[0x4d, 0x04, 0x0f, 0x0f, 0x0f, 0x0f, 0x00], &[0; 7]),
        (
            &[0x2d, 0x04, 0, 0, 0, 0, 0],
            &[0x00, 0x00, 0x0f, 0x0f, 0x0f, 0x0f, 0x00],
        ),
        (&[0x54, 0x00, 0x00], &[0; 3]),
        (&[0x34, 0x00, 0x00], &[0; 3]),
        (&[0x57, 0x00, 0x02], &[0; 3]),
        (&[0x37, 0x00, 0x00], &[0x00, 0x00, 0x02]),
        (&[0x10], &[0x00]),
    ];
    let (outcome, levels) = initialise(Settings::<4>::surface_emg(), &traffic, &waits());
    assert_eq!(outcome, Ok(()));
    assert_eq!(
        levels,
        ["START low", "RESET low", "RESET high", "START high"]
    );
}

#[test]
fn an_ads1298_at_2_khz_with_strong_lead_off_and_one_channel_off() {
    let mut settings = Settings::<8>::surface_emg();
    settings.rate = Rate::Hz2000;
    settings.gain = Gain::X12;
    settings.inputs[7] = Input::Off;
    settings.driven_reference = false;
    settings.lead_off = Some(LeadOff {
        current: LeadOffCurrent::Na24,
        threshold: LeadOffThreshold::Percent70,
    });
    let channels = [0x60, 0x60, 0x60, 0x60, 0x60, 0x60, 0x60, 0x81];
    let mut set = vec![0x45, 0x07];
    set.extend(channels);
    let mut held = vec![0x00, 0x00];
    held.extend(channels);
    let traffic: [(&[u8], &[u8]); 14] = [
        (&[0x11], &[0x00]),
        (&[0x20, 0x00, 0x00], &[0x00, 0x00, 0x92]),
        (&[0x43, 0x00, 0xc0], &[0x00, 0x00, 0x00]),
        (&[0x41, 0x03, 0x84, 0x00, 0xc0, 0xef], &[0; 6]),
        (
            &[0x21, 0x03, 0, 0, 0, 0],
            &[0x00, 0x00, 0x84, 0x00, 0xc0, 0xef],
        ),
        (&set, &[0; 10]),
        (&[0x25, 0x07, 0, 0, 0, 0, 0, 0, 0, 0], &held),
        (&[0x4d, 0x04, 0x00, 0x00, 0x7f, 0x7f, 0x00], &[0; 7]),
        (
            &[0x2d, 0x04, 0, 0, 0, 0, 0],
            &[0x00, 0x00, 0x00, 0x00, 0x7f, 0x7f, 0x00],
        ),
        (&[0x54, 0x00, 0x00], &[0; 3]),
        (&[0x34, 0x00, 0x00], &[0; 3]),
        (&[0x57, 0x00, 0x02], &[0; 3]),
        (&[0x37, 0x00, 0x00], &[0x00, 0x00, 0x02]),
        (&[0x10], &[0x00]),
    ];
    assert_eq!(initialise(settings, &traffic, &waits()).0, Ok(()));
}

#[test]
fn every_field_of_a_register_has_the_sheets_bits() {
    // LOFF: COMP_TH 7:5 in the sheet's order, ILEAD_OFF 3:2, FLEAD_OFF 11 = DC.
    let mut settings = Settings::<4>::surface_emg();
    let thresholds = [
        (LeadOffThreshold::Percent95, 0x03),
        (LeadOffThreshold::Percent92_5, 0x23),
        (LeadOffThreshold::Percent90, 0x43),
        (LeadOffThreshold::Percent87_5, 0x63),
        (LeadOffThreshold::Percent85, 0x83),
        (LeadOffThreshold::Percent80, 0xa3),
        (LeadOffThreshold::Percent75, 0xc3),
        (LeadOffThreshold::Percent70, 0xe3),
    ];
    for (threshold, loff) in thresholds {
        let current = LeadOffCurrent::Na6;
        settings.lead_off = Some(LeadOff { current, threshold });
        assert_eq!(settings.loff(), loff);
    }
    let currents = [
        (LeadOffCurrent::Na6, 0x03),
        (LeadOffCurrent::Na12, 0x07),
        (LeadOffCurrent::Na18, 0x0b),
        (LeadOffCurrent::Na24, 0x0f),
    ];
    for (current, loff) in currents {
        let threshold = LeadOffThreshold::Percent95;
        settings.lead_off = Some(LeadOff { current, threshold });
        assert_eq!(settings.loff(), loff);
    }
    settings.lead_off = None;
    assert_eq!((settings.loff(), settings.config4()), (0x00, 0x00));
    assert_eq!(settings.senses(), [0x0f, 0x0f, 0x00, 0x00, 0x00]);

    // CHnSET: GAIN 6:4, MUX 2:0.
    let gains = [
        (Gain::X6, 0x00),
        (Gain::X1, 0x10),
        (Gain::X2, 0x20),
        (Gain::X3, 0x30),
        (Gain::X4, 0x40),
        (Gain::X8, 0x50),
        (Gain::X12, 0x60),
    ];
    settings.inputs = [Input::Electrodes, Input::Shorted, Input::Test, Input::Off];
    for (gain, bits) in gains {
        settings.gain = gain;
        assert_eq!(settings.chnset(), [bits, bits | 0x01, bits | 0x05, 0x81]);
    }
    assert_eq!(settings.config2(), 0x11, "a channel on the test signal");
}

#[test]
fn a_frame_of_literal_bytes() {
    // Table "Ideal output code": full scale, one step, minus one step, minus full scale.
    let bytes = [
        0xc0, 0x00, 0x00, 0x7f, 0xff, 0xff, 0x00, 0x00, 0x01, 0xff, 0xff, 0xff, 0x80, 0x00, 0x00,
    ];
    let conversion = frame::decode::<4>(&bytes, 0x0f).unwrap();
    assert_eq!(conversion.counts, [8_388_607, 1, -1, -8_388_608]);
    assert_eq!(conversion.lead_off, [false; 4]);

    // 1100 | P 0000 0101 | N 0000 1000 | GPIO 0000: channels 1 and 3 positive, 4 negative.
    let mut off = bytes;
    off[..3].copy_from_slice(&[0xc0, 0x50, 0x80]);
    let conversion = frame::decode::<4>(&off, 0x0f).unwrap();
    assert_eq!(conversion.lead_off, [true, false, true, true]);
    let conversion = frame::decode::<4>(&off, 0x0b).unwrap();
    assert_eq!(
        conversion.lead_off,
        [true, false, false, true],
        "3 is not sensed"
    );

    // Eight channels: P bit 7 and N bit 4 are channels 8 and 5.
    let mut eight = [0; 27];
    eight[..3].copy_from_slice(&[0xc8, 0x01, 0x00]);
    eight[24..].copy_from_slice(&[0xff, 0x00, 0x00]);
    let conversion = frame::decode::<8>(&eight, 0xff).unwrap();
    let expected = [false, false, false, false, true, false, false, true];
    assert_eq!(conversion.lead_off, expected);
    assert_eq!(conversion.counts[7], -65_536);
}

#[test]
fn a_slipped_or_dead_frame_is_refused() {
    let whole = 0xc0_0000_u32;
    for slip in 1..=20 {
        let got = (whole >> slip >> 20) as u8;
        let mut bytes = [0; 15];
        bytes[..3].copy_from_slice(&(whole >> slip).to_be_bytes()[1..]);
        assert_eq!(
            frame::decode::<4>(&bytes, 0),
            Err(Ads129xError::Header { got })
        );
    }
    for (byte, got) in [(0x00, 0b0000), (0xff, 0b1111)] {
        assert_eq!(
            frame::decode::<4>(&[byte; 15], 0),
            Err(Ads129xError::Header { got })
        );
    }
    let short = Ads129xError::FrameLength {
        expected: 15,
        got: 14,
    };
    assert_eq!(frame::decode::<4>(&[0xc0; 14], 0), Err(short));
}

#[test]
fn volts_per_count_at_every_gain() {
    // 2.4 V / gain / 8,388,607, by hand.
    let steps_nv = [
        (Gain::X1, 286.102_329),
        (Gain::X2, 143.051_165),
        (Gain::X3, 95.367_443),
        (Gain::X4, 71.525_582),
        (Gain::X6, 47.683_722),
        (Gain::X8, 35.762_791),
        (Gain::X12, 23.841_861),
    ];
    for (gain, step_nv) in steps_nv {
        let scale = gain.scale().unwrap();
        assert!((scale.volts_per_count() * 1e9 - step_nv).abs() < 1e-6);
        assert_eq!(scale.rails(), (-8_388_608, 8_388_607));
        let full_scale_v = 2.4 / f64::from(gain.factor());
        assert!((scale.volts::<f64>(0x7f_ffff) - full_scale_v).abs() < 1e-12);
    }
}

#[test]
fn another_chip_is_refused_by_its_id() {
    let traffic: [(&[u8], &[u8]); 2] = [
        (&[0x11], &[0x00]),
        (&[0x20, 0x00, 0x00], &[0x00, 0x00, 0x92]),
    ];
    let (outcome, levels) = initialise(Settings::<4>::surface_emg(), &traffic, &waits()[..2]);
    let expected = Ads129xError::WrongId {
        expected: 0x90,
        got: 0x92,
    };
    assert_eq!(outcome, Err(expected));
    assert!(!levels.contains(&"START high".to_owned()));
}

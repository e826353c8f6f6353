use super::{Annotation, Edf, Signal, date, fitting};

fn written(edf: &Edf<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    edf.write(&mut bytes).unwrap();
    bytes
}

fn edf<'a>(counts: &'a [i32], microvolts_per_count: f64) -> Edf<'a> {
    Edf {
        subject: "p 01".to_owned(),
        start_unix_us: 1_790_000_000_250_000,
        rate_hz: 4.0,
        signals: vec![Signal {
            label: "EMG 1 bic-short".to_owned(),
            transducer: "surface".to_owned(),
            prefilter: "none".to_owned(),
            counts,
            microvolts_per_count,
            offset: 10,
        }],
        annotations: vec![Annotation {
            onset_s: 1.5,
            duration_s: Some(0.25),
            text: "lift".to_owned(),
        }],
    }
}

#[test]
fn times_are_those_of_the_calendar() {
    // By Python's datetime.
    for (unix_s, expected) in [
        (0, ("01.01.70", "00.00.00", "01-JAN-1970")),
        (951_782_399, ("28.02.00", "23.59.59", "28-FEB-2000")),
        (951_782_400, ("29.02.00", "00.00.00", "29-FEB-2000")),
        (1_790_000_000, ("21.09.26", "14.13.20", "21-SEP-2026")),
        (4_102_444_799, ("31.12.99", "23.59.59", "31-DEC-2099")),
    ] {
        let (day, time, long) = date(unix_s);
        assert_eq!((day.as_str(), time.as_str(), long.as_str()), expected);
    }
}

#[test]
fn numbers_fit_their_field_and_are_rounded_outward() {
    assert_eq!(fitting(-1234.56789, f64::floor), "-1234.57");
    assert_eq!(fitting(1234.56789, f64::ceil), "1234.568");
    assert_eq!(fitting(0.0, f64::floor), "0.000000");
    assert_eq!(fitting(-187_500.4, f64::floor), "-187501");
}

#[test]
fn sixteen_bits_are_laid_out_as_the_standard_says() {
    // From -100 to +100 microvolts in steps of one; 6 samples are two records of four.
    let counts = [-90, 110, 10, 10, 60, 10];
    let edf = edf(&counts, 1.0);
    assert_eq!(edf.extension(), "edf");
    let file = written(&edf);
    let text = |from: usize, length: usize| {
        std::str::from_utf8(&file[from..from + length])
            .unwrap()
            .trim_end()
    };
    assert_eq!(text(0, 8), "0");
    assert_eq!(text(8, 80), "p_01 X X X");
    assert_eq!(text(88, 80), "Startdate 21-SEP-2026 X X tonus");
    assert_eq!((text(168, 8), text(176, 8)), ("21.09.26", "14.13.20"));
    assert_eq!((text(184, 8), text(192, 44)), ("768", "EDF+C"));
    assert_eq!(
        (text(236, 8), text(244, 8), text(252, 4)),
        ("2", "1.000000", "2")
    );
    let signals = 256;
    assert_eq!(text(signals, 16), "EMG 1 bic-short");
    assert_eq!(text(signals + 16, 16), "EDF Annotations");
    let after_units = signals + 2 * (16 + 80 + 8);
    assert_eq!(
        (text(after_units, 8), text(after_units + 16, 8)),
        ("-100.000", "100.0000")
    );
    assert_eq!(
        (text(after_units + 32, 8), text(after_units + 48, 8)),
        ("-32768", "32767")
    );

    // -100, 100, 0, 0 microvolts: steps of 200 / 65535.
    let sample = |at: usize| i16::from_le_bytes([file[768 + 2 * at], file[769 + 2 * at]]);
    assert_eq!((sample(0), sample(1)), (-32_768, 32_767));
    assert!([sample(2), sample(3)].iter().all(|&zero| zero.abs() <= 1));
    let annotations = |record: usize, bytes: usize| {
        let from = 768 + record * (8 + bytes) + 8;
        &file[from..from + bytes]
    };
    let bytes = (file.len() - 768) / 2 - 8;
    assert!(annotations(0, bytes).starts_with(b"+0.25\x14\x14\0"));
    let second = annotations(1, bytes);
    let expected =
        b"+1.25\x14\x14\0+1.75\x150.25\x14lift\x14\0+1.75\x150.5\x14BAD_gap after the end\x14\0";
    assert!(
        second.starts_with(expected),
        "{}",
        String::from_utf8_lossy(second)
    );
    assert!(second[expected.len()..].iter().all(|&byte| byte == 0));
}

#[test]
fn a_wide_signal_takes_24_bits_and_its_counts_stand_as_they_are() {
    // 300 mV of electrode offset: 16 bits would be steps of 4.6 microvolts.
    let counts = [-8_388_608, 8_388_607, -1, 6_000_000];
    let edf = edf(&counts, 0.0477);
    assert_eq!(edf.extension(), "bdf");
    let file = written(&edf);
    assert_eq!(&file[..8], b"\xffBIOSEMI");
    assert_eq!(
        &file[768..780],
        [
            0, 0, 0x80, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x80, 0x8d, 0x5b
        ]
    );
}

//! The bytes: against what a script wrote that knows only the page, and damaged in every way.

use proptest::prelude::*;
use tonus_shared::image::{
    Capacity, ImageError, MAX_SKILLS, ModelImage, Role, WEARABLE, image_len,
};

/// Bytes at a multiple of four, as the flash has them.
#[derive(Clone)]
struct Words(Vec<u32>, usize);

impl Words {
    fn of(bytes: &[u8]) -> Self {
        let words = bytes.chunks(4).map(|chunk| {
            let mut word = [0; 4];
            word[..chunk.len()].copy_from_slice(chunk);
            u32::from_ne_bytes(word)
        });
        Self(words.collect(), bytes.len())
    }

    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.0)[..self.1]
    }
}

fn golden() -> Vec<u8> {
    let hex = include_str!("../../golden/model_image.txt").trim();
    let pairs = (0..hex.len()).step_by(2);
    pairs
        .map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap())
        .collect()
}

/// The golden image with some bytes changed and its checksum made right again.
fn changed(change: impl Fn(&mut Vec<u8>)) -> Result<(), ImageError> {
    let mut bytes = golden();
    change(&mut bytes);
    let end = bytes.len() - 4;
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
    ModelImage::parse(Words::of(&bytes).bytes(), &WEARABLE).map(|_| ())
}

fn put(at: usize, number: f32) -> Result<(), ImageError> {
    changed(|bytes| bytes[at..at + 4].copy_from_slice(&number.to_le_bytes()))
}

#[test]
fn it_reads_what_the_page_says() {
    let words = Words::of(&golden());
    let image = ModelImage::parse(words.bytes(), &WEARABLE).unwrap();
    // The numbers of model_image.py.
    let latent = image.latent();
    assert_eq!(
        (latent.dofs(), latent.basis().count(), latent.rank()),
        (6, 3, 2)
    );
    let expected: Vec<f32> = (0..36).map(|n| ((n % 17) as f32 - 8.0) / 16.0).collect();
    assert_eq!(latent.loading(), expected);
    assert_eq!(image.dof(Role::HumanPosition(1)), Some(1));
    assert_eq!(image.dof(Role::HumanStiffness(2)), Some(5));
    assert_eq!(
        (image.dofs()[0].noise_std, image.dofs()[3].noise_std),
        (0.001953125, 0.0625)
    );
    let settings = image.settings();
    assert_eq!(
        (settings.placement_m, settings.interval_s, settings.lead_s),
        (0.25, 0.125, 0.5)
    );
    assert_eq!(
        (settings.onset_late_s, settings.onset_std_s),
        (0.03125, 0.0625)
    );
    assert_eq!(
        (
            settings.onset.start_m_per_s,
            settings.onset.shortest_pause_s
        ),
        (0.25, 0.015625)
    );
    let labels: Vec<_> = image.named().iter().map(|named| named.label).collect();
    assert_eq!(labels, ["heben", "übergeben"]);
    let [first, second] = [&image.skills()[0], &image.skills()[1]];
    assert_eq!((first.log_prior(), first.freedom()), (-0.25, None));
    assert_eq!((second.log_prior(), second.freedom()), (-1.5, Some(9.0)));
    assert_eq!(
        (second.weight_mean()[5], second.root().unwrap()),
        (1.0 + 5.0 / 32.0, &[1.0, -0.25, 0.5][..])
    );
    assert_eq!(first.residual_variance()[5], 6.0 / 64.0);
    let durations = image.named()[1];
    assert_eq!(
        (durations.log_duration_mean, durations.log_duration_std),
        (0.75, 0.125)
    );
    let mut again = vec![0; image.encoded_len()];
    assert_eq!(image.encode(&mut again), Ok(again.len()));
    assert_eq!(again, golden());
    assert!(matches!(
        image.encode(&mut again[1..]),
        Err(ImageError::Buffer { .. })
    ));
}

#[test]
fn every_flipped_bit_and_every_cut_is_refused() {
    let golden = golden();
    for at in 0..golden.len() {
        for bit in 0..8 {
            let mut words = golden.clone();
            words[at] ^= 1 << bit;
            let words = Words::of(&words);
            assert!(
                ModelImage::parse(words.bytes(), &WEARABLE).is_err(),
                "{at}, bit {bit}"
            );
        }
        let cut = Words::of(&golden[..at]);
        let error = ModelImage::parse(cut.bytes(), &WEARABLE).unwrap_err();
        assert!(
            matches!(error, ImageError::Length { .. }),
            "cut at {at}: {error}"
        );
    }
    let mut longer = golden;
    longer.push(0);
    assert!(ModelImage::parse(Words::of(&longer).bytes(), &WEARABLE).is_err());
}

#[test]
fn what_does_not_fit_is_named() {
    let words = Words::of(&golden());
    let tight = Capacity {
        dofs: 6,
        functions: 3,
        rank: 2,
        skills: 2,
    };
    assert!(ModelImage::parse(words.bytes(), &tight).is_ok());
    for (capacity, what) in [
        (Capacity { dofs: 5, ..tight }, "DoFs"),
        (
            Capacity {
                functions: 2,
                ..tight
            },
            "basis functions",
        ),
        (Capacity { rank: 1, ..tight }, "rank"),
        (Capacity { skills: 1, ..tight }, "skills"),
    ] {
        let error = ModelImage::parse(words.bytes(), &capacity).unwrap_err();
        assert!(
            matches!(error, ImageError::Capacity { what: got, .. } if got == what),
            "{error}"
        );
    }
    // Whatever the capacity says, there is no room for more than the format's own limits.
    let endless = Capacity {
        dofs: 1000,
        functions: 1000,
        rank: 1000,
        skills: 1000,
    };
    let mut many = golden();
    many[15] = MAX_SKILLS as u8 + 1;
    let error = ModelImage::parse(Words::of(&many).bytes(), &endless).unwrap_err();
    assert!(matches!(
        error,
        ImageError::Capacity {
            what: "skills",
            most: MAX_SKILLS,
            ..
        }
    ));
    assert_eq!(image_len(6, 3, 2, 2), golden().len());
}

#[test]
fn an_image_that_lies_askew_is_refused() {
    let mut shifted = vec![0; 1];
    shifted.extend(golden());
    let words = Words::of(&shifted);
    let error = ModelImage::parse(&words.bytes()[1..], &WEARABLE).unwrap_err();
    assert_eq!(error, ImageError::Alignment);
}

/// Offsets as the page has them.
#[test]
fn impossible_contents_are_refused_by_name() {
    let byte = |at: usize, value: u8| changed(|bytes| bytes[at] = value);
    assert!(matches!(byte(0, 0), Err(ImageError::Magic { .. })));
    assert!(matches!(
        byte(4, 2),
        Err(ImageError::Version { got: 2, .. })
    ));
    assert!(matches!(byte(16, 3), Err(ImageError::Code { got: 3, .. })));
    assert!(matches!(byte(19, 1), Err(ImageError::Code { got: 1, .. })));
    assert!(matches!(put(20, f32::NAN), Err(ImageError::Basis(_))));
    for at in [24, 28, 32, 36, 40] {
        assert!(
            matches!(put(at, f32::NAN), Err(ImageError::Range { .. })),
            "{at}"
        );
    }
    assert!(matches!(
        put(28, 0.0),
        Err(ImageError::Range {
            what: "the interval",
            ..
        })
    ));
    for at in (44..68).step_by(4) {
        assert!(
            matches!(put(at, f32::INFINITY), Err(ImageError::Onset(_))),
            "{at}"
        );
    }
    // DoFs from 68 on, eight bytes each; skills from 116 on, 32 each.
    assert!(matches!(byte(68, 7), Err(ImageError::Code { got: 7, .. })));
    assert!(matches!(
        byte(68, 2),
        Err(ImageError::Role {
            what: "position",
            got: 0,
            ..
        })
    ));
    assert!(matches!(
        byte(92, 5),
        Err(ImageError::Role {
            what: "stiffness",
            got: 0,
            ..
        })
    ));
    assert!(matches!(byte(93, 0), Err(ImageError::Transform { dof: 3 })));
    assert!(matches!(put(72, 0.0), Err(ImageError::Range { .. })));
    assert!(matches!(byte(116, 0), Err(ImageError::Label { skill: 0 })));
    assert!(matches!(
        byte(117, 0xFF),
        Err(ImageError::Label { skill: 0 })
    ));
    assert!(matches!(byte(125, 1), Err(ImageError::Label { skill: 0 })));
    assert!(matches!(
        byte(148, b'a'),
        Err(ImageError::Label { skill: 1 } | ImageError::LabelOrder { skill: 1 })
    ));
    assert!(matches!(put(132, f32::NAN), Err(ImageError::Model(_))));
    assert!(matches!(put(136, 2.0), Err(ImageError::Model(_))));
    assert!(matches!(put(140, f32::NAN), Err(ImageError::Range { .. })));
    assert!(matches!(put(144, -0.1), Err(ImageError::Range { .. })));
    for at in (180..golden().len() - 4).step_by(4) {
        assert!(
            matches!(put(at, f32::NAN), Err(ImageError::Model(_))),
            "table at {at}"
        );
    }
}

proptest! {
    #![proptest_config(tonus_tests::seeded(4000))]

    /// Whatever bytes, with a right checksum too: no panic, and what is taken is written back as it was.
    #[test]
    fn changed_bytes_are_refused_or_come_back(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut bytes = golden();
        let end = bytes.len() - 4;
        for (index, flip) in flips {
            let at = index.index(end);
            bytes[at] ^= flip;
        }
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes[..end]);
        bytes[end..].copy_from_slice(&crc.to_le_bytes());
        let words = Words::of(&bytes);
        if let Ok(image) = ModelImage::parse(words.bytes(), &WEARABLE) {
            let mut again = vec![0; image.encoded_len()];
            prop_assert_eq!(image.encode(&mut again), Ok(bytes.len()));
            prop_assert_eq!(again, bytes);
        }
    }

    #[test]
    fn random_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        prop_assert!(ModelImage::parse(Words::of(&bytes).bytes(), &WEARABLE).is_err());
    }
}

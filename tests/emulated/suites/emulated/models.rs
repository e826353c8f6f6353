//! Models as a host sends them.

use sha2::{Digest, Sha256};
use tonus_emulated::Machine;
use tonus_shared::wire::{Control, MAX_PIECE_BYTES, ModelUpload, Packet};

use super::host;

/// Built by another program: tests/golden/model_image.py.
const GOLDEN: &str = include_str!("../../../golden/model_image.txt");
/// Where the first skill's log prior stands in it: behind the head, 8 + 20 + 24 bytes, six degrees of freedom of 8 and
/// a name of 16.
const LOG_PRIOR: usize = 16 + 8 + 20 + 24 + 6 * 8 + 16;

/// Bytes of a model.
pub(crate) struct Model(Vec<u8>);

impl Model {
    pub(crate) fn golden() -> Self {
        let digits = GOLDEN.trim().as_bytes().chunks_exact(2);
        let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16);
        Self(digits.map(|pair| byte(pair).unwrap()).collect())
    }

    /// The same with another prior.
    pub(crate) fn other() -> Self {
        let Self(mut bytes) = Self::golden();
        assert_eq!(bytes[LOG_PRIOR..][..4], (-0.25_f32).to_le_bytes());
        bytes[LOG_PRIOR..][..4].copy_from_slice(&(-0.5_f32).to_le_bytes());
        let body = bytes.len() - 4;
        let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes[..body]);
        bytes[body..].copy_from_slice(&checksum.to_le_bytes());
        Self(bytes)
    }

    /// As numbers of four bytes, at an address where they can be read.
    pub(crate) fn aligned(&self) -> Vec<u32> {
        let words = self.0.chunks_exact(4);
        words
            .map(|word| u32::from_le_bytes(word.try_into().unwrap()))
            .collect()
    }

    pub(crate) fn words(&self) -> usize {
        self.0.len() / 4
    }

    fn sha256(&self) -> [u8; 32] {
        Sha256::digest(&self.0).into()
    }

    /// By which the wearable names it.
    pub(crate) fn hash(&self) -> [u8; 8] {
        *self.sha256().first_chunk().unwrap()
    }
}

/// Sends a model, piece by piece; each is answered before the next.
pub(crate) fn upload(machine: &mut Machine, model: &Model) {
    let Model(bytes) = model;
    let begin = ModelUpload::Begin {
        total_bytes: bytes.len() as u32,
        sha256: model.sha256(),
    };
    let pieces = (0..)
        .step_by(MAX_PIECE_BYTES)
        .zip(bytes.chunks(MAX_PIECE_BYTES));
    let pieces = pieces.map(|(offset_bytes, bytes)| ModelUpload::Piece {
        offset_bytes,
        bytes: bytes.iter().copied().collect(),
    });
    let steps = std::iter::once(begin).chain(pieces);
    for (sequence, step) in (100..).zip(steps.chain([ModelUpload::Finish])) {
        let answer = host::ask(machine, sequence, Packet::ModelUpload(step));
        let outcome = answer.map(|(outcome, _)| outcome);
        assert_eq!(outcome, Some(Ok(())), "step {}", sequence - 100);
    }
}

/// The hash of the model in use.
pub(crate) fn active(machine: &mut Machine) -> Option<[u8; 8]> {
    let asked = Packet::Control(Control::SendModelState);
    let (outcome, came) = host::ask(machine, 902, asked).expect("an answer");
    assert_eq!(outcome, Ok(()));
    let state = came.into_iter().find_map(|packet| match packet {
        Packet::ModelState(state) => Some(state),
        _ => None,
    });
    state.expect("a state").active.map(|model| model.hash)
}

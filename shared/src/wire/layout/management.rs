//! The bytes of packets that set the wearable up.

use heapless::{String, Vec};

use super::{take_bool, take_muscles};
use crate::wire::bytes::{Reader, Writer};
use crate::wire::check::out_of_range;
use crate::wire::error::WireError;
use crate::wire::packet::{
    ActiveModel, Calibration, Control, LastWords, ModelState, ModelUpload, Reception, Refusal,
    Reply,
};
use crate::wire::table::{Kind, MAX_LAST_WORDS_BYTES, MAX_PIECE_BYTES, TABLE, whole};

const BEGIN_BYTES: usize = 1 + 4 + 32;
const PIECE_BYTES_BEFORE: usize = 1 + 4;
const FINISH_BYTES: usize = 1;

pub(super) fn upload_payload_bytes(step: &ModelUpload) -> usize {
    match step {
        ModelUpload::Begin { .. } => BEGIN_BYTES,
        ModelUpload::Piece { bytes, .. } => PIECE_BYTES_BEFORE + bytes.len(),
        ModelUpload::Finish | ModelUpload::Abandon => FINISH_BYTES,
    }
}

pub(super) const fn words_payload_bytes(words: usize) -> usize {
    1 + words
}

pub(super) fn put_control(packet: Control, out: &mut Writer<'_>) {
    let (command, value) = match packet {
        Control::Raw(on) => (1, u32::from(on)),
        Control::SendCalibration => (2, 0),
        Control::SendModelState => (3, 0),
        Control::Restart { boot_id } => (4, boot_id),
        Control::SendLastWords => (5, 0),
        Control::FaceForward => (6, 0),
    };
    out.u8(command);
    out.u32(value);
}

pub(super) fn take_control(input: &mut Reader<'_>) -> Result<Control, WireError> {
    let command = input.u8()?;
    let value = input.u32()?;
    let most = match command {
        1 => 1,
        4 => u32::MAX,
        _ => 0,
    };
    if value > most {
        return Err(out_of_range("value", value, 0, most));
    }
    match command {
        1 => Ok(Control::Raw(value == 1)),
        2 => Ok(Control::SendCalibration),
        3 => Ok(Control::SendModelState),
        4 => Ok(Control::Restart { boot_id: value }),
        5 => Ok(Control::SendLastWords),
        6 => Ok(Control::FaceForward),
        got => Err(out_of_range("command", got, 1, 6)),
    }
}

pub(super) fn put_calibration(packet: &Calibration, out: &mut Writer<'_>) {
    out.u32(packet.revision);
    out.u8(packet.channels);
    out.bytes(packet.muscles.map(|muscle| muscle as u8));
    out.u8(packet.mains_hz.unwrap_or(0));
    out.f32(packet.semg_hz);
    out.f32s(packet.rest_v);
    out.f32s(packet.mvc_v);
    out.f32s([packet.activation_window_s, packet.l1, packet.l2]);
    out.f32s(packet.rest_stiffness_nm_per_rad);
    out.f32s([packet.body_mass_kg, packet.body_height_m]);
}

pub(super) fn take_calibration(input: &mut Reader<'_>) -> Result<Calibration, WireError> {
    Ok(Calibration {
        revision: input.u32()?,
        channels: input.u8()?,
        muscles: take_muscles(input)?,
        mains_hz: Some(input.u8()?).filter(|hz| *hz != 0),
        semg_hz: input.f32()?,
        rest_v: input.f32s()?,
        mvc_v: input.f32s()?,
        activation_window_s: input.f32()?,
        l1: input.f32()?,
        l2: input.f32()?,
        rest_stiffness_nm_per_rad: input.f32s()?,
        body_mass_kg: input.f32()?,
        body_height_m: input.f32()?,
    })
}

pub(super) fn put_upload(packet: &ModelUpload, out: &mut Writer<'_>) {
    match packet {
        ModelUpload::Begin {
            total_bytes,
            sha256,
        } => {
            out.u8(0);
            out.u32(*total_bytes);
            out.bytes(*sha256);
        }
        ModelUpload::Piece {
            offset_bytes,
            bytes,
        } => {
            out.u8(1);
            out.u32(*offset_bytes);
            out.slice(bytes);
        }
        ModelUpload::Finish => out.u8(2),
        ModelUpload::Abandon => out.u8(3),
    }
}

pub(super) fn take_upload(input: &mut Reader<'_>, length: usize) -> Result<ModelUpload, WireError> {
    let step = input.u8()?;
    let expected = match step {
        0 => BEGIN_BYTES,
        1 => length.max(PIECE_BYTES_BEFORE + 1),
        2 | 3 => FINISH_BYTES,
        got => return Err(out_of_range("step", got, 0, 3)),
    };
    exactly(Kind::ModelUpload, expected, length)?;
    Ok(match step {
        0 => ModelUpload::Begin {
            total_bytes: input.u32()?,
            sha256: input.bytes()?,
        },
        1 => ModelUpload::Piece {
            offset_bytes: input.u32()?,
            bytes: take_piece(input)?,
        },
        2 => ModelUpload::Finish,
        _ => ModelUpload::Abandon,
    })
}

fn take_piece(input: &mut Reader<'_>) -> Result<Vec<u8, MAX_PIECE_BYTES>, WireError> {
    let bytes = input.rest();
    Vec::from_slice(bytes)
        .map_err(|_| out_of_range("bytes", bytes.len() as f64, 1, MAX_PIECE_BYTES as f64))
}

fn exactly(kind: Kind, expected: usize, length: usize) -> Result<(), WireError> {
    if expected == length {
        return Ok(());
    }
    Err(WireError::WrongLength {
        kind,
        expected: whole(expected),
        got: whole(length),
    })
}

pub(super) fn put_model_state(packet: &ModelState, out: &mut Writer<'_>) {
    let active = packet.active.as_ref();
    let receiving = packet.receiving.as_ref();
    out.u8(u8::from(active.is_some()));
    out.bytes(active.map_or([0; 8], |active| active.hash));
    out.u8(u8::from(receiving.is_some()));
    out.bytes(receiving.map_or([0; 8], |receiving| receiving.hash));
    out.u32(receiving.map_or(0, |receiving| receiving.received_bytes));
    out.u32(receiving.map_or(0, |receiving| receiving.total_bytes));
    out.u32(packet.capacity_bytes);
    out.bytes(active.map_or([0; 4], |active| {
        [active.skills, active.dofs, active.functions, active.rank]
    }));
}

pub(super) fn take_model_state(input: &mut Reader<'_>) -> Result<ModelState, WireError> {
    let held = take_bool("state", input)?;
    let active_hash = input.bytes()?;
    let begun = take_bool("receiving", input)?;
    let receiving = Reception {
        hash: input.bytes()?,
        received_bytes: input.u32()?,
        total_bytes: input.u32()?,
    };
    let capacity_bytes = input.u32()?;
    let [skills, dofs, functions, rank] = input.bytes()?;
    let active = ActiveModel {
        hash: active_hash,
        skills,
        dofs,
        functions,
        rank,
    };
    let no_model = ActiveModel {
        hash: [0; 8],
        skills: 0,
        dofs: 0,
        functions: 0,
        rank: 0,
    };
    if !held && active != no_model {
        return Err(out_of_range("what describes no model", 1, 0, 0));
    }
    let nothing = Reception {
        hash: [0; 8],
        received_bytes: 0,
        total_bytes: 0,
    };
    if !begun && receiving != nothing {
        return Err(out_of_range("what describes no reception", 1, 0, 0));
    }
    Ok(ModelState {
        active: held.then_some(active),
        receiving: begun.then_some(receiving),
        capacity_bytes,
    })
}

pub(super) fn put_reply(packet: &Reply, out: &mut Writer<'_>) {
    out.u8(packet.answered as u8);
    out.u32(packet.sequence);
    out.u8(u8::from(packet.outcome.is_err()));
    out.u8(packet.outcome.map_or_else(|refusal| refusal as u8, |()| 0));
    out.u32(packet.detail);
}

pub(super) fn take_reply(input: &mut Reader<'_>) -> Result<Reply, WireError> {
    let number = input.u8()?;
    let answered = Kind::from_number(number)
        .ok_or_else(|| out_of_range("answered kind", number, 1, TABLE.len() as f64))?;
    let sequence = input.u32()?;
    let refused = take_bool("outcome", input)?;
    let reason = input.u8()?;
    let outcome = if refused {
        let known = Refusal::ALL
            .into_iter()
            .find(|known| *known as u8 == reason);
        Err(known.ok_or_else(|| out_of_range("reason", reason, 1, Refusal::ALL.len() as f64))?)
    } else if reason == 0 {
        Ok(())
    } else {
        return Err(out_of_range("reason", reason, 0, 0));
    };
    Ok(Reply {
        answered,
        sequence,
        outcome,
        detail: input.u32()?,
    })
}

pub(super) fn put_words(packet: &LastWords, out: &mut Writer<'_>) {
    out.u8(u8::try_from(packet.words.len()).unwrap_or(u8::MAX));
    out.slice(packet.words.as_bytes());
}

pub(super) fn take_words(input: &mut Reader<'_>, length: usize) -> Result<LastWords, WireError> {
    let told = usize::from(input.u8()?);
    if told > MAX_LAST_WORDS_BYTES {
        return Err(out_of_range(
            "length",
            told as f64,
            0,
            MAX_LAST_WORDS_BYTES as f64,
        ));
    }
    exactly(Kind::LastWords, words_payload_bytes(told), length)?;
    let text = core::str::from_utf8(input.rest()).map_err(|error| WireError::NotText {
        field: "words",
        valid_up_to: error.valid_up_to(),
    })?;
    let words = String::try_from(text)
        .map_err(|_| out_of_range("length", told as f64, 0, MAX_LAST_WORDS_BYTES as f64))?;
    Ok(LastWords { words })
}

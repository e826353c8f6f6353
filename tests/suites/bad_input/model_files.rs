//! Model files that hold no model, or not the one that is needed.

use std::path::Path;

use super::{Case, data};

/// The good model with its header text changed and the length before it mended.
fn with_header(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let length = usize::try_from(u64::from_le_bytes(bytes[..8].try_into().unwrap())).unwrap();
    let header = std::str::from_utf8(&bytes[8..8 + length]).unwrap();
    assert!(header.contains(from), "{from} is not in {header}");
    let changed = header.replace(from, to);
    let mut file = (changed.len() as u64).to_le_bytes().to_vec();
    file.extend(changed.as_bytes());
    file.extend(&bytes[8 + length..]);
    file
}

pub(super) fn write(folder: &Path) {
    let file = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    let good = std::fs::read(folder.join("good.safetensors")).unwrap();
    file("empty.model", b"");
    file("cut.model", &good[..good.len() - 1]);
    file("stub.model", &good[..20]);
    file("longer.model", &[good.as_slice(), b"x"].concat());
    let mut flipped = good.clone();
    flipped[good.len() - 9] ^= 0x10;
    file("flipped.model", &flipped);
    file("length.model", &[&[255_u8; 8], &good[8..]].concat());
    file(
        "version.model",
        &with_header(&good, r#"schema_version\":2"#, r#"schema_version\":1"#),
    );
    file("label.model", &with_header(&good, "lift", "lies"));
    file(
        "rank.model",
        &with_header(&good, r#"\"rank\":"#, r#"\"rank\":9"#),
    );
    file(
        "field.model",
        &with_header(&good, r#"\"ridge\""#, r#"\"rigde\""#),
    );
    file(
        "tensor.model",
        &with_header(&good, r#""loading":"#, r#""leading":"#),
    );
    file("type.model", &with_header(&good, r#""F64""#, r#""I64""#));
    let other = br#"{"a":{"dtype":"U8","shape":[1],"data_offsets":[0,1]}}"#;
    let mut bytes = (other.len() as u64).to_le_bytes().to_vec();
    bytes.extend(other);
    bytes.push(7);
    file("other.model", &bytes);
    let huge = std::fs::File::create(folder.join("huge.model")).unwrap();
    huge.set_len(1 << 40).unwrap();
    std::fs::create_dir(folder.join("folder.model")).unwrap();
}

pub(super) const CASES: &[Case] = &[
    data(
        "eval none.model good.csv",
        &["none.model: cannot be read", "No such file"],
    ),
    data(
        "eval folder.model good.csv",
        &["folder.model: cannot be read", "irectory"],
    ),
    data(
        "eval good.csv good.csv",
        &["good.csv: not a whole safetensors file"],
    ),
    data(
        "eval empty.model good.csv",
        &["empty.model: not a whole safetensors file"],
    ),
    data(
        "eval stub.model good.csv",
        &["stub.model: not a whole safetensors file"],
    ),
    data(
        "eval cut.model good.csv",
        &["cut.model: not a whole safetensors file"],
    ),
    data(
        "eval longer.model good.csv",
        &["longer.model: not a whole safetensors file"],
    ),
    data(
        "eval length.model good.csv",
        &["length.model: not a whole safetensors file"],
    ),
    data(
        "eval flipped.model good.csv",
        &["flipped.model: damaged: its checksum is"],
    ),
    data(
        "eval label.model good.csv",
        &["label.model: damaged: its checksum is"],
    ),
    data(
        "eval version.model good.csv",
        &["version.model: schema version 1, this program reads 2: train the model again"],
    ),
    data(
        "eval field.model good.csv",
        &["field.model: its header cannot be read", "rigde"],
    ),
    data(
        "eval rank.model good.csv",
        &["rank.model: tensor `loading` is F64"],
    ),
    data(
        "eval tensor.model good.csv",
        &["tensor.model: it has no tensor `loading`"],
    ),
    data(
        "eval type.model good.csv",
        &["type.model: tensor `demonstration_mean` is I64"],
    ),
    data(
        "eval other.model good.csv",
        &["other.model: a safetensors file, but not a model"],
    ),
    data(
        "eval huge.model good.csv",
        &["huge.model: larger than the 67108864 bytes"],
    ),
    data(
        "infer cut.model --label lift -o out",
        &["cut.model: not a whole safetensors file"],
    ),
    data(
        "info flipped.model",
        &["flipped.model: damaged: its checksum is"],
    ),
    data(
        "train good.csv --add-to cut.model -o out",
        &["cut.model: not a whole safetensors file"],
    ),
    data(
        "train good.csv --add-to em.safetensors -o out",
        &["learnt by EM and must be refitted: train it again from all recordings"],
    ),
    data("info none.model", &["none.model: cannot be read"]),
    data("info folder.model", &["folder.model: cannot be read"]),
    data(
        "eval good.safetensors word.csv",
        &["word.csv:5: column `x`: `five` is not a number"],
    ),
    data(
        "eval good.safetensors no_time.csv",
        &["no_time.csv:1: no column `t_s`"],
    ),
    data(
        "eval good.safetensors good.csv few.csv --exclude lift,push",
        &["good.csv: no demonstrations left"],
    ),
    data(
        "eval good.safetensors strange.csv",
        &["strange.csv: the model does not know `jump`, only lift, push"],
    ),
    data(
        "eval good.safetensors few.csv --leave-one-out",
        &[
            "without one demonstration of `lift` (few.csv)",
            "needs at least 3",
        ],
    ),
];

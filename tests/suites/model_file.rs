//! Model files: what Python reads, and what damage does.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "test suite"
)]

use std::process::Command;
use std::sync::LazyLock;

use proptest::prelude::*;
use tonus::demonstration::Demonstration;
use tonus::model::novelty::{Gate, GateConfig, GateSettings};
use tonus::model::{Dof, Hyperparameters, Model, Parts, Valid, learn};
use tonus::store::{ContentError, MAX_BYTES, StoreError, from_bytes, load, save, to_bytes};
use tonus_shared::promp::Basis;

static MODEL: LazyLock<Model> = LazyLock::new(|| learned(Basis::gaussian(4).unwrap()));

static GATE: LazyLock<Gate> = LazyLock::new(|| {
    let config = GateConfig {
        observations: 3,
        ..GateConfig::of(2)
    };
    let valid = valid(Basis::gaussian(4).unwrap());
    let settings = GateSettings::default();
    Gate::with_settings(&demonstrations(), &valid, &settings, &config).unwrap()
});

fn model() -> Model {
    MODEL.clone()
}

/// A gate for it, which looks at both signals.
fn gate() -> Gate {
    GATE.clone()
}

/// Two skills of a position and a stiffness.
fn learned(basis: Basis) -> Model {
    learn(&demonstrations(), &valid(basis)).unwrap()
}

fn valid(basis: Basis) -> Valid {
    let dofs = vec![Dof::position("x"), Dof::stiffness("kx")];
    Hyperparameters::new(dofs, basis).check().unwrap()
}

fn demonstrations() -> [Demonstration; 6] {
    let demo = |label: &str, trial: &str, a: f64, b: f64| {
        let t_s: Vec<f64> = (0..12).map(|i| f64::from(i) * 0.1).collect();
        let x = t_s.iter().map(|t| a * t + b * t * t).collect();
        let k = t_s.iter().map(|t| 100.0 + 40.0 * b * t).collect();
        Demonstration::new(label, trial, "a.csv", t_s, vec![x, k]).unwrap()
    };
    [
        demo("lift", "1", 1.0, 0.5),
        demo("lift", "2", 1.1, 0.4),
        demo("lift", "3", 0.9, 0.7),
        demo("push", "1", -1.0, 0.2),
        demo("push", "2", -1.2, 0.3),
        demo("push", "3", -1.1, 0.1),
    ]
}

#[test]
fn a_model_comes_back_as_it_was_and_twice_the_same_bytes() {
    let model = model();
    for gate in [None, Some(gate())] {
        let bytes = to_bytes(&model, gate.as_ref()).unwrap();
        let (read, read_gate) = from_bytes(&bytes).unwrap();
        assert_eq!((&read, &read_gate), (&model, &gate));
        assert_eq!(to_bytes(&read, read_gate.as_ref()).unwrap(), bytes);
    }
    for basis in [Basis::fourier(5).unwrap(), Basis::bernstein(4).unwrap()] {
        let other = learned(basis);
        assert_eq!(
            from_bytes(&to_bytes(&other, None).unwrap()).unwrap().0,
            other
        );
    }
}

#[test]
fn python_opens_it_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skills.safetensors");
    let model = model();
    save(&model, None, &path).unwrap();
    let script = r#"
import json, sys, zlib
import safetensors, safetensors.numpy
tensors = safetensors.numpy.load_file(sys.argv[1])
text = safetensors.safe_open(sys.argv[1], "numpy").metadata()["tonus"]
names = sorted(set(tensors) - {"crc32"})
crc = zlib.crc32(text.encode() + b"".join(tensors[name].tobytes() for name in names))
assert crc == tensors["crc32"][0], (crc, tensors["crc32"])
header = json.loads(text)
loading, root = tensors["loading"], tensors["root"]
D, K, r = loading.shape
half = loading.reshape(D * K, r) @ root[1]
variance = (half ** 2).sum(1)
print(json.dumps({
    "dofs": [[dof["name"], dof["unit"], dof["transform"]] for dof in header["dofs"]],
    "labels": header["labels"], "counts": header["counts"], "basis": header["basis"]["family"],
    "shape": [int(n) for n in tensors["weight_mean"].shape], "mean": float(tensors["weight_mean"][1, 0, 2]),
    "variance": float(variance[2]),
}))
"#;
    let output = Command::new("python3")
        .args(["-c", script])
        .arg(&path)
        .output()
        .expect("python3 is needed for this test");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "python3 with numpy and safetensors must read the file: {error}"
    );
    let seen: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let parts = model.parts();
    assert_eq!(
        seen["dofs"],
        serde_json::json!([["x", "m", "identity"], ["kx", "N/m", "log"]])
    );
    assert_eq!(seen["labels"], serde_json::json!(["lift", "push"]));
    assert_eq!(seen["counts"], serde_json::json!([3, 3]));
    assert_eq!(seen["basis"], "gaussian");
    assert_eq!(seen["shape"], serde_json::json!([2, 2, 4]));
    assert_eq!(seen["mean"].as_f64().unwrap(), parts.weight_means[8 + 2]);
    // Row 2 of L times root_1, in plain sums.
    let (rank, root) = (parts.rank, &parts.roots[parts.rank * parts.rank..]);
    let line = &parts.loading[2 * rank..3 * rank];
    let variance: f64 = (0..rank)
        .map(|j| (0..rank).map(|i| line[i] * root[i * rank + j]).sum::<f64>())
        .map(|half| half * half)
        .sum();
    let got = seen["variance"].as_f64().unwrap();
    assert!((got / variance - 1.0).abs() < 1e-12, "{got} for {variance}");
}

#[test]
fn cut_anywhere_it_is_refused() {
    let bytes = to_bytes(&model(), Some(&gate())).unwrap();
    for end in 0..bytes.len() {
        assert!(from_bytes(&bytes[..end]).is_err(), "cut at {end}");
    }
    let mut longer = bytes;
    longer.push(0);
    assert!(from_bytes(&longer).is_err(), "one byte more");
}

#[test]
fn every_flipped_bit_of_the_numbers_is_noticed() {
    let bytes = to_bytes(&model(), Some(&gate())).unwrap();
    let header = u64::from_le_bytes(bytes[..8].try_into().unwrap());
    let start = 8 + usize::try_from(header).unwrap();
    for at in start..bytes.len() {
        for bit in 0..8 {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << bit;
            let error = from_bytes(&damaged).unwrap_err();
            assert!(
                matches!(error, ContentError::Checksum { .. }),
                "{at}: {error}"
            );
        }
    }
}

proptest! {
    #![proptest_config(tonus_tests::seeded(4000))]

    /// What a flip in the header leaves readable is the same model (padding, an equal number).
    #[test]
    fn flipped_bytes_give_an_error_or_the_same_model(
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1..=255_u8), 1..4),
    ) {
        let (model, gate) = (model(), gate());
        let mut bytes = to_bytes(&model, Some(&gate)).unwrap();
        for (index, flip) in flips {
            let at = index.index(bytes.len());
            bytes[at] ^= flip;
        }
        if let Ok(read) = from_bytes(&bytes) {
            prop_assert_eq!(read, (model, Some(gate)));
        }
    }

    #[test]
    fn random_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(from_bytes(&bytes).is_err());
    }

    /// Valid safetensors around a header that lies.
    #[test]
    fn lying_headers_are_refused(key in "[a-z_]{1,12}", value in "(-?[0-9]{1,20}|\"\"|null|\\[\\]|1e999)") {
        let text = format!("{{\"schema_version\":2,\"{key}\":{value}}}");
        let header = serde_json::json!({ "__metadata__": { "tonus": text } }).to_string();
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend(header.as_bytes());
        prop_assert!(from_bytes(&bytes).is_err());
    }
}

#[test]
fn a_huge_file_is_refused_before_it_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.safetensors");
    // Sparse: no disk is used.
    let file = std::fs::File::create(&path).unwrap();
    file.set_len(MAX_BYTES * 1000).unwrap();
    assert!(matches!(load(&path), Err(StoreError::TooLarge { .. })));
    #[cfg(unix)]
    assert!(matches!(
        load("/dev/zero".as_ref()),
        Err(StoreError::TooLarge { .. })
    ));
    assert!(matches!(load(folder.path()), Err(StoreError::Io { .. })));
    assert!(matches!(
        load(&folder.path().join("none")),
        Err(StoreError::Io { .. })
    ));
}

#[test]
fn saving_replaces_the_file_whole_or_leaves_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skills.safetensors");
    std::fs::write(&path, "old").unwrap();
    save(&model(), None, &path).unwrap();
    assert_eq!(load(&path).unwrap(), model());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let nowhere = folder.path().join("none/skills.safetensors");
    assert!(matches!(
        save(&model(), None, &nowhere),
        Err(StoreError::Io { .. })
    ));
}

#[test]
fn a_gate_of_other_signals_is_refused() {
    let mut parts = gate().parts().clone();
    parts.dofs[1].0 = 7;
    let bytes = to_bytes(&model(), Some(&Gate::assemble(parts).unwrap())).unwrap();
    let error = from_bytes(&bytes).unwrap_err();
    assert!(matches!(error, ContentError::Gate(_)), "{error}");
    assert!(error.to_string().contains('7'), "{error}");
}

#[test]
fn numbers_out_of_range_make_no_model() {
    let parts = model().parts().clone();
    let refused = |change: &dyn Fn(&mut Parts)| {
        let mut changed = parts.clone();
        change(&mut changed);
        Model::assemble(changed).unwrap_err().to_string()
    };
    assert!(refused(&|p| p.roots[3] = f64::NAN).contains("the root"));
    assert!(refused(&|p| p.loading[0] = f64::INFINITY).contains("finite"));
    assert!(refused(&|p| p.residual_variance[1] = -1.0).contains("negative"));
    assert!(refused(&|p| p.scale[0] = 0.0).contains("a scale is 0"));
    assert!(refused(&|p| p.rank = usize::MAX).contains("too large"));
    assert!(refused(&|p| p.rank = 0).contains("latent dimension"));
    assert!(refused(&|p| p.labels.swap(0, 1)).contains("not sorted"));
    assert!(refused(&|p| p.dofs[1].name = "x".into()).contains("`x` is there twice"));
    assert!(refused(&|p| p.counts[0] = 0).contains("no demonstrations"));
    assert!(refused(&|p| p.durations[0].min_s = 0.0).contains("duration"));
    assert!(refused(&|p| p.labels.truncate(1)).contains("counts"));
    assert!(refused(&|p| p.pooled_share = 2.0).contains("a share is 2"));
    assert!(refused(&|p| p.weight_means.truncate(1)).contains("weight means"));
}

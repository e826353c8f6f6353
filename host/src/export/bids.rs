//! Raw sEMG as a dataset of the Brain Imaging Data Structure, modality EMG (BIDS 1.11,
//! <https://bids-specification.readthedocs.io>).

use std::fs;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use tonus_shared::wire::Muscle;

use crate::atomic;

use super::edf::{Annotation, Edf, Signal};
use super::error::ExportError;
use super::scans::Scans;

/// What was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The file with the signals.
    pub file: PathBuf,
    /// Channels in it.
    pub channels: usize,
    /// Scans, missing ones included.
    pub scans: usize,
    /// Scans that are missing, annotated and filled with zero volts.
    pub missing: usize,
    /// Demonstrations among the events.
    pub demonstrations: usize,
}

const TASK: &str = "tonus";

/// Writes the raw sEMG of a recording to a new folder.
///
/// # Errors
/// [`ExportError`] where the recording holds none, or the folder holds something.
pub fn write_bids(recording: &Path, folder: &Path) -> Result<Written, ExportError> {
    let scans = Scans::read(recording)?;
    let at = |path: &Path| {
        let path = path.to_owned();
        move |source| ExportError::Write { path, source }
    };
    if let Ok(mut there) = fs::read_dir(folder)
        && there.next().is_some()
    {
        return Err(ExportError::NotEmpty {
            path: folder.to_owned(),
        });
    }
    let label = participant(&scans);
    let person = folder.join(format!("sub-{label}"));
    let emg = person.join("emg");
    fs::create_dir_all(&emg).map_err(at(&emg))?;
    let events = events(&scans);
    let edf = edf(&scans, &label, &events);
    let stem = format!("sub-{label}_task-{TASK}");
    let file = emg.join(format!("{stem}_emg.{}", edf.extension()));
    atomic::write_with(&file, |out| edf.write(&mut BufWriter::new(out))).map_err(at(&file))?;

    let texts = (texts_of_all(&scans, &label).into_iter())
        .map(|(name, text)| (folder.join(name), text))
        .chain(
            texts_of_signals(&scans, &edf, &events, &label)
                .into_iter()
                .map(|(name, text)| (person.join(name), text)),
        );
    for (path, text) in texts {
        atomic::write(&path, text.as_bytes()).map_err(at(&path))?;
    }
    Ok(Written {
        file,
        channels: scans.counts.len(),
        scans: scans.len(),
        missing: scans.gaps.iter().map(|gap| gap.scans).sum(),
        demonstrations: scans.demonstrations.len(),
    })
}

/// Names of files of the dataset, and what they say.
fn texts_of_all(scans: &Scans, label: &str) -> Vec<(&'static str, String)> {
    vec![
        ("dataset_description.json", pretty(&description(scans))),
        ("README", readme()),
        ("participants.tsv", participants(scans, label)),
        ("participants.json", pretty(&participants_columns())),
    ]
}

/// Names of files of the person, and what they say.
fn texts_of_signals(
    scans: &Scans,
    edf: &Edf<'_>,
    events: &[Annotation],
    label: &str,
) -> Vec<(String, String)> {
    let stem = format!("emg/sub-{label}_task-{TASK}");
    let of_person = format!("emg/sub-{label}");
    let acquired = format!(
        "filename\tacq_time\n{stem}_emg.{}\t{}\n",
        edf.extension(),
        acquired(edf.start_unix_us)
    );
    vec![
        (format!("sub-{label}_scans.tsv"), acquired),
        (format!("{stem}_emg.json"), pretty(&sidecar(scans, edf))),
        (format!("{stem}_channels.tsv"), channels(scans)),
        (format!("{stem}_events.tsv"), events_table(events)),
        (format!("{stem}_events.json"), pretty(&events_columns())),
        (format!("{of_person}_electrodes.tsv"), electrodes(scans)),
        (
            format!("{of_person}_coordsystem.json"),
            pretty(&coordinates()),
        ),
    ]
}

/// Letters and digits of the person's name; BIDS allows no others.
fn participant(scans: &Scans) -> String {
    let name = scans.opening.subject.as_ref().map(|person| &person.name);
    let label: String = (name.into_iter().flat_map(|name| name.chars()))
        .filter(char::is_ascii_alphanumeric)
        .collect();
    if label.is_empty() {
        "unknown".to_owned()
    } else {
        label
    }
}

fn channel(number: usize, muscle: Muscle) -> String {
    format!("EMG {number} {}", short(muscle))
}

/// A label of EDF has sixteen characters.
const fn short(muscle: Muscle) -> &'static str {
    match muscle {
        Muscle::Absent => "absent",
        Muscle::BicepsShort => "bic-short",
        Muscle::BicepsLong => "bic-long",
        Muscle::TricepsLateral => "tric-lat",
        Muscle::TricepsLong => "tric-long",
        Muscle::Other => "other",
    }
}

/// What is said about times: demonstrations and gaps, in order.
fn events(scans: &Scans) -> Vec<Annotation> {
    let since_s = |us: u64| (us as f64 - scans.start_us as f64) * 1e-6;
    let demonstrations = scans.demonstrations.iter().map(|(from_us, to_us, label)| {
        let duration_s = to_us.map(|to_us| to_us.saturating_sub(*from_us) as f64 * 1e-6);
        Annotation {
            onset_s: since_s(*from_us),
            duration_s,
            text: label.clone(),
        }
    });
    let gaps = scans.gaps.iter().map(|gap| Annotation {
        onset_s: gap.first as f64 / scans.rate_hz(),
        duration_s: Some(gap.scans as f64 / scans.rate_hz()),
        text: "BAD_gap".to_owned(),
    });
    let mut all: Vec<Annotation> = demonstrations.chain(gaps).collect();
    all.sort_by(|a, b| a.onset_s.total_cmp(&b.onset_s));
    all
}

fn edf<'a>(scans: &'a Scans, label: &str, events: &[Annotation]) -> Edf<'a> {
    let (microvolts_per_count, offset) = scans.scale();
    let signals = (1..).zip(&scans.counts).zip(scans.muscles());
    let signals = signals.map(|((number, counts), muscle)| Signal {
        label: channel(number, *muscle),
        transducer: "surface electrodes, bipolar".to_owned(),
        prefilter: "none".to_owned(),
        counts,
        microvolts_per_count,
        offset,
    });
    Edf {
        subject: label.to_owned(),
        start_unix_us: scans.opening.started_unix_us.saturating_add(scans.start_us),
        rate_hz: scans.rate_hz(),
        signals: signals.collect(),
        // Before the first sample nothing can be said in the file; the table of events says it.
        annotations: (events.iter())
            .filter(|event| event.onset_s >= 0.0)
            .cloned()
            .collect(),
    }
}

fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

fn description(scans: &Scans) -> Value {
    json!({
        "Name": "Surface electromyography of the upper arm, recorded by Tonus",
        "BIDSVersion": "1.11.1",
        "DatasetType": "raw",
        "GeneratedBy": [{ "Name": "tonus", "Version": scans.opening.version }],
    })
}

fn readme() -> String {
    "Surface electromyography of the upper arm, recorded by a Tonus wearable and exported by `tonus export`.\n\n\
     Scans that did not reach the host are filled with zero volts; events named BAD_gap say which. Other events are \
     demonstrations, named by their label.\n"
        .to_owned()
}

fn participants(scans: &Scans, label: &str) -> String {
    let (weight, height) = scans.opening.subject.as_ref().map_or_else(
        || ("n/a".to_owned(), "n/a".to_owned()),
        |person| {
            let height_cm = person.body_height_m * 100.0;
            (person.body_mass_kg.to_string(), format!("{height_cm:.1}"))
        },
    );
    format!("participant_id\tweight\theight\nsub-{label}\t{weight}\t{height}\n")
}

fn participants_columns() -> Value {
    json!({
        "weight": { "Description": "Body mass", "Units": "kg" },
        "height": { "Description": "Body height", "Units": "cm" },
    })
}

fn sidecar(scans: &Scans, edf: &Edf<'_>) -> Value {
    let mains = (scans.configuration.mains_hz).map_or_else(|| json!("n/a"), |hertz| json!(hertz));
    json!({
        "TaskName": TASK,
        "TaskDescription": "Movements that are shown to a robot, or that it follows",
        "EMGPlacementScheme": "Other",
        "EMGPlacementSchemeDescription": "Over the muscle that each channel names; places were not measured",
        "EMGReference": "bipolar: each channel is the difference of two electrodes over one muscle",
        "EMGGround": "n/a",
        "EMGChannelCount": scans.counts.len(),
        "SamplingFrequency": scans.rate_hz(),
        "PowerLineFrequency": mains,
        "SoftwareFilters": "n/a",
        "HardwareFilters": "n/a",
        "RecordingDuration": edf.duration_s(),
        "RecordingType": "continuous",
        "SoftwareVersions": format!("tonus {}", scans.opening.version),
    })
}

fn channels(scans: &Scans) -> String {
    let mut text =
        "name\ttype\tunits\tsampling_frequency\tsignal_electrode\treference_electrode\ttarget_muscle\tstatus\n"
            .to_owned();
    for (number, muscle) in (1..).zip(scans.muscles()) {
        let label = channel(number, *muscle);
        let place = muscle.name().replace('_', " ");
        let rate_hz = scans.rate_hz();
        text += &format!("{label}\tEMG\tuV\t{rate_hz}\tE{number}\tn/a\t{place}\tn/a\n");
    }
    text
}

fn electrodes(scans: &Scans) -> String {
    let mut text = "name\tx\ty\tz\tcoordinate_system\n".to_owned();
    for number in 1..=scans.counts.len() {
        text += &format!("E{number}\tn/a\tn/a\tn/a\tn/a\n");
    }
    text
}

fn coordinates() -> Value {
    json!({
        "EMGCoordinateSystem": "Other",
        "EMGCoordinateSystemDescription": "Places of electrodes were not measured",
        "EMGCoordinateUnits": "n/a",
    })
}

fn events_table(events: &[Annotation]) -> String {
    let mut text = "onset\tduration\ttrial_type\n".to_owned();
    for event in events {
        let duration = event
            .duration_s
            .map_or_else(|| "n/a".to_owned(), |s| format!("{s:.6}"));
        let kind: String = (event.text.chars()).filter(|c| !c.is_control()).collect();
        text += &format!("{:.6}\t{duration}\t{kind}\n", event.onset_s);
    }
    text
}

fn events_columns() -> Value {
    json!({
        "trial_type": {
            "Description": "A demonstration, by its label, or BAD_gap: scans that did not reach the host, filled with zero volts",
        },
    })
}

/// `2026-11-26T19:02:54.123456`, UTC as BIDS wants it without saying so.
fn acquired(unix_us: u64) -> String {
    let (year, month, day) = super::edf::civil(unix_us / 86_400_000_000);
    let us = unix_us % 86_400_000_000;
    let second = us / 1_000_000;
    format!(
        "{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}.{:06}",
        second / 3600,
        second / 60 % 60,
        second % 60,
        us % 1_000_000
    )
}

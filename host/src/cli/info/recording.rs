//! What a recording holds.

use std::path::Path;

use serde_json::{Value, json};
use tonus::live::Input;
use tonus::recording::{End, Entry, Opening, Reading};
use tonus::store;

use super::super::say;

/// Counts of entries, in the order in which they are told.
#[derive(Default)]
struct Counts {
    frames: u64,
    hands: u64,
    unseen: u64,
    robot: u64,
    acts: u64,
    learnt: u64,
    stalls: u64,
    links: u64,
    commands: u64,
    setpoints: u64,
    recognitions: u64,
    messages: u64,
}

impl Counts {
    fn add(&mut self, entry: &Entry) {
        let counter = match entry {
            Entry::Input(timed) => match timed.input {
                Input::Frame(_) => &mut self.frames,
                Input::Hand(Some(_)) => &mut self.hands,
                Input::Hand(None) => &mut self.unseen,
                Input::Robot(_) => &mut self.robot,
                Input::Act(_) => &mut self.acts,
                Input::Learnt(_) => &mut self.learnt,
                Input::Stalled { .. } => &mut self.stalls,
                Input::Link(_) | Input::Tracker(_) => &mut self.links,
            },
            Entry::Command { .. } => &mut self.commands,
            Entry::Setpoint { .. } => &mut self.setpoints,
            Entry::Recognition { .. } => &mut self.recognitions,
            Entry::Message(_) => &mut self.messages,
        };
        *counter += 1;
    }

    fn all(&self) -> [(&'static str, u64); 12] {
        [
            ("frames", self.frames),
            ("hands", self.hands),
            ("pictures without a hand", self.unseen),
            ("robot positions", self.robot),
            ("acts", self.acts),
            ("models learnt or not", self.learnt),
            ("stalls of the program", self.stalls),
            ("changes of a link", self.links),
            ("commands", self.commands),
            ("set-points", self.setpoints),
            ("recognitions", self.recognitions),
            ("messages", self.messages),
        ]
    }
}

/// Reads and reports. A recording that ends in damage is told of as far as it can be read.
pub(super) fn run(file: &Path, json: bool) -> anyhow::Result<()> {
    let mut reading = Reading::open(file)?;
    let mut opening = reading.opening().clone();
    let (mut counts, mut times_us, mut damage) = (Counts::default(), None, None);
    for entry in reading.by_ref() {
        match entry {
            Ok(entry) => {
                counts.add(&entry);
                if let Entry::Input(timed) = &entry {
                    opening.subject = opening.subject.or_else(|| timed.input.wearer().cloned());
                }
                let first_us = times_us.map_or(entry.at_us(), |(first_us, _)| first_us);
                times_us = Some((first_us, entry.at_us()));
            }
            Err(error) => damage = Some(error.to_string()),
        }
    }
    let opening = &opening;
    let seconds = times_us.map_or(0.0, |(first, last): (u64, u64)| {
        last.saturating_sub(first) as f64 * 1e-6
    });
    let closed = reading.end() == Some(End::Closed);
    if json {
        let summary = summary(opening, &counts, seconds, closed, damage.as_deref());
        return say(&format!("{summary}\n"));
    }
    let mut text = format!(
        "{}: {seconds:.3} s, recorded by tonus {}, {}\n",
        file.display(),
        opening.version,
        match (closed, &damage) {
            (_, Some(_)) => "damaged (tonus recover keeps what is whole)",
            (true, None) => "closed",
            (false, None) => "cut (tonus recover closes it)",
        }
    );
    if let Some(damage) = damage {
        text += &format!("  {damage}\n");
    }
    text += &match &opening.subject {
        Some(person) => format!(
            "of {}, {} kg, {} m\n",
            person.name, person.body_mass_kg, person.body_height_m
        ),
        None => "of nobody who was named\n".to_owned(),
    };
    if let Some(skills) = skills(opening) {
        text += &format!("with a model of {}\n", skills.join(", "));
    }
    for (name, count) in counts.all() {
        if count > 0 {
            text += &format!("  {count} {name}\n");
        }
    }
    say(&text)
}

/// Labels of the model that the recording began with.
fn skills(opening: &Opening) -> Option<Vec<String>> {
    let (model, _) = store::from_bytes(opening.model.as_ref()?).ok()?;
    Some(model.labels().to_vec())
}

fn summary(
    opening: &Opening,
    counts: &Counts,
    seconds: f64,
    closed: bool,
    damage: Option<&str>,
) -> Value {
    let entries: serde_json::Map<_, _> = (counts.all().into_iter())
        .map(|(name, count)| (name.replace([' ', '-'], "_"), json!(count)))
        .collect();
    json!({
        "kind": "recording",
        "version": opening.version,
        "started_unix_us": opening.started_unix_us,
        "subject": opening.subject,
        "skills": skills(opening),
        "calibrated": opening.calibration.is_some(),
        "duration_s": seconds,
        "closed": closed,
        "damage": damage,
        "entries": entries,
    })
}

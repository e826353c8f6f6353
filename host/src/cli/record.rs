//! `tonus record` and `tonus calibrate`: without a browser.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::bail;
use serde_json::json;
use tonus::calibration::Profile;
use tonus::config::Config;
use tonus::live::{Person, View};
use tonus::source::LinkChoice;
use tonus::studio::hands::Hands;
use tonus::studio::keep::{self, Keeper};
use tonus::studio::keyboard::Keyboard;
use tonus::studio::run::{Plan, Ran, run};
use tonus::studio::terminal::{Calibrates, Enter, Records};
use tonus_shared::stiffness::Segments;

use super::options::positive;
use super::run::{ask_passkey, stop_at_signal};
use super::say;

/// So long a simulated person takes from the question to the end of a movement, microseconds.
const SIMULATED_US: u64 = 5_200_000;

const RECORD: &str = "Examples:
  tonus record --link ble --label lift_book --count 5 -o lift_book.mcap
  tonus record --link sim --label hand_over --count 2 -o trial.mcap
  tonus export lift_book.mcap -o lift_book.csv && tonus run --demonstrations lift_book-demonstrations.csv";

/// Record demonstrations of one skill at the terminal: everything goes into a recording, which `tonus export` turns into
/// a CSV file to train from.
#[derive(clap::Args)]
#[command(after_help = RECORD)]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    devices: Devices,
    /// The skill that is shown.
    #[arg(long, value_name = "LABEL")]
    label: String,
    /// How often.
    #[arg(long, value_name = "N", default_value_t = 1)]
    count: usize,
    /// Who wears the wearable, as `tonus calibrate` named them: their calibration goes to it.
    #[arg(long, value_name = "NAME")]
    person: Option<String>,
    /// The recording; a new file.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

const CALIBRATE: &str = "Examples:
  tonus calibrate --link ble --name p01 --mass 75 --height 1.75 --mains 50
  tonus calibrate --link sim --name simulated --mass 75 --height 1.75

Rest, maximum contraction, then known loads in the hand (0.5 kg hanging, 0.3 kg by a string over a pulley); the tracker
sees how far the hand gives way. The wearable keeps the result.";

/// Measure a person at the terminal: muscles' levels, co-contraction, joint stiffness.
#[derive(clap::Args)]
#[command(after_help = CALIBRATE)]
pub(crate) struct CalibrateArgs {
    #[command(flatten)]
    devices: Devices,
    /// A name or code of the person.
    #[arg(long, value_name = "NAME")]
    name: String,
    /// Body mass, kg.
    #[arg(long, value_name = "KG", value_parser = positive)]
    mass: f64,
    /// Body height, m.
    #[arg(long, value_name = "M", value_parser = positive)]
    height: f64,
    /// Mains frequency, 50 or 60 Hz; without it there is no notch.
    #[arg(long, value_name = "HZ")]
    mains: Option<u8>,
    /// Record the calibration; a new file.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(clap::Args)]
struct Devices {
    /// The wearable, as for `tonus run` [default: the configuration's].
    #[arg(long, value_name = "LINK")]
    link: Option<LinkChoice>,
    /// The configuration [default: as for `tonus run`].
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Give up after this time.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    seconds: Option<f64>,
    /// Everything simulated follows from it.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

/// What is kept, of whom something is, and who answers.
#[derive(Default)]
struct Known {
    keyboard: Keyboard,
    keeper: Keeper,
    person: Option<Profile>,
}

impl Devices {
    fn found(&self) -> anyhow::Result<(Config, LinkChoice)> {
        let (mut config, _) = Config::find(self.config.as_deref())?;
        let link = match self.link.clone() {
            Some(link) => link,
            None => config.wearable.link.parse()?,
        };
        config.wearable.link = link.to_string();
        Ok((config, link))
    }

    fn run(
        &self,
        (config, link): (Config, LinkChoice),
        hands: Box<dyn Hands>,
        record: Option<PathBuf>,
        Known {
            keyboard,
            keeper,
            person,
        }: Known,
    ) -> anyhow::Result<(Ran, bool)> {
        let stop = Arc::new(AtomicBool::new(false));
        stop_at_signal(Arc::clone(&stop))?;
        let plan = Plan {
            config,
            link,
            hands: Some(hands),
            ends_with_hands: true,
            seconds: self.seconds,
            record,
            page: false,
            lsl: false,
            library: None,
            keeper,
            person,
            seed: self.seed,
            pace: 1.0,
            ask_passkey: ask_passkey(keyboard),
            stop: Arc::clone(&stop),
        };
        let ran = run(plan, |_| {}, problems())?;
        let stopped = stop.load(std::sync::atomic::Ordering::Relaxed);
        Ok((ran, stopped))
    }
}

/// Tells what goes wrong, and nothing else.
fn problems() -> impl FnMut(&View) + 'static {
    let mut told_us = 0;
    move |view| {
        let since_us = told_us;
        for message in view
            .messages
            .iter()
            .filter(|m| m.problem && m.at_us > since_us)
        {
            told_us = message.at_us;
            eprintln!("{}", message.text);
        }
    }
}

fn aloud(json: bool) -> Box<dyn FnMut(&str)> {
    Box::new(move |line| {
        if json {
            eprintln!("{line}");
        } else {
            // Who does not read does not need it.
            let _unread = say(&format!("{line}\n"));
        }
    })
}

fn enter(link: &LinkChoice, keyboard: &Keyboard) -> Enter {
    if *link == LinkChoice::Simulated {
        Enter::at_once()
    } else {
        Enter::of(keyboard.presses())
    }
}

impl RecordArgs {
    /// Fewer demonstrations than asked for are a failure.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let found = self.devices.found()?;
        let simulated = found.1 == LinkChoice::Simulated;
        let person = (self.person.as_deref())
            .map(|name| keep::read(&found.0.recording.people, name))
            .transpose()?;
        let known = Known {
            person,
            ..Known::default()
        };
        let lasts_us = simulated.then_some(SIMULATED_US);
        let records = Records::new(
            self.label,
            self.count,
            enter(&found.1, &known.keyboard),
            lasts_us,
            aloud(json),
        );
        let (ran, stopped) =
            self.devices
                .run(found, Box::new(records), Some(self.output), known)?;
        let Some((path, file)) = ran.file else {
            bail!("nothing was recorded");
        };
        say(&if json {
            let document = json!({ "path": path, "bytes": file.bytes, "entries": file.entries, "dropped": file.dropped });
            format!("{document}\n")
        } else {
            format!("recorded {} ({} bytes)\n", path.display(), file.bytes)
        })?;
        if stopped {
            bail!("interrupted: what was recorded until then is in the file");
        }
        Ok(())
    }
}

impl CalibrateArgs {
    /// A calibration that is not finished is a failure; the wearable then works with what it had.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let found = self.devices.found()?;
        Segments::new(self.mass, self.height)?;
        let person = Person {
            name: Person::name_of(&self.name)?,
            body_mass_kg: self.mass,
            body_height_m: self.height,
            mains_hz: self.mains,
        };
        let name = person.name.clone();
        let keyboard = Keyboard::default();
        let calibrates = Calibrates::new(person, enter(&found.1, &keyboard), aloud(json));
        let done = calibrates.finished();
        let people = found.0.recording.people.clone();
        let known = Known {
            keyboard,
            keeper: Keeper::new(None, Some(people.clone())),
            person: None,
        };
        let hands = Box::new(calibrates);
        let (_, stopped) = self.devices.run(found, hands, self.output, known)?;
        if stopped || !done.get() {
            bail!("the calibration was not finished; the wearable works with what it had");
        }
        say(&if json {
            format!("{}\n", json!({ "calibrated": name, "people": people }))
        } else {
            format!(
                "the calibration of {name} is in use, and kept in {}: --person {name} uses it again\n",
                people.display()
            )
        })
    }
}

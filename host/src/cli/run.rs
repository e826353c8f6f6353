//! `tonus run`: the program that people sit in front of.

use std::io::{IsTerminal, stderr, stdin, stdout};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, bail};
use serde_json::json;
use tonus::config::Config;
use tonus::library::Library;
use tonus::link::ble::{AskPasskey, PASSKEY_WITHIN, passkey};
use tonus::live::View;
use tonus::source::LinkChoice;
use tonus::studio::follows::Follows;
use tonus::studio::hands::Hands;
use tonus::studio::keep::{self, Keeper};
use tonus::studio::keyboard::Keyboard;
use tonus::studio::run::{Plan, Ran, run};
use tonus::studio::story::Story;
use tonus::studio::terminal::Enter;

use super::options::{self, positive};
use super::progress::Progress;
use super::say;

const EXAMPLE: &str = "Examples:
  tonus run                               a simulated person, wearable, tracker and robot; you press the buttons
  tonus run --story                       they tell the whole story themselves
  tonus run --link ble --leap ws://127.0.0.1:6437
  tonus run --link serial:/dev/ttyACM0 --robot udp:127.0.0.1:5005 --demonstrations mine.csv
  tonus run --link ble -o skills.safetensors    keeps the skills that are learnt on the page
  tonus run --link ble --model skills.safetensors
  tonus run --link ble --model skills.safetensors --person p01 --no-page    a and Enter arms, Enter disarms

The page is served to this machine alone, at the address that is printed. Ctrl-C disarms the robot, closes the
recording and ends.";

/// Connect, calibrate, record, train and let the robot follow, in the browser.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct RunArgs {
    /// The wearable: ble[:NAME], serial:PORT, myo, replay:FILE, lsl[:NAME] or sim [default: the configuration's].
    #[arg(long, value_name = "LINK")]
    link: Option<LinkChoice>,
    /// Address of the Leap service, or leapc[:FILE], where the link is no simulation [default: the configuration's].
    #[arg(long, value_name = "URL")]
    leap: Option<String>,
    /// The robot: simulated, or udp:HOST:PORT for a controller of your own [default: the configuration's].
    #[arg(long, value_name = "ROBOT")]
    robot: Option<String>,
    /// The configuration [default: tonus.toml here, or in the user's directory, or none].
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Demonstrations to learn from before it starts: CSV files as `tonus train` reads them.
    #[arg(long, value_name = "CSV", num_args = 1..)]
    demonstrations: Vec<PathBuf>,
    /// Skills to follow from its start: a model file of `tonus train --live` or of -o.
    #[arg(long, value_name = "MODEL", conflicts_with = "demonstrations")]
    model: Option<PathBuf>,
    /// Model file for the skills that are learnt in this run, each time anew.
    #[arg(short, long, value_name = "MODEL")]
    output: Option<PathBuf>,
    /// Who wears the wearable, as a calibration named them: it goes to the wearable. People who are calibrated are kept in
    /// the configuration's directory, unless the link is a simulation.
    #[arg(long, value_name = "NAME")]
    person: Option<String>,
    /// Where to record [default: a new file in the configuration's directory, unless the link is a simulation].
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Record nothing.
    #[arg(long, conflicts_with = "record")]
    no_record: bool,
    /// Port of the page on 127.0.0.1; if it is taken, a free one [default: the configuration's].
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
    /// Serve no page. At a terminal what changes is told there; a and Enter arms, Enter disarms.
    #[arg(long)]
    no_page: bool,
    /// Send envelopes and stiffness to other programs as a stream of the lab streaming layer (needs liblsl).
    #[arg(long)]
    lsl: bool,
    /// Open no browser.
    #[arg(long)]
    no_browser: bool,
    /// A simulated person tells the whole story.
    #[arg(long)]
    story: bool,
    /// Stop after this time.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    seconds: Option<f64>,
    /// A recording in the wearable's place runs so many times as fast as it was, and the session with it: for looking, with
    /// the simulated robot and without --lsl.
    #[arg(long, value_name = "TIMES", value_parser = positive, default_value = "1")]
    pace: f64,
    /// Everything simulated follows from it.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

impl RunArgs {
    /// What is run without a verb: the story, which ends by itself where nobody sits at a terminal.
    pub(crate) fn first() -> Self {
        Self {
            link: Some(LinkChoice::Simulated),
            leap: None,
            // Whatever the configuration names: nobody is there who could arm it.
            robot: Some("simulated".to_owned()),
            config: None,
            demonstrations: Vec::new(),
            model: None,
            output: None,
            person: None,
            record: None,
            no_record: true,
            port: None,
            no_page: false,
            lsl: false,
            no_browser: false,
            story: true,
            seconds: None,
            pace: 1.0,
            seed: 1,
        }
    }

    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let (mut config, file) = Config::find(self.config.as_deref())?;
        if let Some(leap) = &self.leap {
            config.tracker.leap.clone_from(leap);
        }
        if let Some(robot) = &self.robot {
            config.robot.to.clone_from(robot);
        }
        config.page.port = self.port.unwrap_or(config.page.port);
        let link = match self.link.clone() {
            Some(link) => link,
            None => config.wearable.link.parse().context("[wearable] link")?,
        };
        config.wearable.link = link.to_string();
        let simulated = link == LinkChoice::Simulated;
        if self.story && !simulated {
            bail!(super::UsageError(
                "only a simulated person tells the story: --story needs --link sim"
            ));
        }
        self.check_outside(&config, &link)?;
        let record = match (&self.record, self.no_record || simulated) {
            (Some(file), _) => Some(file.clone()),
            (None, true) => None,
            (None, false) => Some(new_recording(&config)?),
        };
        let watched = stdin().is_terminal() && stdout().is_terminal();
        let keyboard = Keyboard::default();
        let hands = self.hands(&keyboard, watched && !json);
        let open = config.page.open && watched && !self.no_browser && !json;
        let stop = Arc::new(AtomicBool::new(false));
        stop_at_signal(Arc::clone(&stop))?;
        let library = match &self.model {
            Some(file) => Some(Library::load(file)?),
            None => library(
                &self.demonstrations,
                config.recognition.false_alarm_rate,
                json,
            )?,
        };
        let people = &config.recording.people;
        let person = (self.person.as_deref())
            .map(|name| keep::read(people, name))
            .transpose()?;
        // As with recordings: of a simulation nothing stays that was not asked for.
        let here = || file.clone().unwrap_or_else(|| PathBuf::from("tonus.toml"));
        let keeper = Keeper::new(self.output, (!simulated).then(|| people.clone()))
            .with_frames((!simulated).then(here));
        let plan = Plan {
            library: library.map(Arc::new),
            keeper,
            person,
            config,
            link,
            hands,
            ends_with_hands: self.story && !watched,
            seconds: self.seconds,
            record,
            page: !self.no_page,
            lsl: self.lsl,
            seed: self.seed,
            pace: self.pace,
            ask_passkey: ask_passkey(keyboard),
            stop,
        };
        if let Some(file) = file.filter(|_| !json) {
            say(&format!("configuration {}\n", file.display()))?;
        }
        let ran = run(plan, |url| served(url, json, open), teller(json))?;
        end(&ran, json)
    }
}

impl RunArgs {
    /// Who acts beside the page: a simulated person, or whoever sits at the terminal where there is no page.
    fn hands(&self, keyboard: &Keyboard, watched: bool) -> Option<Box<dyn Hands>> {
        if self.story {
            return Some(Box::new(Story::default()));
        }
        if !(self.no_page && watched) {
            return None;
        }
        // Who does not read it does not need it.
        let tell = |text: &str| _ = say(&format!("{text}\n"));
        let enter = Enter::of(keyboard.presses());
        Some(Box::new(Follows::new(enter, Box::new(tell))))
    }

    /// No story for a real robot; and devices have their own pace, and so has whoever follows outside.
    fn check_outside(&self, config: &Config, link: &LinkChoice) -> Result<(), super::UsageError> {
        let simulated = config.robot.to == "simulated";
        if self.story && !simulated {
            return Err(super::UsageError(
                "a simulated person arms no real robot: --story needs --robot simulated",
            ));
        }
        let alone = !self.lsl && simulated;
        if self.pace == 1.0 || (alone && matches!(link, LinkChoice::Replay(_))) {
            return Ok(());
        }
        Err(super::UsageError(
            "only a session of recorded devices has another pace, and nobody outside follows it: --pace needs --link replay:FILE and --robot simulated, and no --lsl",
        ))
    }
}

/// Learns from files; none from none.
fn library(
    files: &[PathBuf],
    false_alarm_rate: f64,
    json: bool,
) -> anyhow::Result<Option<Library>> {
    if files.is_empty() {
        return Ok(None);
    }
    let all = options::live_demonstrations(files, &[])?;
    let learning = Progress::spinner("learning", !json && stderr().is_terminal());
    let library = Library::learn(&all, false_alarm_rate)?;
    learning.finish();
    Ok(Some(library))
}

/// Asks at the terminal for the six digits that a wearable shows.
pub(crate) fn ask_passkey(keyboard: Keyboard) -> AskPasskey {
    Arc::new(move |name| {
        if !stdin().is_terminal() {
            return None;
        }
        say(&format!("the passkey that {name} shows: ")).ok()?;
        let typed = keyboard.ask(PASSKEY_WITHIN)?;
        match passkey(&typed) {
            Ok(digits) => Some(digits),
            Err(not_taken) => {
                let _unread = say(&format!("{not_taken}\n"));
                None
            }
        }
    })
}

/// A file of its own for each run, named by the second.
fn new_recording(config: &Config) -> anyhow::Result<PathBuf> {
    let directory = &config.recording.directory;
    std::fs::create_dir_all(directory)
        .with_context(|| format!("{}: cannot be made", directory.display()))?;
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH)?;
    Ok(directory.join(format!("tonus-{}.mcap", since.as_secs())))
}

/// Ctrl-C and the system's wish to end set the flag; a second one ends at once.
pub(crate) fn stop_at_signal(stop: Arc<AtomicBool>) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let wait = move || {
        runtime.block_on(async {
            if signalled().await {
                stop.store(true, Ordering::Relaxed);
                if signalled().await {
                    std::process::exit(130);
                }
            }
        });
    };
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(wait)?;
    Ok(())
}

#[cfg(unix)]
async fn signalled() -> bool {
    use tokio::signal::unix::{SignalKind, signal};
    let Ok(mut end) = signal(SignalKind::terminate()) else {
        return tokio::signal::ctrl_c().await.is_ok();
    };
    tokio::select! {
        interrupted = tokio::signal::ctrl_c() => interrupted.is_ok(),
        ended = end.recv() => ended.is_some(),
    }
}

#[cfg(not(unix))]
async fn signalled() -> bool {
    tokio::signal::ctrl_c().await.is_ok()
}

fn served(url: &str, json: bool, open: bool) {
    let line = if json {
        format!("{}\n", json!({ "url": url }))
    } else {
        format!("the page is at {url}\n")
    };
    // Who does not read it does not need it.
    let _unread = say(&line);
    if open && opener::open_browser(url).is_err() {
        let _unread = say("no browser could be opened: open the address yourself\n");
    }
}

/// Says what happens as it happens: what the story does, and every message.
fn teller(json: bool) -> impl FnMut(&View) + 'static {
    let (mut story, mut told_us) = (String::new(), 0);
    move |view| {
        if json {
            return;
        }
        let mut lines = String::new();
        let since_us = told_us;
        for message in view.messages.iter().filter(|m| m.at_us > since_us) {
            told_us = message.at_us;
            lines.push_str(&line(message.at_us, &message.text));
        }
        if let Some(now) = view.story.as_ref().filter(|now| **now != story) {
            story.clone_from(now);
            lines.push_str(&line(view.at_us, now));
        }
        if !lines.is_empty() {
            let _unread = say(&lines);
        }
    }
}

#[allow(clippy::cast_precision_loss, reason = "seconds")]
fn line(at_us: u64, text: &str) -> String {
    format!("{:8.1} s  {text}\n", at_us as f64 * 1e-6)
}

/// The last words; a story that could not be told is a failure.
fn end(ran: &Ran, json: bool) -> anyhow::Result<()> {
    if json {
        let file = ran.file.as_ref().map(|(path, file)| {
            json!({ "path": path, "bytes": file.bytes, "entries": file.entries, "dropped": file.dropped })
        });
        say(&format!(
            "{}\n",
            json!({ "story": ran.told, "recording": file })
        ))?;
    } else {
        if let Some(told) = &ran.told {
            for (performed, recognised) in told.performed.iter().zip(&told.recognised) {
                let taken = recognised.as_deref().unwrap_or("unknown");
                say(&format!("  {performed:<14} taken for {taken}\n"))?;
            }
        }
        if let Some((path, file)) = &ran.file {
            say(&format!(
                "recorded {} ({} bytes)\n",
                path.display(),
                file.bytes
            ))?;
        }
    }
    match ran.told.as_ref().and_then(|told| told.stuck.as_ref()) {
        Some(stuck) => bail!("the story could not go on: {stuck}"),
        None => Ok(()),
    }
}

//! A running program from its plan: sources started, page served, file opened, engine fed until it ends.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use super::hands::Hands;
use super::keep::Keeper;
use super::real::{Left, Parts, Real};
use super::setup::{self, SetupError};
use super::story::Told;
use crate::broadcast::{Speaker, SpeakerError};
use crate::calibration::Profile;
use crate::config::Config;
use crate::library::Library;
use crate::link::ble::{AskPasskey, Passkeys, passkey};
use crate::live::{Act, Engine, EngineError, Injector, Input, Inputs, Port, SessionClock, View};
use crate::page::{Page, PageError};
use crate::recording::{Finished, Opening, ReadError, RecordError, Recorder};
use crate::source::{LinkChoice, hand, lsl, myo, replay, serial, simulated, wearable};

/// What is to run.
pub struct Plan {
    /// The configuration.
    pub config: Config,
    /// Instead of the wearable that the configuration names.
    pub link: LinkChoice,
    /// Who presses the buttons beside the page.
    pub hands: Option<Box<dyn Hands>>,
    /// Whether the run ends when they are done.
    pub ends_with_hands: bool,
    /// The run ends then, seconds.
    pub seconds: Option<f64>,
    /// Where it is recorded.
    pub record: Option<PathBuf>,
    /// Whether there is a page.
    pub page: bool,
    /// Whether envelopes and stiffness are sent to other programs by the lab streaming layer.
    pub lsl: bool,
    /// Skills known before.
    pub library: Option<Arc<Library>>,
    /// Keeps skills that are learnt and people who are measured.
    pub keeper: Keeper,
    /// Who wears the wearable, as they were measured before.
    pub person: Option<Profile>,
    /// Seed of what is simulated.
    pub seed: u64,
    /// A recording in the wearable's place runs so many times as fast as it was.
    pub pace: f64,
    /// Asks whoever sits there for the passkey that a wearable shows.
    pub ask_passkey: AskPasskey,
    /// Set from outside to end it.
    pub stop: Arc<AtomicBool>,
}

/// What came of it.
#[derive(Debug)]
pub struct Ran {
    /// The story, if one was told.
    pub told: Option<Told>,
    /// The file, if there is one.
    pub file: Option<(PathBuf, Finished)>,
}

/// Why it does not run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The configuration names what there is not.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The engine.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The page.
    #[error(transparent)]
    Page(#[from] PageError),
    /// The file.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The stream for other programs.
    #[error(transparent)]
    Speaker(#[from] SpeakerError),
    /// A recording in the wearable's place.
    #[error(transparent)]
    Replay(#[from] ReadError),
    /// What is simulated.
    #[error(transparent)]
    Simulated(#[from] simulated::SimulatedError),
    /// The system gives no thread.
    #[error("no thread for the {what}: {source}")]
    Thread {
        /// What for.
        what: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
}

/// Runs until it is stopped. `served` is told the page's address once there is one, `watch` sees every view.
///
/// # Errors
/// [`RunError`] says what could not be started; what was started is ended.
pub fn run(
    plan: Plan,
    served: impl FnOnce(&str),
    watch: impl FnMut(&View) + 'static,
) -> Result<Ran, RunError> {
    let engine_config = setup::engine(&plan.config, &plan.link)?;
    let body = setup::body(&plan.config)?;
    let recorder = (plan.record.as_deref())
        .map(|file| Recorder::create(file, &opening(&plan)))
        .transpose()?;
    let mut engine = Engine::new(engine_config, body, plan.library.clone())?;
    let clock = match plan.link {
        LinkChoice::Replay(_) => SessionClock::at_pace(plan.pace),
        _ => SessionClock::start(),
    };
    let inputs = Inputs::new(clock);
    let speaker = plan
        .lsl
        .then(|| Speaker::start(&plan.link.to_string(), plan.config.clock(), clock));
    let speaker = speaker.transpose()?;
    let injector = inputs.injector();
    let passkeys = Passkeys::new(plan.page);
    if let Some(profile) = &plan.person {
        // The queue is empty.
        let _room = injector.input(Input::Act(Act::Recall {
            name: profile.person.name.clone(),
            profile: Some(Box::new(profile.clone())),
        }));
    }
    let disarm = Arc::new(AtomicBool::new(false));
    let page = (plan.page).then(|| serve(&plan, injector, &disarm, &passkeys));
    let page = page.transpose()?;
    if let Some(page) = &page {
        served(page.url());
    }
    let (port, plug) = inputs.port();
    let mut sources = vec![start(&plan, port, &passkeys)?];
    let mut tracker = None;
    if has_tracker(&plan.link) {
        let (port, plug) = inputs.port();
        let told = setup::tracker(&plan.config)?;
        sources.push(thread("hand tracker", move || hand::run(&port, told))?);
        tracker = Some(plug);
    }
    let mut world = Real::new(Parts {
        inputs,
        wearable: plug,
        tracker,
        page,
        recorder,
        speaker,
        passkeys,
        robot: setup::controller(&plan.config)?,
        hands: plan.hands,
        keeper: plan.keeper,
        disarm,
        stop: plan.stop,
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked on the command line"
        )]
        end_us: plan.seconds.map(|seconds| (seconds * 1e6) as u64),
        ends_with_hands: plan.ends_with_hands,
        watch: Box::new(watch),
    });
    let outcome = engine.run(&mut world);
    let Left { hands, file } = world.finish();
    for source in sources {
        // A source that panicked has nothing more to give; the run is over anyhow.
        let _ended = source.join();
    }
    outcome?;
    Ok(Ran {
        told: hands.and_then(|hands| hands.told()),
        file: plan.record.zip(file.transpose()?),
    })
}

/// The page: acts go to the engine, a passkey to whoever asks for it.
fn serve(
    plan: &Plan,
    injector: Injector,
    disarm: &Arc<AtomicBool>,
    passkeys: &Passkeys,
) -> Result<Page, PageError> {
    let (keeper, asking) = (plan.keeper.clone(), passkeys.clone());
    let disarm = Arc::clone(disarm);
    let acts = move |act: Act| {
        if act == Act::Disarm {
            disarm.store(true, Ordering::Relaxed);
            return Ok(());
        }
        let room = injector.input(Input::Act(looked_up(act, &keeper)));
        let busy = || "the program is too busy for that: press again".to_owned();
        room.then_some(()).ok_or_else(busy)
    };
    Page::serve(plan.config.page.port, acts, move |typed| {
        let given = passkey(typed).and_then(|passkey| asking.give(passkey));
        given.map_err(|not_taken| not_taken.to_string())
    })
}

fn opening(plan: &Plan) -> Opening {
    Opening {
        configuration: plan.config.text(),
        model: (plan.library.as_deref()).and_then(|library| library.to_bytes().ok()),
        subject: plan.person.as_ref().map(|profile| profile.person.clone()),
        calibration: plan.person.as_ref().map(Profile::text),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        started_unix_us: unix_us(),
    }
}

/// What is kept of whom an act names: a window gives a name, never numbers.
fn looked_up(act: Act, keeper: &Keeper) -> Act {
    match act {
        Act::Recall { name, .. } => {
            let profile = keeper.recall(&name).ok().map(Box::new);
            Act::Recall { name, profile }
        }
        other => other,
    }
}

/// Whether hands come from a tracker of their own.
fn has_tracker(link: &LinkChoice) -> bool {
    !matches!(link, LinkChoice::Simulated | LinkChoice::Replay(_))
}

/// Starts the wearable's source.
fn start(plan: &Plan, port: Port, passkeys: &Passkeys) -> Result<JoinHandle<()>, RunError> {
    match &plan.link {
        LinkChoice::Simulated => {
            let devices = simulated::SimulatedDevices::new(simulated::SimulatedConfig {
                seed: plan.seed,
                ..simulated::SimulatedConfig::default()
            })?;
            thread("simulated devices", move || simulated::run(devices, &port))
        }
        LinkChoice::Replay(file) => {
            let reading = replay::open(Path::new(file))?;
            thread("recording", move || replay::run(reading, &port))
        }
        LinkChoice::Ble(name) => {
            let (name, ask) = (name.clone(), passkeys.asker(plan.ask_passkey.clone()));
            thread("wearable", move || wearable::run(&port, name, &ask))
        }
        LinkChoice::Serial(name) => {
            let name = name.clone();
            thread("wearable", move || serial::run(&port, &name))
        }
        LinkChoice::Myo => {
            let boot_id = setup::random_boot_id();
            thread("armband", move || myo::run(&port, boot_id))
        }
        LinkChoice::Lsl(name) => {
            let (name, boot_id) = (name.clone(), setup::random_boot_id());
            thread("LSL stream", move || {
                lsl::run(&port, name.as_deref(), boot_id);
            })
        }
    }
}

fn thread(
    what: &'static str,
    work: impl FnOnce() + Send + 'static,
) -> Result<JoinHandle<()>, RunError> {
    let builder = std::thread::Builder::new().name(what.to_owned());
    builder
        .spawn(work)
        .map_err(|source| RunError::Thread { what, source })
}

fn unix_us() -> u64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    // A clock before 1970 tells nothing.
    since.map_or(0, |since| u64::try_from(since.as_micros()).unwrap_or(0))
}

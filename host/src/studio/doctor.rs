//! What this computer has and lacks for Tonus, and how to mend it.

use std::net::{TcpListener, TcpStream, ToSocketAddrs};
use std::path::Path;
use std::time::Duration;

use tonus_native::leapc::LeapC;

use crate::config::{Config, ConfigError};
use crate::leap::{Origin, Service};
use crate::link::ble::BleError;
use crate::link::ble::platform::SystemCentral;
use crate::live::Lamp;
use crate::studio::setup;

/// A service on this machine answers within this.
const PATIENCE: Duration = Duration::from_millis(500);
const TRACKER: &str = "hand tracker";

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Finding {
    /// What.
    pub what: &'static str,
    /// Whether it is there: bad is needed for all, warn for one use alone.
    pub lamp: Lamp,
    /// What was found.
    pub found: String,
    /// What to do, unless all is well.
    pub mend: Option<String>,
}

impl Finding {
    fn good(what: &'static str, found: impl Into<String>) -> Self {
        let (lamp, found) = (Lamp::Good, found.into());
        Self {
            what,
            lamp,
            found,
            mend: None,
        }
    }

    fn missing(
        what: &'static str,
        lamp: Lamp,
        found: impl Into<String>,
        mend: impl Into<String>,
    ) -> Self {
        Self {
            what,
            lamp,
            found: found.into(),
            mend: Some(mend.into()),
        }
    }
}

/// Looks at everything. `named` is the configuration that the command line names.
#[must_use]
pub fn examine(named: Option<&Path>) -> Vec<Finding> {
    let (finding, config) = configuration(named);
    vec![
        Finding::good("program", format!("tonus {}", env!("CARGO_PKG_VERSION"))),
        finding,
        bluetooth(),
        serial(),
        tracker(&config),
        robot(&config),
        page(&config),
        recordings(&config.recording.directory),
    ]
}

fn configuration(named: Option<&Path>) -> (Finding, Config) {
    const WHAT: &str = "configuration";
    match Config::find(named) {
        Ok((config, Some(file))) => (Finding::good(WHAT, file.display().to_string()), config),
        Ok((config, None)) => {
            let places: Vec<String> = (Config::places().iter())
                .map(|place| place.display().to_string())
                .collect();
            let found = format!(
                "none, the defaults are in use; looked for {}",
                places.join(", ")
            );
            (Finding::good(WHAT, found), config)
        }
        Err(error) => {
            let mend = match &error {
                ConfigError::Read { .. } => "check the name, or leave --config out",
                _ => "mend it; `tonus doctor --defaults` prints a whole one",
            };
            let bad = Finding::missing(WHAT, Lamp::Bad, error.to_string(), mend);
            (bad, Config::default())
        }
    }
}

fn bluetooth() -> Finding {
    const WHAT: &str = "Bluetooth LE";
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build();
    let found: Result<SystemCentral, BleError> = match runtime {
        Ok(runtime) => runtime.block_on(SystemCentral::new()),
        Err(error) => {
            return Finding::missing(WHAT, Lamp::Warn, error.to_string(), "close other programs");
        }
    };
    match found {
        Ok(_) => Finding::good(WHAT, "an adapter; `tonus scan` lists who is near by"),
        Err(error) => Finding::missing(
            WHAT,
            Lamp::Warn,
            error.to_string(),
            "needed for --link ble and --link myo alone; without it use the wired wearable (--link serial:PORT) or --link sim",
        ),
    }
}

fn serial() -> Finding {
    const WHAT: &str = "serial ports";
    match serial2::SerialPort::available_ports() {
        Ok(ports) if !ports.is_empty() => {
            let names: Vec<String> = ports
                .iter()
                .map(|port| port.display().to_string())
                .collect();
            Finding::good(WHAT, names.join(", "))
        }
        Ok(_) => Finding::missing(
            WHAT,
            Lamp::Warn,
            "none",
            "needed for --link serial:PORT alone: plug the board's debugger in; on Linux be in the group dialout",
        ),
        Err(error) => Finding::missing(
            WHAT,
            Lamp::Warn,
            error.to_string(),
            "needed for --link serial:PORT alone: on Linux be in the group dialout",
        ),
    }
}

fn tracker(config: &Config) -> Finding {
    let told = match setup::tracker(config) {
        Ok(told) => told,
        Err(error) => {
            return Finding::missing(
                TRACKER,
                Lamp::Bad,
                error.to_string(),
                "mend the configuration",
            );
        }
    };
    match told.origin {
        Origin::Service(service) => websocket(&service, &config.tracker.leap),
        Origin::LeapC(file) => match LeapC::load(file.as_deref()) {
            Ok(leapc) => Finding::good(
                TRACKER,
                format!(
                    "LeapC at {}; `tonus hand --leap leapc` shows what it sees",
                    leapc.path().display()
                ),
            ),
            Err(error) => Finding::missing(
                TRACKER,
                Lamp::Warn,
                error.to_string(),
                "needed to see a real hand: do that, or follow the service's WebSocket ([tracker] leap = \"ws://127.0.0.1:6437\")",
            ),
        },
    }
}

fn websocket(service: &Service, named: &str) -> Finding {
    let at = (service.host.as_str(), service.port);
    let answers = at.to_socket_addrs().ok().is_some_and(|mut all| {
        all.any(|address| TcpStream::connect_timeout(&address, PATIENCE).is_ok())
    });
    if answers {
        let found = format!("somebody answers at {named}; `tonus hand` shows what it sees");
        return Finding::good(TRACKER, found);
    }
    Finding::missing(
        TRACKER,
        Lamp::Warn,
        format!("nobody answers at {named}"),
        "needed to see a real hand: start the Leap service; with Gemini or later also the bridge UltraleapTrackingWebSocket, \
         or use its library ([tracker] leap = \"leapc\")",
    )
}

fn robot(config: &Config) -> Finding {
    const WHAT: &str = "robot";
    match setup::robot(config) {
        Ok(_) => Finding::good(WHAT, config.robot.to.clone()),
        Err(error) => Finding::missing(WHAT, Lamp::Bad, error.to_string(), "mend [robot] to"),
    }
}

fn page(config: &Config) -> Finding {
    const WHAT: &str = "page";
    let port = config.page.port;
    match TcpListener::bind(("127.0.0.1", port)) {
        Ok(_) => Finding::good(WHAT, format!("port {port} is free")),
        Err(error) => Finding::missing(
            WHAT,
            Lamp::Good,
            format!("port {port} is taken ({error})"),
            "nothing: a free one is used, and its address printed",
        ),
    }
}

fn recordings(directory: &Path) -> Finding {
    const WHAT: &str = "recordings";
    // It is made when it is needed; until then what is above it says whether it can be.
    let there = directory.ancestors().find(|above| above.is_dir());
    let writable = tempfile::NamedTempFile::new_in(there.unwrap_or(Path::new("."))).map(drop);
    match writable {
        Ok(()) => Finding::good(WHAT, format!("{} can be written", directory.display())),
        Err(error) => Finding::missing(
            WHAT,
            Lamp::Bad,
            format!("{}: {error}", directory.display()),
            "name another place: [recording] directory",
        ),
    }
}

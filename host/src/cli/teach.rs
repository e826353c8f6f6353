//! `tonus teach`: where the shoulder and the robot are in the tracker's frame.

use std::io::stdin;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use serde_json::json;
use tonus::config::Config;
use tonus::leap::{Leap, Update};
use tonus::studio::setup;
use tonus::transform::{Shoulder, Touched, Transform};

use super::{UsageError, say};

const EXAMPLE: &str = "Examples:
  tonus teach --shoulder
  tonus teach --point 0.40,0.00,0.20 --point 0.60,0.10,0.20 --point 0.45,-0.20,0.35

Each point is a place in the robot's base frame, in metres, that the robot's hand is driven to; touch it with the palm
when you are asked. Three points that lie apart and not on a line suffice, more are better. The result is written
into the configuration.";

/// How long the hand is looked at while it touches a point, and how long it is waited for.
const LOOK: Duration = Duration::from_secs(1);
const WAIT: Duration = Duration::from_secs(10);

/// Teach where the shoulder and the robot are in the tracker's frame, by touching.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct TeachArgs {
    /// Touch your shoulder with the other hand.
    #[arg(long)]
    shoulder: bool,
    /// A point in the robot's base frame, metres; give at least three.
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    point: Vec<[f64; 3]>,
    /// The configuration to write into [default: the one in use, or tonus.toml here].
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

fn point(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|number| number.is_finite()) => Ok([x, y, z]),
        _ => Err(format!(
            "`{text}` is no point: give three numbers, as 0.40,0.00,0.20"
        )),
    }
}

impl TeachArgs {
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        if !self.shoulder && self.point.is_empty() {
            bail!(UsageError(
                "say what to teach: --shoulder, or --point three times or more"
            ));
        }
        let named = self.config.as_deref().filter(|file| file.is_file());
        let (config, found) = Config::find(named)?;
        let file = self
            .config
            .or(found)
            .unwrap_or_else(|| PathBuf::from("tonus.toml"));
        let told = setup::tracker(&config)?;
        let mut shoulder = None;
        if self.shoulder {
            let mut told = told.clone();
            told.wanted = told.wanted.other();
            let mut leap = Leap::new(told, Instant::now());
            let seen = touch(&mut leap, "your shoulder with the other hand")?;
            shoulder = Some(Shoulder::by_touch(&seen)?);
        }
        let (mut robot, mut residual_m) = (None, None);
        if !self.point.is_empty() {
            let mut leap = Leap::new(told, Instant::now());
            let mut touched = Vec::new();
            for robot_m in self.point {
                let seen = touch(&mut leap, &format!("the robot's hand at {robot_m:?} m"))?;
                let tracker_m = middle(&seen).context("the hand was not seen")?;
                touched.push(Touched { tracker_m, robot_m });
            }
            let taught = Transform::teach(&touched)?;
            residual_m = Some(taught.residual_m);
            robot = Some(taught.transform.to_stored());
        }
        let config = config.taught(shoulder, robot);
        config.keep(&file)?;
        say(&if json {
            let tracker =
                json!({ "shoulder": config.tracker.shoulder, "robot": config.tracker.robot });
            format!(
                "{}\n",
                json!({ "file": file, "tracker": tracker, "residual_m": residual_m })
            )
        } else {
            let fits = residual_m.map_or(String::new(), |metres| {
                format!("the points fit each other to {:.1} mm\n", 1e3 * metres)
            });
            format!("{fits}written to {}\n", file.display())
        })
    }
}

/// Asks for a touch and gives the places where the palm was seen meanwhile.
fn touch(leap: &mut Leap, what: &str) -> anyhow::Result<Vec<[f64; 3]>> {
    say(&format!("touch {what}, hold still, and press Enter: "))?;
    let mut line = String::new();
    if stdin().read_line(&mut line)? == 0 {
        bail!("nobody pressed Enter: run it in a terminal");
    }
    let (mut seen, begun) = (Vec::new(), Instant::now());
    let mut first: Option<Instant> = None;
    let mut lost = None;
    while first.is_none_or(|first| first.elapsed() < LOOK) {
        if first.is_none() && begun.elapsed() > WAIT {
            let why =
                lost.unwrap_or_else(|| "no hand was seen: hold it above the tracker".to_owned());
            bail!("{why}");
        }
        match leap.receive(Duration::from_millis(100)) {
            Some(Update::Seen(sight)) => {
                first.get_or_insert_with(Instant::now);
                seen.push(sight.hand.palm_m);
            }
            Some(Update::Lost(loss)) => lost = Some(loss.to_string()),
            _ => {}
        }
    }
    Ok(seen)
}

#[allow(clippy::cast_precision_loss, reason = "a second of pictures")]
fn middle(seen: &[[f64; 3]]) -> Option<[f64; 3]> {
    let count = seen.len();
    let mean = |axis: usize| seen.iter().map(|place| place[axis]).sum::<f64>() / count as f64;
    (count > 0).then(|| [0, 1, 2].map(mean))
}

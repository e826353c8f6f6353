//! What outlives a run: skills that were learnt in it, people who were measured.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::atomic;
use crate::calibration::{Profile, ProfileError};
use crate::config::{Config, ConfigError};
use crate::library::Library;
use crate::live::Frames;

/// Larger files are nobody's, bytes.
const MAX_BYTES: u64 = 1024 * 1024;

/// Why nothing is known of a person.
#[derive(Debug, thiserror::Error)]
pub enum PersonError {
    /// No such file.
    #[error("nothing is kept of `{name}`: calibrate them first (looked for {})", file.display())]
    Nobody {
        /// Who was asked for.
        name: String,
        /// Where they were looked for.
        file: PathBuf,
    },
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file holds something else.
    #[error("{}: {source}", file.display())]
    Content {
        /// The file.
        file: PathBuf,
        /// Why it is none.
        source: ProfileError,
    },
}

/// Writes what is to outlive the run, from whatever thread it comes.
#[derive(Debug, Clone, Default)]
pub struct Keeper {
    skills: Option<PathBuf>,
    people: Option<PathBuf>,
    /// Of all whose files are there.
    names: Arc<Mutex<Vec<String>>>,
    problem: Arc<Mutex<Option<String>>>,
    /// The configuration's file.
    frames: Option<PathBuf>,
    kept_frames: Arc<Mutex<Option<String>>>,
}

impl Keeper {
    /// Keeps skills in the model file `skills`, and people in files of their own in the directory `people`, if any.
    #[must_use]
    pub fn new(skills: Option<PathBuf>, people: Option<PathBuf>) -> Self {
        let names = people.as_deref().map(names).unwrap_or_default();
        Self {
            skills,
            people,
            names: Arc::new(Mutex::new(names)),
            problem: Arc::default(),
            frames: None,
            kept_frames: Arc::default(),
        }
    }

    /// Keeps also what is taught by touching, in this configuration's file; none in a simulation, whose frames are no real
    /// ones.
    #[must_use]
    pub fn with_frames(self, frames: Option<PathBuf>) -> Self {
        Self { frames, ..self }
    }

    /// Shoulder or robot were taught. They are used also where they cannot be kept.
    pub fn frames(&self, frames: &Frames) {
        let kept = match &self.frames {
            None => "in use until the program ends: a simulation's are not kept".to_owned(),
            Some(file) => match keep_frames(file, frames) {
                Ok(()) => format!("in use, and kept in {}", file.display()),
                Err(error) => format!("in use until the program ends, and not kept: {error}"),
            },
        };
        *locked(&self.kept_frames) = Some(kept);
    }

    /// What became of what was taught last, for people.
    #[must_use]
    pub fn kept_frames(&self) -> Option<String> {
        locked(&self.kept_frames).clone()
    }

    /// Skills were learnt. They are followed also where they cannot be kept.
    pub fn skills(&self, library: &Library) {
        let Some(file) = &self.skills else { return };
        let outcome = library.save(file);
        self.note(
            outcome
                .err()
                .map(|error| format!("the skills are not kept: {error}")),
        );
    }

    /// A person was measured.
    pub fn person(&self, profile: &Profile) {
        let Some(people) = &self.people else { return };
        let file = file(people, &profile.person.name);
        let written = atomic::private_folder(people)
            .and_then(|()| atomic::write_private(&file, profile.text().as_bytes()));
        let problem = |error| format!("the calibration is not kept: {}: {error}", file.display());
        self.note(written.err().map(problem));
        *locked(&self.names) = names(people);
    }

    /// Of all who can be recalled, sorted.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        locked(&self.names).clone()
    }

    /// What is kept of a person; none where people are not kept at all.
    ///
    /// # Errors
    /// [`PersonError`].
    pub fn recall(&self, name: &str) -> Result<Profile, PersonError> {
        read(self.people.as_deref().unwrap_or(Path::new("people")), name)
    }

    fn note(&self, problem: Option<String>) {
        *locked(&self.problem) = problem;
    }

    /// What could not be kept last, for people.
    #[must_use]
    pub fn problem(&self) -> Option<String> {
        locked(&self.problem).clone()
    }
}

/// Writes what was taught into the file as it is now: what the command line put in its place for this run stays out of it.
fn keep_frames(file: &Path, frames: &Frames) -> Result<(), ConfigError> {
    let config = if file.is_file() {
        Config::read(file)?
    } else {
        Config::default()
    };
    let robot = frames.robot.map(|transform| transform.to_stored());
    config.taught(frames.shoulder, robot).keep(file)
}

/// What is behind it is whole at every moment, whoever panicked.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Names of all who are kept in this directory, sorted; none where there is none.
fn names(people: &Path) -> Vec<String> {
    let files = std::fs::read_dir(people).into_iter().flatten().flatten();
    let texts = files.filter_map(|file| read_file(&file.path()).ok());
    let mut names: Vec<String> = texts.map(|profile| profile.person.name).collect();
    names.sort();
    names
}

/// A file's name for a person's: what no file system minds stays, other bytes are written as `%` and two digits.
fn file(people: &Path, name: &str) -> PathBuf {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_';
    let text: String = (name.bytes())
        .map(|byte| {
            if plain(byte) {
                char::from(byte).to_string()
            } else {
                format!("%{byte:02x}")
            }
        })
        .collect();
    people.join(text + ".json")
}

/// What is kept of a person in this directory.
///
/// # Errors
/// [`PersonError`].
pub fn read(people: &Path, name: &str) -> Result<Profile, PersonError> {
    let file = file(people, name);
    match read_file(&file) {
        Err(PersonError::Read { source, file })
            if source.kind() == std::io::ErrorKind::NotFound =>
        {
            let name = name.to_owned();
            Err(PersonError::Nobody { name, file })
        }
        other => other,
    }
}

fn read_file(file: &Path) -> Result<Profile, PersonError> {
    let mut text = String::new();
    // One that is cut here is refused as it is read.
    let read = File::open(file).and_then(|file| file.take(MAX_BYTES).read_to_string(&mut text));
    read.map_err(|source| PersonError::Read {
        file: file.to_owned(),
        source,
    })?;
    Profile::parse(&text).map_err(|source| PersonError::Content {
        file: file.to_owned(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transform::{Shoulder, Transform};

    #[test]
    fn what_is_taught_goes_into_the_file_as_it_is_now() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("tonus.toml");
        let shoulder = Shoulder {
            centre_m: [0.2, 0.4, 0.4],
            turned_left_rad: 0.0,
        };
        let frames = |shoulder, robot| Frames { shoulder, robot };
        let keeper = Keeper::default().with_frames(Some(file.clone()));
        assert_eq!(keeper.kept_frames(), None);
        keeper.frames(&frames(Some(shoulder), None));
        // Somebody writes into it meanwhile.
        let mut config = Config::read(&file).unwrap();
        config.robot.to = "udp:10.0.0.2:5005".to_owned();
        config.keep(&file).unwrap();
        keeper.frames(&frames(None, Some(Transform::identity())));
        assert!(keeper.kept_frames().unwrap().contains("tonus.toml"));
        let kept = Config::read(&file).unwrap();
        assert_eq!(kept.robot.to, "udp:10.0.0.2:5005");
        assert_eq!(kept.tracker.shoulder, Some(shoulder));
        let robot = kept.tracker.robot.unwrap();
        assert_eq!(robot.rotation_xyzw, [0.0, 0.0, 0.0, 1.0]);
        // A file that cannot be read is left as it is.
        std::fs::write(&file, "[robot").unwrap();
        keeper.frames(&frames(Some(shoulder), None));
        assert!(keeper.kept_frames().unwrap().contains("not kept"));
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "[robot");
    }

    #[test]
    fn a_simulations_frames_stay_out_of_the_configuration() {
        let keeper = Keeper::default();
        keeper.frames(&Frames::default());
        assert!(keeper.kept_frames().unwrap().contains("are not kept"));
    }
}

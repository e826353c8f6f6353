//! What outlives a run: skills that were learnt in it, people who were measured.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::atomic;
use crate::calibration::{Profile, ProfileError};
use crate::library::Library;

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
        }
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
        let written = std::fs::create_dir_all(people)
            .and_then(|()| atomic::write(&file, profile.text().as_bytes()));
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

//! The one reader of the standard input: a line goes to whoever asked a question, otherwise it is Enter.

use std::io::{BufRead, BufReader, stdin};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::terminal::Pressed;

/// Where lines come from.
type Source = Box<dyn BufRead + Send>;

/// Lines as a person types them; clones are the same keyboard. Nothing is read before somebody wants it.
#[derive(Clone)]
pub struct Keyboard {
    shared: Arc<Mutex<Listeners>>,
}

struct Listeners {
    /// Taken by the thread that reads.
    source: Option<Source>,
    question: Option<Sender<String>>,
    presses: Option<Sender<Pressed>>,
    /// Whether there will be no more lines.
    over: bool,
}

impl Default for Keyboard {
    /// The standard input.
    fn default() -> Self {
        Self::of(BufReader::new(stdin()))
    }
}

impl Keyboard {
    /// Lines of something else.
    #[must_use]
    pub fn of(lines: impl BufRead + Send + 'static) -> Self {
        let listeners = Listeners {
            source: Some(Box::new(lines)),
            question: None,
            presses: None,
            over: false,
        };
        Self {
            shared: Arc::new(Mutex::new(listeners)),
        }
    }

    /// The next line, without its end, is an answer; none where none comes within `limit`, and the lines after that are no
    /// answer any more. A second question takes the place of the first.
    #[must_use]
    pub fn ask(&self, limit: Duration) -> Option<String> {
        let (sender, answer) = channel();
        let mut listeners = self.lock();
        if listeners.over {
            return None;
        }
        listeners.question = Some(sender);
        self.read(&mut listeners);
        drop(listeners);
        match answer.recv_timeout(limit) {
            Ok(line) => Some(line),
            Err(RecvTimeoutError::Disconnected) => None,
            Err(RecvTimeoutError::Timeout) => {
                self.lock().question = None;
                // It may have come in between.
                answer.try_recv().ok()
            }
        }
    }

    /// Every line that answers no question, from now on; the receiver is disconnected when there will be no more.
    #[must_use]
    pub fn presses(&self) -> Receiver<Pressed> {
        let (sender, presses) = channel();
        let mut listeners = self.lock();
        if !listeners.over {
            listeners.presses = Some(sender);
            self.read(&mut listeners);
        }
        presses
    }

    /// Starts to read, once.
    fn read(&self, listeners: &mut Listeners) {
        let Some(mut source) = listeners.source.take() else {
            return;
        };
        let keyboard = self.clone();
        let read = move || {
            let mut line = String::new();
            while source.read_line(&mut line).is_ok_and(|bytes| bytes > 0) {
                keyboard.lock().line(line.trim_end_matches(['\r', '\n']));
                line.clear();
            }
            keyboard.lock().end();
        };
        let started = std::thread::Builder::new()
            .name("keyboard".to_owned())
            .spawn(read);
        if started.is_err() {
            listeners.end();
        }
    }

    /// Every field is replaced in one step, so a thread that panicked left it whole.
    fn lock(&self) -> MutexGuard<'_, Listeners> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listeners {
    fn line(&mut self, line: &str) {
        if let Some(question) = self.question.take()
            && question.send(line.to_owned()).is_ok()
        {
            return;
        }
        // Nobody waits for Enter where this fails.
        let gone = |presses: &Sender<Pressed>| presses.send(line.into()).is_err();
        if self.presses.as_ref().is_some_and(gone) {
            self.presses = None;
        }
    }

    fn end(&mut self) {
        self.over = true;
        self.question = None;
        self.presses = None;
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::sync::mpsc::TryRecvError;
    use std::time::Instant;

    use super::*;

    const SOON: Duration = Duration::from_secs(10);

    fn asked(keyboard: &Keyboard) {
        let began = Instant::now();
        while keyboard.lock().question.is_none() {
            assert!(began.elapsed() < SOON, "nobody asks");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_question_takes_the_next_line_and_enter_the_others() {
        let (lines, mut person) = std::io::pipe().unwrap();
        let keyboard = Keyboard::of(BufReader::new(lines));
        let presses = keyboard.presses();
        person.write_all(b"\n").unwrap();
        assert_eq!(presses.recv_timeout(SOON), Ok(Pressed::Enter));
        let asking = keyboard.clone();
        let answer = std::thread::spawn(move || asking.ask(SOON));
        asked(&keyboard);
        person.write_all(b"012345\r\nb\n").unwrap();
        assert_eq!(answer.join().unwrap().as_deref(), Some("012345"));
        assert_eq!(presses.recv_timeout(SOON), Ok(Pressed::Back));
        // A question that was given up takes nothing.
        assert_eq!(keyboard.ask(Duration::from_millis(5)), None);
        person.write_all(b"\n").unwrap();
        assert_eq!(presses.recv_timeout(SOON), Ok(Pressed::Enter));
        drop(person);
        assert_eq!(keyboard.ask(SOON), None);
        assert!(presses.recv_timeout(SOON).is_err());
        assert_eq!(
            keyboard.presses().try_recv(),
            Err(TryRecvError::Disconnected)
        );
    }
}

use std::sync::mpsc::{Sender, channel};

use super::*;

/// Nobody sits at the terminal.
fn nobody() -> AskPasskey {
    Arc::new(|_| None)
}

/// Somebody sits there and types whatever is sent.
fn somebody() -> (AskPasskey, Sender<Option<u32>>) {
    let (types, lines) = channel();
    let lines = Mutex::new(lines);
    (
        Arc::new(move |_| lines.lock().unwrap().recv().unwrap()),
        types,
    )
}

fn until_wanted(passkeys: &Passkeys) -> Wanted {
    let start = Instant::now();
    loop {
        if let Some(wanted) = passkeys.wanted() {
            return wanted;
        }
        assert!(start.elapsed() < Duration::from_secs(10), "nobody asks");
        std::thread::yield_now();
    }
}

#[test]
fn six_digits_are_a_passkey_and_nothing_else_is() {
    assert_eq!(passkey("048213"), Ok(48_213));
    assert_eq!(passkey(" 999999\n"), Ok(999_999));
    assert_eq!(passkey("000000"), Ok(0));
    for (typed, got) in [
        ("", 0),
        ("48213", 5),
        ("0482130", 7),
        ("+48213", 6),
        ("48 213", 6),
        ("٤٨٢١٣٠", 6),
    ] {
        assert_eq!(passkey(typed), Err(NotTaken::Digits { got }), "{typed}");
    }
    let told = passkey("48213").unwrap_err().to_string();
    assert!(
        told.contains("6 digits") && told.contains("5 characters"),
        "{told}"
    );
    assert!(!told.contains("48213"), "what was typed is not told again");
}

#[test]
fn of_two_windows_the_first_counts() {
    let passkeys = Passkeys::new(true);
    assert_eq!(passkeys.give(1), Err(NotTaken::NotWanted));
    std::thread::scope(|scope| {
        let asked = scope.spawn(|| passkeys.ask("Tonus 7", &nobody(), LIMIT));
        let wanted = until_wanted(&passkeys);
        assert_eq!(wanted.by, "Tonus 7");
        assert!(wanted.left <= LIMIT && wanted.left > LIMIT - Duration::from_secs(10));
        assert_eq!(passkeys.give(48_213), Ok(()));
        assert_eq!(passkeys.give(99), Err(NotTaken::NotWanted));
        assert_eq!(asked.join().unwrap(), Some(48_213));
    });
    assert_eq!(passkeys.wanted(), None);
    assert_eq!(passkeys.give(99), Err(NotTaken::NotWanted));
}

#[test]
fn page_or_terminal_whoever_is_first() {
    let passkeys = Passkeys::new(true);
    let (terminal, types) = somebody();
    std::thread::scope(|scope| {
        let asked = scope.spawn(|| passkeys.ask("a", &terminal, LIMIT));
        until_wanted(&passkeys);
        types.send(Some(111_111)).unwrap();
        assert_eq!(asked.join().unwrap(), Some(111_111));
    });
    // The page is first; the line that the terminal still waits for counts for what is asked then.
    std::thread::scope(|scope| {
        let asked = scope.spawn(|| passkeys.ask("b", &terminal, LIMIT));
        until_wanted(&passkeys);
        passkeys.give(222_222).unwrap();
        assert_eq!(asked.join().unwrap(), Some(222_222));
        let asked = scope.spawn(|| passkeys.ask("c", &terminal, LIMIT));
        assert_eq!(until_wanted(&passkeys).by, "c");
        types.send(Some(333_333)).unwrap();
        assert_eq!(asked.join().unwrap(), Some(333_333));
    });
}

#[test]
fn who_gives_nothing_leaves_the_other_to_it() {
    let passkeys = Passkeys::new(true);
    let (terminal, types) = somebody();
    std::thread::scope(|scope| {
        let asked = scope.spawn(|| passkeys.ask("a", &terminal, LIMIT));
        until_wanted(&passkeys);
        // No six digits were typed there.
        types.send(None).unwrap();
        while passkeys.lock().terminal {
            std::thread::yield_now();
        }
        passkeys.give(5).unwrap();
        assert_eq!(asked.join().unwrap(), Some(5));
    });
    // Without a page the terminal alone decides, at once.
    let started = Instant::now();
    assert_eq!(Passkeys::new(false).ask("a", &nobody(), LIMIT), None);
    assert!(started.elapsed() < LIMIT / 2);
}

#[test]
fn after_the_time_nobody_is_waited_for() {
    let passkeys = Passkeys::new(true);
    let (terminal, types) = somebody();
    let started = Instant::now();
    let limit = Duration::from_millis(150);
    assert_eq!(passkeys.ask("a", &terminal, limit), None);
    assert!(started.elapsed() >= limit);
    assert_eq!(passkeys.wanted(), None);
    assert_eq!(passkeys.give(7), Err(NotTaken::NotWanted));
    // A line that comes now is for nobody, and not for the next who asks.
    types.send(Some(444_444)).unwrap();
    while passkeys.lock().terminal {
        std::thread::yield_now();
    }
    assert_eq!(passkeys.ask("b", &nobody(), limit), None);
}

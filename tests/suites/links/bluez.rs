//! Pairing through BlueZ, whose part is played on a bus of our own: it says what `bluetoothd` says, by its documents
//! (`doc/org.bluez.Agent.rst`, `org.bluez.Device.rst`).

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use dbus::Message;
use dbus::arg::messageitem::MessageItem;
use dbus::channel::Channel;
use dbus::strings::Path;
use tonus::link::ble::agent::{Device, pair_on};
use tonus::link::ble::{AskPasskey, BleError, Passkeys, passkey};

const DEVICE: &str = "/org/bluez/hci0/dev_C7_0A_70_5E_00_01";
const PASSKEY: u32 = 48_213;

/// A bus, and who plays BlueZ on it.
struct Bus {
    daemon: Child,
    address: String,
    done: Arc<AtomicBool>,
    bluez: Option<JoinHandle<()>>,
}

/// How the device behaves.
#[derive(Clone, Copy, PartialEq)]
enum Behaviour {
    /// It shows a passkey.
    Shows,
    /// It was paired before.
    Paired,
    /// It refuses before anything is shown.
    Refuses,
    /// It would pair without a passkey.
    JustWorks,
}

impl Bus {
    fn with(behaviour: Behaviour) -> Self {
        let mut daemon = Command::new("dbus-daemon")
            .args(["--session", "--nofork", "--print-address"])
            .stdout(Stdio::piped())
            .spawn()
            .expect("dbus-daemon is needed: apt-get install dbus-daemon");
        let mut address = String::new();
        BufReader::new(daemon.stdout.take().unwrap())
            .read_line(&mut address)
            .unwrap();
        let address = address.trim().to_owned();
        let done = Arc::new(AtomicBool::new(false));
        let bus = open(&address);
        let named = Message::call_with_args(
            "org.freedesktop.DBus",
            "/",
            "org.freedesktop.DBus",
            "RequestName",
            ("org.bluez", 0_u32),
        );
        bus.send_with_reply_and_block(named, Duration::from_secs(5))
            .unwrap();
        let ended = Arc::clone(&done);
        let bluez = std::thread::spawn(move || play(&bus, behaviour, &ended));
        Self {
            daemon,
            address,
            done,
            bluez: Some(bluez),
        }
    }

    fn pair(&self, typed: Option<u32>) -> Result<(), BleError> {
        let device = Device {
            path: DEVICE.to_owned(),
            name: "Tonus".to_owned(),
        };
        let ask: AskPasskey = Arc::new(move |name| {
            assert_eq!(name, "Tonus");
            typed
        });
        pair_on(&self.address, &device, &ask)
    }
}

impl Drop for Bus {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Relaxed);
        let played = self.bluez.take().map(JoinHandle::join);
        self.daemon.kill().unwrap();
        self.daemon.wait().unwrap();
        if !std::thread::panicking() {
            played.unwrap().unwrap();
        }
    }
}

fn open(address: &str) -> Channel {
    let mut bus = Channel::open_private(address).unwrap();
    bus.register().unwrap();
    bus
}

/// Answers one client until it is told to end.
fn play(bus: &Channel, behaviour: Behaviour, done: &AtomicBool) {
    let mut agent: Option<Path<'static>> = None;
    let mut pairing: Option<(Message, u32)> = None;
    while !done.load(Ordering::Relaxed) {
        bus.read_write(Some(Duration::from_millis(20))).unwrap();
        while let Some(mut message) = bus.pop_message() {
            if let Some((pair, serial)) = &pairing
                && message.get_reply_serial() == Some(*serial)
            {
                bus.send(outcome(pair, &mut message)).unwrap();
                pairing = None;
                continue;
            }
            let member = message.member().map(|member| member.to_string());
            match member.as_deref() {
                Some("RegisterAgent") => {
                    let (path, capability): (Path<'static>, String) = message.read2().unwrap();
                    assert_eq!(capability, "KeyboardOnly");
                    agent = Some(path);
                    bus.send(message.method_return()).unwrap();
                }
                Some("Pair") => {
                    assert_eq!(message.path().unwrap().to_string(), DEVICE);
                    let error = |name: &str| message.error(&name.into(), c"as it is told");
                    let ask = match behaviour {
                        Behaviour::Paired => {
                            bus.send(error("org.bluez.Error.AlreadyExists")).unwrap();
                            continue;
                        }
                        Behaviour::Refuses => {
                            bus.send(error("org.bluez.Error.AuthenticationFailed"))
                                .unwrap();
                            continue;
                        }
                        Behaviour::Shows => "RequestPasskey",
                        Behaviour::JustWorks => "RequestAuthorization",
                    };
                    let client = message.sender().unwrap();
                    let agent = agent.clone().expect("an agent is registered before");
                    let ask = Message::call_with_args(
                        client,
                        agent,
                        "org.bluez.Agent1",
                        ask,
                        (Path::from(DEVICE),),
                    );
                    let serial = bus.send(ask).unwrap();
                    pairing = Some((message, serial));
                }
                _ => {}
            }
        }
    }
}

/// What BlueZ makes of the agent's answer.
fn outcome(pair: &Message, answer: &mut Message) -> Message {
    match answer.as_result() {
        Ok(answer) if answer.get_items() == [MessageItem::UInt32(PASSKEY)] => pair.method_return(),
        Ok(_) => pair.error(&"org.bluez.Error.AuthenticationFailed".into(), c"wrong"),
        Err(error) => {
            let name = error
                .name()
                .unwrap()
                .replace("Canceled", "AuthenticationCanceled");
            pair.error(&name.as_str().into(), c"not answered")
        }
    }
}

#[test]
fn the_digits_that_a_person_types_are_what_bluez_gets() {
    let bus = Bus::with(Behaviour::Shows);
    assert_eq!(bus.pair(Some(PASSKEY)), Ok(()));
    assert_eq!(bus.pair(Some(PASSKEY + 1)), Err(BleError::WrongPasskey));
    assert_eq!(bus.pair(None), Err(BleError::NoPasskey));
    assert_eq!(bus.pair(Some(PASSKEY)), Ok(()), "and again");
}

#[test]
fn the_page_gives_the_digits_where_nobody_sits_at_the_terminal() {
    let bus = Bus::with(Behaviour::Shows);
    let device = Device {
        path: DEVICE.to_owned(),
        name: "Tonus".to_owned(),
    };
    let passkeys = Passkeys::new(true);
    let ask = passkeys.asker(Arc::new(|_| None));
    let (typed, from) = (format!("{PASSKEY:06}"), passkeys.clone());
    let page = std::thread::spawn(move || {
        while from.wanted().is_none_or(|wanted| wanted.by != "Tonus") {
            std::thread::sleep(Duration::from_millis(5));
        }
        from.give(passkey(&typed).unwrap())
    });
    assert_eq!(pair_on(&bus.address, &device, &ask), Ok(()));
    assert_eq!(page.join().unwrap(), Ok(()));
    assert_eq!(passkeys.wanted(), None);
}

#[test]
fn who_was_paired_before_is_paired() {
    let bus = Bus::with(Behaviour::Paired);
    assert_eq!(bus.pair(None), Ok(()));
}

#[test]
fn a_pairing_without_a_passkey_is_none() {
    for behaviour in [Behaviour::Refuses, Behaviour::JustWorks] {
        let error = Bus::with(behaviour).pair(Some(PASSKEY)).unwrap_err();
        assert!(matches!(error, BleError::PairingRefused { .. }), "{error}");
        assert!(
            error.to_string().contains("press its pairing button"),
            "{error}"
        );
    }
}

#[test]
fn without_a_bus_there_is_an_error() {
    let device = Device {
        path: DEVICE.to_owned(),
        name: String::new(),
    };
    let ask: AskPasskey = Arc::new(|_| panic!("nobody is asked"));
    let error = pair_on("unix:path=/nonexistent", &device, &ask).unwrap_err();
    assert!(matches!(error, BleError::System { .. }), "{error}");
}

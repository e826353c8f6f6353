//! Pairing through BlueZ: asks it to pair and answers when it asks for the passkey.
//!
//! BlueZ asks the agent of whoever calls `Device1.Pair`, so both go over one connection to the bus, which exists for
//! one pairing only. Interfaces: BlueZ `doc/org.bluez.Agent.rst`, `org.bluez.AgentManager.rst`, `org.bluez.Device.rst`.

use std::time::{Duration, Instant};

use dbus::channel::{BusType, Channel, default_reply};
use dbus::message::MessageType;
use dbus::{Message, Path};

use super::{AskPasskey, BleError};

/// Where this program's agent stands on its own connection.
const AGENT: &str = "/org/tonus/agent";
/// What the agent can do: type digits that the other side shows.
const CAPABILITY: &str = "KeyboardOnly";
const BLUEZ: &str = "org.bluez";
/// As long as the wearable's pairing window: a person reads and types.
const LIMIT: Duration = Duration::from_secs(60);
/// How long the bus and BlueZ may take for anything else.
const PATIENCE: Duration = Duration::from_secs(5);

/// The device to pair with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// BlueZ's object.
    pub path: String,
    /// For people.
    pub name: String,
}

/// Pairs with a device that is connected; fine if it was paired before. Blocks for up to a minute.
///
/// # Errors
/// [`BleError::PairingRefused`], [`BleError::NoPasskey`], [`BleError::WrongPasskey`], [`BleError::LinkLost`] or
/// [`BleError::System`].
pub fn pair(device: &Device, ask: &AskPasskey) -> Result<(), BleError> {
    let bus = Channel::get_private(BusType::System);
    over(bus.map_err(|error| system(&error))?, device, ask)
}

/// [`pair`] on another bus than the system's.
///
/// # Errors
/// As [`pair`].
pub fn pair_on(bus: &str, device: &Device, ask: &AskPasskey) -> Result<(), BleError> {
    let opened = Channel::open_private(bus).and_then(|mut channel| {
        channel.register()?;
        Ok(channel)
    });
    over(opened.map_err(|error| system(&error))?, device, ask)
}

fn over(bus: Channel, device: &Device, ask: &AskPasskey) -> Result<(), BleError> {
    let agent = Path::from(AGENT);
    let register =
        call("/org/bluez", "org.bluez.AgentManager1", "RegisterAgent")?.append2(agent, CAPABILITY);
    let registered = bus.send_with_reply_and_block(register, PATIENCE);
    registered.map_err(|error| system(&error))?;
    let pairing = call(&device.path, "org.bluez.Device1", "Pair")?;
    let serial = bus.send(pairing).map_err(|()| lost_bus())?;
    let mut asked = Asked::default();
    let until = Instant::now() + LIMIT;
    while Instant::now() < until {
        bus.read_write(Some(Duration::from_millis(100)))
            .map_err(|()| lost_bus())?;
        while let Some(message) = bus.pop_message() {
            if message.get_reply_serial() == Some(serial) {
                return ended(message, asked);
            }
            let answer =
                answer(&message, device, ask, &mut asked).or_else(|| default_reply(&message));
            if let Some(answer) = answer {
                bus.send(answer).map_err(|()| lost_bus())?;
            }
        }
    }
    Err(BleError::PairingRefused {
        reason: format!("nothing within {} s", LIMIT.as_secs()),
    })
}

/// What the agent was asked for so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Asked {
    passkey: bool,
    answered: bool,
}

/// The answer to one call of BlueZ; none for what is none of the agent's.
fn answer(
    message: &Message,
    device: &Device,
    ask: &AskPasskey,
    asked: &mut Asked,
) -> Option<Message> {
    let ours = message.msg_type() == MessageType::MethodCall
        && message.path().is_some_and(|path| &*path == AGENT);
    if !ours {
        return None;
    }
    let member = message.member()?;
    Some(match &*member {
        "RequestPasskey" => {
            asked.passkey = true;
            match ask(&device.name) {
                Some(passkey) => {
                    asked.answered = true;
                    message.method_return().append1(passkey)
                }
                None => refusal(message, "org.bluez.Error.Canceled"),
            }
        }
        "Release" | "Cancel" => message.method_return(),
        // Whatever needs no passkey proves nothing.
        _ => refusal(message, "org.bluez.Error.Rejected"),
    })
}

fn refusal(message: &Message, name: &'static str) -> Message {
    message.error(&name.into(), c"a passkey that a person types, or nothing")
}

/// What the end of `Device1.Pair` means.
fn ended(mut message: Message, asked: Asked) -> Result<(), BleError> {
    let Err(error) = message.as_result() else {
        return Ok(());
    };
    let name = error.name().unwrap_or_default();
    match name.strip_prefix("org.bluez.Error.").unwrap_or(name) {
        "AlreadyExists" => Ok(()),
        _ if asked.answered => Err(BleError::WrongPasskey),
        _ if asked.passkey => Err(BleError::NoPasskey),
        "NotConnected" | "ConnectionAttemptFailed" => Err(BleError::LinkLost),
        _ => Err(BleError::PairingRefused {
            reason: error.to_string(),
        }),
    }
}

fn call(path: &str, interface: &str, member: &str) -> Result<Message, BleError> {
    Message::new_method_call(BLUEZ, path, interface, member).map_err(|reason| BleError::System {
        doing: "pairing",
        reason,
    })
}

fn system(error: &dbus::Error) -> BleError {
    BleError::System {
        doing: "pairing",
        reason: error.to_string(),
    }
}

fn lost_bus() -> BleError {
    BleError::System {
        doing: "pairing",
        reason: "the bus is gone".to_owned(),
    }
}

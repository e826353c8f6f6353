//! The system's Bluetooth, by `btleplug`: BlueZ on Linux, and what macOS and Windows have.
//!
//! **Unproven on a radio.** On Linux pairing goes through an agent of our own; the other systems pair by themselves,
//! in a window of theirs, as soon as something protected is asked for.

use std::collections::HashMap;
use std::pin::Pin;
use std::time::{Duration, Instant};

use btleplug::api::{
    Central as _, CentralEvent, CentralState, Characteristic, Manager as _, Peripheral as _,
    ScanFilter, ValueNotification, WriteType,
};
use btleplug::platform::{Adapter, Manager, Peripheral, PeripheralId};
use futures_util::{Stream, StreamExt};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::task::JoinHandle;

use super::{AskPasskey, BleError, Central, Found, Notified, Parameters};

/// Notifications that wait: two seconds of everything. A fuller queue drops the newest, and the engine counts it lost.
const WAITING: usize = 512;
/// How often to look who has been heard of.
const LOOK: Duration = Duration::from_millis(200);

/// The first Bluetooth adapter of this computer.
#[derive(Debug)]
pub struct SystemCentral {
    adapter: Adapter,
    heard: HashMap<String, Peripheral>,
    link: Option<Link>,
}

#[derive(Debug)]
struct Link {
    peripheral: Peripheral,
    #[cfg_attr(
        not(target_os = "linux"),
        expect(dead_code, reason = "the system asks itself")
    )]
    name: String,
    characteristics: HashMap<u128, Characteristic>,
    arriving: Receiver<Notified>,
    draining: JoinHandle<()>,
}

impl SystemCentral {
    /// Finds the adapter.
    ///
    /// # Errors
    /// [`BleError::NoAdapter`], which says what to do.
    pub async fn new() -> Result<Self, BleError> {
        let none = |reason: String| BleError::NoAdapter { reason };
        let manager = Manager::new().await;
        let manager = manager.map_err(|error| none(no_service(&error)))?;
        let adapters = manager.adapters().await;
        let adapters = adapters.map_err(|error| none(no_service(&error)))?;
        let adapter = adapters.into_iter().next();
        let adapter = adapter.ok_or_else(|| none("this computer has no adapter".to_owned()))?;
        if let Ok(CentralState::PoweredOff) = adapter.adapter_state().await {
            let how = if cfg!(target_os = "linux") {
                " (bluetoothctl power on; rfkill unblock bluetooth)"
            } else {
                ""
            };
            return Err(none(format!("the adapter is switched off{how}")));
        }
        Ok(Self {
            adapter,
            heard: HashMap::new(),
            link: None,
        })
    }

    /// Who has been heard of by now.
    async fn look(&mut self) -> Result<Vec<Found>, BleError> {
        let peripherals = self.adapter.peripherals().await;
        let mut found = Vec::new();
        for peripheral in peripherals.map_err(|error| failed("scanning", &error))? {
            let Ok(Some(properties)) = peripheral.properties().await else {
                continue;
            };
            // BlueZ also tells of those that it remembers.
            let connected = peripheral.is_connected().await.unwrap_or(false);
            if cfg!(target_os = "linux") && properties.rssi.is_none() && !connected {
                continue;
            }
            let id = address(&peripheral);
            found.push(Found {
                id: id.clone(),
                name: properties.local_name,
                services: properties.services.iter().map(|id| id.as_u128()).collect(),
                rssi_dbm: properties.rssi,
            });
            self.heard.insert(id, peripheral);
        }
        Ok(found)
    }

    fn link(&self) -> Result<&Link, BleError> {
        self.link.as_ref().ok_or(BleError::LinkLost)
    }
}

/// The address, or what the system gives instead of one (macOS).
fn address(peripheral: &Peripheral) -> String {
    if cfg!(target_vendor = "apple") {
        peripheral.id().to_string()
    } else {
        peripheral.address().to_string()
    }
}

fn no_service(error: &btleplug::Error) -> String {
    if cfg!(target_os = "linux") {
        format!(
            "the system's Bluetooth service does not answer ({error}): install BlueZ and start it (apt-get install bluez; systemctl start bluetooth)"
        )
    } else {
        format!("{error}: allow this program to use Bluetooth in the system's settings")
    }
}

fn failed(doing: &'static str, error: &btleplug::Error) -> BleError {
    BleError::System {
        doing,
        reason: error.to_string(),
    }
}

impl Link {
    fn characteristic(&self, characteristic: u128) -> Result<&Characteristic, BleError> {
        let found = self.characteristics.get(&characteristic);
        found.ok_or(BleError::Missing { characteristic })
    }

    /// What became of a request that failed.
    async fn judge(&self, doing: &'static str, error: &btleplug::Error) -> BleError {
        if !self.peripheral.is_connected().await.unwrap_or(false) {
            return BleError::LinkLost;
        }
        let reason = error.to_string();
        // As BlueZ, macOS and Windows call the attribute errors 0x05, 0x08 and 0x0f.
        let protected = [
            "NotPermitted",
            "NotAuthorized",
            "uthentic",
            "ncryption",
            "AccessDenied",
        ];
        if protected.iter().any(|word| reason.contains(word)) {
            return BleError::NotAllowed {
                id: address(&self.peripheral),
            };
        }
        BleError::System { doing, reason }
    }
}

/// What the system tells of its own accord.
type Notifications = Pin<Box<dyn Stream<Item = ValueNotification> + Send>>;
type Events = Pin<Box<dyn Stream<Item = CentralEvent> + Send>>;

/// Takes notifications off the system as they come, until the link to `whom` ends.
async fn drain(
    mut notified: Notifications,
    mut events: Events,
    whom: PeripheralId,
    to: Sender<Notified>,
) {
    loop {
        tokio::select! {
            value = notified.next() => {
                let Some(value) = value else { return };
                let notified = Notified {
                    characteristic: value.uuid.as_u128(),
                    value: value.value,
                };
                // A full queue is a host that does not keep up: the engine counts what is missing.
                if to.try_send(notified).is_err() && to.is_closed() {
                    return;
                }
            }
            event = events.next() => match event {
                Some(CentralEvent::DeviceDisconnected(id)) if id == whom => return,
                Some(_) => {}
                None => return,
            },
        }
    }
}

impl Central for SystemCentral {
    async fn scan(
        &mut self,
        limit: Duration,
        enough: &dyn Fn(&Found) -> bool,
    ) -> Result<Vec<Found>, BleError> {
        let started = self.adapter.start_scan(ScanFilter::default()).await;
        started.map_err(|error| failed("scanning", &error))?;
        let until = Instant::now() + limit;
        let found = loop {
            tokio::time::sleep(LOOK).await;
            let found = self.look().await;
            let done = found
                .as_ref()
                .map_or(true, |found| found.iter().any(enough));
            if done || Instant::now() >= until {
                break found;
            }
        };
        // It ends with the program at the latest.
        let _stopped = self.adapter.stop_scan().await;
        found
    }

    async fn connect(&mut self, found: &Found) -> Result<(), BleError> {
        self.leave().await;
        let name = found.title();
        let no_link = |reason: String| BleError::NoLink {
            name: found.title(),
            reason,
        };
        let peripheral = self.heard.get(&found.id).cloned();
        let peripheral = peripheral.ok_or_else(|| no_link("it was not heard of".to_owned()))?;
        let connected = peripheral.connect().await;
        connected.map_err(|error| no_link(error.to_string()))?;
        let discovered = peripheral.discover_services().await;
        discovered.map_err(|error| no_link(error.to_string()))?;
        // Before anything is subscribed to, so that nothing is missed.
        let notified = peripheral.notifications().await;
        let notified = notified.map_err(|error| failed("listening", &error))?;
        let events = self.adapter.events().await;
        let events = events.map_err(|error| failed("listening", &error))?;
        let characteristics = peripheral.characteristics().into_iter();
        let (to, arriving) = channel(WAITING);
        self.link = Some(Link {
            characteristics: characteristics
                .map(|characteristic| (characteristic.uuid.as_u128(), characteristic))
                .collect(),
            draining: tokio::spawn(drain(notified, events, peripheral.id(), to)),
            peripheral,
            name,
            arriving,
        });
        Ok(())
    }

    async fn parameters(&mut self) -> Result<Parameters, BleError> {
        let peripheral = &self.link()?.peripheral;
        let told = peripheral.connection_parameters().await.ok().flatten();
        Ok(Parameters {
            mtu: peripheral.mtu(),
            interval_us: told.map(|told| told.interval_us),
        })
    }

    #[cfg(target_os = "linux")]
    async fn pair(&mut self, ask: &AskPasskey) -> Result<(), BleError> {
        let link = self.link()?;
        let device = super::agent::Device {
            path: format!("/org/bluez/{}", link.peripheral.id()),
            name: link.name.clone(),
        };
        let ask = ask.clone();
        let paired = tokio::task::spawn_blocking(move || super::agent::pair(&device, &ask)).await;
        paired.unwrap_or(Err(BleError::NoPasskey))
    }

    #[cfg(not(target_os = "linux"))]
    async fn pair(&mut self, _ask: &AskPasskey) -> Result<(), BleError> {
        self.link().map(|_| ())
    }

    async fn subscribe(&mut self, characteristic: u128) -> Result<(), BleError> {
        let link = self.link()?;
        let found = link.characteristic(characteristic)?;
        match link.peripheral.subscribe(found).await {
            Ok(()) => Ok(()),
            Err(error) => Err(link.judge("subscribing", &error).await),
        }
    }

    async fn write(
        &mut self,
        characteristic: u128,
        value: &[u8],
        confirmed: bool,
    ) -> Result<(), BleError> {
        let link = self.link()?;
        let found = link.characteristic(characteristic)?;
        let how = if confirmed {
            WriteType::WithResponse
        } else {
            WriteType::WithoutResponse
        };
        match link.peripheral.write(found, value, how).await {
            Ok(()) => Ok(()),
            Err(error) => Err(link.judge("writing", &error).await),
        }
    }

    async fn notified(&mut self) -> Result<Notified, BleError> {
        let link = self.link.as_mut().ok_or(BleError::LinkLost)?;
        link.arriving.recv().await.ok_or(BleError::LinkLost)
    }

    async fn leave(&mut self) {
        if let Some(link) = self.link.take() {
            link.draining.abort();
            // A link that is gone already cannot be ended.
            let _ended = link.peripheral.disconnect().await;
        }
    }
}

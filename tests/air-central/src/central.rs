//! The host's idea of a Bluetooth central, over trouble: a handle for its logic, and a driver that owns the stack.

use std::collections::BTreeMap;
use std::time::Duration;

use tokio::sync::{mpsc, oneshot};
use tonus::link::ble::{AskPasskey, BleError, Central, Found, Notified, Parameters};
use trouble_host::Address;

/// How long one look for advertisers takes.
pub(crate) const LOOK: Duration = Duration::from_millis(200);

/// What the driver is asked for. An answer that never comes is a link that ended.
pub(crate) enum Command {
    Scan(oneshot::Sender<BTreeMap<String, Found>>),
    Connect(
        Address,
        oneshot::Sender<Result<mpsc::UnboundedReceiver<Notified>, String>>,
    ),
    Parameters(oneshot::Sender<Parameters>),
    Pair(AskPasskey, oneshot::Sender<Result<(), BleError>>),
    Subscribe(u128, oneshot::Sender<Result<(), BleError>>),
    Write(u128, Vec<u8>, bool, oneshot::Sender<Result<(), BleError>>),
    Leave(oneshot::Sender<()>),
}

/// The handle.
pub(crate) struct AirCentral {
    driver: mpsc::UnboundedSender<Command>,
    arriving: Option<mpsc::UnboundedReceiver<Notified>>,
}

impl AirCentral {
    /// A handle, and what its driver takes.
    pub(crate) fn new() -> (Self, mpsc::UnboundedReceiver<Command>) {
        let (driver, commands) = mpsc::unbounded_channel();
        let new = Self {
            driver,
            arriving: None,
        };
        (new, commands)
    }

    async fn ask<T>(
        &self,
        command: impl FnOnce(oneshot::Sender<T>) -> Command,
    ) -> Result<T, BleError> {
        let (to, answer) = oneshot::channel();
        let sent = self.driver.send(command(to));
        sent.map_err(|_| BleError::LinkLost)?;
        answer.await.map_err(|_| BleError::LinkLost)
    }
}

impl Central for AirCentral {
    async fn scan(
        &mut self,
        limit: Duration,
        enough: &dyn Fn(&Found) -> bool,
    ) -> Result<Vec<Found>, BleError> {
        let until = tokio::time::Instant::now() + limit;
        loop {
            let found: Vec<_> = self.ask(Command::Scan).await?.into_values().collect();
            if found.iter().any(enough) || tokio::time::Instant::now() >= until {
                return Ok(found);
            }
        }
    }

    async fn connect(&mut self, found: &Found) -> Result<(), BleError> {
        let no_link = |reason: String| BleError::NoLink {
            name: found.title(),
            reason,
        };
        let address = crate::address(&found.id);
        let address = address.ok_or_else(|| no_link("that is no address".to_owned()))?;
        let arriving = self.ask(|to| Command::Connect(address, to)).await?;
        self.arriving = Some(arriving.map_err(no_link)?);
        Ok(())
    }

    async fn parameters(&mut self) -> Result<Parameters, BleError> {
        self.ask(Command::Parameters).await
    }

    async fn pair(&mut self, ask: &AskPasskey) -> Result<(), BleError> {
        self.ask(|to| Command::Pair(ask.clone(), to)).await?
    }

    async fn subscribe(&mut self, characteristic: u128) -> Result<(), BleError> {
        self.ask(|to| Command::Subscribe(characteristic, to))
            .await?
    }

    async fn write(
        &mut self,
        characteristic: u128,
        value: &[u8],
        confirmed: bool,
    ) -> Result<(), BleError> {
        let value = value.to_vec();
        self.ask(|to| Command::Write(characteristic, value, confirmed, to))
            .await?
    }

    async fn notified(&mut self) -> Result<Notified, BleError> {
        let arriving = self.arriving.as_mut().ok_or(BleError::LinkLost)?;
        arriving.recv().await.ok_or(BleError::LinkLost)
    }

    async fn leave(&mut self) {
        self.arriving = None;
        // Without a link there is nothing to leave.
        let _left = self.ask(Command::Leave).await;
    }
}

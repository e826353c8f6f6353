//! One host, from its connection to its leaving: pairs it, answers it, drops it.

use core::{cell::Cell, ops::ControlFlow, sync::atomic::Ordering};

use bt_hci::{
    cmd::le::{LeReadLocalSupportedFeatures, LeSetDataLength, LeSetPhy},
    controller::{ControllerCmdAsync, ControllerCmdSync},
    param::PhyKind,
};
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Instant, with_timeout};
use tonus_shared::wire::WireError;
use trouble_host::{
    BondInformation, Controller, Error, Stack,
    att::{AttClient, AttErrorCode},
    connection::{RequestedConnParams, SecurityLevel},
    gatt::{GattConnectionEvent, GattEvent, Reply, WriteEvent},
};

use super::{
    BondList, Bonds, Dropped, Link, Notice, Pool, Ports, Wish, attributes::Attributes, bonds::keep,
};
use crate::inbox::Refusal;

/// The connection interval asked for.
const INTERVAL_WANTED: Duration = Duration::from_millis(15);
/// Without a packet for this long a link is lost.
const SUPERVISION: Duration = Duration::from_millis(2000);
/// The longest air packet, and its time at one megabit per second.
const AIR_BYTES: u16 = 251;
const AIR_TIME_US: u16 = 2120;
/// How often a silent link is checked, should its `Disconnected` event have been lost.
const LIVENESS_PERIOD: Duration = Duration::from_secs(1);
/// A link that is not authenticated by then is dropped: there is only one, and it keeps others out. As long
/// as the pairing window, so that a person has time to type.
const STRANGER_LIMIT: Duration = super::OPEN;

/// A host and what it needs to be served.
pub(super) struct Host<'a, 'stack, 'server, R> {
    pub(super) link: &'a Link<'stack, 'server>,
    pub(super) attributes: &'a Attributes,
    pub(super) ports: &'a Ports<'a>,
    pub(super) report: &'a R,
}

impl<R: Fn(Notice)> Host<'_, '_, '_, R> {
    /// Whether the other side has proven a passkey or a bond made with one.
    pub(super) fn is_authenticated(&self) -> bool {
        let level = self.link.raw().security_level();
        level.is_ok_and(|level| level.authenticated())
    }

    /// Asks for what makes the link better; never returns. `phy_answers` turns false when the controller
    /// fails to answer, and then it is not asked again.
    pub(super) async fn ask<C>(&self, stack: &Stack<'_, C, Pool>, phy_answers: &Cell<bool>)
    where
        C: Controller
            + ControllerCmdAsync<LeSetPhy>
            + ControllerCmdSync<LeSetDataLength>
            + ControllerCmdSync<LeReadLocalSupportedFeatures>,
    {
        let raw = self.link.raw();
        let interval = RequestedConnParams {
            min_connection_interval: INTERVAL_WANTED,
            max_connection_interval: INTERVAL_WANTED,
            max_latency: 0,
            min_event_length: Duration::MIN,
            max_event_length: Duration::MIN,
            supervision_timeout: SUPERVISION,
        };
        if raw
            .update_connection_params(stack, &interval)
            .await
            .is_err()
        {
            (self.report)(Notice::NotGranted(Wish::Interval));
        }
        if raw
            .update_data_length(stack, AIR_BYTES, AIR_TIME_US)
            .await
            .is_err()
        {
            (self.report)(Notice::NotGranted(Wish::DataLength));
        }
        if phy_answers.get() && raw.set_phy(stack, PhyKind::Le2M).await.is_err() {
            phy_answers.set(false);
            (self.report)(Notice::NotGranted(Wish::TwoMegabits));
        }
        core::future::pending().await
    }

    /// Answers the host until it leaves or must be dropped.
    pub(super) async fn attend<C: Controller>(
        &self,
        stack: &Stack<'_, C, Pool>,
        kept: &mut BondList,
        bonds: &mut impl Bonds,
    ) {
        let raw = self.link.raw();
        let connected = Instant::now();
        let mut shown = false;
        loop {
            let now = Instant::now();
            let left = self.ports.window.left(now);
            // Outside the window the stack must not even for a moment take a stranger's key for a bond.
            if raw.set_bondable(left > Duration::MIN).is_err() {
                return;
            }
            if !self.is_authenticated() && now.saturating_duration_since(connected) > STRANGER_LIMIT
            {
                return (self.report)(Notice::Dropped(Dropped::Stranger));
            }
            let period = if left > Duration::MIN {
                left.min(LIVENESS_PERIOD)
            } else {
                LIVENESS_PERIOD
            };
            let event = with_timeout(period, self.link.next());
            let event = match select(event, self.ports.window.pressed()).await {
                Either::First(Ok(event)) => event,
                _ if raw.is_connected() => continue,
                _ => return,
            };
            let judged = match event {
                GattConnectionEvent::Disconnected { .. } => return,
                GattConnectionEvent::Gatt { event } => {
                    self.answer(event).await;
                    continue;
                }
                GattConnectionEvent::PairingComplete {
                    security_level,
                    bond,
                } => match self.paired(shown, security_level) {
                    ControlFlow::Continue(()) => {
                        shown = false;
                        self.remember(stack, kept, bonds, bond).await;
                        continue;
                    }
                    drop => drop,
                },
                event => self.judge(&event, &mut shown),
            };
            if let ControlFlow::Break(reason) = judged {
                return (self.report)(Notice::Dropped(reason));
            }
        }
    }

    /// Follows a pairing, and ends the link where it goes the wrong way. `shown` says whether this link's
    /// passkey was shown while the window was open.
    fn judge(
        &self,
        event: &GattConnectionEvent<'_, '_, Pool>,
        shown: &mut bool,
    ) -> ControlFlow<Dropped> {
        match event {
            GattConnectionEvent::PassKeyDisplay(key) => {
                *shown = self.ports.window.is_open(Instant::now());
                if !*shown {
                    return ControlFlow::Break(Dropped::WindowClosed);
                }
                (self.report)(Notice::Passkey(key.value()));
            }
            GattConnectionEvent::PairingFailed(error) => {
                *shown = false;
                (self.report)(Notice::PairingFailed(error.clone()));
            }
            // A display cannot be asked for these.
            GattConnectionEvent::PassKeyConfirm(_)
            | GattConnectionEvent::PassKeyInput
            | GattConnectionEvent::OobRequest => return ControlFlow::Break(Dropped::NoPasskey),
            GattConnectionEvent::Encrypted {
                security_level,
                bond,
            } => {
                if !security_level.authenticated() {
                    return ControlFlow::Break(Dropped::NoPasskey);
                }
                if bond.is_some() {
                    (self.report)(Notice::Resumed);
                }
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }

    /// Whether a pairing that the stack completed counts.
    fn paired(&self, shown: bool, level: SecurityLevel) -> ControlFlow<Dropped> {
        if !level.authenticated() {
            ControlFlow::Break(Dropped::NoPasskey)
        } else if shown {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(Dropped::WindowClosed)
        }
    }

    /// Closes the window behind a host that has paired, and keeps its bond.
    async fn remember<C: Controller>(
        &self,
        stack: &Stack<'_, C, Pool>,
        kept: &mut BondList,
        bonds: &mut impl Bonds,
        bond: Option<BondInformation>,
    ) {
        self.ports.window.close();
        (self.report)(Notice::Paired);
        // A host that keeps no bond pairs again next time.
        let Some(bond) = bond else { return };
        if let Some(oldest) = keep(kept, &bond) {
            // Absent at worst; the list decides what is given to the stack next time.
            let _ = stack.remove_bond_information(oldest);
        }
        if bonds.store(kept).await.is_err() {
            (self.report)(Notice::BondNotKept);
        }
    }

    /// Brings the value that a host is about to read up to date.
    fn refresh(&self, handle: u16) -> Result<(), Error> {
        if handle == self.attributes.battery.handle {
            let percent = self.ports.battery_percent.load(Ordering::Relaxed).min(100);
            self.link.set(&self.attributes.battery, &percent)?;
        } else if handle == self.attributes.calibration.handle && self.is_authenticated() {
            let frame = self.ports.calibration.get();
            self.link.set(&self.attributes.calibration, &frame)?;
        }
        Ok(())
    }

    /// Answers one request.
    async fn answer(&self, event: GattEvent<'_, '_, Pool>) {
        let reply = match event {
            GattEvent::Write(write) => match self.attributes.written(write.handle()) {
                Some(expected) => {
                    let now = Instant::now();
                    let offered =
                        write.with_data(|_, bytes| self.ports.inbox.offer(now, expected, bytes));
                    match offered {
                        Ok(()) => write.accept_unprocessed(),
                        Err(refusal) => refuse(write, &refusal),
                    }
                }
                None => write.accept(),
            },
            GattEvent::Read(read) => match self.refresh(read.handle()) {
                Ok(()) => read.accept(),
                Err(error) => Err(error),
            },
            // A command gets no answer, not even a refusal.
            GattEvent::NotAllowed(refused)
                if matches!(refused.payload().incoming(), AttClient::Command(_)) =>
            {
                drop(refused.into_payload());
                return;
            }
            other => other.accept(),
        };
        match reply {
            Ok(reply) => reply.send().await,
            Err(error) => (self.report)(Notice::RequestFailed(error)),
        }
    }
}

/// Refuses a write with the attribute error that says why; a command is dropped.
fn refuse<'stack>(
    write: WriteEvent<'stack, '_, Pool>,
    refusal: &Refusal,
) -> Result<Reply<'stack, Pool>, Error> {
    if matches!(write.payload().incoming(), AttClient::Command(_)) {
        return write.accept_unprocessed();
    }
    write.reject(match refusal {
        Refusal::Malformed(WireError::TooShort { .. } | WireError::WrongLength { .. }) => {
            AttErrorCode::INVALID_ATTRIBUTE_VALUE_LENGTH
        }
        Refusal::Malformed(_) | Refusal::OutOfPlace { .. } | Refusal::NotFromHost { .. } => {
            AttErrorCode::VALUE_NOT_ALLOWED
        }
        Refusal::TooFast | Refusal::Full => AttErrorCode::INSUFFICIENT_RESOURCES,
    })
}

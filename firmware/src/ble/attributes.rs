//! The attribute table: what a host finds, and what it needs for it.
//!
//! Everything needs an authenticated link but battery and device information. The stack checks a
//! subscription's right again before every notification, so one that is remembered does not open a new link.

use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use heapless::Vec;
use tonus_shared::{
    gatt,
    wire::{Kind, MAX_FRAME_BYTES},
};
use trouble_host::{
    Error,
    attribute::{
        AttributeTable, Characteristic, CharacteristicProp, PermissionLevel, Service,
        ServiceBuilder, Uuid,
    },
    gap::GapConfig,
};

/// GAP service with name and appearance (5), GATT service (1), battery (3), device information (7), ours
/// with seven written or read (2 each) and five notified (3 each) characteristics. Two are spare: a build of
/// the stack that can also be a central adds one to the GAP service.
const ATTRIBUTES: usize = 5 + 1 + 3 + 7 + (1 + 5 * 2 + 5 * 3) + 2;

pub(super) type Table<'v> = AttributeTable<'v, NoopRawMutex, ATTRIBUTES>;
pub(super) type Server<'v, P, const HOSTS: usize> =
    trouble_host::prelude::AttributeServer<'v, NoopRawMutex, P, ATTRIBUTES, HOSTS>;
/// The largest value of a characteristic: one frame.
pub(super) type Value = Vec<u8, MAX_FRAME_BYTES>;
type Builder<'r, 'v> = ServiceBuilder<'r, 'v, NoopRawMutex, ATTRIBUTES>;

/// What a host may read about the wearable without pairing.
#[derive(Clone, Copy, Debug)]
pub struct DeviceInformation {
    /// Who made it.
    pub manufacturer: &'static str,
    /// Which board.
    pub model: &'static str,
    /// Version of the firmware.
    pub firmware: &'static str,
}

/// The characteristics, by what they carry.
pub(super) struct Attributes {
    pub(super) stream: Characteristic<[u8]>,
    pub(super) raw: Characteristic<[u8]>,
    pub(super) orientation: Characteristic<[u8]>,
    pub(super) hand: Characteristic<[u8]>,
    pub(super) control: Characteristic<[u8]>,
    /// A host reads the frame that was shown last.
    pub(super) calibration: Characteristic<Value>,
    pub(super) model: Characteristic<[u8]>,
    pub(super) inference: Characteristic<[u8]>,
    pub(super) reports: Characteristic<[u8]>,
    pub(super) ping: Characteristic<[u8]>,
    pub(super) battery: Characteristic<u8>,
}

impl Attributes {
    /// Builds the table. `calibration` is the place of the one value that a host reads from ours.
    pub(super) fn build<'v>(
        device: &DeviceInformation,
        calibration: &'v mut [u8; MAX_FRAME_BYTES],
    ) -> Result<(Table<'v>, Self), Error> {
        let mut table = Table::new();
        GapConfig::default(gatt::DEVICE_NAME)
            .build(&mut table)
            .map_err(|_| Error::InvalidValue)?;
        let battery = open_to_all(&mut table, device);
        let mut service = table.add_service(Service::new(uuid(gatt::SERVICE)));
        let attributes = Self {
            stream: notified(&mut service, gatt::STREAM),
            raw: notified(&mut service, gatt::RAW_SEMG),
            orientation: notified(&mut service, gatt::ORIENTATION),
            hand: written(
                &mut service,
                gatt::HAND_POSITION,
                &[CharacteristicProp::WriteWithoutResponse],
            ),
            control: written(&mut service, gatt::CONTROL, &[CharacteristicProp::Write]),
            calibration: service
                .add_characteristic(
                    uuid(gatt::CALIBRATION),
                    [CharacteristicProp::Read, CharacteristicProp::Write],
                    Value::new(),
                    calibration,
                )
                .read_permission(PermissionLevel::AuthenticationRequired)
                .write_permission(PermissionLevel::AuthenticationRequired)
                .build(),
            model: written(
                &mut service,
                gatt::MODEL_UPLOAD,
                &[
                    CharacteristicProp::Write,
                    CharacteristicProp::WriteWithoutResponse,
                ],
            ),
            inference: notified(&mut service, gatt::INFERENCE),
            reports: notified(&mut service, gatt::REPORTS),
            ping: written(
                &mut service,
                gatt::PING,
                &[CharacteristicProp::WriteWithoutResponse],
            ),
            battery,
        };
        service.build();
        Ok((table, attributes))
    }

    /// The characteristic that notifies frames of this kind, by the second byte of the frame.
    pub(super) fn notified(&self, frame: &[u8]) -> &Characteristic<[u8]> {
        const STREAM: u8 = Kind::Stream as u8;
        const RAW: u8 = Kind::RawSemg as u8;
        const ORIENTATION: u8 = Kind::Orientation as u8;
        const INFERENCE: u8 = Kind::Inference as u8;
        match frame.get(1) {
            Some(&STREAM) => &self.stream,
            Some(&RAW) => &self.raw,
            Some(&ORIENTATION) => &self.orientation,
            Some(&INFERENCE) => &self.inference,
            _ => &self.reports,
        }
    }

    /// The kind of frame that a host may write to the value `handle`; `None` where the stack itself takes
    /// what is written.
    pub(super) fn written(&self, handle: u16) -> Option<Kind> {
        [
            (self.hand.handle, Kind::HandPosition),
            (self.control.handle, Kind::Control),
            (self.calibration.handle, Kind::Calibration),
            (self.model.handle, Kind::ModelUpload),
            (self.ping.handle, Kind::Ping),
        ]
        .into_iter()
        .find_map(|(value, kind)| (value == handle).then_some(kind))
    }
}

/// Battery and device information, for which no pairing is needed.
fn open_to_all(table: &mut Table<'_>, device: &DeviceInformation) -> Characteristic<u8> {
    let mut service = table.add_service(Service::new(gatt::BATTERY_SERVICE));
    let battery = service
        .add_characteristic_small(gatt::BATTERY_LEVEL, [CharacteristicProp::Read], 0_u8)
        .build();
    service.build();
    let mut service = table.add_service(Service::new(gatt::DEVICE_INFORMATION_SERVICE));
    service
        .add_characteristic_ro(gatt::MANUFACTURER_NAME, device.manufacturer)
        .build();
    service
        .add_characteristic_ro(gatt::MODEL_NUMBER, device.model)
        .build();
    service
        .add_characteristic_ro(gatt::FIRMWARE_REVISION, device.firmware)
        .build();
    service.build();
    battery
}

/// A characteristic that is only notified: its value is never readable.
fn notified(service: &mut Builder<'_, '_>, identifier: u128) -> Characteristic<[u8]> {
    service
        .add_characteristic_small(
            uuid(identifier),
            [CharacteristicProp::Notify],
            Vec::<u8, 0>::new(),
        )
        .cccd_permission(PermissionLevel::AuthenticationRequired)
        .to_raw()
        .build()
}

/// A characteristic that is only written; what is written goes to the inbox, not into the table.
fn written(
    service: &mut Builder<'_, '_>,
    identifier: u128,
    how: &[CharacteristicProp],
) -> Characteristic<[u8]> {
    service
        .add_characteristic_small(uuid(identifier), how, Vec::<u8, 0>::new())
        .write_permission(PermissionLevel::AuthenticationRequired)
        .to_raw()
        .build()
}

/// Identifiers travel least significant byte first.
fn uuid(value: u128) -> Uuid {
    Uuid::new_long(value.to_le_bytes())
}

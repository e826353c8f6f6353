use tonus_shared::wire::{
    Calibration, Control, HandPosition, Header, MAX_FRAME_BYTES, Orientation, Ping, encode,
};

use super::*;

fn bytes(packet: &Packet) -> Vec<u8> {
    let header = Header {
        boot_id: 1,
        sequence: 2,
        device_us: 3,
    };
    let mut bytes = [0; MAX_FRAME_BYTES];
    let length = encode(&header, packet, &mut bytes).unwrap();
    bytes[..length].to_vec()
}

#[test]
fn every_request_goes_to_its_own_characteristic() {
    let calibration: Calibration =
        tonus_shared::pipeline::illustrative([tonus_shared::wire::Muscle::BicepsLong], 1_000);
    let piece = ModelUpload::Piece {
        offset_bytes: 0,
        bytes: [1, 2, 3, 4].into_iter().collect(),
    };
    // As docs/wire.md has it: what is written without an answer is what comes often.
    let expected = [
        (
            Packet::HandPosition(HandPosition { position_m: None }),
            0xa058_2894_5ca6_433e_ad68_db88_37ae_d19e,
            false,
        ),
        (
            Packet::Ping(Ping::Request {
                id: 1,
                requested_us: 2,
            }),
            0xa058_289a_5ca6_433e_ad68_db88_37ae_d19e,
            false,
        ),
        (
            Packet::Control(Control::SendCalibration),
            0xa058_2895_5ca6_433e_ad68_db88_37ae_d19e,
            true,
        ),
        (
            Packet::Calibration(calibration),
            0xa058_2896_5ca6_433e_ad68_db88_37ae_d19e,
            true,
        ),
        (
            Packet::ModelUpload(ModelUpload::Finish),
            0xa058_2897_5ca6_433e_ad68_db88_37ae_d19e,
            true,
        ),
        (
            Packet::ModelUpload(piece),
            0xa058_2897_5ca6_433e_ad68_db88_37ae_d19e,
            false,
        ),
    ];
    for (packet, characteristic, confirmed) in expected {
        let place = place(&bytes(&packet)).unwrap();
        assert_eq!(
            (place.characteristic, place.confirmed),
            (characteristic, confirmed)
        );
    }
    let orientation = Orientation {
        xyzw: [0.0, 0.0, 0.0, 1.0],
    };
    assert_eq!(place(&bytes(&Packet::Orientation(orientation))), None);
    assert_eq!(place(b"no frame"), None);
}

#[test]
fn a_link_that_cannot_carry_the_stream_is_refused_with_what_it_offers() {
    let link = |mtu, interval_us| check(&Parameters { mtu, interval_us });
    assert_eq!(link(100, Some(20_000)), Ok(()));
    assert_eq!(link(99, Some(15_000)), Err(BleError::Mtu { got: 99 }));
    assert_eq!(
        link(247, Some(20_001)),
        Err(BleError::Interval { got_us: 20_001 })
    );
    assert_eq!(link(247, None), Ok(()), "nobody tells");
    let text = BleError::Interval { got_us: 48_750 }.to_string();
    assert!(
        text.contains("48.75 ms") && text.contains("20 ms"),
        "{text}"
    );
}

fn found(id: &str, name: &str, service: u128, rssi_dbm: i16) -> Found {
    Found {
        id: id.to_owned(),
        name: Some(name.to_owned()),
        services: vec![service],
        rssi_dbm: Some(rssi_dbm),
    }
}

/// Hears these, and does nothing else.
struct Ear(Vec<Found>);

impl Central for Ear {
    async fn scan(
        &mut self,
        _: Duration,
        _: &dyn Fn(&Found) -> bool,
    ) -> Result<Vec<Found>, BleError> {
        Ok(self.0.clone())
    }
    async fn connect(&mut self, _: &Found) -> Result<(), BleError> {
        Err(BleError::LinkLost)
    }
    async fn parameters(&mut self) -> Result<Parameters, BleError> {
        Err(BleError::LinkLost)
    }
    async fn pair(&mut self, _: &AskPasskey) -> Result<(), BleError> {
        Err(BleError::LinkLost)
    }
    async fn subscribe(&mut self, _: u128) -> Result<(), BleError> {
        Err(BleError::LinkLost)
    }
    async fn write(&mut self, _: u128, _: &[u8], _: bool) -> Result<(), BleError> {
        Err(BleError::LinkLost)
    }
    async fn notified(&mut self) -> Result<crate::link::ble::Notified, BleError> {
        Err(BleError::LinkLost)
    }
    async fn leave(&mut self) {}
}

#[tokio::test]
async fn the_strongest_wearable_of_the_name_or_address_is_taken() {
    let mut ear = Ear(vec![
        found("01:02", "Tonus", gatt::SERVICE, -70),
        found("01:03", "Tonus", gatt::SERVICE, -40),
        found("01:04", "Other", gatt::SERVICE, -30),
        found("01:05", "Tonus", 0x1234, -20),
    ]);
    let mut look = async |name: Option<&str>| {
        let wanted = Wanted::wearable(name.map(str::to_owned));
        find(&mut ear, &wanted).await.map(|found| found.id)
    };
    assert_eq!(look(None).await.unwrap(), "01:04");
    assert_eq!(look(Some("Tonus")).await.unwrap(), "01:03");
    assert_eq!(look(Some("01:02")).await.unwrap(), "01:02");
    let error = look(Some("Mine")).await.unwrap_err().to_string();
    assert!(
        error.starts_with("no wearable named Mine within 10 s, but Tonus (01:02), "),
        "{error}"
    );
    assert!(!error.contains("01:05"), "that is no wearable: {error}");
}

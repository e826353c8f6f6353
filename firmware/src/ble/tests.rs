use embassy_time::Duration;
use tonus_shared::wire::Kind;
use trouble_host::attribute::{PermissionLevel, Uuid};

use super::{attributes::Attributes, sending::admit, *};

const DEVICE: DeviceInformation = DeviceInformation {
    manufacturer: "maker",
    model: "board",
    firmware: "1.2.3",
};

/// Runs `check` on a table.
fn with_table(check: impl FnOnce(&attributes::Table<'_>, &Attributes)) {
    let mut calibration = [0; MAX_FRAME_BYTES];
    let (table, attributes) = Attributes::build(&DEVICE, &mut calibration).unwrap();
    check(&table, &attributes);
}

#[test]
fn every_attribute_of_ours_needs_authentication() {
    let open: &[u16] = &[
        0x2800, 0x2803, 0x2a00, 0x2a01, 0x2a19, 0x2a29, 0x2a24, 0x2a26,
    ];
    with_table(|table, _| {
        let mut protected = 0;
        for handle in 1..=u16::try_from(table.len()).unwrap() {
            let identifier = table.uuid(handle).unwrap();
            let permissions = table.permissions(handle).unwrap();
            if open
                .iter()
                .any(|short| identifier == Uuid::new_short(*short))
            {
                assert_eq!(permissions.write, PermissionLevel::NotAllowed, "{handle}");
                continue;
            }
            let closed = [
                PermissionLevel::AuthenticationRequired,
                PermissionLevel::NotAllowed,
            ];
            assert!(closed.contains(&permissions.write), "{identifier:?}");
            let is_subscription = identifier == Uuid::new_short(0x2902);
            assert!(
                is_subscription || closed.contains(&permissions.read),
                "{identifier:?}"
            );
            protected += 1;
        }
        assert_eq!(protected, 10 + 5, "ten values and five subscriptions");
    });
}

#[test]
fn identifiers_go_out_least_significant_byte_first() {
    with_table(|table, attributes| {
        let bytes = [
            0x9e, 0xd1, 0xae, 0x37, 0x88, 0xdb, 0x68, 0xad, 0x3e, 0x43, 0xa6, 0x5c, 0x91, 0x28,
            0x58, 0xa0,
        ];
        assert_eq!(
            table.uuid(attributes.stream.handle),
            Some(Uuid::new_long(bytes))
        );
    });
}

#[test]
fn every_kind_leaves_by_its_characteristic() {
    with_table(|_, attributes| {
        for (kind, expected) in [
            (Kind::Configuration, &attributes.reports),
            (Kind::Stream, &attributes.stream),
            (Kind::RawSemg, &attributes.raw),
            (Kind::Orientation, &attributes.orientation),
            (Kind::Ping, &attributes.reports),
            (Kind::Inference, &attributes.inference),
            (Kind::Status, &attributes.reports),
            (Kind::Calibration, &attributes.reports),
            (Kind::ModelState, &attributes.reports),
            (Kind::Reply, &attributes.reports),
            (Kind::LastWords, &attributes.reports),
        ] {
            assert_eq!(attributes.notified(&[1, kind as u8]), expected, "{kind}");
        }
    });
}

#[test]
fn every_written_characteristic_takes_its_kind_and_no_other_place_takes_any() {
    with_table(|table, attributes| {
        let expected = [
            (attributes.hand.handle, Kind::HandPosition),
            (attributes.control.handle, Kind::Control),
            (attributes.calibration.handle, Kind::Calibration),
            (attributes.model.handle, Kind::ModelUpload),
            (attributes.ping.handle, Kind::Ping),
        ];
        for handle in 1..=u16::try_from(table.len()).unwrap() {
            let kind = expected.iter().find(|(at, _)| *at == handle);
            assert_eq!(attributes.written(handle), kind.map(|(_, kind)| *kind));
        }
    });
}

#[test]
fn a_whole_frame_needs_an_mtu_of_100() {
    let interval = Duration::from_millis(15);
    assert_eq!(admit(89, 100, interval), Ok(()));
    for negotiated in [99, 23] {
        assert_eq!(
            admit(89, negotiated, interval),
            Err(Withheld::MtuTooSmall {
                needed: 100,
                negotiated
            })
        );
    }
    assert_eq!(admit(244, 247, interval), Ok(()));
    assert_eq!(
        admit(244, 246, interval),
        Err(Withheld::MtuTooSmall {
            needed: 247,
            negotiated: 246
        })
    );
}

#[test]
fn an_interval_above_20_ms_is_refused() {
    assert_eq!(admit(89, 247, Duration::from_millis(20)), Ok(()));
    assert_eq!(
        admit(89, 247, Duration::from_micros(21_250)),
        Err(Withheld::IntervalTooLong {
            limit_us: 20_000,
            actual_us: 21_250
        })
    );
}

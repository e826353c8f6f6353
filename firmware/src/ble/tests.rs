use super::*;

#[test]
fn subscribing_needs_authentication_and_reading_is_closed() {
    let (table, stream) = attributes().unwrap();
    let value = table.permissions(stream.handle).unwrap();
    assert_eq!(value.read, PermissionLevel::NotAllowed);
    assert_eq!(value.write, PermissionLevel::NotAllowed);
    let subscription = table.permissions(stream.cccd_handle.unwrap()).unwrap();
    assert_eq!(
        subscription.write,
        PermissionLevel::AuthenticationRequired,
        "encryption alone would let Just Works in"
    );
}

#[test]
fn identifiers_go_out_least_significant_byte_first() {
    let (table, stream) = attributes().unwrap();
    let bytes = [
        0x9e, 0xd1, 0xae, 0x37, 0x88, 0xdb, 0x68, 0xad, 0x3e, 0x43, 0xa6, 0x5c, 0x91, 0x28, 0x58,
        0xa0,
    ];
    assert_eq!(table.uuid(stream.handle), Some(Uuid::new_long(bytes)));
}

#[test]
fn a_whole_frame_needs_an_mtu_of_100() {
    let interval = Duration::from_millis(15);
    assert_eq!(admit(100, interval), Ok(()));
    assert_eq!(
        admit(99, interval),
        Err(Withheld::MtuTooSmall {
            needed: 100,
            negotiated: 99
        })
    );
    assert_eq!(
        admit(23, interval),
        Err(Withheld::MtuTooSmall {
            needed: 100,
            negotiated: 23
        })
    );
}

#[test]
fn an_interval_above_20_ms_is_refused() {
    assert_eq!(admit(247, Duration::from_millis(20)), Ok(()));
    assert_eq!(
        admit(247, Duration::from_micros(21_250)),
        Err(Withheld::IntervalTooLong {
            limit_us: 20_000,
            actual_us: 21_250
        })
    );
}

//! A controller that never keeps the host stack waiting, and never hands it what it cannot take.

use bt_hci::{
    ControllerToHostPacket,
    cmd::{self, AsyncCmd, SyncCmd},
    controller::{Controller, ControllerCmdAsync, ControllerCmdSync},
    data::{AclBroadcastFlag, AclPacket, AclPacketBoundary, IsoPacket, SyncPacket},
    param,
};
use embassy_time::{Duration, with_timeout};
use embedded_io::ErrorType;

/// No command is waited for longer than this. The slowest are answered over the air, after a few connection
/// intervals; `LE Set PHY` may never be, and one command that hangs would hang all.
const COMMAND_LIMIT: Duration = Duration::from_secs(2);
/// Channel of the attribute protocol.
const ATTRIBUTES: [u8; 2] = [4, 0];
/// An empty frame for a channel that does not exist: the host stack drops it.
const NOTHING: &[u8] = &[0, 0, 0x3f, 0];
/// Finds groups of attributes by their type.
const READ_BY_GROUP_TYPE: u8 = 0x10;
/// Bytes of [`READ_BY_GROUP_TYPE`] with a 128-bit type, of which there are no groups.
const LONG_GROUP_TYPE_BYTES: u16 = 1 + 2 + 2 + 16;
/// A request of that kind that the host stack answers with "not supported".
const UNSUPPORTED_GROUP_TYPE: &[u8] = &[6, 0, 4, 0, READ_BY_GROUP_TYPE, 1, 0, 1, 0, 0];

/// The controller behind [`COMMAND_LIMIT`]: a command that is not answered in time fails as if the other
/// side had not answered. Data has no limit here: it waits for room, until the link ends.
pub(super) struct Guarded<'c, C>(pub(super) &'c C);

impl<C: ErrorType> ErrorType for Guarded<'_, C> {
    type Error = C::Error;
}

impl<C: Controller> Controller for Guarded<'_, C> {
    type Buffer<'a> = C::Buffer<'a>;

    fn alloc_buf(&self) -> Result<Self::Buffer<'_>, Self::Error> {
        self.0.alloc_buf()
    }

    async fn write_acl_data(&self, packet: &AclPacket<'_>) -> Result<(), Self::Error> {
        self.0.write_acl_data(packet).await
    }

    async fn write_sync_data(&self, packet: &SyncPacket<'_>) -> Result<(), Self::Error> {
        self.0.write_sync_data(packet).await
    }

    async fn write_iso_data(&self, packet: &IsoPacket<'_>) -> Result<(), Self::Error> {
        self.0.write_iso_data(packet).await
    }

    async fn read<'a>(
        &self,
        buffer: &'a mut Self::Buffer<'_>,
    ) -> Result<ControllerToHostPacket<'a>, Self::Error> {
        Ok(match self.0.read(buffer).await? {
            ControllerToHostPacket::Acl(packet) => {
                ControllerToHostPacket::Acl(match instead(&packet) {
                    Some(harmless) => AclPacket::new(
                        packet.handle(),
                        AclPacketBoundary::FirstFlushable,
                        AclBroadcastFlag::PointToPoint,
                        harmless,
                    ),
                    None => packet,
                })
            }
            packet => packet,
        })
    }
}

/// What to hand to the host stack in the place of a packet that would make it panic: trouble-host 0.8 takes the
/// fields of an attribute request from where they should be without asking how long it is, whoever sent it.
///
/// The first piece of a frame tells its length, channel and operation; a piece too short for that is dropped,
/// and with it its frame.
fn instead(packet: &AclPacket<'_>) -> Option<&'static [u8]> {
    if packet.boundary_flag() == AclPacketBoundary::Continuing {
        return None;
    }
    let Some((&[low, high, channel @ ..], content)) = packet.data().split_first_chunk::<4>() else {
        return Some(NOTHING);
    };
    let length = u16::from_le_bytes([low, high]);
    if channel != ATTRIBUTES {
        return (length == 0).then_some(NOTHING);
    }
    match content.first() {
        Some(&READ_BY_GROUP_TYPE) if length == LONG_GROUP_TYPE_BYTES => {
            Some(UNSUPPORTED_GROUP_TYPE)
        }
        // Odd operations are answers and notifications, and the wearable asked nobody anything.
        Some(&operation) if operation & 1 == 0 && length >= shortest(operation) => None,
        _ => Some(NOTHING),
    }
}

/// Bytes of the shortest request of this operation (Bluetooth Core 5.4, volume 3, part F, 3.4), for those whose
/// fields are taken unseen.
fn shortest(operation: u8) -> u16 {
    match operation {
        // Exchange MTU, read, write with and without response.
        0x02 | 0x0a | 0x12 | 0x52 => 3,
        // Find information, read by type, read blob, read multiple, read by group type, prepare write, read multiple of
        // variable length.
        0x04 | 0x08 | 0x0c | 0x0e | READ_BY_GROUP_TYPE | 0x16 | 0x20 => 5,
        // Find by type value.
        0x06 => 7,
        // Execute write.
        0x18 => 2,
        _ => 1,
    }
}

impl<C, Q> ControllerCmdSync<Q> for Guarded<'_, C>
where
    C: ControllerCmdSync<Q>,
    Q: SyncCmd + ?Sized,
{
    async fn exec(&self, command: &Q) -> Result<Q::Return, cmd::Error<Self::Error>> {
        with_timeout(COMMAND_LIMIT, self.0.exec(command))
            .await
            .unwrap_or(Err(cmd::Error::Hci(UNANSWERED)))
    }
}

impl<C, Q> ControllerCmdAsync<Q> for Guarded<'_, C>
where
    C: ControllerCmdAsync<Q>,
    Q: AsyncCmd + ?Sized,
{
    async fn exec(&self, command: &Q) -> Result<(), cmd::Error<Self::Error>> {
        with_timeout(COMMAND_LIMIT, self.0.exec(command))
            .await
            .unwrap_or(Err(cmd::Error::Hci(UNANSWERED)))
    }
}

const UNANSWERED: param::Error = param::Error::LMP_LL_RESPONSE_TIMEOUT;

#[cfg(test)]
mod tests {
    use bt_hci::param::ConnHandle;

    use super::*;

    fn first(data: &[u8]) -> Option<&'static [u8]> {
        instead(&AclPacket::new(
            ConnHandle::new(1),
            AclPacketBoundary::FirstFlushable,
            AclBroadcastFlag::PointToPoint,
            data,
        ))
    }

    #[test]
    fn an_attribute_request_without_its_fields_is_dropped_and_a_whole_one_passes() {
        for (operation, bytes) in [
            (0x02, 3),
            (0x04, 5),
            (0x06, 7),
            (0x08, 7),
            (0x0a, 3),
            (0x0c, 5),
            (0x0e, 5),
            (0x10, 7),
            (0x12, 3),
            (0x16, 5),
            (0x18, 2),
            (0x20, 5),
            (0x52, 3),
        ] {
            let mut frame = [0; 4 + 7];
            frame[2] = 4;
            frame[4] = operation;
            for length in 0..=bytes {
                frame[0] = length;
                let content = &frame[..4 + usize::from(length).max(1)];
                let whole = u16::from(length) >= shortest(operation);
                assert_eq!(first(content).is_none(), whole, "{operation:#x} {length}");
            }
            assert!(u16::from(bytes) >= shortest(operation), "{operation:#x}");
        }
    }

    #[test]
    fn frames_without_content_or_header_are_dropped() {
        for data in [
            &[][..],
            &[0],
            &[1, 0, 4],
            &[0, 0, 4, 0],
            &[0, 0, 6, 0],
            &[3, 0, 4, 0],
        ] {
            assert_eq!(first(data), Some(NOTHING), "{data:?}");
        }
        assert_eq!(first(&[2, 0, 6, 0, 1, 1]), None);
    }

    #[test]
    fn what_only_a_server_sends_is_dropped() {
        // Error, the responses, notification, indication.
        for operation in (0x01..=0x1d).step_by(2) {
            let frame = [3, 0, 4, 0, operation, 0, 0];
            assert_eq!(first(&frame), Some(NOTHING), "{operation:#x}");
        }
        assert_eq!(first(&[1, 0, 4, 0, 0x1e]), None, "a confirmation");
    }

    #[test]
    fn a_group_type_of_128_bits_is_answered_in_another_form() {
        let mut frame = [0; 4 + 21];
        frame[0] = 21;
        frame[2] = 4;
        frame[4] = 0x10;
        assert_eq!(first(&frame), Some(UNSUPPORTED_GROUP_TYPE));
    }

    #[test]
    fn later_pieces_of_a_frame_pass() {
        let piece = AclPacket::new(
            ConnHandle::new(1),
            AclPacketBoundary::Continuing,
            AclBroadcastFlag::PointToPoint,
            &[],
        );
        assert_eq!(instead(&piece), None);
    }
}

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
/// Length and channel of a frame of the logical link protocol (L2CAP).
const LINK_HEADER_BYTES: usize = 4;
/// An empty frame for a channel that does not exist: the host stack drops it.
const NOTHING: [u8; LINK_HEADER_BYTES] = [0, 0, 0x3f, 0];

/// The controller behind [`COMMAND_LIMIT`]: a command that is not answered in time fails as if the other
/// side had not answered.
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
            ControllerToHostPacket::Acl(packet) if is_empty(&packet) => {
                ControllerToHostPacket::Acl(AclPacket::new(
                    packet.handle(),
                    AclPacketBoundary::FirstFlushable,
                    AclBroadcastFlag::PointToPoint,
                    &NOTHING,
                ))
            }
            packet => packet,
        })
    }
}

/// Whether a packet begins a frame without content: the host stack looks at the first byte of an attribute
/// request without asking whether there is one, and would panic.
fn is_empty(packet: &AclPacket<'_>) -> bool {
    packet.boundary_flag() != AclPacketBoundary::Continuing
        && packet.data().get(..2).is_none_or(|length| length == [0, 0])
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

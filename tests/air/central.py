"""A host on the virtual air: connects, pairs, reads, writes and counts."""

import asyncio
import re
import struct
import zlib
from pathlib import Path

from bumble import att, core, smp
from bumble.device import Peer
from bumble.gatt_client import UUID
from bumble.pairing import PairingConfig, PairingDelegate

from radio import PATIENCE_S, WEARABLE

ROOT = Path(__file__).resolve().parents[2]
HEADER = struct.Struct("<BBIIQ")


def identifiers():
    """The identifiers that the project defines once, in Rust."""
    text = (ROOT / "shared/src/gatt.rs").read_text()
    return {name: UUID(f"{digits[:8]}-{digits[8:12]}-{digits[12:16]}-{digits[16:20]}-{digits[20:]}")
            for name, digits in ((name, value.replace("_", ""))
                                 for name, value in re.findall(r"pub const (\w+): u128 = 0x([0-9a-f_]+);", text))}


IDS = identifiers()
VERSION = int(re.search(r"pub const VERSION: u8 = (\d+);", (ROOT / "shared/src/wire/table.rs").read_text()).group(1))
KINDS = dict(configuration=1, stream=2, raw=3, orientation=4, hand=5, ping=6, inference=7, status=8, control=9,
             calibration=10, model=11, model_state=12, reply=13, last_words=14)
NOTIFIED = ["STREAM", "RAW_SEMG", "ORIENTATION", "INFERENCE", "REPORTS"]
WRITTEN = ["HAND_POSITION", "CONTROL", "CALIBRATION", "MODEL_UPLOAD", "PING"]

# What docs/wire.md has from its payload's first byte on: four channels at 1 kHz, a notch at 50 Hz.
CALIBRATION = struct.pack(
    "<IB8sBf8f8ff2f4f2f", 7, 4, bytes([1, 2, 3, 4, 0, 0, 0, 0]), 50, 1000.0,
    *[1e-5] * 4, *[0.0] * 4, *[5e-4] * 4, *[0.0] * 4, 0.025, 0.5, 3.0, 20.0, 20.0, 20.0, 15.0, 75.0, 1.8)


def frame(kind, payload, sequence=0, boot_id=0xB007, device_us=0):
    """The bytes of one frame, by docs/wire.md."""
    body = HEADER.pack(VERSION, KINDS[kind], boot_id, sequence, device_us) + payload
    return body + struct.pack("<I", zlib.crc32(body))


def good(name, number):
    """A frame that belongs to this characteristic."""
    payloads = dict(
        HAND_POSITION=("hand", struct.pack("<B3f", 1, 0.1, 0.2, 0.3)),
        CONTROL=("control", struct.pack("<BI", 2, 0)),
        CALIBRATION=("calibration", CALIBRATION),
        MODEL_UPLOAD=("model", bytes([2])),
        PING=("ping", struct.pack("<BIQQQ", 0, number, 1_000, 0, 0)))
    kind, payload = payloads[name]
    return frame(kind, payload, number)


def ping(number):
    return good("PING", number)


class Delegate(PairingDelegate):
    """A person at the host: types the passkey that the wearable shows, or cannot."""

    def __init__(self, wearable, capability, wrong=0, **named):
        super().__init__(capability, **named)
        self.wearable = wearable
        self.wrong = wrong

    async def get_number(self):
        return (await self.wearable.passkey() + self.wrong) % 1_000_000


def keyboard(wearable, wrong=0, **named):
    return PairingConfig(delegate=Delegate(wearable, PairingDelegate.KEYBOARD_INPUT_ONLY, wrong), **named)


def just_works(wearable, **named):
    return PairingConfig(mitm=False, delegate=Delegate(wearable, PairingDelegate.NO_OUTPUT_NO_INPUT), **named)


class Central:
    """One connection of one host."""

    def __init__(self, device, wearable):
        self.device = device
        self.wearable = wearable
        self.frames = []
        self.arrived = asyncio.Event()

    async def connect(self, mtu=247):
        self.connection = await self.device.connect(WEARABLE, timeout=PATIENCE_S)
        self.peer = Peer(self.connection)
        self.client = self.peer.gatt_client
        self.lost = asyncio.Event()
        self.connection.on("disconnection", lambda _reason: self.lost.set())
        await self.wearable.says("notice Connected")
        if mtu:
            self.mtu = await self.peer.request_mtu(mtu)
        return self

    async def discover(self):
        await self.peer.discover_services()
        for service in self.peer.services:
            await service.discover_characteristics()
        self.characteristics = {c.uuid: c for service in self.peer.services for c in service.characteristics}
        return self

    def of(self, name):
        return self.characteristics[IDS[name]]

    async def pair(self, config):
        """Pairs; gives what went wrong, or nothing."""
        self.device.pairing_config_factory = lambda _connection: config
        try:
            await asyncio.wait_for(self.connection.pair(), PATIENCE_S)
        except (core.ProtocolError, core.InvalidStateError, core.BaseBumbleError, asyncio.CancelledError) as error:
            return error
        return None

    async def request(self, request):
        """One attribute request; gives its error code, or nothing."""
        response = await asyncio.wait_for(self.client.send_request(request), PATIENCE_S)
        return response.error_code if response.op_code == att.Opcode.ATT_ERROR_RESPONSE else None

    async def write(self, name, value):
        return await self.request(att.ATT_Write_Request(attribute_handle=self.of(name).handle, attribute_value=value))

    async def write_command(self, name, value):
        await self.client.send_command(
            att.ATT_Write_Command(attribute_handle=self.of(name).handle, attribute_value=value))

    async def settle(self):
        """Waits until everything sent before has been handled."""
        return await self.request(att.ATT_Read_Request(attribute_handle=self.characteristics[UUID(0x2A19)].handle))

    async def subscription(self, name):
        """The handle of a characteristic's subscription."""
        characteristic = self.of(name)
        if not characteristic.descriptors:
            await characteristic.discover_descriptors()
        return next(d.handle for d in characteristic.descriptors if d.type == UUID(0x2902))

    async def subscribe(self, *names):
        def arrived(value):
            self.frames.append(bytes(value))
            self.arrived.set()
        for name in names:
            await asyncio.wait_for(self.of(name).subscribe(arrived), PATIENCE_S)
        return self

    async def received(self, count, kind=None, limit_s=PATIENCE_S):
        """Waits until `count` frames (of one kind) have arrived since the last call to `forget`."""
        async def wait():
            while True:
                found = [f for f in self.frames if kind is None or f[1] == KINDS[kind]]
                if len(found) >= count:
                    return found
                self.arrived.clear()
                await self.arrived.wait()
        return await asyncio.wait_for(wait(), limit_s)

    def forget(self):
        self.frames.clear()

    async def dropped(self):
        await asyncio.wait_for(self.lost.wait(), PATIENCE_S)

    async def leave(self):
        await self.connection.disconnect()
        await self.wearable.says("notice Disconnected")


def sequence(bytes_):
    """The number of a frame, whose check must hold."""
    assert zlib.crc32(bytes_[:-4]) == struct.unpack("<I", bytes_[-4:])[0], f"checksum of {bytes_.hex()}"
    return HEADER.unpack_from(bytes_)[3]


def gaps(frames):
    """Frames missing between the first number and the last. None may come twice, and those of one kind come in
    order; a report may overtake the stream."""
    for kind in {f[1] for f in frames}:
        numbers = [sequence(f) for f in frames if f[1] == kind]
        assert numbers == sorted(set(numbers)), f"kind {kind} out of order or twice"
    numbers = {sequence(f) for f in frames}
    return max(numbers) - min(numbers) + 1 - len(numbers)


def dropped(frames):
    """Packets that the wearable replaced by newer ones, by its newest status: an overloaded machine stalls the virtual
    link as a wall does the radio."""
    return struct.unpack_from("<I", [f for f in frames if f[1] == KINDS["status"]][-1], 18 + 23)[0]


def stream_times_ms(frames):
    """The device time of every stream packet, which comes every 10 ms."""
    return [HEADER.unpack_from(f)[4] // 1000 for f in frames if f[1] == KINDS["stream"]]


async def ready(air, wearable, device=None, names=("STREAM", "REPORTS")):
    """A host that is connected, paired and subscribed."""
    await wearable.press()
    central = Central(device or await air.host(), wearable)
    await central.connect()
    await central.discover()
    error = await central.pair(keyboard(wearable))
    assert error is None, error
    await wearable.says("notice Paired")
    await central.subscribe(*names)
    return central

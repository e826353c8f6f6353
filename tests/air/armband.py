"""Scenarios: a Myo armband, played by Bumble from a recording of a real one, before the host's own logic."""

import asyncio
import csv
import os
from pathlib import Path

from bumble import gatt
from bumble.core import UUID, AdvertisingData
from bumble.gatt import Characteristic

# Thalmic Labs' myohw.h, not the host's code.
BASE = "D506{:04X}-A904-DEB9-4748-2C7F4A124842"
CONTROL, IMU_SERVICE, SEMG_SERVICE = 0x0001, 0x0002, 0x0005
COMMAND, IMU, SEMG = 0x0401, 0x0402, (0x0105, 0x0205, 0x0305, 0x0405)
NEVER_SLEEP, STREAM_ALL = bytes([9, 1, 1]), bytes([1, 3, 2, 1, 1])
RECORDING = "myo_readings_wrist_mit/csv/12345-1_fist.csv"
CHANNELS = 8
# Scans that one raw packet of eight channels holds.
SCANS_PER_PACKET = 9
# Far faster than the armband's 10 ms, also on a machine under load: what comes slower has lost some on the way, and would be taken so.
PACKET_S = 0.0005


def rows():
    """The recording's counts, a whole number of raw packets."""
    data = Path(os.environ.get("TONUS_DATA", Path(__file__).parents[3] / "shared" / "data"))
    with open(data / RECORDING, newline="") as file:
        counts = [[int(row[f"emg{channel}"]) for channel in range(CHANNELS)] for row in csv.DictReader(file)]
    return counts[:len(counts) // (2 * SCANS_PER_PACKET) * 2 * SCANS_PER_PACKET]


class Myo:
    """The armband's services on a Bumble device."""

    def __init__(self, device):
        def notifying(short):
            return Characteristic(UUID(BASE.format(short)), Characteristic.Properties.NOTIFY,
                                  Characteristic.READABLE, bytes(20))
        self.device = device
        self.commands = []
        self.commanded = asyncio.Event()
        command = Characteristic(
            UUID(BASE.format(COMMAND)), Characteristic.Properties.WRITE, Characteristic.WRITEABLE,
            gatt.CharacteristicValue(write=self._take))
        self.semg = [notifying(short) for short in SEMG]
        self.imu = notifying(IMU)
        device.add_service(gatt.Service(UUID(BASE.format(CONTROL)), [command]))
        device.add_service(gatt.Service(UUID(BASE.format(IMU_SERVICE)), [self.imu]))
        device.add_service(gatt.Service(UUID(BASE.format(SEMG_SERVICE)), self.semg))
        self.sent = 0

    def _take(self, _connection, value):
        self.commands.append(bytes(value))
        if bytes(value) == STREAM_ALL:
            self.commanded.set()

    async def advertise(self):
        uuid = bytes.fromhex(BASE.format(CONTROL).replace("-", ""))[::-1]
        data = AdvertisingData([(AdvertisingData.FLAGS, b"\x06"),
                                (AdvertisingData.COMPLETE_LIST_OF_128_BIT_SERVICE_CLASS_UUIDS, uuid)])
        self.device.advertising_data = bytes(data)
        await self.device.start_advertising(auto_restart=True)

    async def play(self, counts):
        """Two rows a packet, round the four characteristics; now and then an attitude between."""
        for first in range(0, len(counts), 2):
            value = b"".join(count.to_bytes(1, "big", signed=True) for row in counts[first:first + 2] for count in row)
            await self.device.notify_subscribers(self.semg[self.sent % 4], value)
            if self.sent % 2 == 0:
                await self.device.notify_subscribers(self.imu, (16_384).to_bytes(2, "little") + bytes(18))
            self.sent += 1
            await asyncio.sleep(PACKET_S)


def scans(central, start):
    """The host's scans from its `start`-th line on: indices and counts."""
    found = [line.split(" ", 2)[1:] for line in central.lines[start:] if line.startswith("scan ")]
    return [int(index) for index, _ in found], [[int(count) for count in counts.strip("[]").split(",")] for _, counts in found]


async def everything(central, start, expected):
    """The host has given out as many scans as were played."""
    while len(scans(central, start)[0]) < expected:
        await asyncio.sleep(0.1)


async def myo_recording(air):
    """What a real armband measured, played through a GATT server and the host's own logic, comes out to the last count, in order
    and without a gap; after a lost link the host finds the armband again and tells it anew to stream."""
    myo = Myo(await air.host())
    await myo.advertise()
    central = await air.session("myo")
    await myo_up(central, myo)
    counts = rows()
    start = len(central.lines)
    await myo.play(counts)
    await asyncio.wait_for(everything(central, start, len(counts)), 60)
    indices, came = scans(central, start)
    assert came == counts, next((row, a, b) for row, (a, b) in enumerate(zip(came, counts)) if a != b)
    assert indices == list(range(indices[0], indices[0] + len(counts)))

    for connection in list(myo.device.connections.values()):
        await connection.disconnect()
    await central.says("down the link ended")
    myo.commands.clear()
    myo.commanded.clear()
    await myo_up(central, myo)
    start = len(central.lines)
    few = counts[:10 * SCANS_PER_PACKET]
    await myo.play(few)
    await asyncio.wait_for(everything(central, start, len(few)), 60)
    assert scans(central, start)[1] == few


async def myo_up(central, myo):
    await asyncio.wait_for(myo.commanded.wait(), 30)
    assert myo.commands == [NEVER_SLEEP, STREAM_ALL], myo.commands
    await central.says(r"up .*\(F0:00:00:00:00:01\)")
    await central.says("reply Control Ok")


SCENARIOS = [myo_recording]

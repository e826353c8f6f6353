"""Scenarios: what a host may throw at the wearable. It may refuse and it may drop the link; it may not end,
change anything, or stop streaming to the next host."""

import asyncio
import random
import struct
import zlib

from central import CALIBRATION, IDS, KINDS, VERSION, WRITTEN, Central, frame, gaps, good, ping, ready
from streams import back

WRITES = 10_000
# With the read that ends it no more than the stack's queue of requests holds, so that each is looked at.
BATCH = 7
SEED = 0x5EED


def spoil(rng, name, number):
    """A write that must be refused: bytes at random, a good frame damaged, or one that belongs elsewhere."""
    whole = bytearray(good(name, number))
    match rng.randrange(7):
        case 0:
            return rng.randbytes(rng.randrange(244))
        case 1:
            whole[rng.randrange(len(whole))] ^= 1 << rng.randrange(8)
        case 2:
            del whole[rng.randrange(len(whole)):]
        case 3:
            whole += rng.randbytes(rng.randint(1, 244 - len(whole)))
        case 4:
            return frame(rng.choice([kind for kind in KINDS if kind != "ping"]), rng.randbytes(rng.choice([250, 3])))[:244]
        case 5:
            return good(rng.choice([other for other in WRITTEN if other != name]), number)
        case 6:
            # Another version, and a kind that does not exist, under a right checksum.

            body = bytes([VERSION ^ rng.randint(1, 255), rng.randrange(256)]) + bytes(whole[2:-4])
            return body + struct.pack("<I", zlib.crc32(body))
    return bytes(whole)


async def garbage_writes(air):
    """Ten thousand writes that are no frames, or not where they belong: each is refused and counted, none changes
    the calibration, and the stream goes on: the newest is sent whenever the answers leave room."""
    wearable = await air.wearable()
    central = await ready(air, wearable)
    assert await central.write("CALIBRATION", good("CALIBRATION", 1)) is None
    await wearable.says("taken calibration 1")
    await central.received(1, "reply")
    before = bytes(await central.of("CALIBRATION").read_value())
    assert before[18:-4] == CALIBRATION
    rng = random.Random(SEED)
    central.forget()
    for number in range(WRITES):
        name = rng.choice(WRITTEN)
        value = spoil(rng, name, number)
        if rng.randrange(20) == 0:
            assert await central.write(name, value) is not None, (name, value.hex())
        else:
            await central.write_command(name, value)
        if number % BATCH == BATCH - 1:
            await central.settle()
    await central.settle()
    assert await wearable.refused() == WRITES
    assert wearable.said("taken") == ["taken calibration 1"], wearable.said("taken")
    assert bytes(await central.of("CALIBRATION").read_value()) == before
    await central.received(10, "stream")
    missing = gaps(central.frames)
    assert missing <= len(central.frames) / 100, f"{missing} of {len(central.frames)} missing, {wearable.said('notice')}"
    assert not wearable.said("notice (Disconnected|Restarted|Dropped|Withheld)"), wearable.lines[-12:]
    # A good one is still taken.
    await central.write_command("PING", ping(99_999))
    await wearable.says("taken ping 99999")


garbage_writes.limit_s = 300


async def flood(air):
    """Good frames faster than anyone may send them: the rest is refused, and the next is taken again."""
    wearable = await air.wearable()
    central = await ready(air, wearable)
    for number in range(2_000):
        await central.write_command("PING", ping(number))
        if number % 50 == 49:
            await asyncio.sleep(0)
    await asyncio.sleep(0.5)
    await central.settle()
    await central.write_command("PING", ping(5_000))
    await wearable.says("taken ping 5000")
    central.forget()
    await central.received(20, "stream")


async def garbage_below(air):
    """Nonsense below the attributes, from a host that is not even paired: signalling, pairing and attribute
    packets of any length, empty ones too. Afterwards an honest host pairs and streams."""
    wearable = await air.wearable()
    device = await air.host()
    rng = random.Random(SEED)
    central = await Central(device, wearable).connect()
    # What a stack may take for granted: every operation of the attribute protocol without some of its fields, and the
    # one with a 128-bit type of which there are no groups.
    cut = [bytes([operation]) + bytes(length) for operation in range(0x60) for length in range(8)]
    cut.append(b"\x10\x01\x00\xff\xff" + bytes(IDS["SERVICE"]))
    for number in range(2_000 + len(cut)):
        if central.lost.is_set():
            await wearable.says("notice Advertising")
            central = await Central(device, wearable).connect()
        channel = rng.choice([4, 4, 5, 6, rng.randrange(0x10000)])
        payload = rng.randbytes(rng.choice([0, 1, 2, rng.randrange(244)]))
        if payload and rng.randrange(2):
            # An operation that exists on this channel.
            payload = bytes([rng.randrange(0x20)]) + payload[1:]
        length = len(payload) if rng.randrange(8) else rng.randrange(0x10000)
        if number < len(cut):
            channel, payload, length = 4, cut[number], len(cut[number])
        air.throw(device, struct.pack("<HH", length, channel) + payload)
        if number % BATCH == BATCH - 1:
            # Time to look at them: what the stack's queue has no room for is dropped unseen.
            await asyncio.sleep(0.002)
    assert wearable.is_running(), wearable.lines[-12:]
    if not central.lost.is_set():
        await central.connection.disconnect()
    await wearable.says("notice Disconnected")
    assert not wearable.said("notice (Paired|Resumed)|taken"), wearable.lines[-12:]

    honest = await air.host()
    central = await ready(air, wearable, honest)
    await central.received(20, "stream")
    await air.lose(wearable)
    central = await back(honest, wearable)
    await central.received(20, "stream")


SCENARIOS = [garbage_writes, flood, garbage_below]

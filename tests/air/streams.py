"""Scenarios: packets without a gap, links that are lost, stall or are too slow, and hosts that come back."""

import asyncio
from itertools import pairwise

from bumble import att

from central import Central, dropped, frame, gaps, keyboard, ready, stream_times_ms
from flash import kept_bonds
from links import wearable_drops
from radio import PATIENCE_S

# Stream packets that must come without a gap; `scenarios.py --packets` sets it.
PACKETS = 3000
# The wearer's time in the long scenarios, twice the host's.
HURRIED_HZ = 200
BOND_BYTES = 40


async def back(device, wearable, *names):
    """The host connects again and encrypts by its bond."""
    central = await (await Central(device, wearable).connect()).discover()
    await asyncio.wait_for(central.connection.encrypt(), PATIENCE_S)
    await wearable.says("notice Resumed")
    await central.subscribe(*names or ("STREAM", "REPORTS"))
    central.forget()
    return central


async def stays_silent(central):
    """Nothing comes for many times the period of a stream."""
    for _ in range(20):
        await central.settle()
        await asyncio.sleep(0.01)
    assert not central.frames, [f.hex() for f in central.frames]


async def stream(air):
    """Thousands of packets, by their sequence numbers none missing, none twice, none out of order."""
    wearable = await air.wearable("--stream-hz", str(HURRIED_HZ))
    central = await ready(air, wearable)
    before = dropped(await central.received(1, "status"))
    central.forget()
    await central.received(PACKETS, "stream", limit_s=30 + 10 * PACKETS / HURRIED_HZ)
    frames = list(central.frames)
    held = dropped(frames) - before
    assert gaps(frames) == 0, f"{gaps(frames)} frames missing of {len(frames)}, {held} of them before a stalled link"
    assert not wearable.said("notice (Withheld|Restarted|RequestFailed)"), wearable.lines[-12:]


stream.limit_s = 3600


async def small_mtu(air):
    """At the attribute MTU of 23 no frame is cut short: none is sent, and the console says why."""
    wearable = await air.wearable()
    await wearable.press()
    central = await (await Central(await air.host(), wearable).connect(mtu=None)).discover()
    assert await central.pair(keyboard(wearable)) is None
    await central.subscribe("STREAM", "REPORTS")
    await wearable.says(r"notice Withheld\(MtuTooSmall \{ needed: 100, negotiated: 23 \}\)")
    await stays_silent(central)
    assert await central.peer.request_mtu(247) == 247
    await central.received(20, "stream")


async def slow_link(air):
    """Above a connection interval of 20 ms nothing is sent; when the link is quick again the stream goes on."""
    wearable = await air.wearable()
    central = await ready(air, wearable)
    await central.received(20, "stream")
    await central.connection.update_parameters(30, 30, 0, 2000)
    await wearable.says(r"notice Withheld\(IntervalTooLong \{ limit_us: 20000, actual_us: 30000 \}\)")
    await central.settle()
    central.forget()
    await stays_silent(central)
    await central.connection.update_parameters(15, 15, 0, 2000)
    await central.received(20, "stream")


async def stalled_link(air):
    """Over a link that stalls the newest goes first: what waited is at most what was on its way."""
    wearable = await air.wearable(places=3)
    central = await ready(air, wearable)
    central.forget()
    await central.received(20, "stream")
    wearable.radio.stall()
    await asyncio.sleep(1.5)
    before = len(central.frames)
    wearable.radio.recover()
    await central.received(before + 60)
    steps = [b - a for a, b in pairwise(stream_times_ms(central.frames[before:]))]
    jump = next(i for i, step in enumerate(steps) if step > 10)
    # Three in the controller, one before it, two in the stack's queue, one in hand.
    assert jump < 7, steps
    assert steps[jump] > 500, steps
    assert set(steps[:jump] + steps[jump + 1:]) == {10}, steps


async def link_loss(air):
    """A lost link is taken up by the bond: no pairing, no window, and the stream goes on."""
    wearable = await air.wearable()
    device = await air.host()
    central = await ready(air, wearable, device)
    await central.received(20, "stream")
    for _ in range(3):
        await air.lose(wearable)
        central = await back(device, wearable)
        await central.received(20, "stream")
        assert gaps(central.frames) == 0
    assert len(wearable.said("notice (Paired|Passkey)")) == 2, wearable.lines


async def reset(air):
    """After a reset of the wearable its bonds are read back, and the stream goes on."""
    wearable = await air.wearable()
    device = await air.host()
    central = await ready(air, wearable, device)
    await central.received(20, "stream")
    await wearable.stop()
    await air.silence()
    wearable = await air.wearable()
    central = await back(device, wearable)
    await central.received(20, "stream")
    assert not wearable.said("notice (Paired|Passkey)"), wearable.lines


async def fifth_bond(air):
    """Four hosts are remembered. A fifth takes the oldest's place, and only while the window is open."""
    wearable = await air.wearable()
    devices = []
    for count in range(1, 6):
        devices.append(await air.host())
        central = await ready(air, wearable, devices[-1])
        await central.leave()
        assert len(kept_bonds(air.flash)) == BOND_BYTES * min(count, 4)
    kept = kept_bonds(air.flash)
    other = await (await Central(await air.host(), wearable).connect()).discover()
    await wearable_drops(wearable, other.pair(keyboard(wearable)), other)
    assert kept_bonds(air.flash) == kept

    oldest = await Central(devices[0], wearable).connect()
    attempt = asyncio.create_task(oldest.connection.encrypt())
    await oldest.dropped()
    attempt.cancel()
    await asyncio.gather(attempt, return_exceptions=True)
    await wearable.says("notice Advertising")
    assert not wearable.said("notice Resumed"), wearable.lines
    for device in devices[1:]:
        central = await back(device, wearable)
        await central.received(10, "stream")
        await central.leave()


async def silent_controller(air):
    """A controller that never answers one command, and takes no other until it has, costs one link: the stack
    starts anew and does not ask again."""
    wearable = await air.wearable(answers_phy=False)
    device = await air.host()
    await wearable.press()
    central = await (await Central(device, wearable).connect()).discover()
    await wearable.says(r"notice NotGranted\(TwoMegabits\)")
    attempt = asyncio.create_task(central.pair(keyboard(wearable)))
    await wearable.says("notice Restarted")
    await wearable.says("notice Advertising")
    await central.dropped()
    attempt.cancel()
    await asyncio.gather(attempt, return_exceptions=True)
    for _ in range(2):
        central = await ready(air, wearable, device)
        await central.received(20, "stream")
        await central.leave()
    assert len(wearable.said("notice (NotGranted|Restarted)")) == 2, wearable.lines


async def cut_write(air):
    """A link that ends in the middle of a write leaves nothing behind."""
    wearable = await air.wearable()
    device = await air.host()
    central = await ready(air, wearable, device)
    write = bytes(att.ATT_Write_Request(attribute_handle=central.of("CONTROL").handle,
                                        attribute_value=frame("control", bytes(5))))
    for cut in (1, 3, 10, len(write) - 1):
        packet = len(write).to_bytes(2, "little") + b"\x04\x00" + write
        air.throw(device, packet[:4 + cut])
        await air.lose(wearable)
        central = await back(device, wearable)
        await central.received(20, "stream")
    assert not wearable.said("taken"), wearable.lines
    assert await wearable.refused() == 0


SCENARIOS = [stream, small_mtu, slow_link, stalled_link, link_loss, reset, fifth_bond, silent_controller, cut_write]

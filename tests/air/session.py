"""Scenarios: the host's own logic (crate tonus), as `tonus run` has it, against the wearable's own code."""

import streams

# The wearable's own pace: this host works on each packet, as `tonus run` does.
STREAM_HZ = 100
PERIOD_US = 10_000
# A lost wearable that is near by streams again within a second or two; a machine under load takes longer.
BACK_S = 10.0
UP = r"up .*\(C7:0A:70:5E:00:01\) mtu Some\(247\) interval Some\(15000\)"


async def streamed(central, packets):
    """One link was used, and nothing is missing by the packets' numbers nor by the device's own clock."""
    await central.says("reply Calibration Ok")
    await central.says(r"ping Reply \{ id: 12648430, requested_us: 123456789, ")
    counted = await central.says(
        r"stream (\d+) lost 0 duplicate 0 stale 0 boots 1 unreadable 0 in (\d+) us dropped 0", 30 + 10 * packets / STREAM_HZ)
    came, took_us = (int(number) for number in counted.groups())
    assert packets <= came and took_us == (came - 1) * PERIOD_US, counted.group(0)


async def paired(air, wearable, *options):
    """The host has found the wearable by its service, and a person has typed what it shows."""
    await wearable.press()
    central = await air.session("wearable", *options)
    await central.says("passkey?")
    await central.type(f"{await wearable.passkey():06}")
    await central.says("paired EncryptedAuthenticated")
    await central.says(UP)
    return central


async def host_session(air):
    """The host finds the wearable, pairs, streams; the link is killed and comes back within seconds by the bond, twice,
    the second time after a reset of the wearable: every packet within a link has its successor."""
    packets = streams.PACKETS // 3
    wearable = await air.wearable()
    central = await paired(air, wearable, "--packets", str(packets))
    await streamed(central, packets)
    await air.lose(wearable)
    await central.says("down the link ended: ")
    await central.says(UP, BACK_S)
    await streamed(central, packets)
    assert not central.said("down (?!the link ended)"), central.lines
    assert len(central.said("passkey?")) == 1, "the bond is kept"

    await wearable.stop()
    await air.silence()
    await central.says("down the link ended: ")
    await central.says("down no wearable within 10 s: ")
    await air.wearable()
    await central.says(UP)
    await streamed(central, packets)


host_session.limit_s = 3600


async def host_refuses_a_small_mtu(air):
    """A link that leaves the MTU at 23 is refused before a passkey is asked for, with what to do, and tried again."""
    wearable = await air.wearable()
    wearable.radio.small_mtu = True
    await wearable.press()
    central = await air.session("wearable")
    for _ in range(2):
        await central.says("down the link carries attributes of 23 bytes, the stream needs 100: ")
    assert not central.said("passkey|up|stream"), central.lines
    wearable.radio.small_mtu = False
    await central.says("passkey?")


async def host_refuses_a_long_interval(air):
    """A host that keeps to a longer interval than the wearable asks for is refused the stream by itself, with its interval."""
    wearable = await air.wearable()
    wearable.oddities["interval"] = "not granted"
    await wearable.press()
    central = await air.session("wearable", "--interval-ms", "50")
    await central.says(r"down the connection interval is 50 ms, the stream needs 20 ms or less: ")
    assert not central.said("passkey|up|stream"), central.lines


async def host_types_a_wrong_passkey(air):
    """Wrong digits are named as such, and the right ones of the next attempt are taken."""
    wearable = await air.wearable()
    await wearable.press()
    central = await air.session("wearable")
    await central.says("passkey?")
    await central.type(f"{(await wearable.passkey() + 1) % 1_000_000:06}")
    await central.says("down the wearable did not take the passkey: press its pairing button")
    await central.says("passkey?")
    await central.type("nonsense")
    await central.says("down no passkey was given: ")
    await central.says("passkey?")
    await wearable.passkey()
    await central.type(f"{await wearable.passkey():06}")
    await central.says(UP)
    await streamed(central, 100)


async def host_at_a_closed_window(air):
    """Without a press on the button nobody pairs, and the host says what to press."""
    await air.wearable()
    central = await air.session("wearable")
    await central.says("down .*press its pairing button", 60)
    assert not central.said("up|stream"), central.lines


SCENARIOS = [host_session, host_refuses_a_small_mtu, host_refuses_a_long_interval, host_types_a_wrong_passkey, host_at_a_closed_window]

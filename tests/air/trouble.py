"""Scenarios: a host on the wearable's own stack, in the other role (tests/air-central). Bumble may forgive what it
does not, and the other way round; both are asked by the same bytes."""

import asyncio

import streams
from central import CALIBRATION, KINDS
from flash import kept_bonds
from radio import PATIENCE_S
from streams import BOND_BYTES, HURRIED_HZ

PERIOD_US = 10_000
REFUSED = ["read refused 0x05", "write refused 0x05", "subscribe refused 0x05", "subscribe refused 0x05"]


async def used(central, packets):
    """The host has used everything, and what it saw is right."""
    await central.says("reply Calibration Ok")
    read = bytes.fromhex((await central.says("calibration (.*)")).group(1))
    assert read[1] == KINDS["calibration"] and read[18:-4] == CALIBRATION, read.hex()
    await central.says(r"ping Reply \{ id: 12648430, requested_us: 123456789, ")
    counted = await central.says(
        r"stream (\d+) lost 0 duplicate 0 stale 0 boots 1 unreadable 0 in (\d+) us", 30 + 10 * packets / HURRIED_HZ)
    came, took_us = (int(number) for number in counted.groups())
    # By the device's own clock none is missing either.
    assert packets <= came and took_us == (came - 1) * PERIOD_US, counted.group(0)
    await central.says("left")
    assert await asyncio.wait_for(central.process.wait(), PATIENCE_S) == 0


async def leaves(air, wearable, central):
    """The host's program has ended; so has its controller."""
    air.link.remove_controller(central.radio)
    await wearable.says("notice Disconnected")
    await wearable.says("notice Advertising")


async def trouble_central(air):
    """A host on the other stack is refused, pairs, calibrates, pings and counts; it comes back by its bond alone,
    also after the wearable's reset, and with another key it is nobody."""
    bond = air.flash.with_name("bond")
    wearable = await air.wearable("--stream-hz", str(HURRIED_HZ))
    await wearable.press()
    central = await air.central(bond, "--packets", str(streams.PACKETS))
    await central.says("mtu 247")
    await central.says("security NoEncryption")
    await central.says("characteristics 10")
    await central.says("passkey?")
    assert central.said(".* (refused|granted|failed)") == REFUSED, central.lines
    await central.type(f"{await wearable.passkey():06}")
    await central.says("paired EncryptedAuthenticated")
    await wearable.says("notice Paired")
    await used(central, streams.PACKETS)
    await leaves(air, wearable, central)
    assert len(kept_bonds(air.flash)) == BOND_BYTES

    central = await air.central(bond)
    await central.says("security EncryptedAuthenticated")
    await wearable.says("notice Resumed")
    await used(central, 300)
    await leaves(air, wearable, central)

    await wearable.stop()
    await air.silence()
    wearable = await air.wearable()
    central = await air.central(bond)
    await central.says("security EncryptedAuthenticated")
    await wearable.says("notice Resumed")
    await used(central, 300)
    await leaves(air, wearable, central)

    key = bytearray(bond.read_bytes())
    key[-1] ^= 1
    bond.write_bytes(key)
    central = await air.central(bond)
    await wearable.says("notice Connected")
    assert await asyncio.wait_for(central.process.wait(), PATIENCE_S) == 1
    await central.says("ended")
    assert not central.said("security Encrypted|.* granted|calibration|stream"), central.lines
    assert not wearable.said("notice (Paired|Passkey)"), wearable.lines
    assert len(wearable.said("notice Resumed")) == 1, wearable.lines


trouble_central.limit_s = 3600


SCENARIOS = [trouble_central]

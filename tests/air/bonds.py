"""Scenarios: the power goes while a bond is stored. Either the bond is there, or its host pairs again; the hosts of
before come back, and a stranger stays one."""

import asyncio
import random

from bumble.keys import PairingKeys

from central import Central, keyboard, ready
from flash import kept_bonds
from radio import PATIENCE_S, WEARABLE, radio_of
from streams import BOND_BYTES, back

SEED = 0xB0_0D
# A record's sequence, length, version and checksum, and its mark, in words.
RECORD_WORDS = 4
PLACES = 8
RANDOM_CUTS = 6


def steps(bonds):
    """Words that a record of so many bonds takes."""
    return RECORD_WORDS + bonds * BOND_BYTES // 4


async def pairs_until_the_power_goes(air, after):
    """A new host pairs with a wearable whose power goes after so many steps of the storing, or right behind it."""
    wearable = await air.wearable("--power-steps", str(after))
    device = await air.host()
    await wearable.press()
    central = await (await Central(device, wearable).connect()).discover()
    pairing = asyncio.create_task(central.pair(keyboard(wearable)))
    await wearable.says("notice Paired")
    lost = asyncio.create_task(wearable.process.wait())
    # Where it outlives the storing, it is soon cut off by hand.
    await asyncio.wait([lost], timeout=0.2)
    survived = wearable.is_running()
    await wearable.stop()
    wearable.stopped = True
    await lost
    await air.silence()
    await asyncio.gather(pairing, return_exceptions=True)
    return device, survived


async def turned_away(wearable, device):
    """The host knows no key, or a wrong one: it is not taken for anybody."""
    resumed = len(wearable.said("notice Resumed"))
    central = await Central(device, wearable).connect()
    attempt = asyncio.create_task(central.connection.encrypt())
    await central.dropped()
    attempt.cancel()
    await asyncio.gather(attempt, return_exceptions=True)
    await wearable.says("notice Advertising")
    assert len(wearable.said("notice Resumed")) == resumed, wearable.lines


async def stranger(air, wearable, known, rng):
    """Somebody at the address of a host whose key is in doubt, with a key of his own."""
    air.link.remove_controller(radio_of(known))
    device = await air.host(address=str(known.random_address).split("/")[0])
    keys = PairingKeys(ltk=PairingKeys.Key(value=rng.randbytes(16), authenticated=True))
    await device.keystore.update(str(WEARABLE), keys)
    await turned_away(wearable, device)
    air.link.remove_controller(radio_of(device))
    air.link.add_controller(radio_of(known))


async def cut(air, before, old, known, full, rng, after):
    """One cut, in a wearable whose flash was `before`; whether the new bond is there."""
    air.flash.write_bytes(before)
    new, survived = await pairs_until_the_power_goes(air, after)
    kept = kept_bonds(air.flash)
    whole = (old[BOND_BYTES:] if full else old) + kept[-BOND_BYTES:]
    is_kept = kept == whole and kept != old
    assert is_kept or kept == old, f"cut {after}: {kept.hex()}"
    assert is_kept or not survived, f"cut {after}: stored, and not there"
    if is_kept:
        address = bytes(new.random_address)
        assert kept[-BOND_BYTES + 2:][:6] == address, f"cut {after}: {kept.hex()}"

    wearable = await air.wearable()
    await stranger(air, wearable, new, rng)
    central = await back(known, wearable)
    await central.received(5, "stream")
    await central.leave()
    if is_kept:
        central = await back(new, wearable)
    else:
        await turned_away(wearable, new)
        central = await ready(air, wearable, new)
        assert kept_bonds(air.flash)[-BOND_BYTES:] != old[-BOND_BYTES:]
    await central.received(5, "stream")
    await wearable.stop()
    await air.silence()
    return is_kept, survived


async def cuts(air, hosts, total, full):
    """Pairs so many hosts, and cuts the storing of one more at its ends and at random places between."""
    rng = random.Random(SEED)
    wearable = await air.wearable()
    for _ in range(hosts):
        known = await air.host()
        central = await ready(air, wearable, known)
        await central.leave()
    await wearable.stop()
    await air.silence()
    before, old = air.flash.read_bytes(), kept_bonds(air.flash)
    places = {0, 1, 2, total - 2, total - 1, total} | set(rng.sample(range(3, total - 2), RANDOM_CUTS))
    found = {}
    for after in sorted(places):
        found[after] = await cut(air, before, old, known, full, rng, after)
    # The cut before the mark loses the bond; at the mark's half it is there by a majority of its bits.
    expected = {after: (after >= total - 1, after == total) for after in places}
    assert found == expected, found


async def bond_cut(air):
    """The second bond, in a page with room."""
    await cuts(air, 1, steps(2), full=False)


async def bond_cut_in_a_full_page(air):
    """The ninth pairing: the list of four is full, and so is the page. The other page is erased and this one closed."""
    await cuts(air, PLACES, 2 + steps(4), full=True)


bond_cut.limit_s = bond_cut_in_a_full_page.limit_s = 400


SCENARIOS = [bond_cut, bond_cut_in_a_full_page]

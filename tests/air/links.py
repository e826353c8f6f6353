"""Scenarios: what a host finds, what it may do, and how it pairs."""

import asyncio

from bumble import att
from bumble.gatt_client import UUID

from central import CALIBRATION, IDS, KINDS, NOTIFIED, WRITTEN, Central, good, just_works, keyboard, ping, ready, sequence
from flash import kept_bonds
from radio import radio_of

AUTHENTICATION = att.ATT_INSUFFICIENT_AUTHENTICATION_ERROR
NOT_PERMITTED = {att.ATT_READ_NOT_PERMITTED_ERROR, att.ATT_WRITE_NOT_PERMITTED_ERROR}


async def discovery(air):
    """Every characteristic is there with its properties; battery and device information need no pairing."""
    wearable = await air.wearable()
    central = await (await Central(await air.host(), wearable).connect()).discover()
    notify, read, write, command = 0x10, 0x02, 0x08, 0x04
    expected = dict(STREAM=notify, RAW_SEMG=notify, ORIENTATION=notify, INFERENCE=notify, REPORTS=notify, HAND_POSITION=command,
                    CONTROL=write, CALIBRATION=read | write, MODEL_UPLOAD=write | command, PING=command)
    service = next(s for s in central.peer.services if s.uuid == IDS["SERVICE"])
    found = {c.uuid: int(c.properties) for c in service.characteristics}
    assert found == {IDS[name]: properties for name, properties in expected.items()}, found
    values = [bytes(await central.characteristics[UUID(short)].read_value())
              for short in (0x2A19, 0x2A29, 0x2A24, 0x2A26)]
    assert values == [bytes([75]), b"Tonus", b"air", b"0.1.0"], values


async def whole_packets(air):
    """The attribute MTU goes up to 247, and the link to 15 ms, two megabits and long packets."""
    wearable = await air.wearable()
    central = await (await Central(await air.host(), wearable).connect(mtu=517)).discover()
    assert central.mtu == 247, central.mtu
    assert central.client.mtu == 247
    await central.settle()
    assert central.connection.parameters.connection_interval == 15.0, central.connection.parameters
    assert not wearable.said("notice NotGranted"), wearable.lines


async def refusals(central, expected):
    """Every protected read, write and subscription, each by every request there is for it."""
    wrong = []
    for name in NOTIFIED + WRITTEN:
        handle = central.of(name).handle
        requests = [att.ATT_Read_Request(attribute_handle=handle),
                    att.ATT_Read_Blob_Request(attribute_handle=handle, value_offset=0),
                    att.ATT_Write_Request(attribute_handle=handle, attribute_value=ping(1))]
        if name in NOTIFIED:
            requests.append(att.ATT_Write_Request(
                attribute_handle=await central.subscription(name), attribute_value=b"\x01\x00"))
        for request in requests:
            error = await central.request(request)
            if error not in expected:
                wrong.append((name, request.name, error))
    value = central.of("CALIBRATION").handle
    error = await central.request(att.ATT_Read_By_Type_Request(
        starting_handle=value, ending_handle=value, attribute_type=IDS["CALIBRATION"]))
    if error not in expected:
        wrong.append(("CALIBRATION", "read by type", error))
    return wrong


async def permissions_before_pairing(air):
    """Without pairing everything of ours is refused, whatever request asks for it, and nothing comes through."""
    wearable = await air.wearable()
    central = await (await Central(await air.host(), wearable).connect()).discover()
    wrong = await refusals(central, NOT_PERMITTED | {AUTHENTICATION})
    assert not wrong, wrong
    for name in WRITTEN:
        await central.write_command(name, ping(1))
    await central.settle()
    assert not wearable.said("taken"), wearable.lines
    # What only authentication may open says so; the rest is open to nobody.
    calibration = central.of("CALIBRATION").handle
    for request in (att.ATT_Read_Request(attribute_handle=calibration),
                    att.ATT_Write_Request(attribute_handle=calibration, attribute_value=b""),
                    att.ATT_Write_Request(attribute_handle=await central.subscription("STREAM"),
                                          attribute_value=b"\x01\x00")):
        assert await central.request(request) == AUTHENTICATION, request


async def just_works_refused(air):
    """A host without keyboard gets nothing and is dropped, although the window is open; so is its bond."""
    wearable = await air.wearable()
    device = await air.host()
    central = await (await Central(device, wearable).connect()).discover()
    await wearable.press()
    await central.pair(just_works(wearable))
    await wearable.says(r"notice Dropped\(NoPasskey\)")
    await central.dropped()
    await wearable.says("notice Advertising")
    # It comes back, and is still nobody.
    central = await (await Central(device, wearable).connect()).discover()
    wrong = await refusals(central, NOT_PERMITTED | {AUTHENTICATION})
    assert not wrong, wrong
    assert not wearable.said("notice (Paired|Resumed|Passkey)"), wearable.lines
    assert not kept_bonds(air.flash)


async def legacy_pairing_refused(air):
    """Pairing without secure connections fails, passkey or not."""
    wearable = await air.wearable()
    await wearable.press()
    for config in (keyboard(wearable, sc=False), just_works(wearable, sc=False)):
        central = await (await Central(await air.host(), wearable).connect()).discover()
        error = await central.pair(config)
        assert error is not None, "legacy pairing went through"
        wrong = await refusals(central, NOT_PERMITTED | {AUTHENTICATION})
        assert not wrong, wrong
        await central.leave()
    assert not wearable.said("notice (Paired|Passkey)"), wearable.lines


async def pairing_needs_the_window(air):
    """Outside the window the passkey is not even shown; inside it a wrong passkey fails and the right one pairs."""
    wearable = await air.wearable()
    device = await air.host()
    central = await (await Central(device, wearable).connect()).discover()
    device.pairing_config_factory = lambda _connection: keyboard(wearable)
    attempt = central.pair(keyboard(wearable))
    await wearable_drops(wearable, attempt, central)
    assert not wearable.said("notice (Paired|Passkey)"), wearable.lines

    await wearable.press()
    central = await (await Central(device, wearable).connect()).discover()
    error = await central.pair(keyboard(wearable, wrong=1))
    assert error is not None, "a wrong passkey went through"
    await wearable.says("notice PairingFailed")
    assert await central.write("CALIBRATION", b"") == AUTHENTICATION
    error = await central.pair(keyboard(wearable))
    assert error is None, error
    await wearable.says("notice Paired")
    # One press lets in one host.
    await central.leave()
    other = await (await Central(await air.host(), wearable).connect()).discover()
    await wearable_drops(wearable, other.pair(keyboard(wearable)), other)


async def wearable_drops(wearable, attempt, central):
    """The wearable ends a pairing that it did not ask for."""
    pairing = asyncio.create_task(attempt)
    await wearable.says(r"notice Dropped\(WindowClosed\)")
    await central.dropped()
    pairing.cancel()
    await asyncio.gather(pairing, return_exceptions=True)
    await wearable.says("notice Advertising")


async def permissions_after_passkey(air):
    """After the passkey every subscription, write and read that exists is granted."""
    wearable = await air.wearable()
    central = await ready(air, wearable, names=())
    for name in NOTIFIED:
        handle = await central.subscription(name)
        assert await central.request(
            att.ATT_Write_Request(attribute_handle=handle, attribute_value=b"\x01\x00")) is None, name
        assert await central.request(att.ATT_Read_Request(attribute_handle=handle)) is None, name
        # The values themselves are open to nobody.
        assert await central.request(
            att.ATT_Read_Request(attribute_handle=central.of(name).handle)) == att.ATT_READ_NOT_PERMITTED_ERROR, name
    # The illustrative calibration, as a frame.
    shown = bytes(await central.of("CALIBRATION").read_value())
    assert len(shown) == 140 and shown[1] == KINDS["calibration"] and sequence(shown) == 0, shown.hex()
    # A request of each kind is taken, and answered among the reports.
    await central.subscribe("REPORTS")
    for number, (name, kind) in enumerate(dict(CONTROL="control", CALIBRATION="calibration", MODEL_UPLOAD="model",
                                               HAND_POSITION="hand", PING="ping").items()):
        await central.write_command(name, good(name, number))
        await wearable.says(f"taken .* {number}$")
        if kind in ("control", "calibration", "model"):
            replies = await central.received(1, "reply")
            assert replies[-1][18] == KINDS[kind] and replies[-1][19:23] == number.to_bytes(4, "little"), replies
        if kind == "ping":
            answer = (await central.received(1, "ping"))[-1]
            assert answer[19:23] == number.to_bytes(4, "little"), answer.hex()
        central.forget()
    assert bytes(await central.of("CALIBRATION").read_value())[18:-4] == CALIBRATION


async def spoofed_address(air):
    """A stranger under a known host's address gets nothing, and the known host's bond outlives it."""
    wearable = await air.wearable()
    known = await air.host()
    central = await ready(air, wearable, known)
    await central.leave()
    kept = kept_bonds(air.flash)

    known_radio = radio_of(known)
    air.link.remove_controller(known_radio)
    stranger = await air.host(address=str(known.random_address).split("/")[0])
    await wearable.press()
    attacker = await (await Central(stranger, wearable).connect()).discover()
    await attacker.pair(just_works(wearable))
    await attacker.dropped()
    await wearable.says("notice Advertising")
    assert kept_bonds(air.flash) == kept
    air.link.remove_controller(radio_of(stranger))
    air.link.add_controller(known_radio)

    central = await (await Central(known, wearable).connect()).discover()
    await central.connection.encrypt()
    await wearable.says("notice Resumed")
    await central.subscribe("STREAM")
    await central.received(10, "stream")


SCENARIOS = [discovery, whole_packets, permissions_before_pairing, just_works_refused, legacy_pairing_refused,
             pairing_needs_the_window, permissions_after_passkey, spoofed_address]

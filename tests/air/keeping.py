"""What a host sets up stays, whatever happens to link and power: calibration and models."""

import asyncio
import hashlib
import random
import struct
import sys

from central import CALIBRATION, KINDS, ROOT, frame, good, ready
from streams import back

sys.path.insert(0, str(ROOT / "tests/golden"))
import model_image  # noqa: E402

SEED = 0x70_0715
PIECE_BYTES = 216
# Pieces on their way at once; the wearable holds as many while it erases a page.
WINDOW = 4
INTERVAL_S = 0.015
CUTS = 20
NOT_CALIBRATED, NO_MODEL = 1 << 4, 1 << 5
WRONG_OFFSET, NOT_FITTING, BUSY = 6, 8, 9
STATE = struct.Struct("<B8sB8sIIIBBBB")
REPLY = struct.Struct("<BIBBI")


class Replies:
    """Requests and what became of them."""

    def __init__(self, central):
        self.central = central
        self.number = 0

    async def ask(self, name, kind, payload, command=False):
        """One request and its answer: outcome (0 done), reason, detail."""
        number = await self.send(name, kind, payload, command)
        return await self.answer(number)

    async def send(self, name, kind, payload, command=True):
        self.number += 1
        write = self.central.write_command if command else self.central.write
        assert await write(name, frame(kind, payload, self.number)) is None
        return self.number

    async def answer(self, number):
        count = 1
        while True:
            for bytes_ in await self.central.received(count, "reply"):
                _kind, answered, outcome, reason, detail = REPLY.unpack_from(bytes_, 18)
                if answered == number:
                    return outcome, reason, detail
            count += 1

    async def state(self):
        """The models that the wearable says it holds."""
        self.central.forget()
        assert await self.ask("CONTROL", "control", struct.pack("<BI", 3, 0)) == (0, 0, 0)
        bytes_ = (await self.central.received(1, "model_state"))[-1]
        there, hash_, receiving, coming, received, total, _capacity, *_shape = STATE.unpack_from(bytes_, 18)
        return (hash_ if there else None), ((coming, received, total) if receiving else None)

    async def begin(self, model):
        return await self.ask("MODEL_UPLOAD", "model", b"\0" + struct.pack("<I", len(model)) + digest(model))

    async def pieces(self, model, offset=0, until=None):
        """Sends a model from `offset` on, a few pieces ahead of the answers; goes back where one was not taken."""
        until = len(model) if until is None else until
        while offset < until:
            asked = []
            for start in range(offset, min(until, offset + WINDOW * PIECE_BYTES), PIECE_BYTES):
                piece = b"\1" + struct.pack("<I", start) + model[start:start + PIECE_BYTES]
                asked.append(await self.send("MODEL_UPLOAD", "model", piece))
            # A connection interval's worth: the wearable takes no more than one frame in 2 ms for long.
            await asyncio.sleep(INTERVAL_S)
            for number in asked:
                outcome, reason, detail = await self.answer(number)
                assert outcome == 0 or reason in (WRONG_OFFSET, BUSY), reason
                if reason != BUSY:
                    offset = detail
            self.central.forget()

    async def finish(self):
        return await self.ask("MODEL_UPLOAD", "model", b"\2")

    async def upload(self, model, offset=0):
        await self.pieces(model, offset)
        outcome, reason, _detail = await self.finish()
        assert outcome == 0, reason


def digest(model):
    return hashlib.sha256(model).digest()


def first(model):
    return digest(model)[:8]


def model(salt):
    """Some 14 kB, four pages of the flash."""
    return model_image.image(functions=30, rank=16, skills=2, salt=salt)


async def flags(central):
    central.forget()
    return (await central.received(1, "status"))[-1][18 + 35]


async def power_cut(air, wearable, device):
    """The wearable loses its power and gets it back; the host comes back by its bond."""
    await wearable.stop()
    await air.silence()
    wearable = await air.wearable()
    central = await back(device, wearable, "STREAM", "REPORTS")
    return wearable, central


async def calibration_is_kept(air):
    """A calibration outlives the power, and until there is one the status says so."""
    wearable = await air.wearable()
    device = await air.host()
    central = await ready(air, wearable, device)
    assert await flags(central) & NOT_CALIBRATED
    assert await central.write("CALIBRATION", good("CALIBRATION", 3)) is None
    assert await Replies(central).answer(3) == (0, 0, 0)
    assert not await flags(central) & NOT_CALIBRATED
    wearable, central = await power_cut(air, wearable, device)
    assert bytes(await central.of("CALIBRATION").read_value())[18:-4] == CALIBRATION
    assert not await flags(central) & NOT_CALIBRATED


async def model_upload(air):
    """A model is taken whole, used, and there after the power came back; what fits this build alone is taken."""
    wearable = await air.wearable()
    device = await air.host()
    central = await ready(air, wearable, device)
    assert await flags(central) & NO_MODEL
    replies = Replies(central)
    assert await replies.state() == (None, None)
    assert await replies.begin(model(1)) == (0, 0, 0)
    await replies.upload(model(1))
    await wearable.says("model true")
    assert await replies.state() == (first(model(1)), None)
    assert not await flags(central) & NO_MODEL
    # Whole as announced, and of another version.
    other = model(1)[:4] + b"\2" + model(1)[5:]
    assert await replies.begin(other) == (0, 0, 0)
    await replies.pieces(other)
    outcome, reason, _detail = await replies.finish()
    assert (outcome, reason) == (1, NOT_FITTING)
    wearable, central = await power_cut(air, wearable, device)
    assert await Replies(central).state() == (first(model(1)), None)
    assert wearable.said("model true"), wearable.lines


async def model_upload_without_link(air):
    """A link that is lost in the middle of an upload: it goes on where it stopped."""
    wearable = await air.wearable()
    device = await air.host()
    central = await ready(air, wearable, device)
    await Replies(central).begin(model(1))
    await Replies(central).pieces(model(1), until=20 * PIECE_BYTES)
    await air.lose(wearable)
    central = await back(device, wearable, "STREAM", "REPORTS")
    replies = Replies(central)
    active, receiving = await replies.state()
    assert active is None and receiving == (first(model(1)), 20 * PIECE_BYTES, len(model(1))), receiving
    await replies.upload(model(1), receiving[1])
    assert await replies.state() == (first(model(1)), None)


async def model_cut(air):
    """Power that goes at twenty random places of an upload leaves a working model each time, and the upload goes on."""
    rng = random.Random(SEED)
    wearable = await air.wearable()
    device = await air.host()
    central = await ready(air, wearable, device)
    replies = Replies(central)
    assert await replies.begin(model(0)) == (0, 0, 0)
    await replies.upload(model(0))
    for cut in range(1, CUTS + 1):
        old, new = model(cut - 1), model(cut)
        assert await replies.begin(new) == (0, 0, 0)
        # Some pieces are written, some on their way; or the end is.
        await replies.pieces(new, until=rng.randrange(len(new)))
        for _ in range(rng.randrange(WINDOW)):
            await replies.send("MODEL_UPLOAD", "model", b"\2")
        wearable, central = await power_cut(air, wearable, device)
        assert wearable.said("model true"), wearable.lines
        replies = Replies(central)
        active, receiving = await replies.state()
        assert active == first(old), f"cut {cut}: {active}"
        assert receiving is not None and receiving[0] == first(new), f"cut {cut}: {receiving}"
        await replies.upload(new, receiving[1])
        assert await replies.state() == (first(new), None), f"cut {cut}"


model_cut.limit_s = 400


async def restart(air):
    """A restart is granted for this boot alone."""
    wearable = await air.wearable()
    device = await air.host()
    central = await ready(air, wearable, device)
    boot_id = struct.unpack_from("<I", (await central.received(1, "stream"))[0], 2)[0]
    replies = Replies(central)
    outcome, _reason, _detail = await replies.ask("CONTROL", "control", struct.pack("<BI", 4, boot_id ^ 1))
    assert outcome == 1
    await replies.send("CONTROL", "control", struct.pack("<BI", 4, boot_id))
    assert await wearable.process.wait() == 0
    wearable.stopped = True


SCENARIOS = [calibration_is_kept, model_upload, model_upload_without_link, model_cut, restart]

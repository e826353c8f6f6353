"""The whole story, clicked through as a person would: calibrate, check the fit, record, trim, label, discard, train, arm,
recognise, disarm. Runs against everything that serves the page: the stand-in of the tests and `tonus run --link sim`.
"""

import json

from browser import find, until

# A step of a calibration by a simulated person, and learning, take at most so long.
MEASURED_S = 60.0
LEARNT_S = 120.0


def calibrate(tab, name):
    tab.click("step-calibrate")
    tab.wait_visible("who")
    if not tab.value(f"{find('who')}.open"):
        tab.click("who-head")
    tab.write("person-name", name)
    tab.write("person-mass", "75")
    tab.write("person-height", "1.75")
    tab.click("calibrate")
    tab.wait_visible("calibration-step")
    back(tab)
    through_steps(tab, "calibration-use")
    back_from_result(tab)
    assert tab.value(f"{find('result')}.querySelectorAll('td').length") >= 10, "the result names rest, maximum and stiffness"
    assert "±" in tab.text("result"), "every number has its uncertainty"
    tab.click("calibration-use")
    tab.wait_text("calibration-in-use", name)
    tab.wait(f"{find('step-calibrate')}.dataset.done === 'true'", "the step is done")


def touch(tab, place):
    """One point in the robot's frame, typed; the simulated person touches it."""
    before = points(tab)
    for axis, value in zip("xyz", place):
        tab.write(f"teach-{axis}", f"{value:.2f}")
    tab.click("teach-point")
    tab.wait_visible("teach-touching")
    until(lambda: points(tab) == before + 1, f"{place} is touched", 30)
    assert not tab.visible("teach-problem") or points(tab) >= 3, tab.text("teach-problem")


def points(tab):
    return tab.value(f"{find('teach-points')}.children.length")


def teach(tab, look=lambda name: None):
    """Shoulder and points are touched; a line of them teaches nothing, one that is removed and another in its place do."""
    tab.click("step-connect")
    tab.click("teach-head")
    tab.wait_visible("teach-shoulder")
    assert tab.value(f"{find('teach-use')}.disabled"), "there is nothing to use yet"
    tab.click("teach-shoulder")
    tab.wait_visible("teach-touching")
    tab.wait_text("teach-shoulder-at", "touched at", 30)
    for place in [(0.55, 0.10, 0.45), (0.65, 0.10, 0.45), (0.75, 0.10, 0.45)]:
        touch(tab, place)
    tab.wait_text("teach-problem", "on one line")
    look("teach-line")
    assert tab.value(f"{find('teach-use')}.disabled"), "a line teaches nothing"
    tab.click("teach-remove-2")
    until(lambda: points(tab) == 2, "the point is removed")
    touch(tab, (0.65, -0.10, 0.55))
    tab.wait_text("teach-status", "fit each other to")
    look("teach")
    tab.click("teach-use")
    tab.wait_text("teach-status", "in use")
    assert points(tab) == 0, "what is used is not there to be used again"
    tab.click("teach-head")
    tab.wait_text("devices", "shares a frame with the robot")


def check_fit(tab):
    tab.click("step-calibrate")
    tab.click("check-fit")
    through_steps(tab, "fit")
    assert tab.text("fit").strip(), "the check says how the wearable sits"


def back(tab):
    """From the second step to the first, which stands, may be measured again, and leads on."""
    tab.click("step-calibrate")
    tab.click("calibration-step-go")
    tab.wait_visible("calibration-next", MEASURED_S)
    assert tab.value(f"{find('calibration-back')}.disabled"), "there is nothing before the first step"
    tab.click("calibration-next")
    tab.wait_text("step-count", "Step 2 ")
    tab.click("calibration-back")
    tab.wait_text("step-count", "Step 1 ")
    tab.wait_visible("calibration-next")
    tab.click("calibration-again")
    tab.wait(f"!{find('calibration-next')}.checkVisibility()", "it is measured again")
    tab.wait_visible("calibration-next", MEASURED_S)
    tab.click("calibration-next")
    tab.wait_text("step-count", "Step 2 ")


def back_from_result(tab):
    """To the last step that was measured and on to the result again, which says the same."""
    before = tab.text("result")
    tab.click("calibration-back")
    tab.wait_visible("calibration-next")
    assert not tab.visible("found"), "what somebody goes back from is not there to be used"
    tab.click("calibration-next")
    tab.wait_visible("calibration-use")
    assert tab.text("result") == before, "nothing was measured again, so the same is found"


def look_up(tab):
    """The result of the calibration in use is folded away, and stays."""
    assert tab.visible("found-head") and not tab.visible("result"), "it is folded"
    tab.click("found-head")
    tab.wait_visible("result")
    assert "±" in tab.text("result")


def through_steps(tab, last):
    """Start and Next, step after step, until the element `last` is there."""
    steps = 0
    tab.wait_visible("calibration-step")
    while not tab.visible(last):
        count = tab.text("step-count")
        assert tab.text("step-instruction"), "a step says what to do"
        tab.click("calibration-step-go")
        until(lambda: any(map(tab.visible, ("calibration-next", "step-problem", last))), f"{count} is measured", MEASURED_S)
        assert not tab.visible("step-problem"), f"{count}: {tab.text('step-problem')}"
        # The last measurement of a check is its answer.
        if not tab.visible(last):
            tab.click("calibration-next")
        until(lambda: tab.visible(last) or tab.text("step-count") != count, f"{count} is over")
        steps += 1
        assert steps < 60, "a calibration ends"
    return steps


def record(tab, label, seconds):
    before = demonstrations(tab)
    tab.click("step-record")
    tab.write("record-label", label)
    tab.click("record")
    tab.wait_visible("recording")
    tab.wait(f"parseFloat({find('recording')}.textContent.split(':')[1]) >= {seconds}", f"{label} is recorded for {seconds} s", seconds + 30)
    tab.click("stop")
    until(lambda: len(demonstrations(tab)) == len(before) + 1, "the demonstration is in the list")
    return (set(demonstrations(tab)) - set(before)).pop()


def demonstrations(tab):
    ids = tab.value("[...document.querySelectorAll('[data-testid=demonstrations] > li')].map((li) => li.dataset.testid)")
    return [int(each.rsplit("-", 1)[1]) for each in ids]


def field(tab, test_id):
    return tab.value(f"{find(test_id)}.value")


def unfold(tab, item):
    if tab.value(f"{find(f'demonstration-{item}-head')}.getAttribute('aria-expanded')") == "false":
        tab.click(f"demonstration-{item}-head")


def lasts_s(tab, item):
    """How much of a demonstration is kept, and all of it, as the program says."""
    kept, _, whole = tab.value(f"{find(f'demonstration-{item}-head')}.lastChild.textContent").split()[:3]
    return float(kept), float(whole)


def trim(tab, item):
    """By number at its begin, by handle at its end: the program must say both back."""
    unfold(tab, item)
    kept_s, whole_s = lasts_s(tab, item)
    from_s, to_s = (float(field(tab, f"demonstration-{item}-{name}")) for name in ("from", "to"))
    tab.write(f"demonstration-{item}-from", f"{from_s + 0.2:.2f}")
    until(lambda: abs(lasts_s(tab, item)[0] - (kept_s - 0.2)) < 0.02, "the begin is trimmed by 0.2 s")
    left, right, y = tab.value(f"""(() => {{
        const box = {find(f'demonstration-{item}-curve')}.getBoundingClientRect();
        return [box.left + 34, box.right - 8, box.top + box.height / 2];
    }})()""")
    place = lambda t_s: (left + (right - left) * t_s / whole_s, y)
    tab.drag(place(to_s), place(to_s - 0.3))
    until(lambda: abs(lasts_s(tab, item)[0] - (kept_s - 0.5)) < 0.05, "the end is trimmed by 0.3 s")
    now_s = float(field(tab, f"demonstration-{item}-to"))
    assert abs(now_s - (to_s - 0.3)) < 0.05, f"the field says {now_s} s"


def raw(tab):
    """Raw sEMG goes when it is not wanted and comes when it is."""
    until(lambda: tab.visible("raw-empty") or "µV" in tab.text("raw-scale"), "raw sEMG is drawn or said to be missing")
    if not tab.visible("raw-empty"):
        tab.click("raw")
        tab.wait_visible("raw-empty")
    tab.click("raw")
    tab.wait_text("raw", "Stop")
    tab.wait(f"Boolean({find('chart-raw')}.querySelector('canvas')) && {find('raw-scale')}.textContent.includes('µV')", "raw sEMG is drawn")


def relabel(tab, item, label):
    unfold(tab, item)
    tab.write(f"demonstration-{item}-label", label)
    tab.wait_text(f"demonstration-{item}-head", label)


def discard(tab, item):
    unfold(tab, item)
    tab.click(f"demonstration-{item}-discard")
    assert item in demonstrations(tab), "one press discards nothing"
    tab.click(f"demonstration-{item}-discard")
    until(lambda: item not in demonstrations(tab), "the demonstration is discarded")


def train(tab, labels):
    tab.click("step-train")
    tab.click("train")
    tab.wait(f"{find('step-train')}.dataset.done === 'true' && {find('train')}.textContent === 'Train again'", "skills are learnt", LEARNT_S)
    assert not tab.visible("train-problem"), tab.text("train-problem")
    for label in labels:
        assert label in tab.text("counts"), f"{label} is among the skills"
        assert label in tab.text("posterior"), f"{label} has a probability"


def arm(tab):
    tab.click("step-follow")
    tab.wait(f"!{find('arm')}.disabled", "the robot may be armed", 30)
    tab.focus("arm")
    tab.key("Space")
    assert state(tab) == "disarmed", "Space never arms"
    tab.click("arm")
    until(lambda: state(tab) in ("following", "holding"), "the robot is armed")


def state(tab):
    return tab.value(f"{find('robot')}.dataset.state")


def recognise(tab, labels):
    """Asks for movements until one is decided on while the robot follows; what is said of it."""
    decided = f"{find('verdict')}.dataset.kind === 'decided' && {find('robot')}.dataset.state === 'following' && {find('verdict')}.textContent"
    for attempt in range(6):
        tab.wait(f"{find('verdict')}.dataset.kind === 'still'", "the hand is at rest", 30)
        # On a machine that is too busy the evidence grows old, and the robot is disarmed, as it should be.
        if state(tab) == "disarmed":
            print("disarmed:", tab.text("robot-reason"))
            arm(tab)
        tab.write("ask-label", labels[attempt % len(labels)])
        tab.click("ask")
        try:
            said = tab.wait(decided, "a movement is recognised and followed", 15)
        except AssertionError:
            continue
        assert said.split(",")[0] in labels, f"{said!r} names one of {json.dumps(labels)}"
        return said
    raise AssertionError("no movement of six is recognised and followed")


def disarm(tab, key, focus):
    tab.focus(focus)
    tab.key(key)
    until(lambda: state(tab) == "disarmed", f"{key} disarms", 2.0)


def whole(tab, labels, each, seconds, look):
    """All of it; `look` is called with a name wherever there is something new to see. What was said of a movement."""
    raw(tab)
    teach(tab, lambda name: look(f"real-{name}"))
    calibrate(tab, "ada")
    look("real-calibrated")
    check_fit(tab)
    for label in labels:
        for _ in range(each):
            record(tab, label, seconds)
    more = record(tab, labels[0], seconds)
    trim(tab, more)
    look("real-recorded")
    relabel(tab, more, labels[-1])
    discard(tab, more)
    train(tab, labels)
    look("real-trained")
    arm(tab)
    said = recognise(tab, labels)
    look("real-recognised")
    disarm(tab, "Space", "arm")
    arm(tab)
    disarm(tab, "Escape", "step-connect")
    return said

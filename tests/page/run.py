#!/usr/bin/env python3
"""The page of `tonus run` in headless Chromium: everything a person does is clicked, every picture is measured.

    tests/page/run.py target/debug/examples/page_stand                    the page alone, before a scripted program
    tests/page/run.py --story target/debug/tonus run --link sim ...      the story alone, before any program that prints its address

Pictures go to target/page. Prints each check and exits with 1 at the first that fails.
"""

import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import story
from browser import Browser, find, until

HERE = Path(__file__).resolve().parent
PICTURES = HERE.parents[1] / "target" / "page"
SIZES = [(1280, 800), (1920, 1080)]
THEMES = ["light", "dark"]
LABELS = ["lift_filter", "lift_bottle", "hand_over"]
LAYOUT = (HERE / "layout.js").read_text()
CONTRAST = (HERE / "contrast.js").read_text()
PLANTED = {
    ".health { margin-top: -30px !important }": "overlap",
    ".steps button { width: 40px !important; overflow: hidden }": "cut off",
    ".side { margin-right: -40px; margin-left: 40px }": "leaves the window",
    ".robot .reason { margin-top: -16px }": "texts overlap",
}


@contextmanager
def program(command):
    """The program, and the address that it prints."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True)
    try:
        for text in process.stdout:
            if found := re.search(r"http://127\.0\.0\.1:\d+/#[0-9a-f]{32}", text):
                break
        else:
            raise AssertionError(f"{command} ended without an address")
        yield process, found.group()
    finally:
        process.send_signal(signal.SIGCONT)
        process.terminate()
        process.wait(20)


def looked_at(tab, name):
    """Pictures and measures of what is to be seen now, in both sizes and themes."""
    complaints = []
    for width, height in SIZES:
        for theme in THEMES:
            tab.size(width, height, theme)
            tab.wait(f"innerWidth === {width} && document.documentElement.dataset.drawn === '{theme}'", "the window has its size")
            # Charts take their new room with the next views.
            time.sleep(0.4)
            where = f"{name} {width} {theme}"
            complaints += [f"{where}: {each}" for each in tab.value(LAYOUT) + tab.value(CONTRAST)]
            tab.picture(PICTURES / f"{name}-{width}-{theme}.png")
    tab.size(*SIZES[0], THEMES[0])
    assert not complaints, "\n".join(complaints)


def check_the_measures(tab):
    """What is planted must be found: overlaps, cut texts, things out of the window, pale texts."""
    for style, expected in [*PLANTED.items(), (".facts dd { color: #b8c0c8 !important }", "contrast")]:
        # The page's policy forbids style elements, so the rule goes into a sheet that is there.
        tab.value(f"document.styleSheets[1].insertRule({style!r}, document.styleSheets[1].cssRules.length)")
        found = tab.value(LAYOUT) + tab.value(CONTRAST)
        tab.value("document.styleSheets[1].deleteRule(document.styleSheets[1].cssRules.length - 1)")
        assert any(expected in each for each in found), f"{style}: {expected!r} is not among {found}"


def the_page_alone(tab, address):
    tab.wait(f"!document.body.classList.contains('stale')", "the page is live")
    looked_at(tab, "begin")
    check_the_measures(tab)
    story.raw(tab)
    for step in ("connect", "record", "train", "follow"):
        tab.click(f"step-{step}")
        looked_at(tab, f"empty-{step}")
    story.teach(tab, lambda name: looked_at(tab, name))
    tab.click("step-calibrate")
    looked_at(tab, "people")
    recall(tab)
    tab.write("person-name", "ada")
    tab.click("calibrate")
    tab.wait_visible("calibration-step")
    assert "Waiting for the wearable" in tab.text("step-status"), "it is said that the wearable has not answered"
    assert tab.value(f"{find('calibration-step-go')}.disabled"), "nothing is measured before it has"
    looked_at(tab, "calibration")
    tab.click("calibration-cancel")
    story.calibrate(tab, "ada")
    story.look_up(tab)
    looked_at(tab, "result")
    tab.click("found-head")
    story.check_fit(tab)
    looked_at(tab, "fit")
    for label in LABELS:
        for _ in range(2):
            story.record(tab, label, 1.5)
    more = story.record(tab, LABELS[0], 1.5)
    story.trim(tab, more)
    looked_at(tab, "demonstrations")
    story.relabel(tab, more, LABELS[-1])
    story.discard(tab, more)
    story.train(tab, LABELS)
    assert "6 of 6" in tab.text("held-out"), "it is said how many are recognised when left out"
    looked_at(tab, "train")
    story.arm(tab)
    story.recognise(tab, LABELS)
    tab.picture(PICTURES / "recognised.png")
    looked_at(tab, "follow")
    tab.wait(f"{find('verdict')}.dataset.kind === 'unknown'", "an unknown movement is said to be", 60)
    assert story.state(tab) == "holding"
    tab.picture(PICTURES / "unknown.png")
    story.disarm(tab, "Space", "arm")


def keys(tab):
    """Space and Escape disarm from everywhere, Enter arms, Space writes where texts are written, and never presses."""
    tab.click("step-record")
    for key, focus in [("Escape", "record-label"), ("Space", "step-train"), ("Space", "disarm"), ("Escape", "scene-person"), ("Space", "arm")]:
        tab.focus("arm")
        tab.key("Enter")
        until(lambda: story.state(tab) != "disarmed", "Enter arms", 2.0)
        story.disarm(tab, key, focus)
        tab.key(key)
        time.sleep(0.3)
        assert story.state(tab) == "disarmed", f"{key} twice on {focus} leaves it disarmed"
    tab.focus("arm")
    tab.key("Enter")
    until(lambda: story.state(tab) != "disarmed", "Enter arms", 2.0)
    tab.write("record-label", "lift")
    tab.focus("record-label")
    tab.key("Space")
    time.sleep(0.3)
    assert " " in story.field(tab, "record-label"), "Space writes into a text"
    assert story.state(tab) != "disarmed", "a Space that is written does not disarm"
    story.disarm(tab, "Escape", "record-label")
    assert "Disarmed" in tab.text("says"), "a screen reader is told"
    reached = set()
    tab.value("document.activeElement.blur()")
    for _ in range(60):
        tab.key("Tab")
        reached.add(tab.value("document.activeElement.dataset.testid ?? ''"))
    wanted = tab.value("[...document.querySelectorAll('button, input, select, canvas[tabindex]')]"
                       ".filter((node) => node.checkVisibility() && !node.disabled).map((node) => node.dataset.testid)")
    assert not set(wanted) - reached, f"not reached by Tab: {set(wanted) - reached}"
    before = tab.value("document.documentElement.dataset.drawn")
    tab.click("theme")
    tab.wait(f"document.documentElement.dataset.drawn !== '{before}'", "the theme changes")
    tab.click("theme")


def recall(tab):
    """Somebody who was measured before is chosen from the list, and the page says who is in use."""
    names = tab.value(f"[...{find('known-name')}.options].map((option) => option.value)")
    assert names == ["ben", "p07"], names
    tab.value(f"{find('known-name')}.value = 'p07'")
    tab.click("recall")
    tab.wait_text("calibration-in-use", "p07")
    tab.click("who-head")


def lost(tab, process, address):
    """A program that stands still, one that is gone, a token that is wrong or missing: each is said and looks dead."""
    stale = "document.body.classList.contains('stale')"
    process.send_signal(signal.SIGSTOP)
    tab.wait(stale, "a program that stands still is noticed", 2.0)
    assert "nothing new" in tab.text("lost")
    looked_at_lost(tab, "still")
    process.send_signal(signal.SIGCONT)
    tab.wait(f"!{stale}", "it is noticed that it goes on", 5.0)
    assert not tab.visible("lost")
    tab.call("Page.reload")
    tab.wait(f"document.readyState === 'complete' && !{stale}", "a window that is loaded anew still has its token")
    complaints = list(tab.complaints)
    tab.open(address.split("#")[0] + "?other#" + "0" * 32)
    tab.wait(f"{stale} && {find('lost')}.textContent.includes('does not take this window')", "a wrong token is said")
    tab.value("sessionStorage.clear()")
    tab.open(address.split("#")[0] + "?none")
    tab.wait(f"{stale} && {find('lost')}.textContent.includes('lacks the token')", "a missing token is said")
    tab.open(address)
    tab.wait(f"!{stale}", "the right address is taken")
    process.kill()
    tab.wait(f"{stale} && {find('lost')}.textContent.includes('lost')", "a program that is gone is noticed", 2.0)
    looked_at_lost(tab, "lost")
    tab.key("Space")
    tab.wait_text("warns", "not sent")
    # What a refused or lost connection writes on the console is wanted here.
    tab.complaints = complaints


def looked_at_lost(tab, name):
    tab.size(*SIZES[0], "light")
    time.sleep(0.2)
    found = tab.value(LAYOUT)
    tab.picture(PICTURES / f"{name}.png")
    assert not found, f"{name}: {found}"


def nothing_left_the_machine(tab, address):
    own = address.split("/")[2]
    foreign = [each for each in tab.requests if not re.match(rf"(http|ws)://{re.escape(own)}/", each)]
    assert tab.requests and not foreign, f"asked for elsewhere: {foreign}"
    assert not tab.complaints, f"the console says: {tab.complaints}"


def pairing(tab):
    """The wearable asks twice: nobody answers the first time, the second time somebody mistypes, then does not."""
    tab.wait_visible("passkey-form")
    assert "Tonus 7" in tab.text("passkey-what"), "it is said who shows the passkey"
    looked_at(tab, "passkey")
    tab.click("step-calibrate")
    tab.wait_text("devices", "no passkey was given", 40)
    # It asks again, and the field comes to whoever looks elsewhere.
    tab.wait_visible("passkey-form")
    tab.write("passkey", "04821")
    tab.click("passkey-give")
    assert tab.visible("passkey-form"), "the browser itself asks for six digits"
    # Whoever comes around the browser is told by the program.
    tab.value("import('/js/program.js').then((it) => it.givePasskey('04821'))")
    tab.wait_text("refused", "5 characters")
    tab.write("passkey", "048213")
    tab.click("passkey-give")
    tab.wait(f"{find('passkey-form')}.hidden", "it is taken")
    tab.wait_text("devices", "MTU 247")
    kept = tab.value("JSON.stringify([document.documentElement.outerHTML, {...localStorage}, {...sessionStorage}]) + document.querySelector('[data-testid=passkey]').value")
    assert "048213" not in kept, "the digits are kept nowhere on the page"


def stand(command):
    with program(command) as (process, address), Browser() as tab:
        tab.size(*SIZES[0], THEMES[0])
        tab.open(address)
        the_page_alone(tab, address)
        print("clicked through; pictures in", PICTURES)
        keys(tab)
        print("keys: Space and Escape disarm, everything is reached by Tab")
        nothing_left_the_machine(tab, address)
        lost(tab, process, address)
        print("a program that stands still or is gone is said to be")
        nothing_left_the_machine(tab, address)
    with program([*command, "--pairs", "2"]) as (_, address), Browser() as tab:
        tab.size(*SIZES[0], THEMES[0])
        tab.open(address)
        tab.wait(f"!document.body.classList.contains('stale')", "the page is live")
        pairing(tab)
        nothing_left_the_machine(tab, address)
        print("the passkey is asked for, taken and kept nowhere")
    with program([*command, "--channels", "8"]) as (_, address), Browser() as tab:
        tab.size(*SIZES[0], THEMES[0])
        tab.open(address)
        tab.wait(f"!document.body.classList.contains('stale')", "the page is live")
        story.raw(tab)
        looked_at(tab, "eight-channels")
        nothing_left_the_machine(tab, address)
        print("eight channels fit")


def story_alone(command):
    with program(command) as (_, address), Browser() as tab:
        tab.size(*SIZES[0], THEMES[0])
        tab.open(address)
        tab.wait("!document.body.classList.contains('stale')", "the page is live")
        try:
            print("recognised:", story.whole(tab, LABELS, each=5, seconds=5.2, look=lambda name: looked_at(tab, name)))
            nothing_left_the_machine(tab, address)
        finally:
            tab.picture(PICTURES / "story.png")


def main():
    arguments = sys.argv[1:]
    if not arguments or arguments == ["--story"]:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        if arguments[0] == "--story":
            story_alone(arguments[1:])
        else:
            stand(arguments)
    except AssertionError as error:
        print(f"FAILED: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

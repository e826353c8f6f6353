#!/usr/bin/env python3
"""Holds the walk-through's wiring tables and drawings to the pins in the firmware's board files.

    tests/check/pins.py               prints each disagreement and exits with 1 when there is one
    tests/check/pins.py --self-test   swaps pins in each place and expects that to be found

A pin of a board file is known by the field or name it is given; LABELS says what it goes to, in the words of the
table's column "goes to" and of the drawing.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GUIDE = "docs/build-a-wearable.md"

# Board -> heading of its table, and per pin of its file: what the pin goes to.
LABELS = {
    "dk": ("### nRF52840 DK", {
        "Converter.clock": "SCLK",
        "Converter.to_chip": "DIN",
        "Converter.from_chip": "DOUT",
        "Converter.select": "CS",
        "Converter.data_ready": "DRDY",
        "Converter.start": "START",
        "Converter.reset": "RESET",
        "Converter.self_test": "self-test at start",
        "AttitudeSensor.data": "SDA",
        "AttitudeSensor.clock": "SCL",
        "share.button": "lets a host pair",
        "share.to_host": "to the host",
        "share.from_host": "from the host",
    }),
    "xiao": ("### XIAO nRF52840 Sense", {
        "FrontEnd.amplifiers": "amplifier 1",
        "FrontEnd.amplifiers 2": "amplifier 2",
        "FrontEnd.amplifiers 3": "amplifier 3",
        "FrontEnd.amplifiers 4": "amplifier 4",
        "FrontEnd.battery": "middle of the battery's divider",
        "take.divider_switch": "switch of the battery's divider",
        "take.attitude_supply": "supply of the attitude sensor",
        "AttitudeSensor.data": "SDA",
        "AttitudeSensor.clock": "SCL",
        "share.button": "lets a host pair",
        "share.to_host": "to the host",
        "share.from_host": "from the host",
    }),
}


def names(label, text):
    return re.search(rf"\b{re.escape(label)}\b", text) is not None


def board_pins(code):
    """Name of each pin -> `P0.27`: the field, or the variable, below the struct, macro or function that it is in."""
    code = re.sub(r"//[^\n]*", "", code[code.index("fn take()"):])
    tokens = re.compile(r"fn (take)\b|\b(Converter|AttitudeSensor|FrontEnd) \{|(share)!\(|(\w+)(?::| =)|\b(P[01])_(\d\d)\b")
    place, name, pins = "", "", {}
    for match in tokens.finditer(code):
        function, struct, macro, field, port, number = match.groups()
        if port:
            key, count = f"{place}.{name}", 1
            while (key if count == 1 else f"{key} {count}") in pins:
                count += 1
            pins[key if count == 1 else f"{key} {count}"] = f"{port}.{number}"
        elif field:
            name = field
        else:
            place = function or struct or macro
    return pins


def rows(guide, heading):
    """(pin, what it goes to) of each row with a pin in one of its first two columns."""
    section = guide.split(f"\n{heading}\n")[1].split("\n### ")[0].split("\n## ")[0]
    for line in section.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("|") and len(cells) > 2:
            for pin in re.findall(r"\bP[01]\.\d\d\b", " ".join(cells[:2])):
                yield pin, cells[2]


def wires(drawing):
    """(pin, what stands at the other end of its wire): the texts left and right at the same height."""
    texts = re.findall(r'<text x="[\d.]+" y="(\d+)"([^>]*)>([^<]*)<', drawing)
    for y, style, text in texts:
        pin = re.match(r"P[01]\.\d\d", text)
        if pin and 'text-anchor="end"' in style:
            right = [(abs(int(y) - int(at)), other) for at, style, other in texts if "anchor" not in style]
            yield pin.group(), min(right)[1]


def complaints(board, code, guide, drawing):
    heading, labels = LABELS[board]
    pins = board_pins(code)
    for name in pins.keys() ^ labels.keys():
        yield f"{board}: {name} is in one only of the board file and tests/check/pins.py"
    expected = {pins[name]: label for name, label in labels.items() if name in pins}
    for place, found in ((GUIDE, list(rows(guide, heading))), (f"wiring-{board}.svg", list(wires(drawing)))):
        for pin, goes_to in found:
            if pin not in expected:
                yield f"{place}: {pin} is no pin of {board}.rs"
            elif not names(expected[pin], goes_to):
                yield f"{place}: {pin} goes to '{expected[pin]}' in {board}.rs, here to '{goes_to}'"
    listed = [pin for pin, _ in rows(guide, heading)]
    for pin, label in expected.items():
        if listed.count(pin) != 1:
            yield f"{GUIDE}: {pin} ('{label}') is in {listed.count(pin)} rows of {board}'s table"
        if pin not in drawing:
            yield f"wiring-{board}.svg: {pin} ('{label}') is missing"


def sources(board):
    files = (f"firmware/src/board/{board}.rs", GUIDE, f"docs/figures/wiring-{board}.svg")
    return [(ROOT / file).read_text() for file in files]


def self_test():
    swaps = {"dk": ("P0.27", "P0.26"), "xiao": ("P0.02", "P0.03")}
    for board, pair in swaps.items():
        for place in range(3):
            texts = sources(board)
            first, second = [pin.replace(".", "_") if place == 0 else pin for pin in pair]
            text = texts[place]
            texts[place] = text.replace(first, "?").replace(second, first).replace("?", second) if place != 1 else (
                text.replace(f"| {first} |", "?").replace(f"| {second} |", f"| {first} |").replace("?", f"| {second} |"))
            if texts[place] == text or not list(complaints(board, *texts)):
                return f"{board}: {first} and {second} swapped in source {place} went unnoticed"
        code, guide, drawing = sources(board)
        if not list(complaints(board, code, re.sub(r"\n\|[^\n]*lets a host pair[^\n]*", "", guide), drawing)):
            return f"{board}: a missing row went unnoticed"
    return None


def main(arguments):
    if arguments == ["--self-test"]:
        failure = self_test()
        print(failure or "pins: swapped pins and missing rows are found")
        return failure is not None
    found = [line for board in LABELS for line in complaints(board, *sources(board))]
    print("\n".join(found) or "pins: tables and drawings agree with the board files")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

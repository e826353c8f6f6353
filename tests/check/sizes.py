#!/usr/bin/env python3
"""Holds the size of each image to what is recorded in tests/check/sizes.txt, and below the limits.

    tests/check/sizes.py NAME IMAGE            exits with 1 when the image grew by more than 5 %, or is too large
    tests/check/sizes.py --accept NAME IMAGE   records what it takes now
    tests/check/sizes.py --self-test           shows that the check can fail

Flash is everything loaded there, initial data included. RAM is what is there before `main` runs, without the stack,
which has its own 64 kB (memory.x).
"""

import sys
import tempfile
from pathlib import Path

from elf import ALLOCATED, NO_BITS, Elf

RECORD = Path(__file__).with_name("sizes.txt")
HEADER = "# image, bytes of flash, bytes of static RAM. To accept new ones: bash tests/check/link.sh --accept\n"
FLASH_LIMIT, RAM_LIMIT = 384 * 1024, 160 * 1024
GROWTH = 0.05
RAM = range(0x2000_0000, 0x2004_0000)


def sizes(elf):
    """(flash, static RAM) in bytes."""
    taken = [section for section in elf.sections if section.flags & ALLOCATED and section.size]
    flash = sum(section.size for section in taken if section.type != NO_BITS)
    ram = sum(section.size for section in taken if section.address in RAM)
    return flash, ram


def read(record):
    rows = {}
    for number, line in enumerate(record.read_text().splitlines() if record.exists() else [], 1):
        if line and not line.startswith("#"):
            fields = line.split()
            if len(fields) != 3:
                sys.exit(f"{record}:{number}: wants an image, its flash and its RAM, found {line!r}")
            rows[fields[0]] = (int(fields[1]), int(fields[2]))
    return rows


def write(record, rows):
    record.write_text(HEADER + "".join(f"{name} {flash} {ram}\n" for name, (flash, ram) in sorted(rows.items())))


def complaints(name, found, record):
    for what, now, limit in zip(("flash", "static RAM"), found, (FLASH_LIMIT, RAM_LIMIT)):
        if now > limit:
            yield f"{name}: {now} B of {what}, and {limit} B are allowed"
    recorded = read(record).get(name)
    if recorded is None:
        yield f"{name} is not in {record.name}; record it: bash tests/check/link.sh --accept"
        return
    for what, now, before in zip(("flash", "static RAM"), found, recorded):
        if now > before * (1 + GROWTH):
            yield (f"{name}: {now} B of {what}, {now / before - 1:+.1%} against the recorded {before} B; "
                   "make it smaller, or accept it: bash tests/check/link.sh --accept")


def self_test():
    with tempfile.TemporaryDirectory() as scratch:
        record = Path(scratch) / "sizes.txt"
        write(record, {"a": (1000, 2000)})
        cases = [
            ("a", (1050, 2100), []),
            ("a", (10, 20), []),
            ("a", (1051, 2100), ["a: 1051 B of flash, +5.1%"]),
            ("a", (1000, 2101), ["a: 2101 B of static RAM"]),
            ("b", (1, 1), ["b is not in sizes.txt"]),
            ("a", (393217, 1), ["a: 393217 B of flash, and 393216 B are allowed", "a: 393217 B of flash, +"]),
            ("a", (1, 163841), ["a: 163841 B of static RAM, and 163840 B", "a: 163841 B of static RAM, +"]),
        ]
        for name, found, expected in cases:
            got = list(complaints(name, found, record))
            if len(got) != len(expected) or not all(line.startswith(start) for line, start in zip(got, expected)):
                return f"{name} {found}: expected {expected}, got {got}"
    return None


def main(arguments):
    if arguments == ["--self-test"]:
        failure = self_test()
        print(failure or "sizes: growth, excess and a missing record are found")
        return failure is not None
    accept = arguments[:1] == ["--accept"]
    if len(arguments) != 2 + accept:
        print(__doc__, file=sys.stderr)
        return 2
    name, image = arguments[accept:]
    found = sizes(Elf(Path(image).read_bytes()))
    if accept:
        write(RECORD, read(RECORD) | {name: found})
    print(f"{name}: flash {found[0]} of {FLASH_LIMIT} B, static RAM {found[1]} of {RAM_LIMIT} B")
    failures = list(complaints(name, found, RECORD))
    print("\n".join(failures), end="\n" if failures else "")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

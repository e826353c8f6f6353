#!/usr/bin/env python3
"""Checks the chip's image, and that `shared` for the chip allocates nothing.

    tests/check/image.py ble|wired START IMAGE RLIB...   exits with 1 when something is wrong; START is where it lies
    tests/check/image.py --expect-alloc RLIB   exits with 1 unless the library is found to allocate
"""

import re
import sys
from pathlib import Path

from elf import ALLOCATED, FUNCTION, NO_BITS, Elf, members

FLASH = range(0x0000_0000, 0x0010_0000)
RAM = range(0x2000_0000, 0x2004_0000)
ARM = 40

# The allocator's entry points, or any function of the `alloc` crate in either mangling.
ALLOCATION = re.compile(r"__rust_(?:alloc|dealloc|realloc)|__rg_alloc|_ZN5alloc|_R\w*?\d_?5alloc\d|^(?:malloc|free)$")

# What must be in an image: the interrupts that its transport and the converter live by, and Nordic's libraries where
# there is a radio. Without one they must not be: that image is executed elsewhere, which their licence forbids.
COMMON = ["EGU1_SWI1", "SAADC"]
RADIO = ["mpsl_init", "sdc_init", "sdc_hci_data_put"]
REACHED = {"ble": [*COMMON, "RADIO", "TIMER0", "RTC0", "CLOCK_POWER", "EGU0_SWI0", *RADIO], "wired": [*COMMON, "UARTE0"]}
ABSENT = {"ble": [], "wired": RADIO}


def allocating(symbols):
    return sorted({symbol.name for symbol in symbols if ALLOCATION.search(symbol.name)})


def check_image(image, transport, start):
    symbols = {symbol.name: symbol for symbol in image.symbols if symbol.defined}
    loaded = [section for section in image.sections if section.flags & ALLOCATED and section.size]
    in_ram = [section for section in loaded if section.address in RAM]
    code = sum(section.size for section in loaded if section.address in FLASH)
    data = sum(section.size for section in in_ram if section.type != NO_BITS)
    bss = sum(section.size for section in in_ram if section.type == NO_BITS)
    stack = symbols["_stack_start"].value - symbols["_stack_end"].value
    print(f"image: text {code} B, data {data} B, bss {bss} B, stack {stack} B")
    print(f"image: flash {code + data} of {len(FLASH)} B, RAM {data + bss + stack} of {len(RAM)} B")

    if image.machine != ARM or image.wide:
        yield "the image is not 32-bit Arm"
    for section in loaded:
        end = section.address + section.size - 1
        if not any(section.address in memory and end in memory for memory in (FLASH, RAM)):
            yield f"section {section.name} lies at {section.address:#x}..{end:#x}, outside flash and RAM"
    if code + data > len(FLASH):
        yield "code and initial data do not fit the flash"
    if symbols["_stack_end"].value != RAM.start or any(
            section.address < symbols["_stack_start"].value for section in in_ram):
        yield "the stack does not have the bottom of RAM to itself: an overflow would go unnoticed"
    default = symbols["DefaultHandler_"].value if "DefaultHandler_" in symbols else None
    if min(section.address for section in loaded) != start:
        yield f"the image does not begin at {start:#x}, where the board looks for it"
    for name in ABSENT[transport]:
        if name in symbols:
            yield f"{name} is in the image"
    for name in REACHED[transport]:
        if name not in symbols or symbols[name].kind != FUNCTION or symbols[name].value == default:
            yield f"{name} is not in the image"
    for name in allocating(symbols.values()):
        yield f"the image allocates: {name}"


def check_library(path):
    objects = list(members(path.read_bytes()))
    for name in allocating(symbol for each in objects for symbol in each.symbols):
        yield f"{path.name} allocates: {name}"


def main(arguments):
    if len(arguments) < 2 or arguments[0] != "--expect-alloc" and (len(arguments) < 3 or arguments[0] not in REACHED):
        print(__doc__, file=sys.stderr)
        return 2
    if arguments[0] == "--expect-alloc":
        found = list(check_library(Path(arguments[1])))
        print("\n".join(found) or f"{arguments[1]}: an allocation went unnoticed")
        return not found
    transport, start, image, *libraries = arguments
    violations = list(check_image(Elf(Path(image).read_bytes()), transport, int(start, 0)))
    for library in libraries:
        violations += check_library(Path(library))
    print("\n".join(violations) or f"image: sound; {len(libraries)} libraries for the chip, none allocates")
    return bool(violations)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

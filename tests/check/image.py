#!/usr/bin/env python3
"""Checks the chip's image, and that `shared` for the chip allocates nothing.

    tests/check/image.py IMAGE RLIB...     prints sizes; exits with 1 when something is wrong
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

# What must be in the image: the interrupts that Nordic's libraries and the converter live by, and the
# libraries themselves.
REACHED = ["RADIO", "TIMER0", "RTC0", "CLOCK_POWER", "EGU0_SWI0", "EGU1_SWI1", "SAADC", "mpsl_init", "sdc_init",
           "sdc_hci_data_put"]


def allocating(symbols):
    return sorted({symbol.name for symbol in symbols if ALLOCATION.search(symbol.name)})


def check_image(image):
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
    for name in REACHED:
        if name not in symbols or symbols[name].kind != FUNCTION or symbols[name].value == default:
            yield f"{name} is not in the image"
    for name in allocating(symbols.values()):
        yield f"the image allocates: {name}"


def check_library(path):
    objects = list(members(path.read_bytes()))
    for name in allocating(symbol for each in objects for symbol in each.symbols):
        yield f"{path.name} allocates: {name}"


def main(arguments):
    if len(arguments) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    if arguments[0] == "--expect-alloc":
        found = list(check_library(Path(arguments[1])))
        print("\n".join(found) or f"{arguments[1]}: an allocation went unnoticed")
        return not found
    violations = list(check_image(Elf(Path(arguments[0]).read_bytes())))
    for library in arguments[1:]:
        violations += check_library(Path(library))
    print("\n".join(violations) or f"image: sound; {len(arguments) - 1} libraries for the chip, none allocates")
    return bool(violations)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

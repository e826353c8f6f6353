#!/usr/bin/env python3
"""Reads a UF2 file as the XIAO's bootloader does and compares it with the image that it was made from.

    tests/check/uf2.py FILE IMAGE    exits with 1 when the flash would not hold the image, or anything else

Written from Microsoft's specification (github.com/microsoft/uf2) and from what Adafruit's nRF52 bootloader accepts
(src/usb/uf2/ghostfat.c), not from the tool that writes the file.
"""

import struct
import sys
from pathlib import Path

ERASED = 0xFF
# Adafruit's uf2cfg.h: the family, and where an application may be written on a board with a SoftDevice's place.
FAMILY, WRITABLE = 0xADA52840, range(0x1000, 0xEA000)


def flashed(data):
    """Address -> byte of the flash after the file was copied to the drive; a complaint ends it."""
    if not data or len(data) % 512:
        raise ValueError(f"{len(data)} bytes are not whole blocks of 512")
    flash, seen, count = {}, set(), len(data) // 512
    for offset in range(0, len(data), 512):
        block = data[offset:offset + 512]
        first, second, flags, address, size, number, total, family = struct.unpack_from("<8I", block)
        (last,) = struct.unpack_from("<I", block, 508)
        if (first, second, last) != (0x0A324655, 0x9E5D5157, 0x0AB16F30):
            raise ValueError(f"block at {offset}: wrong magic numbers")
        if not flags & 0x2000 or flags & 1 or size != 256 or address % 256:
            raise ValueError(f"block at {offset}: the bootloader would pass over it")
        if family != FAMILY:
            raise ValueError(f"block at {offset}: family {family:#x}")
        if address not in WRITABLE:
            raise ValueError(f"block at {offset}: {address:#x} is not an application's")
        if total != count or number >= total or number in seen:
            raise ValueError(f"block at {offset}: number {number} of {total}, in a file of {count}")
        seen.add(number)
        for place, byte in enumerate(block[32:32 + size], address):
            if place in flash:
                raise ValueError(f"{place:#x} is written twice")
            flash[place] = byte
    return flash


def loaded(elf):
    """Address -> byte that a 32-bit little-endian ELF file loads, by its program headers."""
    table, size, count = *struct.unpack_from("<I", elf, 28), *struct.unpack_from("<HH", elf, 42)
    memory = {}
    for header in range(table, table + size * count, size):
        kind, offset, _, address, length = struct.unpack_from("<5I", elf, header)
        if kind == 1:
            memory.update(zip(range(address, address + length), elf[offset:offset + length]))
    return memory


def compare(uf2, elf):
    flash, memory = flashed(uf2), loaded(elf)
    if not memory:
        raise ValueError("the image loads nothing")
    wrong = [place for place, byte in memory.items() if flash.get(place) != byte]
    if wrong:
        raise ValueError(f"{len(wrong)} bytes differ, the first at {min(wrong):#x}")
    beside = [place for place, byte in flash.items() if place not in memory and byte != ERASED]
    if beside:
        raise ValueError(f"{len(beside)} bytes are no part of the image, the first at {min(beside):#x}")
    return len(memory), len(uf2) // 512


def main(arguments):
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    uf2, elf = (Path(argument).read_bytes() for argument in arguments)
    try:
        length, blocks = compare(uf2, elf)
        # The comparison itself must be able to fail: a block less, and one bit in a payload.
        for damaged in (uf2[:-512], uf2[:40] + bytes([uf2[40] ^ 1]) + uf2[41:]):
            try:
                compare(damaged, elf)
            except ValueError:
                continue
            raise ValueError("a damaged file went unnoticed")
    except ValueError as error:
        print(f"uf2: {error}")
        return 1
    print(f"uf2: {blocks} blocks put the image's {length} B where they belong")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

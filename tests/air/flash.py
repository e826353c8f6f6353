"""What lies in the wearable's flash, read by the description in firmware/src/storage/records.rs alone."""

import struct
import zlib

PAGE_BYTES = 4096
BONDS = 0xFE000
PLACES, PLACE_BYTES, PAGE_HEADER_BYTES = 8, 508, 32
HEADER = struct.Struct("<IHHI")


def record(path, partition):
    """The newest whole record of a partition, or nothing."""
    flash = path.read_bytes()
    newest, kept = -1, b""
    for page in range(2):
        for place in range(PLACES):
            start = partition + page * PAGE_BYTES + PAGE_HEADER_BYTES + place * PLACE_BYTES
            sequence, length, _version, checksum = HEADER.unpack_from(flash, start)
            payload = flash[start + HEADER.size:start + HEADER.size + length]
            mark = int.from_bytes(flash[start + PLACE_BYTES - 4:start + PLACE_BYTES], "little")
            # One that the power went in counts by the majority of its bits.
            written = mark.bit_count() <= 16
            if written and sequence > newest and zlib.crc32(flash[start:start + 8] + payload) == checksum:
                newest, kept = sequence, payload
    return kept


def kept_bonds(path):
    return record(path, BONDS)

"""Golden frames of protocol version 1, built with struct and zlib alone: python3 wire_golden.py > wire_golden.txt"""
import struct
import zlib

BOOT, SEQUENCE, DEVICE_US = 0xDEADBEEF, 0x01020304, 0x0000_0102_0304_0506


def frame(kind, payload):
    body = struct.pack("<BBIIQ", 1, kind, BOOT, SEQUENCE, DEVICE_US) + payload
    return body + struct.pack("<I", zlib.crc32(body))


def i24(count):
    return (count & 0xFFFFFF).to_bytes(3, "little")


FRAMES = {
    "configuration": frame(1, struct.pack("<fffiIB8BBB8s", 1111.11, 100.0, 2.5e-6, -7, 63_500, 4,
                                          1, 2, 3, 4, 0, 0, 0, 0, 50, 1, bytes(range(0xA0, 0xA8)))),
    "configuration_8_no_notch": frame(1, struct.pack("<fffiIB8BBB8s", 200.0, 100.0, 1.0, 0, 85_000, 8,
                                                     5, 5, 5, 5, 1, 2, 3, 4, 0, 0, bytes(8))),
    "stream": frame(2, struct.pack("<I8fff3f8BBH", 78_500, 0.1, 0.25, 0.001, 1.0, 0, 0, 0, 0, 0.5, 1.75,
                                   310.5, 222.25, 95.125, 0, 1, 2, 0, 0, 0, 0, 0, 4, 0b1000_0101)),
    "raw": frame(3, struct.pack("<IBB", 0xFFFF_FFFE, 3, 2) + b"".join(map(i24, (0, 1, -1, 8_388_607, -8_388_608, 1_000)))),
    "raw_full": frame(3, struct.pack("<IBB", 9, 8, 9) + b"".join(i24(1_000 * n - 36_000) for n in range(72))),
    "orientation": frame(4, struct.pack("<4f", 0.5, -0.5, 0.5, -0.5)),
    "hand_seen": frame(5, struct.pack("<B3f", 1, 0.25, -0.4, 0.125)),
    "hand_not_seen": frame(5, struct.pack("<B3f", 0, 0.0, 0.0, 0.0)),
    "ping_request": frame(6, struct.pack("<BIQQQ", 0, 77, 123_456_789_012, 0, 0)),
    "ping_reply": frame(6, struct.pack("<BIQQQ", 1, 77, 123_456_789_012, 5_000_000, 5_000_250)),
    "inference": frame(7, struct.pack("<BB" + "Bf" * 4 + "f3f", 3, 2, 2, -0.0625, 0, -2.75, 0, 0.0, 0, 0.0,
                                      0.375, 410.0, 380.5, 120.25)),
    "status": frame(8, struct.pack("<IHBIIIII8B", 3_600, 3_987, 3, 1, 2, 30, 4, 5, 0, 1, 2, 4, 8, 15, 0, 0)),
    "status_no_battery": frame(8, struct.pack("<IHBIIIII8B", 1, 0, 0, *[0] * 13)),
}

for name, data in FRAMES.items():
    print(name, data.hex())

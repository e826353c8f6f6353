"""Golden frames of protocol version 2, built with struct and zlib alone: python3 wire_golden.py > wire_golden.txt"""
import struct
import zlib

BOOT, SEQUENCE, DEVICE_US = 0xDEADBEEF, 0x01020304, 0x0000_0102_0304_0506


def frame(kind, payload):
    body = struct.pack("<BBIIQ", 2, kind, BOOT, SEQUENCE, DEVICE_US) + payload
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
    "status": frame(8, struct.pack("<IHBIIIII8BBIIHI", 3_600, 3_987, 3, 1, 2, 30, 4, 5, 0, 1, 2, 4, 8, 15, 0, 0,
                                   0b10_1001, 70_000, 8, 513, 9)),
    "status_no_battery": frame(8, struct.pack("<IHBIIIII8BBIIHI", 1, 0, 0, *[0] * 18)),
    "control_raw": frame(9, struct.pack("<BI", 1, 1)),
    "control_send_calibration": frame(9, struct.pack("<BI", 2, 0)),
    "control_send_model_state": frame(9, struct.pack("<BI", 3, 0)),
    "control_restart": frame(9, struct.pack("<BI", 4, 0xFEDC_BA98)),
    "control_send_last_words": frame(9, struct.pack("<BI", 5, 0)),
    "control_face_forward": frame(9, struct.pack("<BI", 6, 0)),
    "calibration": frame(10, struct.pack("<IB8BBf8f8f3f4f2f", 0x0A0B_0C0D, 4,
                                         1, 2, 3, 4, 0, 0, 0, 0, 60, 1000.0, 1e-5, 2e-5, 0.0, 4e-6, 0, 0, 0, 0,
                                         5e-4, 6e-4, 7e-4, 8e-4, 0, 0, 0, 0, 0.025, 0.75, 1.5, 13.0, 13.5, 12.0, 11.5, 62.5, 1.625)),
    "calibration_8_no_notch": frame(10, struct.pack("<IB8BBf8f8f3f4f2f", 0, 8, 5, 5, 1, 1, 2, 3, 4, 4, 0, 2000.0, *[0.125] * 8,
                                                    *[1.0] * 8, 0.5, 0.0, 2.25, 1.0, 2.0, 3.0, 4.0, 20.0, 2.5)),
    "upload_begin": frame(11, struct.pack("<BI32s", 0, 90_001, bytes(range(0x40, 0x60)))),
    "upload_piece": frame(11, struct.pack("<BI5s", 1, 0x0001_02F0, b"\x00\x01\xfe\xff\x80")),
    "upload_piece_full": frame(11, struct.pack("<BI216s", 1, 0, bytes(range(216)))),
    "upload_finish": frame(11, b"\x02"),
    "upload_abandon": frame(11, b"\x03"),
    "model_state": frame(12, struct.pack("<B8sB8sIII4B", 1, bytes(range(1, 9)), 1, bytes(range(0x81, 0x89)), 4_320, 90_001, 163_840,
                                         3, 12, 30, 16)),
    "model_state_empty": frame(12, struct.pack("<B8sB8sIII4B", 0, bytes(8), 0, bytes(8), 0, 0, 163_840, 0, 0, 0, 0)),
    "reply_done": frame(13, struct.pack("<BIBBI", 11, 0x0506_0708, 0, 0, 4_320)),
    "reply_refused": frame(13, struct.pack("<BIBBI", 10, 7, 1, 2, 0)),
    "last_words": frame(14, b"\x1c" + "main.rs:7: Größe 3 > 2 ⚠".encode()),
    "last_words_full": frame(14, bytes([128]) + b"x" * 128),
    "last_words_none": frame(14, bytes(1)),
}

for name, data in FRAMES.items():
    print(name, data.hex())

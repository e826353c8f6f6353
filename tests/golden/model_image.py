"""Golden model image of format version 1, built with struct and zlib alone: python3 model_image.py > model_image.txt"""
import struct
import zlib

D, K, R, Q = 6, 3, 2, 2


def dof(role, transform, noise):
    return struct.pack("<BBHf", role, transform, 0, noise)


def skill(label, log_prior, freedom, log_mean, log_std):
    return label.ljust(16, b"\0") + struct.pack("<4f", log_prior, freedom, log_mean, log_std)


def table(numbers):
    return struct.pack(f"<{len(numbers)}f", *numbers)


body = struct.pack("<B3xf", 0, 0.0625)
body += struct.pack("<5f", 0.25, 0.125, 0.5, 0.03125, 0.0625)
body += struct.pack("<6f", 0.0625, 0.25, 3.0, 0.5, 0.03125, 0.015625)
body += b"".join(dof(1 + axis, 0, 0.001953125) for axis in range(3))
body += b"".join(dof(4 + axis, 1, 0.0625) for axis in range(3))
body += skill("heben".encode(), -0.25, 0.0, 0.5, 0.25)
body += skill("übergeben".encode(), -1.5, 9.0, 0.75, 0.125)
body += table([(n % 17 - 8) / 16 for n in range(D * K * R)])
for q in range(Q):
    body += table([q + n / 32 for n in range(D * K)])
    body += table([1.0, -0.25 * q, 0.5])
    body += table([(d + 1) / 64 for d in range(D)])
head = struct.pack("<4sIIBBBB", b"TNSM", 1, 16 + len(body) + 4, D, K, R, Q)
image = head + body
print((image + struct.pack("<I", zlib.crc32(image))).hex())

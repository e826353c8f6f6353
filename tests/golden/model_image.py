"""Model images of format version 1, built with struct and zlib alone: python3 model_image.py > model_image.txt

Without an argument the golden one of 544 bytes; the virtual air makes larger ones by `image`."""
import struct
import zlib


def dof(role, transform, noise):
    return struct.pack("<BBHf", role, transform, 0, noise)


def skill(label, log_prior, freedom, log_mean, log_std):
    return label.ljust(16, b"\0") + struct.pack("<4f", log_prior, freedom, log_mean, log_std)


def table(numbers):
    return struct.pack(f"<{len(numbers)}f", *numbers)


def factor(rank, number):
    """A lower triangle, row by row, with ones on its diagonal; the last is 0.5 for the golden one's sake."""
    return [(1.0 if row < rank - 1 or rank == 1 else 0.5) if row == column else -0.25 * number / rank * 2
            for row in range(rank) for column in range(row + 1)]


def image(functions=3, rank=2, skills=2, salt=0):
    """Human position and stiffness, and what follows from a number; another `salt` makes another model."""
    dofs = 6
    named = [skill("heben".encode(), -0.25, 0.0, 0.5, 0.25), skill("übergeben".encode(), -1.5, 9.0, 0.75, 0.125)]
    body = struct.pack("<B3xf", 0, 0.0625)
    body += struct.pack("<5f", 0.25, 0.125, 0.5, 0.03125, 0.0625)
    body += struct.pack("<6f", 0.0625, 0.25, 3.0, 0.5, 0.03125, 0.015625)
    body += b"".join(dof(1 + axis, 0, 0.001953125) for axis in range(3))
    body += b"".join(dof(4 + axis, 1, 0.0625) for axis in range(3))
    body += b"".join(named[:skills])
    body += table([((n + salt) % 17 - 8) / 16 for n in range(dofs * functions * rank)])
    for q in range(skills):
        body += table([q + n / 32 for n in range(dofs * functions)])
        body += table(factor(rank, q))
        body += table([(d + 1) / 64 for d in range(dofs)])
    head = struct.pack("<4sIIBBBB", b"TNSM", 1, 16 + len(body) + 4, dofs, functions, rank, skills)
    whole = head + body
    return whole + struct.pack("<I", zlib.crc32(whole))


if __name__ == "__main__":
    print(image().hex())

"""Reads what the checks need from linked images and Rust libraries: sections, symbols, line tables.

Little-endian ELF of 32 or 64 bits, `ar` archives, DWARF 4 and 5 line programs; nothing to install.
"""

import struct
from collections import namedtuple

Section = namedtuple("Section", "name type flags address size data link")
Symbol = namedtuple("Symbol", "name value size kind defined")

ALLOCATED, NO_BITS = 2, 8
FUNCTION = 2


def text_at(data, offset):
    return data[offset:data.index(b"\0", offset)].decode("utf-8", "replace")


class Elf:
    """One ELF file: `machine`, `sections` by order, `symbols`."""

    def __init__(self, data):
        if data[:4] != b"\x7fELF" or data[5] != 1:
            raise ValueError("not a little-endian ELF file")
        self.wide = data[4] == 2
        self.machine = struct.unpack_from("<H", data, 18)[0]
        table = struct.unpack_from("<Q", data, 40)[0] if self.wide else struct.unpack_from("<I", data, 32)[0]
        size, count, names = struct.unpack_from("<HHH", data, 58 if self.wide else 46)
        # Fields: name, type, flags, address, offset, size, link.
        layout = "<IIQQQQI" if self.wide else "<IIIIIII"
        headers = [struct.unpack_from(layout, data, table + i * size) for i in range(count)]
        strings = data[headers[names][4]:headers[names][4] + headers[names][5]]
        self.sections = [
            Section(text_at(strings, name), kind, flags, address, length,
                    b"" if kind == NO_BITS else data[offset:offset + length], link)
            for name, kind, flags, address, offset, length, link in headers]

    def section(self, name):
        return next((section for section in self.sections if section.name == name), None)

    @property
    def symbols(self):
        for table in self.sections:
            if table.type != 2:
                continue
            names = self.sections[table.link].data
            for offset in range(0, table.size, 24 if self.wide else 16):
                if self.wide:
                    name, info, _, home, value, size = struct.unpack_from("<IBBHQQ", table.data, offset)
                else:
                    name, value, size, info, _, home = struct.unpack_from("<IIIBBH", table.data, offset)
                yield Symbol(text_at(names, name), value, size, info & 15, home != 0)


def members(data):
    """The ELF objects in an `ar` archive such as an rlib."""
    if data[:8] != b"!<arch>\n":
        raise ValueError("not an archive")
    offset = 8
    while offset + 60 <= len(data):
        size = int(data[offset + 48:offset + 58])
        body = data[offset + 60:offset + 60 + size]
        if body[:4] == b"\x7fELF":
            yield Elf(body)
        offset += 60 + size + size % 2


class Reader:
    """A cursor over DWARF data."""

    def __init__(self, data, offset):
        self.data, self.at = data, offset

    def take(self, layout):
        value = struct.unpack_from("<" + layout, self.data, self.at)[0]
        self.at += struct.calcsize("<" + layout)
        return value

    def text(self):
        value = text_at(self.data, self.at)
        self.at = self.data.index(b"\0", self.at) + 1
        return value

    def leb(self, signed=False):
        value = shift = 0
        while True:
            byte = self.take("B")
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value - (1 << shift) if signed and byte & 0x40 else value


def entry_table(reader, elf, five):
    """The directories and files of one line program as (name, directory index)."""
    if not five:
        directories = [("", 0)]
        while name := reader.text():
            directories.append((name, 0))
        files = [("", 0)]
        while name := reader.text():
            files.append((name, reader.leb()))
            reader.leb(), reader.leb()
        return directories, files
    tables = []
    for _ in range(2):
        formats = [(reader.leb(), reader.leb()) for _ in range(reader.take("B"))]
        rows = []
        for _ in range(reader.leb()):
            name, directory = "", 0
            for content, form in formats:
                if form in (0x0E, 0x1F):  # strp, line_strp
                    home = elf.section(".debug_str" if form == 0x0E else ".debug_line_str")
                    value = text_at(home.data, reader.take("I"))
                elif form == 0x08:
                    value = reader.text()
                elif form == 0x1E:  # data16: a checksum
                    value, reader.at = None, reader.at + 16
                else:
                    value = {0x0B: lambda: reader.take("B"), 0x05: lambda: reader.take("H"),
                             0x0F: reader.leb}[form]()
                if content == 1:
                    name = value
                elif content == 2:
                    directory = value
            rows.append((name, directory))
        tables.append(rows)
    return tables


def source_rows(elf):
    """Source file -> number of line-table rows, that is of places in the machine code that came from it.

    Rows of code that the linker threw away start at address 0 and are left out.
    """
    counts = {}
    lines = elf.section(".debug_line")
    if lines is None:
        return counts
    reader = Reader(lines.data, 0)
    while reader.at < len(lines.data):
        length = reader.take("I")
        end = reader.at + length
        version = reader.take("H")
        if version >= 5:
            reader.take("H")  # address and segment size
        program = reader.take("I")
        program += reader.at
        reader.take("B")
        if version >= 4:
            reader.take("B")
        reader.take("B"), reader.take("b"), reader.take("B")
        opcode_base = reader.take("B")
        operands = [reader.take("B") for _ in range(opcode_base - 1)]
        directories, files = entry_table(reader, elf, version >= 5)
        paths = [f"{directories[index][0]}/{name}" for name, index in files]
        reader.at = program
        run_program(reader, end, opcode_base, operands, paths, counts, elf.wide)
        reader.at = end
    return counts


def run_program(reader, end, opcode_base, operands, paths, counts, wide):
    file, address, pending = 1, 0, {}

    def row():
        pending[file] = pending.get(file, 0) + 1

    while reader.at < end:
        opcode = reader.take("B")
        if opcode >= opcode_base or opcode == 1:
            row()
        elif opcode == 0:
            length = reader.leb()
            after = reader.at + length
            extended = reader.take("B")
            if extended == 2:
                address = reader.take("Q" if wide else "I")
            elif extended == 1:  # end of sequence
                if address:
                    for index, count in pending.items():
                        counts[paths[index]] = counts.get(paths[index], 0) + count
                file, address, pending = 1, 0, {}
            reader.at = after
        elif opcode == 4:
            file = reader.leb()
        elif opcode == 9:
            reader.take("H")
        else:
            for _ in range(operands[opcode - 1]):
                reader.leb(signed=opcode == 3)

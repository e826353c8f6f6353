#!/usr/bin/env python3
"""Checks which room may use which: the direction of the arrows in the architecture.

Reads `use` trees and inline paths of every Rust file, and the dependencies in the Cargo.toml files. The
rules are the tables below; a room that is not in its table is a violation, so that a new room says what it
stands on. Prints `file:line: what` for each violation and exits with 1.

    tests/check/layering.py               checks the project
    tests/check/layering.py --self-test   plants violations in a scratch tree and expects each to be found
"""

import re
import sys
import tempfile
import tomllib
from pathlib import Path

# --- The rules ------------------------------------------------------------------------------------------

ANY = {"*"}

# Package -> packages of this workspace it may depend on.
PACKAGES = {
    "tonus-shared": set(),
    "tonus-firmware": {"tonus-shared"},
    # A tool for the host; it knows the flash's layout.
    "tonus-uf2": {"tonus-firmware"},
    "tonus": {"tonus-native", "tonus-shared"},
    # The only place on the host where unsafe code stands; it knows nothing of Tonus.
    "tonus-native": set(),
    "tonus-tests": {"tonus", "tonus-native", "tonus-shared"},
    # A library of others, played: it knows nothing of Tonus.
    "tonus-leapc-stand": set(),
    "tonus-air": {"tonus-firmware", "tonus-shared"},
    # The host's own logic, over another Bluetooth stack.
    "tonus-air-central": {"tonus", "tonus-shared"},
    "tonus-on-target": {"tonus-shared"},
    # Under GPL-2.0, as the emulator that it links: nothing may stand on it.
    "tonus-emulated": {"tonus-firmware", "tonus-shared"},
}

# Source folder -> (its crate's name in paths, room -> rooms of the same crate it may use, or one module of a
# room). `lib` and `main` are the crate roots.
ROOMS = {
    "shared/src": ("tonus_shared", {
        "lib": ANY,
        "real": set(),
        "gatt": set(),
        "sample": {"real"},
        "semg": {"real", "sample"},
        "stiffness": {"real"},
        "promp": {"real"},
        "onset": {"real"},
        # A model as bytes: it says with what detector its movements begin.
        "image": {"promp", "onset"},
        # The warning bits of a channel are a packet's field; nothing else of the signal reaches the wire.
        "wire": {"real", "sample", "semg::quality"},
        "pipeline": {"real", "sample", "semg", "stiffness", "wire"},
        # Packets and hand positions in, inference packets out.
        "recognition": {"image", "onset", "promp", "wire"},
    }),
    "firmware/src": ("tonus_firmware", {
        "lib": ANY,
        "main": ANY,
        "afe": {"acquisition"},
        "imu": set(),
        "acquisition": {"afe"},
        "outbox": set(),
        "storage": set(),
        "inbox": set(),
        # Bonds are kept in the flash.
        "ble": {"inbox", "keeper", "outbox", "storage"},
        "signal_path": {"acquisition", "outbox"},
        "requests": {"outbox", "recognition", "signal_path"},
        "wired": {"inbox", "outbox"},
        # The flash must hold the largest model.
        "recognition": {"storage"},
        "battery": set(),
        "last_words": set(),
        "reset": set(),
        "vitals": {"battery"},
        # The one who writes calibrations and models; recognition lets go of a model before.
        "keeper": {"recognition", "requests", "storage"},
        # The loop that the parts meet in.
        "wearable": {"acquisition", "afe", "inbox", "keeper", "requests", "signal_path", "vitals"},
        # From here on the chip. Pins, and what this board has: its battery, its attitude sensor, its flash.
        "board": {"acquisition", "battery", "imu", "reset", "storage"},
        "watchdog": set(),
        "panic": {"last_words"},
        "attitude": {"board", "imu", "watchdog"},
        "front_end": {"acquisition", "afe", "board", "watchdog"},
        # The two transports; an image has one.
        "radio": {"board", "ble", "inbox", "keeper", "outbox", "watchdog"},
        "serial": {"board", "inbox", "keeper", "outbox", "watchdog", "wired"},
    }),
    "host/src": ("tonus", {
        "lib": ANY,
        "main": ANY,
        "atomic": set(),
        "table": set(),
        "statistics": set(),
        "envelope": set(),
        "demonstration": {"table"},
        "model": {"demonstration"},
        "store": {"atomic", "model"},
        "link": set(),
        # The one room that compares time bases; it is told times and reads no clock.
        "clock": set(),
        # A hand is aged by its tracker's clock.
        "leap": {"clock"},
        "robot": set(),
        "simulate": {"link", "robot", "demonstration"},
        "session": {"model", "robot"},
        # Skills ready to be followed.
        "library": {"demonstration", "model", "session", "store"},
        # The running program as a function of its inputs.
        "live": {"calibration", "clock", "demonstration", "library", "model", "robot", "session", "store", "transform"},
        # Devices that give inputs: each a thread of its own.
        "source": {"leap", "link", "live", "recording", "robot", "simulate", "transform"},
        # Measures a person: levels, co-contraction, joint stiffness; and whether the wearable sits as it did.
        "calibration": {"statistics"},
        # From the tracker's frame to the robot's.
        "transform": set(),
        # What happened, on disk.
        "recording": {"atomic", "live", "robot"},
        # The wearable's stream for other programs.
        "broadcast": {"clock", "live"},
        # Recordings for other programs.
        "export": {"atomic", "clock", "config", "demonstration", "library", "live", "recording", "robot", "session"},
        # What is seen, in a browser.
        "page": {"live"},
        "config": {"atomic", "clock", "robot", "transform"},
        # All of it joined: threads, files, page.
        "studio": {"atomic", "broadcast", "calibration", "clock", "config", "leap", "library", "link", "live", "page", "recording", "robot", "session",
                   "simulate", "source", "store", "transform"},
        "demo": {"demonstration", "library", "link", "model", "robot", "session", "simulate"},
        # Other methods on the same demonstrations, for comparison: nothing stands on them but the experiments.
        "baseline": {"demonstration", "model", "statistics"},
        "experiment": {"baseline", "demonstration", "link", "model", "robot", "session", "simulate", "statistics",
                       "table"},
        "report": {"atomic", "demonstration", "experiment", "model", "session"},
        "cli": ANY,
    }),
}

# Source folder or file -> path prefixes that may not occur below it, and why.
FORBIDDEN_PATHS = [
    ("shared/src", ["std", "alloc"], "shared is no_std and allocates nothing"),
    ("host/src/model", ["std::fs", "std::net", "std::time", "std::process"], "a model knows no file, network or clock"),
    ("host/src/model.rs", ["std::fs", "std::net", "std::time", "std::process"], "a model knows no file, network or clock"),
    ("host/src/model", ["tonus_shared::wire", "tonus_shared::pipeline", "tonus_shared::semg"], "a model sees numbers, not packets or signals"),
    ("host/src/clock", ["std::time", "std::fs", "std::net"], "a comparison of clocks is told the times"),
    ("host/src/robot", ["tonus_shared::semg", "tonus_shared::promp"], "a robot takes commands, not models"),
    ("firmware/src/lib.rs", ["std", "embassy_nrf", "nrf_sdc", "nrf_mpsl"], "the library part of the firmware is portable"),
    ("firmware/src/ble.rs", ["std", "embassy_nrf", "nrf_sdc", "nrf_mpsl"], "the library part of the firmware is portable"),
    ("firmware/src/acquisition.rs", ["std", "embassy_nrf", "nrf_sdc", "nrf_mpsl"], "the library part of the firmware is portable"),
    ("firmware/src/outbox.rs", ["std", "embassy_nrf", "nrf_sdc", "nrf_mpsl"], "the library part of the firmware is portable"),
    ("firmware/src/storage.rs", ["std", "embassy_nrf", "nrf_sdc", "nrf_mpsl"], "the library part of the firmware is portable"),
    ("firmware/src/storage", ["std", "embassy_nrf", "nrf_sdc", "nrf_mpsl"], "the library part of the firmware is portable"),
    ("firmware/src/recognition.rs", ["std", "embassy_nrf", "nrf_sdc", "nrf_mpsl"], "the library part of the firmware is portable"),
    ("firmware/src/signal_path.rs", ["std", "embassy_nrf", "nrf_sdc", "nrf_mpsl"], "the library part of the firmware is portable"),
]

# Pattern -> the places where alone it may stand, and why. Comments do not count.
FORBIDDEN_TEXT = [
    (r"\bfn\s+\w*(?:butterworth|bilinear|biquad|jacobian|pseudo_?inverse|bernstein|fourier|potter)\w*",
     ["shared/src"], "filter, stiffness, basis and conditioning maths live in shared alone"),
    (r"\bstruct\s+(?:Biquad|Section|Cascade|Chain|Basis|Belief|Latent|Mixture)\b",
     ["shared/src"], "filter, stiffness, basis and conditioning maths live in shared alone"),
    (r"\b(?:P[01]_\d\d|TIMER\d|PPI_CH\d+|PPI_GROUP\d)\b",
     ["firmware/src/board"], "board alone names pins, timers and PPI channels"),
    (r"(?i)\b(?:0x)?a058_?289[0-9a-f]",
     ["shared/src/gatt.rs"], "identifiers are written once, in shared/src/gatt.rs"),
]

SOURCES = ["shared/src", "firmware/src", "host/src", "tests/src"]

# --- Reading Rust ---------------------------------------------------------------------------------------


def blank(text):
    """The same text with everything but its line breaks removed, so that line numbers stay."""
    return re.sub(r"[^\n]", " ", text)


TOKENS = re.compile(
    r"//[^\n]*|/\*.*?\*/|b?r(#*)\".*?\"\1|b?\"(?:\\.|[^\"\\])*\"|b?'(?:\\.[^']*|[^\\'])'", re.S)


def without_comments(text):
    """Blanks comments alone; a string that holds `//` stays whole."""
    return TOKENS.sub(lambda match: blank(match.group()) if match.group().startswith("/") else match.group(), text)


def code_only(text):
    """Blanks comments, strings and inline `#[cfg(test)] mod ... { }` blocks."""
    text = TOKENS.sub(lambda match: blank(match.group()), text)
    while match := re.search(r"#\[cfg\(test\)\]\s*(?:#\[[^\]]*\]\s*)*mod\s+\w+\s*\{", text):
        depth, end = 1, match.end()
        while depth and end < len(text):
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        text = text[:match.start()] + blank(text[match.start():end]) + text[end:]
    return text


def expand(tree):
    """The full paths of one use tree: `a::{b, c::d}` gives `a::b` and `a::c::d`."""
    tree = tree.strip()
    brace = tree.find("{")
    if brace < 0:
        yield re.sub(r"\s+as\s+\w+$", "", tree).replace(" ", "").replace("\n", "")
        return
    prefix, body, depth, item = tree[:brace], tree[brace + 1:tree.rindex("}")], 0, ""
    for character in body + ",":
        depth += {"{": 1, "}": -1}.get(character, 0)
        if character == "," and depth == 0:
            if item.strip():
                for rest in expand(item):
                    yield (prefix + rest).replace(" ", "").replace("\n", "")
            item = ""
        else:
            item += character


def paths(code):
    """Every path in the code with its line: expanded `use` trees, and inline paths."""
    used = re.compile(r"\buse\s+([^;]+);")
    for match in used.finditer(code):
        line = code.count("\n", 0, match.start()) + 1
        for path in expand(match.group(1)):
            yield line, path.removeprefix("::")
    rest = used.sub(lambda match: blank(match.group()), code)
    for match in re.finditer(r"(?<![\w:])(?:::)?[A-Za-z_]\w*(?:\s*::\s*[A-Za-z_]\w*)+", rest):
        line = rest.count("\n", 0, match.start()) + 1
        yield line, re.sub(r"\s", "", match.group()).removeprefix("::")
    for match in re.finditer(r"\bextern\s+crate\s+(\w+)", rest):
        yield rest.count("\n", 0, match.start()) + 1, match.group(1)


def is_test(path):
    return path.name == "tests.rs" or "tests" in path.parts[1:-1]


def module_of(relative):
    """`semg/chain.rs` is module ["semg", "chain"]; `lib.rs` and `main.rs` are the root."""
    parts = list(relative.with_suffix("").parts)
    if parts[-1] in ("mod", "lib", "main"):
        parts.pop()
    return parts


def resolve(path, module, crate):
    """The path below the crate's root, or None when it leaves the crate."""
    parts = path.split("::")
    if parts[0] in ("crate", crate):
        return parts[1:]
    if parts[0] not in ("self", "super"):
        return None
    here = list(module)
    while parts and parts[0] in ("self", "super"):
        if parts.pop(0) == "super":
            here = here[:-1]
    return here + parts


# --- Checking -------------------------------------------------------------------------------------------


def check_packages(root):
    for manifest in sorted([*root.glob("*/Cargo.toml"), *root.glob("host/*/Cargo.toml"), *root.glob("firmware/*/Cargo.toml"), *root.glob("tests/*/Cargo.toml")]):
        document = tomllib.loads(manifest.read_text())
        name = document["package"]["name"]
        where = f"{manifest.relative_to(root)}:1"
        if name not in PACKAGES:
            yield f"{where}: package {name} is not in the table PACKAGES"
            continue
        tables = [document] + list(document.get("target", {}).values())
        named = {dependency for table in tables
                 for kind in ("dependencies", "dev-dependencies", "build-dependencies")
                 for dependency in table.get(kind, {})}
        for dependency in sorted((named & set(PACKAGES)) - PACKAGES[name] - {name}):
            yield f"{where}: package {name} may not depend on {dependency}"


def re_exports(root_code):
    """Items that a crate root re-exports, with the room they come from."""
    rooms = {}
    for match in re.finditer(r"\bpub\s+use\s+([^;]+);", root_code):
        for path in expand(match.group(1)):
            parts = path.removeprefix("crate::").removeprefix("self::").split("::")
            if len(parts) > 1:
                rooms[parts[-1]] = parts[0]
    return rooms


def allowed(path, places):
    return any(path == place or path.startswith(place + "::") for place in places)


def check_rooms(root, folder, crate, rooms):
    base = root / folder
    library = base / "lib.rs"
    exported = re_exports(code_only(library.read_text())) if library.exists() else {}
    for file in sorted(base.rglob("*.rs")):
        relative = file.relative_to(base)
        if is_test(file.relative_to(root)):
            continue
        module = module_of(relative)
        room = module[0] if module else relative.stem
        where = file.relative_to(root)
        if room not in rooms:
            yield f"{where}:1: room {room} is not in the table ROOMS[{folder!r}]"
            continue
        seen = set()
        for line, path in paths(code_only(file.read_text())):
            below = resolve(path, module, crate)
            if not below:
                continue
            target = exported.get(below[0], below[0])
            known = target in rooms and target not in ("lib", "main", room)
            if known and rooms[room] != ANY and not allowed("::".join([target, *below[1:]]), rooms[room]):
                if (line, target) not in seen:
                    seen.add((line, target))
                    yield f"{where}:{line}: {room} may not use {target} ({path})"


def files_below(root, place):
    path = root / place
    return [path] if path.is_file() else sorted(path.rglob("*.rs"))


def check_forbidden_paths(root):
    for place, prefixes, why in FORBIDDEN_PATHS:
        for file in files_below(root, place):
            if is_test(file.relative_to(root)):
                continue
            found = {(line, prefix) for line, path in paths(code_only(file.read_text()))
                     for prefix in prefixes if path == prefix or path.startswith(prefix + "::")}
            for line, prefix in sorted(found):
                yield f"{file.relative_to(root)}:{line}: {prefix} does not belong here: {why}"


def check_forbidden_text(root):
    for pattern, allowed, why in FORBIDDEN_TEXT:
        for source in SOURCES:
            for file in files_below(root, source):
                name = file.relative_to(root)
                if is_test(name) or any(name.is_relative_to(place) for place in allowed):
                    continue
                code = without_comments(file.read_text())
                for match in re.finditer(pattern, code):
                    line = code.count("\n", 0, match.start()) + 1
                    yield f"{name}:{line}: `{match.group()}`: {why}"


def check(root):
    violations = list(check_packages(root))
    for folder, (crate, rooms) in ROOMS.items():
        violations += check_rooms(root, folder, crate, rooms)
    return violations + list(check_forbidden_paths(root)) + list(check_forbidden_text(root))


# --- Testing the check itself ---------------------------------------------------------------------------

CLEAN = {
    "shared/Cargo.toml": '[package]\nname = "tonus-shared"\n',
    "shared/src/lib.rs": "pub mod promp;\nmod real;\npub use real::Real;\n",
    "shared/src/real.rs": "",
    "shared/src/promp/mod.rs": (
        "// use crate::semg::Chain;\n"
        'const TEXT: &str = "crate::semg::Chain std::vec::Vec";\n'
        "use crate::Real;\nuse super::real as scalar;\n"
        "#[cfg(test)]\nmod tests { use crate::semg::Chain; use std::vec::Vec; }\n"),
    "shared/src/wire/check.rs": "use crate::semg::quality::Quality;\n",
    "shared/src/pipeline.rs": "use crate::{semg::Chain, wire::{self, Stream}};\n",
    "host/Cargo.toml": '[package]\nname = "tonus"\n[dependencies]\ntonus-shared = { path = "x" }\n',
    "host/src/model/learn.rs": "use tonus_shared::promp::Basis;\nuse crate::demonstration::Demonstration;\n",
    "firmware/src/board/dk.rs": "struct Pins(P0_02, TIMER1);\n",
}

# File, its content, and the start of the complaint expected.
PLANTED = [
    ("shared/src/promp/row.rs", "\nuse crate::semg::Chain;\n", "shared/src/promp/row.rs:2: promp may not use semg"),
    ("shared/src/wire/frame.rs", "use crate::{\n    Real,\n    stiffness::{arm, person},\n};\n",
     "shared/src/wire/frame.rs:1: wire may not use stiffness"),
    ("shared/src/wire/packet.rs", "use crate::semg::{\n    chain::Chain, quality::Quality};\n",
     "shared/src/wire/packet.rs:1: wire may not use semg (crate::semg::chain::Chain)"),
    ("shared/src/stiffness/arm.rs", "use super::super::semg::chain;\n", "shared/src/stiffness/arm.rs:1: stiffness may not use semg"),
    ("shared/src/sample.rs", "fn f() {\n    let x = crate::wire::VERSION;\n}\n", "shared/src/sample.rs:2: sample may not use wire"),
    ("shared/src/semg/chain.rs", "extern crate alloc;\n", "shared/src/semg/chain.rs:1: alloc does not belong here"),
    ("shared/src/semg/filter.rs", "fn f() -> std::vec::Vec<u8> {}\n", "shared/src/semg/filter.rs:1: std does not belong here"),
    ("shared/src/novel.rs", "", "shared/src/novel.rs:1: room novel is not in the table"),
    ("host/src/model/recognise.rs", "use crate::link::Packet;\n", "host/src/model/recognise.rs:1: model may not use link"),
    ("host/src/model/em.rs", "use crate::robot::Command;\n", "host/src/model/em.rs:1: model may not use robot"),
    ("host/src/model/fit.rs", "use std::{fmt, fs::File};\n", "host/src/model/fit.rs:1: std::fs does not belong here"),
    ("host/src/robot/gate.rs", "use crate::session::Session;\n", "host/src/robot/gate.rs:1: robot may not use session"),
    ("host/src/envelope.rs", "\n\nfn butterworth_low_pass() {}\n", "host/src/envelope.rs:3: `fn butterworth_low_pass`"),
    ("firmware/src/radio.rs", "let pin = p.P0_13;\n", "firmware/src/radio.rs:1: `P0_13`"),
    ("host/src/link/ble.rs", "// a0582891\nconst ID: u128 = 0xa058_2891_5ca6_433e;\n", "host/src/link/ble.rs:2: `0xa058_2891`"),
    ("host/src/link/find.rs", 'const ID: &str = "A0582891-5ca6";\n', "host/src/link/find.rs:1: `A0582891`"),
    ("host/Cargo.toml", '[package]\nname = "tonus"\n[dependencies]\ntonus-firmware = { path = "x" }\n',
     "host/Cargo.toml:1: package tonus may not depend on tonus-firmware"),
    ("shared/Cargo.toml", '[package]\nname = "tonus-shared"\n[target.x.dev-dependencies]\ntonus = "1"\n',
     "shared/Cargo.toml:1: package tonus-shared may not depend on tonus"),
]


def complaints(files):
    with tempfile.TemporaryDirectory() as scratch:
        for name, text in files.items():
            file = Path(scratch) / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        return check(Path(scratch))


def self_test():
    failures = [f"clean tree: {complaint}" for complaint in complaints(CLEAN)]
    for name, text, expected in PLANTED:
        found = complaints(CLEAN | {name: text})
        if len(found) != 1 or not found[0].startswith(expected):
            failures.append(f"planted in {name}: expected only {expected!r}, found {found}")
    print("\n".join(failures) or f"layering check: {len(PLANTED)} planted violations found, clean tree clean")
    return bool(failures)


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    if sys.argv[1:]:
        print(__doc__, file=sys.stderr)
        return 2
    violations = check(Path(__file__).resolve().parents[2])
    print("\n".join(violations) or "layering: every room uses only what it may")
    return bool(violations)


if __name__ == "__main__":
    sys.exit(main())

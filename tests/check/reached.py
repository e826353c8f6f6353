#!/usr/bin/env python3
"""Proves that named crates are reached: in the dependency graph of a binary, and in its machine code.

Listing a crate in Cargo.toml proves nothing. What counts is code that the linker kept, because the program
can get to it: a function symbol of the crate, or line-table rows of its source files (which survive when
its functions were inlined). Both are looked for under the very version that the graph resolves to.

    tests/check/reached.py PACKAGE TARGET BINARY CRATE...
"""

import json
import subprocess
import sys
from pathlib import Path

from elf import FUNCTION, Elf, source_rows


def normal_dependencies(package, target):
    """Crate name -> source folders of the versions that the package's binary is built from."""
    metadata = json.loads(subprocess.run(
        ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", target],
        check=True, stdout=subprocess.PIPE).stdout)
    packages = {each["id"]: each for each in metadata["packages"]}
    nodes = {each["id"]: each for each in metadata["resolve"]["nodes"]}
    waiting = [each["id"] for each in metadata["packages"] if each["name"] == package]
    reached = set()
    while waiting:
        identity = waiting.pop()
        if identity in reached:
            continue
        reached.add(identity)
        for dependency in nodes[identity]["deps"]:
            macro = any("proc-macro" in kind for target_of in packages[dependency["pkg"]]["targets"]
                        for kind in target_of["kind"])
            if not macro and any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                waiting.append(dependency["pkg"])
    folders = {}
    for identity in reached:
        each = packages[identity]
        folders.setdefault(each["name"], []).append(str(Path(each["manifest_path"]).parent))
    return folders


def evidence(crate, folders, functions, rows):
    """(function symbols, line rows) of the crate in the image."""
    name = crate.replace("-", "_")
    legacy, modern = f"_ZN{len(name)}{name}", f"_{len(name)}{name}"
    symbols = sum(1 for each in functions
                  if each.startswith(legacy) or (each.startswith("_R") and modern in each))
    lines = sum(count for path, count in rows.items()
                if any(path.startswith(folder + "/") for folder in folders))
    return symbols, lines


def main(arguments):
    if len(arguments) < 4:
        print(__doc__, file=sys.stderr)
        return 2
    package, target, binary, *crates = arguments
    graph = normal_dependencies(package, target)
    image = Elf(Path(binary).read_bytes())
    functions = [each.name for each in image.symbols if each.kind == FUNCTION and each.defined]
    rows = source_rows(image)
    missing = 0
    for crate in crates:
        if crate not in graph:
            print(f"{package}: {crate} is not in its dependency graph")
            missing += 1
            continue
        symbols, lines = evidence(crate, graph[crate], functions, rows)
        print(f"{package}: {crate}: {symbols} functions, {lines} source rows in the machine code")
        if symbols == 0 and lines == 0:
            print(f"{package}: {crate} is built but never reached")
            missing += 1
    return bool(missing)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

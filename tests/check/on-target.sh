#!/usr/bin/env bash
# The shared code on an emulated Cortex-M4F: results as on the host, instruction counts as recorded.
set -euo pipefail
cd "$(dirname "$0")/../.."
counts=target/on-target/counts.txt
mkdir -p target/on-target
# A fault on the chip hangs, and `timeout` ends it.
tests/on-target/run >"$counts" || { cat "$counts" >&2; echo "the run on the emulated chip failed: the lines above say where" >&2; exit 1; }
cat "$counts"
python3 tests/on-target/compare.py "$counts"
TONUS_VECTORS="$PWD/target/on-target/vectors.rs" \
    cargo clippy --locked --quiet --target "$CHIP" --profile on-target -p tonus-on-target -- -D warnings

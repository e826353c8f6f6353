#!/usr/bin/env bash
# Each dependency that the project names is on a path that its binaries reach.
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/check/libclang.sh
chip=thumbv7em-none-eabihf
host=$(rustc -vV | sed -n 's/^host: //p')

cargo firmware --locked
cargo build --locked --release -p tonus
chip_reaches() { python3 tests/check/reached.py tonus-firmware "$chip" "target/$chip/firmware/tonus-firmware" "$@"; }
host_reaches() { python3 tests/check/reached.py tonus "$host" target/release/tonus "$@"; }

chip_reaches embassy-executor embassy-nrf heapless micromath libm defmt nalgebra tonus-shared trouble-host
host_reaches nalgebra libm tonus-shared

# The check itself must be able to fail: a crate that no one has, one in the graph of another binary only,
# and one that is built for the chip but leaves no code there.
for absent in no-such-crate ratatui crc-catalog; do
    if chip_reaches "$absent"; then
        echo "$absent was not missed" >&2
        exit 1
    fi
done
echo "dependencies: all reached, the absent ones missed"

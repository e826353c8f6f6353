#!/usr/bin/env bash
# Links the chip's images, prints what they take, holds that to what is recorded, and shows that `shared` for the chip
# allocates nothing: neither in its own and its dependencies' libraries, nor in a linked image.
#
#     tests/check/link.sh            --accept records the sizes as they are now
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/check/libclang.sh
chip=thumbv7em-none-eabihf

# One line for each image: name, cargo alias, transport, and where it lies.
images=(
    "dk-ble firmware ble 0"
    "dk-wired firmware-wired wired 0"
    "xiao-ble firmware-xiao ble 0x27000"
    "xiao-wired firmware-xiao-wired wired 0x27000"
)
elf="target/$chip/firmware/tonus-firmware"

mapfile -t libraries < <(
    cargo build --locked --quiet -p tonus-shared --target "$chip" --message-format json |
        python3 -c '
import json, sys
for line in sys.stdin:
    for name in json.loads(line).get("filenames", []):
        if sys.argv[1] in name and name.endswith(".rlib"):
            print(name)' "$chip"
)
[ "${#libraries[@]}" -gt 0 ] || { echo "no library of shared was built for $chip" >&2; exit 1; }
python3 tests/check/sizes.py --self-test
for image in "${images[@]}"; do
    read -r name alias transport start <<<"$image"
    cargo "$alias" --locked
    python3 tests/check/image.py "$transport" "$start" "$elf" "${libraries[@]}"
    python3 tests/check/sizes.py "$@" "$name" "$elf"
    # An image that lies behind a bootloader goes there as a UF2 file.
    if [ "$start" != 0 ]; then
        cargo xiao-uf2
        python3 tests/check/uf2.py target/tonus-xiao.uf2 "$elf"
    fi
done

# The check itself must be able to fail: a library that does allocate is found out.
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
cat >"$scratch/allocates.rs" <<'RUST'
#![no_std]
extern crate alloc;
pub fn grow(length: usize) -> alloc::vec::Vec<u8> {
    alloc::vec![1; length]
}
RUST
rustc --edition 2024 --crate-type rlib --target "$chip" -o "$scratch/liballocates.rlib" "$scratch/allocates.rs"
python3 tests/check/image.py --expect-alloc "$scratch/liballocates.rlib"

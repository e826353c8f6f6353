# Sourced. Points the generator of the radio bindings at a libclang that has its own headers beside it.
#
# Debian's `libclang-dev` alone puts the library where it cannot find its `stdint.h` ("'stdint.h' file not
# found"); the copy under llvm-*/lib can. Whoever set LIBCLANG_PATH knows better.
if [ -z "${LIBCLANG_PATH:-}" ]; then
    for directory in /usr/lib/llvm-*/lib; do
        if compgen -G "$directory/libclang[.-][s0-9]*" >/dev/null && compgen -G "$directory/clang/*/include/stdint.h" >/dev/null; then
            export LIBCLANG_PATH="$directory"
        fi
    done
fi

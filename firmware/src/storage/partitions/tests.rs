use super::*;

const MEMORY_DK: &str = include_str!("../../../../memory.x");
const MEMORY_XIAO: &str = include_str!("../../../memory-xiao.x");

/// A number of a linker script, as GNU ld reads it: what stands between `before` and the next `,`, `;` or space.
fn number(script: &str, before: &str) -> u32 {
    let (_, text) = script
        .split_once(before)
        .unwrap_or_else(|| panic!("no `{before}`"));
    let text = text.split([',', ';', ' ', '\n']).next().unwrap();
    match (text.strip_prefix("0x"), text.strip_suffix('K')) {
        (Some(hex), _) => u32::from_str_radix(hex, 16).unwrap(),
        (_, Some(kilo)) => kilo.parse::<u32>().unwrap() * 1024,
        _ => text.parse().unwrap(),
    }
}

#[test]
fn linker_scripts_put_the_image_where_the_tables_say() {
    let places = [
        ("? _image_start : ", "? _image_length : ", MEMORY_DK, DK),
        ("_image_start = ", "_image_length = ", MEMORY_XIAO, XIAO),
    ];
    for (start, length, script, Layout { image, .. }) in places {
        assert_eq!(
            (number(script, start), number(script, length)),
            (image.start, image.length)
        );
    }
}

#[test]
fn stack_and_variables_share_the_whole_ram() {
    let region = |name: &str| {
        let (_, line) = MEMORY_DK.split_once(name).unwrap();
        (number(line, "ORIGIN = "), number(line, "LENGTH = "))
    };
    let (stack, ram) = (region("  STACK : "), region("  RAM   : "));
    assert_eq!(stack.0, 0x2000_0000);
    assert_eq!(ram.0, stack.0 + stack.1);
    assert_eq!(ram.0 + ram.1, 0x2000_0000 + 256 * 1024);
}

/// The comments at the heads of the linker scripts, line by line against the tables.
#[test]
fn linker_scripts_print_the_tables() {
    for (script, layout) in [(MEMORY_DK, DK), (MEMORY_XIAO, XIAO)] {
        for partition in layout.partitions().into_iter().flatten() {
            let row = format!(
                " *   0x{:05x} {:4} kB  ",
                partition.start,
                partition.length / 1024
            );
            assert!(script.contains(&row), "{partition:?} wants `{row}`");
        }
    }
}

/// The DK's partitions cover the flash, each beginning where the one before it ends.
#[test]
fn the_dk_wastes_no_page() {
    let mut end = 0;
    for partition in DK.partitions().into_iter().flatten() {
        assert_eq!(partition.start, end, "{partition:?}");
        end = partition.end();
    }
    assert_eq!(end, FLASH_BYTES);
}

/// The addresses of the bootloader's own source: `linker/nrf52840.ld`, `uf2cfg.h` and `DFU_APP_DATA_RESERVED`.
#[test]
fn the_xiao_respects_its_bootloader() {
    const BOOTLOADER: u32 = 0xf_4000;
    const RESERVED_FOR_DATA: u32 = 10 * PAGE_BYTES;
    assert_eq!(XIAO.application.start, 0x2_7000);
    assert_eq!(XIAO.boot[1].start, BOOTLOADER);
    assert_eq!(XIAO.boot[1].end(), FLASH_BYTES);
    assert!(XIAO.application.end() <= BOOTLOADER - RESERVED_FOR_DATA);
    for kept in [XIAO.calibration, XIAO.bonds] {
        assert!(kept.start >= BOOTLOADER - RESERVED_FOR_DATA && kept.end() <= BOOTLOADER);
    }
}

/// 3 (360 x 16 + 360 + 256 + 12) numbers of 4 bytes are 76,656.
#[test]
fn the_largest_model_fits_with_room_for_its_header() {
    for layout in [DK, XIAO] {
        assert_eq!(layout.model_capacity(), 77_824);
        assert!(layout.model_capacity() - 76_656 >= 1024);
    }
}

//! `tonus-uf2 IMAGE FILE`: the wearable's image (ELF) as a file for the XIAO's bootloader.
//!
//! `cargo xiao-uf2` runs it on the image that `cargo firmware-xiao` built. Exit code 0 is success, 1 an image or a
//! file system that will not do, 2 a command line that makes no sense.

mod blocks;
mod error;
mod image;

use std::{
    io::Write,
    path::{Path, PathBuf},
    process::ExitCode,
};

use error::Uf2Error;
use image::Image;
use tonus_firmware::storage::partitions::XIAO;

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [elf, uf2] = arguments.as_slice() else {
        eprintln!(
            "usage: tonus-uf2 IMAGE FILE (cargo xiao-uf2 fills both in)\n\
             for example: tonus-uf2 target/thumbv7em-none-eabihf/firmware/tonus-firmware target/tonus-xiao.uf2"
        );
        return ExitCode::from(2);
    };
    match convert(elf, uf2) {
        Ok(blocks) => {
            let (file, kb) = (uf2.display(), blocks * blocks::PAYLOAD_BYTES / 1024);
            println!(
                "{file}: {blocks} blocks, {kb} kB of flash; copy it to the drive that the XIAO's bootloader shows"
            );
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("tonus-uf2: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Returns the number of blocks written.
fn convert(elf: &Path, uf2: &Path) -> Result<usize, Uf2Error> {
    let bytes = std::fs::read(elf).map_err(|source| Uf2Error::Read {
        path: elf.to_owned(),
        source,
    })?;
    let blocks = blocks::blocks(&Image::read(&bytes, &XIAO.image)?);
    write_whole(uf2, blocks.as_flattened()).map_err(|source| Uf2Error::Write {
        path: uf2.to_owned(),
        source,
    })?;
    Ok(blocks.len())
}

/// The file is there whole or not at all: half of one would be half an image on the chip.
fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = Path::new(&part);
    let written = std::fs::File::create(part).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()?;
        std::fs::rename(part, path)
    });
    if written.is_err() {
        // What is half written helps nobody; the first error is the one to report.
        let _ = std::fs::remove_file(part);
    }
    written
}

#[cfg(test)]
mod tests;

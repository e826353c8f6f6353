//! Where everything lies in the flash: one table per board, checked when it is compiled.

/// What is erased at once, in bytes; partitions begin and end on it (nRF52840 product specification, NVMC).
pub const PAGE_BYTES: u32 = 4096;
/// What is written at once, in bytes.
pub const WORD_BYTES: u32 = 4;
/// Flash of the nRF52840 in bytes.
pub const FLASH_BYTES: u32 = 1024 * 1024;

/// Longest image that a board must have room for, in bytes.
const IMAGE_BYTES: u32 = 384 * 1024;
/// Largest model that must fit, in bytes: three skills of 12 degrees of freedom with 30 weights each at rank
/// 16, no loadings shared. Per skill the loadings (360 x 16), the mean weights (360), a covariance (16 x 16)
/// and the noise (12), each an f32.
const MODEL_BYTES: u32 = 3 * 4 * (360 * 16 + 360 + 16 * 16 + 12);

/// What a partition holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Name {
    /// What starts the application.
    Bootloader,
    /// How far the bootloader has come with an update.
    BootloaderState,
    /// Nordic's master boot record and SoftDevice, which the XIAO's bootloader stands on.
    SoftDevice,
    /// The image that runs.
    Application,
    /// The image that will run next.
    Update,
    /// A model: while one of the two is in use, the other receives.
    Model,
    /// The wearer's calibration.
    Calibration,
    /// Hosts that were paired with.
    Bonds,
}

/// A run of whole pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Partition {
    /// What it holds.
    pub name: Name,
    /// Address of its first byte.
    pub start: u32,
    /// Length in bytes.
    pub length: u32,
}

impl Partition {
    const fn kilobytes(name: Name, start: u32, length_kb: u32) -> Self {
        Self {
            name,
            start,
            length: length_kb * 1024,
        }
    }

    /// Address behind its last byte.
    #[must_use]
    pub const fn end(&self) -> u32 {
        self.start + self.length
    }

    const fn overlaps(&self, other: &Self) -> bool {
        self.start < other.end() && other.start < self.end()
    }
}

/// A board's flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// What is not ours to write.
    pub boot: [Partition; 2],
    /// The application's slot.
    pub application: Partition,
    /// A second slot, where updates are signed and swapped in. One page longer than the first: a swap that
    /// loses power goes on through the spare page.
    pub update: Option<Partition>,
    /// Where the linker puts the image. It is the application's slot when a bootloader starts it, and begins at
    /// 0 when nothing does.
    pub image: Partition,
    /// The two models.
    pub models: [Partition; 2],
    /// The calibration.
    pub calibration: Partition,
    /// The bonds.
    pub bonds: Partition,
}

/// The nRF52840-DK. Its bootloader is still to come: see `image`.
pub const DK: Layout = Layout {
    boot: [
        Partition::kilobytes(Name::Bootloader, 0x0_0000, 32),
        Partition::kilobytes(Name::BootloaderState, 0x0_8000, 4),
    ],
    application: Partition::kilobytes(Name::Application, 0x0_9000, 404),
    update: Some(Partition::kilobytes(Name::Update, 0x6_e000, 408)),
    image: Partition::kilobytes(Name::Application, 0x0_0000, 404),
    models: [
        Partition::kilobytes(Name::Model, 0xd_4000, 80),
        Partition::kilobytes(Name::Model, 0xe_8000, 80),
    ],
    calibration: Partition::kilobytes(Name::Calibration, 0xf_c000, 8),
    bonds: Partition::kilobytes(Name::Bonds, 0xf_e000, 8),
};

/// The Seeed XIAO nRF52840 Sense, whose bootloader stays (Adafruit's nRF52 bootloader, `linker/nrf52840.ld`
/// and `uf2cfg.h`; SoftDevice S140 7.3.0 ends at 0x27000).
///
/// The bootloader writes applications to 0x1000..0xea000 alone and keeps the 40 kB behind them for the
/// application's data: calibration and bonds outlive every update there. The models do not fit beside them; an
/// update of the bootloader itself passes through the end of the application's range and so destroys one, which its
/// hash then tells.
pub const XIAO: Layout = Layout {
    boot: [
        Partition::kilobytes(Name::SoftDevice, 0x0_0000, 156),
        Partition::kilobytes(Name::Bootloader, 0xf_4000, 48),
    ],
    application: Partition::kilobytes(Name::Application, 0x2_7000, 620),
    update: None,
    image: Partition::kilobytes(Name::Application, 0x2_7000, 620),
    models: [
        Partition::kilobytes(Name::Model, 0xc_2000, 80),
        Partition::kilobytes(Name::Model, 0xd_6000, 80),
    ],
    calibration: Partition::kilobytes(Name::Calibration, 0xe_a000, 8),
    bonds: Partition::kilobytes(Name::Bonds, 0xe_c000, 8),
};

const _: () = DK.check();
const _: () = XIAO.check();

impl Layout {
    /// Longest model in bytes: a slot less the page that describes it.
    #[must_use]
    pub const fn model_capacity(&self) -> u32 {
        self.models[0].length - PAGE_BYTES
    }

    /// Every partition; the image is none, it lies over others.
    #[must_use]
    pub const fn partitions(&self) -> [Option<Partition>; 8] {
        [
            Some(self.boot[0]),
            Some(self.boot[1]),
            Some(self.application),
            self.update,
            Some(self.models[0]),
            Some(self.models[1]),
            Some(self.calibration),
            Some(self.bonds),
        ]
    }

    /// Stops the compiler when the table contradicts itself.
    const fn check(&self) {
        let all = self.partitions();
        let mut first = 0;
        while first < all.len() {
            if let Some(partition) = all[first] {
                assert!(partition.start.is_multiple_of(PAGE_BYTES));
                assert!(partition.length.is_multiple_of(PAGE_BYTES) && partition.length > 0);
                assert!(partition.end() <= FLASH_BYTES);
                let mut second = first + 1;
                while second < all.len() {
                    if let Some(other) = all[second] {
                        assert!(!partition.overlaps(&other));
                    }
                    second += 1;
                }
            }
            first += 1;
        }
        assert!(self.application.length >= IMAGE_BYTES);
        if let Some(update) = self.update {
            assert!(update.length >= self.application.length + PAGE_BYTES);
            assert!(!self.image.overlaps(&update));
        }
        // What links fits the slot, and writing a model or a record never hits the running image.
        assert!(self.image.length <= self.application.length);
        assert!(self.image.end() <= self.models[0].start);
        assert!(self.models[0].length == self.models[1].length);
        assert!(self.model_capacity() >= MODEL_BYTES);
        assert!(self.calibration.length == 2 * PAGE_BYTES);
        assert!(self.bonds.length == 2 * PAGE_BYTES);
    }
}

#[cfg(test)]
mod tests;

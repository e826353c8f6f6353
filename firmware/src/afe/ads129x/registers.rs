//! Commands and registers of the ADS1294 and ADS1298 (TI SBAS459, "SPI command definitions" and "Register maps").
//!
//! | addr | register   | reset | 7     | 6        | 5       | 4        | 3          | 2         | 1             | 0         |
//! |------|------------|-------|-------|----------|---------|----------|------------|-----------|---------------|-----------|
//! | 00h  | ID         | –     | DEV2  | DEV1     | DEV0    | 1        | 0          | CH2       | CH1           | CH0       |
//! | 01h  | CONFIG1    | 06h   | HR    | DAISY_EN | CLK_EN  | 0        | 0          | DR2       | DR1           | DR0       |
//! | 02h  | CONFIG2    | 40h¹  | 0     | 0        | WCT_CHOP| INT_TEST | 0          | TEST_AMP  | TEST_FREQ1    | TEST_FREQ0|
//! | 03h  | CONFIG3    | 40h   | PD_REFBUF | 1    | VREF_4V | RLD_MEAS | RLDREF_INT | PD_RLD    | RLD_LOFF_SENS | RLD_STAT² |
//! | 04h  | LOFF       | 00h   | COMP_TH2 | COMP_TH1 | COMP_TH0 | VLEAD_OFF_EN | ILEAD_OFF1 | ILEAD_OFF0 | FLEAD_OFF1 | FLEAD_OFF0 |
//! | 05h… | CHnSET     | 00h   | PDn   | GAINn2   | GAINn1  | GAINn0   | 0          | MUXn2     | MUXn1         | MUXn0     |
//! | 0Dh  | RLD_SENSP  | 00h   | channel 8 … channel 1 |
//! | 0Eh  | RLD_SENSN  | 00h   | channel 8 … channel 1 |
//! | 0Fh  | LOFF_SENSP | 00h   | channel 8 … channel 1 |
//! | 10h  | LOFF_SENSN | 00h   | channel 8 … channel 1 |
//! | 11h  | LOFF_FLIP  | 00h   | channel 8 … channel 1 |
//! | 12h  | LOFF_STATP²| 00h   | channel 8 … channel 1 |
//! | 13h  | LOFF_STATN²| 00h   | channel 8 … channel 1 |
//! | 14h  | GPIO       | 0Fh   | GPIOD4 | GPIOD3  | GPIOD2  | GPIOD1   | GPIOC4     | GPIOC3    | GPIOC2        | GPIOC1    |
//! | 15h  | PACE       | 00h   | 0     | 0        | 0       | PACEE1   | PACEE0     | PACEO1    | PACEO0        | PD_PACE   |
//! | 16h  | RESP       | 00h   | RESP_DEMOD_EN1 | RESP_MOD_EN1 | 1 | RESP_PH2 | RESP_PH1 | RESP_PH0 | RESP_CTRL1  | RESP_CTRL0|
//! | 17h  | CONFIG4    | 00h   | RESP_FREQ2 | RESP_FREQ1 | RESP_FREQ0 | 0 | SINGLE_SHOT | WCT_TO_RLD | PD_LOFF_COMP | 0   |
//! | 18h  | WCT1       | 00h   | aVF_CH6 | aVL_CH5 | aVR_CH7 | aVR_CH4 | PD_WCTA    | WCTA2     | WCTA1         | WCTA0     |
//! | 19h  | WCT2       | 00h   | PD_WCTC | PD_WCTB | WCTB2   | WCTB1    | WCTB0      | WCTC2     | WCTC1         | WCTC0     |
//!
//! ¹ The sheet's table says 40h, its bits 00h; the driver writes it and never relies on it.
//! ² Read only. The bits PD_… of CONFIG3 and CONFIG4 are named "power down", but their 1 means "on".
//!
//! CH5SET to CH8SET do not exist on the ADS1294.

/// The address of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct Register(pub u8);

impl Register {
    pub(super) const ID: Self = Self(0x00);
    pub(super) const CONFIG1: Self = Self(0x01);
    pub(super) const CONFIG3: Self = Self(0x03);
    pub(super) const CH1SET: Self = Self(0x05);
    pub(super) const RLD_SENSP: Self = Self(0x0d);
    pub(super) const GPIO: Self = Self(0x14);
    pub(super) const CONFIG4: Self = Self(0x17);

    /// Bits that read back as they were written; the others are status.
    pub(super) const fn written_bits(self) -> u8 {
        match self.0 {
            0x03 => !config3::RLD_STAT,
            0x00 | 0x12 | 0x13 => 0,
            _ => 0xff,
        }
    }
}

impl core::fmt::Display for Register {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:02X}h", self.0)
    }
}

/// One-byte commands, and the two that take an address and a count.
pub(super) mod command {
    /// Continuous reading: a frame can be clocked out after every data-ready edge.
    pub(crate) const RDATAC: u8 = 0x10;
    /// Stops it. The chip wakes in continuous reading and then ignores RREG.
    pub(crate) const SDATAC: u8 = 0x11;
    /// `001r rrrr`, then `000n nnnn`: reads n + 1 registers from r.
    pub(crate) const RREG: u8 = 0x20;
    /// `010r rrrr`, then `000n nnnn`: writes n + 1 registers from r.
    pub(crate) const WREG: u8 = 0x40;
}

pub(super) mod config1 {
    /// High-resolution mode: modulator at `f_CLK / 4`.
    pub(crate) const HR: u8 = 1 << 7;
    pub(crate) const DR_2_KHZ: u8 = 0b100;
    pub(crate) const DR_1_KHZ: u8 = 0b101;
}

pub(super) mod config2 {
    pub(crate) const INT_TEST: u8 = 1 << 4;
    /// Square wave of `f_CLK / 2^20`.
    pub(crate) const TEST_FREQ_2_20: u8 = 0b01;
}

pub(super) mod config3 {
    pub(crate) const PD_REFBUF: u8 = 1 << 7;
    /// Must be 1.
    pub(crate) const ALWAYS: u8 = 1 << 6;
    pub(crate) const RLDREF_INT: u8 = 1 << 3;
    pub(crate) const PD_RLD: u8 = 1 << 2;
    pub(crate) const RLD_STAT: u8 = 1 << 0;
}

pub(super) mod loff {
    pub(crate) const COMP_TH_SHIFT: u8 = 5;
    pub(crate) const ILEAD_OFF_SHIFT: u8 = 2;
    pub(crate) const FLEAD_OFF_DC: u8 = 0b11;
}

pub(super) mod chnset {
    pub(crate) const PD: u8 = 1 << 7;
    pub(crate) const GAIN_SHIFT: u8 = 4;
    pub(crate) const MUX_ELECTRODE: u8 = 0b000;
    pub(crate) const MUX_SHORTED: u8 = 0b001;
    pub(crate) const MUX_TEST: u8 = 0b101;
}

pub(super) mod config4 {
    pub(crate) const PD_LOFF_COMP: u8 = 1 << 1;
}

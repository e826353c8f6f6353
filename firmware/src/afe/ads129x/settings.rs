//! What the chip is asked to do, and the register values that say so.

use tonus_shared::sample::{AdcScale, AdcScaleError};

use super::registers::{chnset, config1, config2, config3, config4, loff};

/// Internal reference, V (CONFIG3 bit VREF_4V is 0).
pub const REFERENCE_V: f64 = 2.4;
/// Code of a positive full scale, `2^23 - 1` (SBAS459, "Data format").
const FULL_SCALE: i32 = 0x7f_ffff;

/// Scans per second, both in high-resolution mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rate {
    /// 1 kHz, 262 Hz bandwidth.
    Hz1000,
    /// 2 kHz, 524 Hz bandwidth.
    Hz2000,
}

impl Rate {
    /// Scans per second, by the chip's own clock; its internal oscillator is only good to 0.5 % at room
    /// temperature and 2.5 % over all.
    #[must_use]
    pub const fn hz(self) -> u32 {
        match self {
            Self::Hz1000 => 1000,
            Self::Hz2000 => 2000,
        }
    }

    /// Time between two scans, us.
    #[must_use]
    pub const fn period_us(self) -> u32 {
        1_000_000 / self.hz()
    }
}

/// Gain of a channel's amplifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are the values")]
pub enum Gain {
    X1,
    X2,
    X3,
    X4,
    X6,
    X8,
    X12,
}

impl Gain {
    const fn bits(self) -> u8 {
        match self {
            Self::X6 => 0b000,
            Self::X1 => 0b001,
            Self::X2 => 0b010,
            Self::X3 => 0b011,
            Self::X4 => 0b100,
            Self::X8 => 0b101,
            Self::X12 => 0b110,
        }
    }

    /// The factor.
    #[must_use]
    pub const fn factor(self) -> u8 {
        match self {
            Self::X1 => 1,
            Self::X2 => 2,
            Self::X3 => 3,
            Self::X4 => 4,
            Self::X6 => 6,
            Self::X8 => 8,
            Self::X12 => 12,
        }
    }

    /// Volts at the electrodes per count: `REFERENCE_V / gain / (2^23 - 1)`.
    pub(super) fn step_v(self) -> f64 {
        REFERENCE_V / f64::from(self.factor()) / f64::from(FULL_SCALE)
    }

    /// The scale of counts at this gain, for `shared`.
    ///
    /// # Errors
    /// None for any gain; the type is that of [`AdcScale::new`].
    pub fn scale(self) -> Result<AdcScale, AdcScaleError> {
        AdcScale::new(self.step_v(), 0, -FULL_SCALE - 1, FULL_SCALE)
    }
}

/// Current through an electrode by which its loss is noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are the values")]
pub enum LeadOffCurrent {
    Na6,
    Na12,
    Na18,
    Na24,
}

/// Level at which the comparators call an electrode lost, per cent of the supply (positive side; the negative
/// side is its mirror image).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are the values")]
pub enum LeadOffThreshold {
    Percent95,
    Percent92_5,
    Percent90,
    Percent87_5,
    Percent85,
    Percent80,
    Percent75,
    Percent70,
}

/// Lead-off detection by direct current: an electrode that comes off drifts to a rail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeadOff {
    /// Current.
    pub current: LeadOffCurrent,
    /// Comparator level.
    pub threshold: LeadOffThreshold,
}

/// What a channel converts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Its electrode pair.
    Electrodes,
    /// Nothing: switched off, and its input shorted as the sheet recommends.
    Off,
    /// Its amplifier's inputs shorted, to measure noise and offset.
    Shorted,
    /// The internal test signal.
    Test,
}

/// Settings of a chip with `C` channels, 4 (ADS1294) or 8 (ADS1298).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings<const C: usize> {
    /// Scans per second.
    pub rate: Rate,
    /// Gain of every channel.
    pub gain: Gain,
    /// Input of each channel.
    pub inputs: [Input; C],
    /// Lead-off detection at both electrodes of every channel that has electrodes; none when switched off.
    pub lead_off: Option<LeadOff>,
    /// Whether the reference electrode (the sheet's right leg) is driven with the mean of all channels'
    /// electrodes, inverted, which lowers mains hum.
    pub driven_reference: bool,
}

impl<const C: usize> Settings<C> {
    /// All channels on their electrodes at gain 6 and 1 kHz (±0.4 V, so that electrode offsets of up to 0.3 V fit), lead-off at
    /// 6 nA and 95 %, driven reference.
    #[must_use]
    pub const fn surface_emg() -> Self {
        Self {
            rate: Rate::Hz1000,
            gain: Gain::X6,
            inputs: [Input::Electrodes; C],
            lead_off: Some(LeadOff {
                current: LeadOffCurrent::Na6,
                threshold: LeadOffThreshold::Percent95,
            }),
            driven_reference: true,
        }
    }

    /// All channels that are not off on one internal input at gain 6, without lead-off currents.
    pub(super) fn inward(&self, input: Input) -> Self {
        Self {
            rate: self.rate,
            gain: Gain::X6,
            inputs: self.inputs.map(|wanted| match wanted {
                Input::Off => Input::Off,
                _ => input,
            }),
            lead_off: None,
            driven_reference: false,
        }
    }

    /// One bit per channel that has electrodes.
    fn electrode_mask(&self) -> u8 {
        let bits = (0_u8..).zip(&self.inputs);
        bits.filter(|(_, input)| **input == Input::Electrodes)
            .fold(0, |mask, (bit, _)| mask | 1 << bit)
    }

    /// Channels whose lead-off bits mean something, one bit each.
    pub(super) fn lead_off_mask(&self) -> u8 {
        self.lead_off.map_or(0, |_| self.electrode_mask())
    }

    pub(super) fn config1(&self) -> u8 {
        let rate = match self.rate {
            Rate::Hz1000 => config1::DR_1_KHZ,
            Rate::Hz2000 => config1::DR_2_KHZ,
        };
        config1::HR | rate
    }

    pub(super) fn config2(&self) -> u8 {
        if self.inputs.contains(&Input::Test) {
            config2::INT_TEST | config2::TEST_FREQ_2_20
        } else {
            0
        }
    }

    pub(super) fn config3(&self) -> u8 {
        let driver = if self.driven_reference {
            config3::RLDREF_INT | config3::PD_RLD
        } else {
            0
        };
        config3::PD_REFBUF | config3::ALWAYS | driver
    }

    pub(super) fn loff(&self) -> u8 {
        self.lead_off.map_or(0, |lead_off| {
            (lead_off.threshold as u8) << loff::COMP_TH_SHIFT
                | (lead_off.current as u8) << loff::ILEAD_OFF_SHIFT
                | loff::FLEAD_OFF_DC
        })
    }

    pub(super) fn chnset(&self) -> [u8; C] {
        let gain = self.gain.bits() << chnset::GAIN_SHIFT;
        self.inputs.map(|input| match input {
            Input::Electrodes => gain | chnset::MUX_ELECTRODE,
            Input::Off => chnset::PD | chnset::MUX_SHORTED,
            Input::Shorted => gain | chnset::MUX_SHORTED,
            Input::Test => gain | chnset::MUX_TEST,
        })
    }

    /// RLD_SENSP, RLD_SENSN, LOFF_SENSP, LOFF_SENSN, LOFF_FLIP.
    pub(super) fn senses(&self) -> [u8; 5] {
        let driver = if self.driven_reference {
            self.electrode_mask()
        } else {
            0
        };
        let lead_off = self.lead_off_mask();
        [driver, driver, lead_off, lead_off, 0]
    }

    pub(super) fn config4(&self) -> u8 {
        self.lead_off.map_or(0, |_| config4::PD_LOFF_COMP)
    }
}

//! What is connected to the chip: pins, electrodes, the serial line, devices on SPI and I2C.

use std::collections::VecDeque;

use crate::device::{ads129x::Ads129x, lsm6dso::Lsm6dso};

/// Levels of all pins.
#[derive(Clone, Debug, Default)]
pub struct Pins {
    /// What the world drives, by port.
    outside: [u32; 2],
    /// Level of each pin.
    pub levels: [u32; 2],
    /// Pins whose sensing latch is set.
    pub latched: [u32; 2],
    /// What the chip drives, and whether it does.
    chip: [(u32, u32); 2],
}

impl Pins {
    /// What the world drives on a port.
    #[must_use]
    pub fn driven(&self, port: usize) -> u32 {
        self.outside[port]
    }

    /// Drives a pin (32 and up are port 1).
    pub fn set(&mut self, pin: u32, high: bool) {
        let port = (pin / 32) as usize;
        let bit = 1 << (pin % 32);
        self.outside[port] = self.outside[port] & !bit | if high { bit } else { 0 };
    }

    /// Level of a pin that the chip drives; high where it does not (a pull-up).
    #[must_use]
    pub fn chip_level(&self, pin: u32) -> bool {
        let (levels, driven) = self.chip[(pin / 32) as usize];
        (levels | !driven) >> (pin % 32) & 1 == 1
    }

    /// Whether the chip drives a pin high; an open one has a pull-down.
    fn chip_drives_high(&self, pin: u32) -> bool {
        let (levels, driven) = self.chip[(pin / 32) as usize];
        (levels & driven) >> (pin % 32) & 1 == 1
    }
}

/// Voltages that the chip runs from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Supply {
    /// Of the chip itself.
    pub vdd_mv: u32,
    /// In front of its first regulator: the battery.
    pub vddh_mv: u32,
}

impl Default for Supply {
    /// The DK on USB or a coin cell: both are 3 V (its user guide, section "Power supply").
    fn default() -> Self {
        Self {
            vdd_mv: 3000,
            vddh_mv: 3000,
        }
    }
}

/// Voltages at the converter's inputs, as the counts that it makes of them.
#[derive(Clone, Debug, Default)]
pub struct Converter {
    /// What it measures of the chip's own supply.
    pub supply: Supply,
    /// Counts of each input in turn, by the input's number (1 is AIN0); repeated when over.
    pub signals: Vec<(u32, Vec<i16>)>,
    /// Conversions so far: cycle, input, count.
    pub converted: Vec<(u64, u32, i16)>,
    /// Times that it was told to sample and could not.
    pub missed: u64,
    taken: usize,
}

impl Converter {
    /// With these signals at its inputs.
    #[must_use]
    pub fn with_signals(signals: Vec<(u32, Vec<i16>)>) -> Self {
        Self {
            signals,
            ..Self::default()
        }
    }

    /// The next count of an input, taken at a cycle; an input without a signal gives 0.
    pub fn next(&mut self, input: u32, at: u64) -> i16 {
        let signal = self.signals.iter().find(|(number, _)| *number == input);
        let count = signal
            .and_then(|(_, counts)| counts.get(self.taken % counts.len().max(1)))
            .copied()
            .unwrap_or_default();
        let last_of_round = self
            .signals
            .last()
            .is_none_or(|(number, _)| *number == input);
        if last_of_round {
            self.taken += 1;
        }
        self.converted.push((at, input, count));
        count
    }
}

/// The other end of the serial line.
#[derive(Clone, Debug, Default)]
pub struct Serial {
    /// What the chip sent, with the cycle at which each byte was complete.
    pub sent: Vec<(u64, u8)>,
    /// What the host is sending, back to back.
    pub to_send: VecDeque<u8>,
}

/// Everything outside the chip.
#[derive(Debug, Default)]
pub struct World {
    /// Of the random numbers and the device number.
    pub seed: u64,
    /// Pins.
    pub pins: Pins,
    /// Electrodes at the chip's own converter.
    pub converter: Converter,
    /// The host.
    pub serial: Serial,
    /// A converter on SPI.
    pub ads: Option<Ads129x>,
    /// A motion sensor on I2C.
    pub imu: Option<Lsm6dso>,
}

impl World {
    /// The chip drives these levels on the pins whose bit is set in `driven`.
    pub fn drive(&mut self, port: usize, levels: u32, driven: u32, now: u64) {
        self.pins.chip[port] = (levels, driven);
        let pins = &self.pins;
        if let Some(ads) = &mut self.ads {
            let wires = ads.wires;
            let start = wires.start.is_some_and(|pin| pins.chip_drives_high(pin));
            let reset = wires.reset.is_none_or(|pin| pins.chip_level(pin));
            ads.pins(start, reset, !pins.chip_level(wires.select), now);
        }
        self.show_ready();
    }

    /// One byte on SPI, in both directions; what is not wired so hears nothing, and the open line reads as ones.
    /// `mode`: bit order, clock phase, clock polarity; the ADS129x shifts out on the rising and takes on the falling
    /// edge (mode 1), the most significant bit first.
    pub fn spi(&mut self, wires: [u32; 3], mode: u32, byte: u8, now: u64) -> u8 {
        const MODE_1: u32 = 0b010;
        let selected = |ads: &&mut Ads129x| !self.pins.chip_level(ads.wires.select);
        let heard = self
            .ads
            .as_mut()
            .filter(|ads| ads.wires.bus == wires && mode == MODE_1)
            .filter(selected);
        let answer = heard.map_or(0xFF, |ads| ads.exchange(byte, now));
        self.show_ready();
        answer
    }

    /// The device at an address on I2C, if it answers.
    fn on_i2c(&mut self, wires: [u32; 2], address: u8) -> Option<&mut Lsm6dso> {
        let imu = self.imu.as_mut()?;
        (imu.wires == wires && imu.address == address && !imu.absent).then_some(imu)
    }

    /// Bytes to an address on I2C; whether a device took them.
    pub fn i2c_write(&mut self, wires: [u32; 2], address: u8, bytes: &[u8], at: u64) -> bool {
        let heard = self.on_i2c(wires, address);
        heard.map(|imu| imu.write(bytes, at)).is_some()
    }

    /// Bytes from an address on I2C; whether a device gave them.
    pub fn i2c_read(&mut self, wires: [u32; 2], address: u8, bytes: &mut [u8], at: u64) -> bool {
        let heard = self.on_i2c(wires, address);
        heard.map(|imu| imu.read(bytes, at)).is_some()
    }

    /// Whether some device holds the clock of I2C low, so that nothing on it comes to an end.
    #[must_use]
    pub fn i2c_stalled(&self, wires: [u32; 2]) -> bool {
        let imu = self.imu.as_ref();
        imu.is_some_and(|imu| imu.wires == wires && imu.stalls && !imu.absent)
    }

    /// Power went from everything and came back; what is wrong with a device stays wrong.
    pub fn cycle_power(&mut self) {
        if let Some(ads) = &mut self.ads {
            ads.cycle_power();
        }
        if let Some(imu) = &mut self.imu {
            imu.reset();
        }
        self.show_ready();
    }

    /// Whether anything but the world's own hand moves a pin.
    #[must_use]
    pub fn has_devices(&self) -> bool {
        self.ads.is_some()
    }

    /// Cycle at which something outside happens by itself.
    #[must_use]
    pub fn deadline(&self) -> Option<u64> {
        self.ads.as_ref().and_then(Ads129x::deadline)
    }

    /// Lets it happen.
    pub fn fire(&mut self, at: u64) {
        if let Some(ads) = &mut self.ads {
            ads.fire(at);
        }
        self.show_ready();
    }

    fn show_ready(&mut self) {
        if let Some(ads) = &self.ads {
            self.pins.set(ads.wires.ready, ads.ready_level());
        }
    }
}

//! Chance that is the same in every run.

/// SplitMix64 (Steele, Lea and Flood, 2014).
#[derive(Clone, Debug)]
pub struct Noise(u64);

impl Noise {
    /// The same numbers for the same seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number: every value is as likely as any other.
    pub fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }

    /// A byte in which each bit is set with a chance of `of_256` in 256.
    pub fn bits(&mut self, of_256: u32) -> u8 {
        let chances = self.draw().to_le_bytes();
        (0..8).zip(chances).fold(0, |bits, (bit, chance)| {
            bits | u8::from(u32::from(chance) < of_256) << bit
        })
    }

    /// Fills `bytes`.
    pub fn fill(&mut self, bytes: &mut [u8]) {
        for part in bytes.chunks_mut(8) {
            let drawn = self.draw().to_le_bytes();
            part.copy_from_slice(&drawn[..part.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Noise;

    #[test]
    fn numbers_are_those_of_the_published_generator() {
        // From the reference implementation (Vigna, splitmix64.c) with seed 1234567.
        let mut noise = Noise::new(1_234_567);
        let drawn = [noise.draw(), noise.draw(), noise.draw()];
        let published = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
        ];
        assert_eq!(drawn, published);
    }

    #[test]
    fn bits_are_set_as_often_as_asked() {
        let mut noise = Noise::new(1);
        assert_eq!((noise.bits(0), noise.bits(256)), (0, 0xFF));
        let set: u32 = (0..10_000).map(|_| noise.bits(64).count_ones()).sum();
        // A quarter of 80,000, within six standard deviations of 122.
        assert!(set.abs_diff(20_000) < 740, "{set}");
    }
}

//! From a calibration packet to what a pipeline is set up with, on one board.

use crate::Real;
use crate::sample::AdcScale;
use crate::semg::chain::{ChainConfig, NotchConfig};
use crate::semg::design::Mains;
use crate::stiffness::{ArmStiffness, CoContraction, ILLUSTRATIVE, ParameterError, Segments};
use crate::wire::{Calibration, MAX_CHANNELS, Muscle};

use super::config::{ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, PipelineConfig, PipelineError};

/// Sharpness of the notch (centre frequency / -3 dB width): 50 Hz are taken out 1.7 Hz wide.
const NOTCH_Q: f64 = 30.0;
/// Envelopes at rest and at maximum contraction over the upper arm, V: **illustrative**, good for seeing that a
/// contraction shows, not for its strength.
const ILLUSTRATIVE_LEVELS_V: (f32, f32) = (10e-6, 500e-6);

/// What a board brings to every calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Random number drawn at start; tells one start from another.
    pub boot_id: u32,
    /// First eight bytes of the hash of the firmware's source; zero when unknown.
    pub firmware_hash: [u8; 8],
    /// Converter.
    pub adc: AdcScale,
    /// Scan rates that the board can do, Hz.
    pub rates_hz: &'static [u32],
}

/// Why a calibration cannot be used on a board. The one in use stands.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// It is for a wearable with another number of channels.
    #[error("calibration of {got} channels, this board has {expected}: calibrate this board")]
    Channels {
        /// Channels of the board.
        expected: usize,
        /// Channels of the calibration.
        got: u8,
    },
    /// The converter cannot do this rate.
    #[error("scan rate {got_hz} Hz, this board can do {offered_hz:?} Hz: choose one of these")]
    Rate {
        /// Rate of the calibration, Hz.
        got_hz: f32,
        /// Rates of the board, Hz.
        offered_hz: &'static [u32],
    },
    /// A frequency that no power line has.
    #[error("mains frequency {got_hz} Hz: give 50 or 60, or none for no notch")]
    Mains {
        /// Frequency of the calibration, Hz.
        got_hz: u8,
    },
    /// The arm's parameters are impossible.
    #[error(transparent)]
    Arm(#[from] ParameterError),
    /// The pipeline cannot work with it.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
}

impl Board {
    /// What a pipeline of `C` channels is set up with. [`super::Pipeline::new`] and
    /// [`super::Pipeline::reconfigure`] then ask whether filters, levels and arm can work.
    ///
    /// # Errors
    /// [`CalibrationError`], all but `Pipeline`.
    pub fn config<const C: usize>(
        &self,
        calibration: &Calibration,
        raw: bool,
    ) -> Result<PipelineConfig<C>, CalibrationError> {
        const { assert!(C >= 1 && C <= MAX_CHANNELS, "1 to 8 channels") }
        if usize::from(calibration.channels) != C {
            return Err(CalibrationError::Channels {
                expected: C,
                got: calibration.channels,
            });
        }
        let rate_hz = self.rate_hz(calibration.semg_hz)?;
        Ok(PipelineConfig {
            boot_id: self.boot_id,
            firmware_hash: self.firmware_hash,
            adc: self.adc,
            chain: ChainConfig {
                notch: notch(calibration.mains_hz)?,
                ..ChainConfig::at_rate(rate_hz)
            },
            channels: core::array::from_fn(|channel| ChannelConfig {
                muscle: calibration.muscles[channel],
                rest_v: calibration.rest_v[channel].widen(),
                mvc_v: calibration.mvc_v[channel].widen(),
            }),
            activation_window_s: calibration.activation_window_s.widen(),
            arm: arm(calibration)?,
            raw,
        })
    }

    fn rate_hz(&self, wanted_hz: f32) -> Result<f64, CalibrationError> {
        let offered = self.rates_hz.iter().copied().map(f64::from);
        offered
            .into_iter()
            .find(|rate_hz| *rate_hz == wanted_hz.widen())
            .ok_or(CalibrationError::Rate {
                got_hz: wanted_hz,
                offered_hz: self.rates_hz,
            })
    }
}

fn notch(mains_hz: Option<u8>) -> Result<Option<NotchConfig>, CalibrationError> {
    let mains = match mains_hz {
        None => return Ok(None),
        Some(50) => Mains::Hz50,
        Some(60) => Mains::Hz60,
        Some(got_hz) => return Err(CalibrationError::Mains { got_hz }),
    };
    Ok(Some(NotchConfig { mains, q: NOTCH_Q }))
}

fn arm(calibration: &Calibration) -> Result<ArmStiffness<f32>, ParameterError> {
    ArmStiffness::new(
        CoContraction::new(calibration.l1, calibration.l2)?,
        calibration.rest_stiffness_nm_per_rad,
        Segments::new(calibration.body_mass_kg, calibration.body_height_m)?,
    )
}

/// The calibration of a board that nobody has calibrated: its muscles and rate, and **illustrative** levels and arm,
/// of no particular person. Its revision is 0.
#[must_use]
pub fn illustrative<const C: usize>(muscles: [Muscle; C], semg_hz: u32) -> Calibration {
    const { assert!(C >= 1 && C <= MAX_CHANNELS, "1 to 8 channels") }
    let used = |level: f32| core::array::from_fn(|slot| if slot < C { level } else { 0.0 });
    let (rest_v, mvc_v) = ILLUSTRATIVE_LEVELS_V;
    Calibration {
        revision: 0,
        channels: C as u8,
        muscles: super::signal::slots(muscles),
        mains_hz: None,
        semg_hz: semg_hz as f32,
        rest_v: used(rest_v),
        mvc_v: used(mvc_v),
        activation_window_s: f32::of(DEFAULT_ACTIVATION_WINDOW_S),
        l1: f32::of(ILLUSTRATIVE.l1),
        l2: f32::of(ILLUSTRATIVE.l2),
        rest_stiffness_nm_per_rad: ILLUSTRATIVE.rest_stiffness_nm_per_rad.map(f32::of),
        body_mass_kg: f32::of(ILLUSTRATIVE.body_mass_kg),
        body_height_m: f32::of(ILLUSTRATIVE.body_height_m),
    }
}

#[cfg(test)]
mod tests {
    use crate::pipeline::Pipeline;
    use crate::semg::design::DesignError;

    use super::*;

    const ARM: [Muscle; 4] = [
        Muscle::BicepsShort,
        Muscle::BicepsLong,
        Muscle::TricepsLateral,
        Muscle::TricepsLong,
    ];

    fn board() -> Board {
        Board {
            boot_id: 5,
            firmware_hash: [6; 8],
            adc: AdcScale::new(1e-7, 0, -(1 << 23), (1 << 23) - 1).unwrap(),
            rates_hz: &[500, 1_000, 4_000],
        }
    }

    fn pipeline(calibration: &Calibration) -> Result<Pipeline<4>, CalibrationError> {
        Ok(Pipeline::new(&board().config(calibration, false)?)?)
    }

    #[test]
    fn every_field_reaches_the_pipeline() {
        let calibration = Calibration {
            mains_hz: Some(60),
            semg_hz: 500.0,
            rest_v: [1e-5, 2e-5, 3e-5, 4e-5, 0.0, 0.0, 0.0, 0.0],
            mvc_v: [1e-4, 2e-4, 3e-4, 4e-4, 0.0, 0.0, 0.0, 0.0],
            activation_window_s: 0.0625,
            l1: 0.5,
            l2: 2.0,
            rest_stiffness_nm_per_rad: [10.0, 11.0, 12.0, 13.0],
            body_mass_kg: 60.0,
            body_height_m: 1.5,
            ..illustrative(ARM, 1_000)
        };
        let config: PipelineConfig<4> = board().config(&calibration, true).unwrap();
        assert_eq!(
            (config.boot_id, config.firmware_hash, config.raw),
            (5, [6; 8], true)
        );
        assert_eq!(config.adc, board().adc);
        assert_eq!(config.chain.rate_hz, 500.0);
        assert_eq!(config.chain.notch.unwrap().mains, Mains::Hz60);
        assert_eq!(config.activation_window_s, 0.0625);
        for (channel, at) in config.channels.iter().zip(1_u8..) {
            let level = f64::from(at) * 1e-5;
            assert_eq!(channel.muscle, ARM[usize::from(at) - 1]);
            assert!((channel.rest_v / level - 1.0).abs() < 1e-6);
            assert!((channel.mvc_v / level - 10.0).abs() < 1e-5);
        }
        let arm = ArmStiffness::new(
            CoContraction::new(0.5, 2.0).unwrap(),
            [10.0, 11.0, 12.0, 13.0],
            Segments::new(60.0, 1.5).unwrap(),
        );
        assert_eq!(config.arm, arm.unwrap());
        assert!(Pipeline::new(&config).is_ok());
    }

    #[test]
    fn the_illustrative_calibration_works_on_any_number_of_channels() {
        let calibration = illustrative(ARM, 1_000);
        assert_eq!((calibration.revision, calibration.channels), (0, 4));
        let config: PipelineConfig<4> = board().config(&calibration, false).unwrap();
        assert_eq!(config.arm, ArmStiffness::illustrative());
        assert_eq!(config.chain, ChainConfig::at_rate(1_000.0));
        assert!(pipeline(&calibration).is_ok());
        let one: PipelineConfig<1> = board()
            .config(&illustrative([Muscle::BicepsLong], 1_000), false)
            .unwrap();
        assert!(Pipeline::new(&one).is_ok());
        let eight: PipelineConfig<8> = board()
            .config(&illustrative([Muscle::TricepsLong; 8], 500), false)
            .unwrap();
        assert!(Pipeline::new(&eight).is_ok());
    }

    #[test]
    fn what_the_board_cannot_do_is_refused_by_name() {
        let good = illustrative(ARM, 1_000);
        let refused = |calibration| pipeline(&calibration).unwrap_err();
        let channels = refused(illustrative([Muscle::BicepsLong], 1_000));
        assert_eq!(
            channels,
            CalibrationError::Channels {
                expected: 4,
                got: 1
            }
        );
        for got_hz in [999.0, 0.0, -1_000.0] {
            let rate = CalibrationError::Rate {
                got_hz,
                offered_hz: &[500, 1_000, 4_000],
            };
            assert_eq!(
                refused(Calibration {
                    semg_hz: got_hz,
                    ..good
                }),
                rate
            );
        }
        let mains = refused(Calibration {
            mains_hz: Some(16),
            ..good
        });
        assert_eq!(mains, CalibrationError::Mains { got_hz: 16 });
        let nan = refused(Calibration {
            semg_hz: f32::NAN,
            ..good
        });
        assert!(matches!(nan, CalibrationError::Rate { .. }));
    }

    #[test]
    fn what_makes_no_arm_and_no_pipeline_is_refused_by_name() {
        use CalibrationError::{Arm, Pipeline as Refused};
        let good = illustrative(ARM, 1_000);
        let refused = |calibration| pipeline(&calibration).unwrap_err();
        let arm = [
            Calibration { l1: -0.1, ..good },
            Calibration { l2: 0.0, ..good },
            Calibration {
                rest_stiffness_nm_per_rad: [13.0, 13.0, 0.0, 12.0],
                ..good
            },
            Calibration {
                body_mass_kg: 19.0,
                ..good
            },
            Calibration {
                body_height_m: 2.6,
                ..good
            },
        ];
        for calibration in arm {
            assert!(matches!(refused(calibration), Arm(_)), "{calibration:?}");
        }
        let rate = refused(Calibration {
            semg_hz: 4_000.0,
            ..good
        });
        assert!(matches!(
            rate,
            Refused(PipelineError::Design(DesignError::Rate { .. }))
        ));
        let window = refused(Calibration {
            activation_window_s: 5.0,
            ..good
        });
        assert!(matches!(
            window,
            Refused(PipelineError::Design(DesignError::Window { .. }))
        ));
        let levels = refused(Calibration {
            mvc_v: good.rest_v,
            ..good
        });
        assert!(matches!(
            levels,
            Refused(PipelineError::Calibration { channel: 0, .. })
        ));
        let mut muscles = good.muscles;
        muscles[2] = Muscle::Absent;
        let absent = refused(Calibration { muscles, ..good });
        assert_eq!(absent, Refused(PipelineError::AbsentMuscle { channel: 2 }));
        let elsewhere = refused(Calibration {
            muscles: [Muscle::Other; 8],
            ..good
        });
        assert!(matches!(elsewhere, Refused(PipelineError::Activation(_))));
        let curve = refused(Calibration {
            l1: 2_000.0,
            ..good
        });
        assert!(matches!(
            curve,
            Refused(PipelineError::CoContraction { .. })
        ));
        let falls = refused(Calibration {
            rest_stiffness_nm_per_rad: [1e-3; 4],
            ..good
        });
        assert!(matches!(falls, Refused(PipelineError::RestingStiffness(_))));
    }
}

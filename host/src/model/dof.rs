//! One signal of a model: its name, unit and transform.

/// How a DoF's value enters the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Transform {
    /// As it is.
    Identity,
    /// Its natural logarithm: for what is positive, such as stiffness.
    Log,
}

/// One signal of a model.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dof {
    /// Column name.
    pub name: String,
    /// Unit of the values in files: `m`, `N/m`, `rad`.
    pub unit: String,
    /// How values enter the model.
    pub transform: Transform,
}

/// A value that has no logarithm.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{dof}` is {value:?}, and it enters the model as a logarithm: it must be positive")]
pub struct NotPositive {
    /// The DoF.
    pub dof: String,
    /// The value.
    pub value: f64,
}

impl Dof {
    /// A position in metres, as it is.
    #[must_use]
    pub fn position(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            unit: "m".to_owned(),
            transform: Transform::Identity,
        }
    }

    /// A stiffness in N/m, as its logarithm.
    #[must_use]
    pub fn stiffness(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            unit: "N/m".to_owned(),
            transform: Transform::Log,
        }
    }

    /// Whether it is measured in metres.
    #[must_use]
    pub fn is_position(&self) -> bool {
        self.unit == "m" && self.transform == Transform::Identity
    }

    /// The value as the model has it.
    ///
    /// # Errors
    /// A value that is not positive, of a DoF that enters as its logarithm.
    pub fn encode(&self, value: f64) -> Result<f64, NotPositive> {
        match self.transform {
            Transform::Identity => Ok(value),
            Transform::Log if value > 0.0 => Ok(libm::log(value)),
            Transform::Log => Err(NotPositive {
                dof: self.name.clone(),
                value,
            }),
        }
    }

    /// The noise variance of an observation as the model has it: `std` is in the DoF's unit, at `value` in that
    /// unit. For a logarithm to first order, `(std / value)^2`.
    ///
    /// # Errors
    /// As [`Dof::encode`].
    pub fn encode_variance(&self, value: f64, std: f64) -> Result<f64, NotPositive> {
        let encoded = match self.transform {
            Transform::Identity => std,
            Transform::Log => {
                self.encode(value)?;
                std / value
            }
        };
        Ok(encoded * encoded)
    }

    /// Mean and standard deviation in the DoF's unit of what the model has as a Gaussian: of the log-normal
    /// if it enters as a logarithm, `exp(m + v / 2)` and that times `sqrt(exp(v) - 1)`.
    #[must_use]
    pub fn decode(&self, mean: f64, variance: f64) -> (f64, f64) {
        match self.transform {
            Transform::Identity => (mean, libm::sqrt(variance)),
            Transform::Log => {
                let value = libm::exp(mean + 0.5 * variance);
                (value, value * libm::sqrt(libm::expm1(variance)))
            }
        }
    }

    /// The value in the DoF's unit of a quantile of what the model has: quantiles go through any increasing transform,
    /// so that of a logarithm is its exponential and never negative.
    #[must_use]
    pub fn decode_quantile(&self, quantile: f64) -> f64 {
        match self.transform {
            Transform::Identity => quantile,
            Transform::Log => libm::exp(quantile),
        }
    }

    /// Change of a decoded `mean` from the change of what the model has; that of its variance is left out.
    #[must_use]
    pub fn decode_rate(&self, mean: f64, rate: f64) -> f64 {
        match self.transform {
            Transform::Identity => rate,
            Transform::Log => mean * rate,
        }
    }
}

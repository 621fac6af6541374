//! Linear or logarithmic.

/// On which scale a quantity is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// As it is.
    Linear,
    /// By its natural logarithm: effects multiply, and errors are relative.
    Logarithm,
}

impl Scale {
    /// Logarithms for values that all have one.
    pub fn for_values(mut values: impl Iterator<Item = f64>) -> Self {
        if values.all(|value| value > 0.0) { Self::Logarithm } else { Self::Linear }
    }

    /// `value` on this scale; `None` for the logarithm of what is not greater than 0.
    pub fn of(self, value: f64) -> Option<f64> {
        match self {
            Self::Linear => Some(value),
            Self::Logarithm => (value > 0.0).then(|| value.ln()),
        }
    }

    /// The value that [`Self::of`] gave `scaled`.
    pub fn undo(self, scaled: f64) -> f64 {
        match self {
            Self::Linear => scaled,
            Self::Logarithm => scaled.exp(),
        }
    }
}

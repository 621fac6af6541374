//! Memory limit of tasks.

use super::{Estimator, FitCost, contenders};
use crate::recording::Recording;
use crate::setup::Setup;
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// Memory limit in bytes, greater than 0.
///
/// ```
/// use palpate_estimators::estimator::MemoryLimit;
///
/// let limit: MemoryLimit = "2 GB".parse()?;
/// assert!(limit.check("the fit", 1.9e9).is_ok());
/// let exceeded = limit.check("the fit", 3e9).unwrap_err();
/// assert_eq!(exceeded.to_string(), "the fit needs about 3.0 GB of memory; the limit is 2.0 GB");
/// # Ok::<(), palpate_estimators::estimator::MemoryLimitError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct MemoryLimit {
    bytes: f64,
}

/// Invalid memory limit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MemoryLimitError {
    /// Text other than a number with a unit.
    #[error("`{0}` is not a size of memory; write it as in \"2 GB\" or \"500 MB\"")]
    Text(String),
    /// Size that is not positive and finite.
    #[error("{0} bytes of memory; it must be greater than 0, and finite")]
    Size(f64),
}

/// Task that exceeds the memory limit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{work} needs about {} of memory; the limit is {limit}", Size(*needed_bytes))]
pub struct MemoryExceeded {
    /// Name of the task.
    pub work: String,
    /// Estimated peak memory.
    pub needed_bytes: f64,
    /// Memory limit.
    pub limit: MemoryLimit,
}

impl MemoryLimit {
    /// Returns a limit in bytes.
    ///
    /// # Errors
    /// [`MemoryLimitError`] unless positive and finite.
    pub fn new(bytes: f64) -> Result<Self, MemoryLimitError> {
        if bytes.is_finite() && bytes > 0.0 { Ok(Self { bytes }) } else { Err(MemoryLimitError::Size(bytes)) }
    }

    /// Checks the memory of a task.
    ///
    /// # Errors
    /// [`MemoryExceeded`].
    pub fn check(self, work: &str, needed_bytes: f64) -> Result<(), MemoryExceeded> {
        if needed_bytes <= self.bytes {
            return Ok(());
        }
        Err(MemoryExceeded { work: work.to_owned(), needed_bytes, limit: self })
    }

    /// Checks the memory of a fit.
    ///
    /// # Errors
    /// [`MemoryExceeded`].
    pub fn check_fit(self, estimator: &Estimator, cost: FitCost) -> Result<(), MemoryExceeded> {
        self.check(&format!("the fit of {}", estimator.kind()), cost.memory_bytes)
    }

    /// Returns advice for a refused fit.
    pub fn remedy(self, refused: &Estimator, setup: &Setup, recording: &Recording) -> String {
        let others = contenders(setup, refused, recording.rows.len());
        let suits = |other: &&Estimator| {
            other.kind() != refused.kind() && self.check_fit(other, other.fit_cost(setup, recording)).is_ok()
        };
        let mut kinds: Vec<&str> = others.iter().filter(suits).map(Estimator::kind).collect();
        kinds.dedup();
        match kinds[..] {
            [] => "raise the limit, or leave rows out".into(),
            _ => {
                let kinds = kinds.join(", ");
                format!("raise the limit, leave rows out, or name an estimator that keeps less: {kinds}")
            }
        }
    }
}

impl FromStr for MemoryLimit {
    type Err = MemoryLimitError;

    fn from_str(text: &str) -> Result<Self, MemoryLimitError> {
        const UNITS: [(&str, f64); 7] = [
            ("GiB", 1073741824.0),
            ("MiB", 1048576.0),
            ("KiB", 1024.0),
            ("GB", 1e9),
            ("MB", 1e6),
            ("kB", 1e3),
            ("B", 1.0),
        ];
        let wrong = || MemoryLimitError::Text(text.to_owned());
        let (number, unit) = UNITS
            .iter()
            .find_map(|(unit, bytes)| Some((text.trim().strip_suffix(unit)?, bytes)))
            .ok_or_else(wrong)?;
        Self::new(number.trim().parse::<f64>().map_err(|_| wrong())? * unit)
    }
}

impl Display for MemoryLimit {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        Size(self.bytes).fmt(f)
    }
}

/// Memory size in bytes, displayed as "2.0 GB", "600 MB", "1 kB".
pub struct Size(pub f64);

impl Display for Size {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.0 {
            b if b >= 1e9 => write!(f, "{:.1} GB", b / 1e9),
            b if b >= 1e6 => write!(f, "{:.0} MB", b / 1e6),
            b => write!(f, "{:.0} kB", (b / 1e3).ceil()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_with_their_units() {
        for (text, bytes) in
            [("2 GB", 2e9), ("500MB", 5e8), (" 1.5 GiB ", 1.5 * 1073741824.0), ("64 B", 64.0)]
        {
            assert_eq!(text.parse(), MemoryLimit::new(bytes), "{text}");
        }
        for text in ["3 apples", "GB", "two GB", "2", ""] {
            assert_eq!(text.parse::<MemoryLimit>(), Err(MemoryLimitError::Text(text.to_owned())));
        }
        for text in ["0 GB", "-1 MB", "inf GB", "nan B"] {
            assert!(matches!(text.parse::<MemoryLimit>(), Err(MemoryLimitError::Size(_))), "{text}");
        }
    }
}

//! Critical values of χ², computed once.

use palpate_numerics::chi_squared_critical_value;
use std::sync::OnceLock;

/// Critical values of χ² at one significance level.
pub(crate) struct CriticalValues {
    level: f64,
    known: [OnceLock<f64>; 65],
}

impl CriticalValues {
    pub const fn new(level: f64) -> Self {
        Self { level, known: [const { OnceLock::new() }; 65] }
    }

    /// Critical value with at least 1 degree of freedom.
    pub fn at(&self, freedom: usize) -> f64 {
        let freedom = freedom.max(1);
        let value = || chi_squared_critical_value(self.level, freedom);
        self.known.get(freedom).map_or_else(value, |known| *known.get_or_init(value))
    }
}

//! How much more sensors help.

use std::ops::RangeInclusive;

use super::{Assessment, DesignError, SensorProblem};
use palpate_numerics::watch::Watch;

/// The score of so many sensors is good enough when it lies within this share of the score of the most.
const ENOUGH: f64 = 0.1;

/// Layouts of one number of sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CountPoint {
    /// How many.
    pub count: usize,
    /// The even layout; `None` where there is none.
    pub even: Option<Assessment>,
    /// The layout by greedy choice and exchange.
    pub designed: Assessment,
}

impl SensorProblem<'_> {
    /// Even and designed layouts for each number of sensors.
    ///
    /// # Errors
    /// [`DesignError`] for the largest number or else the first that no layout can have.
    pub fn counts(
        &self,
        range: RangeInclusive<usize>,
        seed: u64,
        watch: Watch,
    ) -> Result<Vec<CountPoint>, DesignError> {
        // What no layout can have is told before the work, not in its midst.
        if !range.is_empty() {
            self.with_count(*range.end())?;
        }
        let mut points = Vec::new();
        for count in range {
            let problem = self.with_count(count)?;
            let even = problem.even()?.map(|even| even.assessment);
            let designed = problem.greedy_exchange(seed, watch)?;
            points.push(CountPoint { count, even, designed: designed.assessment });
        }
        Ok(points)
    }
}

/// The least number of sensors whose score lies within 10 % of the score of the most; `None` of no points.
pub fn enough(points: &[CountPoint]) -> Option<usize> {
    let least = points.last()?.designed.score;
    let bound = least + ENOUGH * least.abs();
    points.iter().find(|point| point.designed.score <= bound).map(|point| point.count)
}

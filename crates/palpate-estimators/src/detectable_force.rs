//! Smallest detectable force, from the signal-to-noise ratio by the rule of [`crate::status`]; the scatter of
//! untouched rows is a second noise.

use crate::status::{Detection, FalseAlarmRate};
use crate::untouched_scatter::UntouchedScatter;
use palpate_mechanics::contact::{Contact, Position};
use palpate_numerics::{bisect, percentile};

/// Smallest detectable force by position.
///
/// ```
/// use palpate_estimators::{influence::Influence, setup::Setup};
/// use palpate_mechanics::contact::Position;
/// use palpate_mechanics::sensing::SensorKind::Deflection;
/// use palpate_mechanics::surface::Beam;
/// use palpate_mechanics::units::{gpa, mm, um};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?;
/// let limit = setup.cramer_rao_bound()?;
/// let touch = Influence::default().lightest_touch(&limit);
/// let [half_n, surely_n] = touch.forces_at(Position::along(mm(200.0))).map(Option::unwrap);
/// assert!(half_n < surely_n && surely_n < 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct DetectableForce<'a> {
    rate: FalseAlarmRate,
    noise_sds: Vec<(usize, f64)>,
    /// Standardized change by a contact.
    change: Box<dyn Fn(Contact) -> Vec<f64> + 'a>,
    rules: Vec<Rule>,
}

struct Rule {
    needed: [f64; 2],
    weights: Vec<f64>,
}

impl Rule {
    fn new(detection: Detection, weights: Vec<f64>) -> Self {
        Self { needed: DetectableForce::FOUND.map(|found| detection.signal(found)), weights }
    }

    fn length(&self, change: &[f64]) -> f64 {
        change.iter().zip(&self.weights).map(|(value, weight)| (value * weight).powi(2)).sum::<f64>().sqrt()
    }
}

/// Smallest detectable forces at one probability.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchSummary {
    /// Detection probability.
    pub found: f64,
    /// Median over the positions.
    pub median_n: f64,
    /// Position and value of the maximum.
    pub worst: (Position, f64),
    /// Number of positions without detection.
    pub undetected: usize,
}

impl<'a> DetectableForce<'a> {
    /// Detection probabilities.
    pub const FOUND: [f64; 2] = [0.5, 0.95];
    const MOST_N: f64 = 1e6;

    pub(crate) fn new(
        detection: Detection,
        rate: FalseAlarmRate,
        noise_sds: Vec<(usize, f64)>,
        change: Box<dyn Fn(Contact) -> Vec<f64> + 'a>,
    ) -> Self {
        let rules = vec![Rule::new(detection, vec![1.0; noise_sds.len()])];
        Self { rate, noise_sds, change, rules }
    }

    /// Adds the test against the scatter of untouched rows.
    #[must_use]
    pub fn with_scatter(mut self, scatter: &UntouchedScatter) -> Self {
        let weight = |(channel, noise_sd): &(usize, f64)| match scatter.sd.get(*channel) {
            Some(scatter_sd) if *scatter_sd > 0.0 => noise_sd / scatter_sd,
            _ => 0.0,
        };
        let weights: Vec<f64> = self.noise_sds.iter().map(weight).collect();
        let channels = weights.iter().filter(|weight| **weight > 0.0).count();
        if channels > 0 {
            let detection = Detection { channels, unknowns: 1, square: scatter.bound, taken: scatter.bound };
            self.rules.push(Rule::new(detection, weights));
        }
        self
    }

    /// False-alarm rate.
    pub fn rate(&self) -> FalseAlarmRate {
        self.rate
    }

    /// Returns the forces detected with [`DetectableForce::FOUND`].
    pub fn forces_at(&self, position: Position) -> [Option<f64>; 2] {
        [0, 1].map(|i| {
            let forces = self.rules.iter().map(|rule| self.force_n(position, rule, rule.needed[i]));
            forces.reduce(|a, b| Some(f64::max(a?, b?))).flatten()
        })
    }

    fn force_n(&self, position: Position, rule: &Rule, needed: f64) -> Option<f64> {
        let signal = |force_n: f64| rule.length(&(self.change)(Contact { position, force_n }));
        let guess_n = needed / signal(1.0);
        if guess_n <= Self::MOST_N && (signal(guess_n) / needed - 1.0).abs() < 1e-9 {
            return Some(guess_n);
        }
        // Readings that saturate or are not proportional to the force.
        let enough = |force_n: &f64| signal(*force_n) >= needed;
        let high_n = std::iter::successors(Some(1e-9), |force_n| Some(2.0 * force_n))
            .take_while(|force_n| *force_n <= Self::MOST_N)
            .find(enough)?;
        Some(bisect((0.0, high_n), 50, |force_n| !enough(&force_n)))
    }

    /// Summarizes positions for each probability.
    pub fn summaries(&self, positions: &[Position]) -> [Option<TouchSummary>; 2] {
        let forces: Vec<[Option<f64>; 2]> = positions.iter().map(|at| self.forces_at(*at)).collect();
        [0, 1].map(|i| {
            let of = |(at, forces): (&Position, &[Option<f64>; 2])| Some((*at, forces[i]?));
            let mut found: Vec<(Position, f64)> = positions.iter().zip(&forces).filter_map(of).collect();
            found.sort_by(|a, b| a.1.total_cmp(&b.1));
            let forces_n: Vec<f64> = found.iter().map(|(_, force_n)| *force_n).collect();
            Some(TouchSummary {
                found: Self::FOUND[i],
                median_n: percentile(&forces_n, 50.0)?,
                worst: *found.last()?,
                undetected: positions.len() - found.len(),
            })
        })
    }
}

#[cfg(test)]
mod tests;

//! A learnt surface that locates.

use palpate_core::{Estimate, Status};

use super::posterior::Posterior;
use super::{Axis, Scale, Table, Whitening};
use crate::fit::{Locate, LocatorFault};
use crate::setup::Setup;
use palpate_mechanics::contact::Position;

/// What the nuisance coordinate is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NuisanceRole {
    /// Nothing: the reading depends on the position alone.
    None,
    /// The contact force in newtons, which the estimate then tells.
    Force,
    /// Something else.
    Other,
}

/// Readings as a learnt function of position and nuisance coordinate, and its inversion.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredLocator {
    /// On which scale readings are compared.
    pub readings: Scale,
    /// How scaled readings become channels of unit noise.
    pub whitening: Whitening,
    /// The learnt readings.
    pub table: Table,
    /// What the nuisance coordinate is.
    pub role: NuisanceRole,
    /// On which scale it is held.
    pub nuisance: Scale,
    /// The squared residual, in variances, from which on no contact explains a reading.
    pub residual_limit: f64,
    /// The contact's force in newtons, where it is known.
    pub force_n: Option<f64>,
}

impl MeasuredLocator {
    /// Whether the estimate tells the force.
    pub(super) fn locates_force(&self) -> bool {
        self.role == NuisanceRole::Force
    }

    /// The nuisance coordinate at `node`, off its scale.
    pub(super) fn force_at(&self, node: f64) -> f64 {
        self.nuisance.undo(self.table.nuisance.at(node))
    }

    /// The variance of the nuisance coordinate, off its scale, when that of `node` is `variance`.
    pub(super) fn force_spread(&self, node: f64, variance: f64) -> f64 {
        let slope = self.table.nuisance.step
            * match self.nuisance {
                Scale::Linear => 1.0,
                Scale::Logarithm => self.force_at(node),
            };
        variance * slope * slope
    }

    /// The reading on its scale, whitened; `None` where it is off the scale.
    pub(super) fn whitened(&self, reading: &[f64]) -> Option<Vec<f64>> {
        let scaled = reading.iter().map(|value| self.readings.of(*value)).collect::<Option<Vec<f64>>>()?;
        let mut whitened = vec![0.0; self.whitening.channels()];
        self.whitening.apply(&scaled, &mut whitened);
        Some(whitened)
    }
}

impl Locate for MeasuredLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        match self.whitened(reading) {
            Some(whitened) => Posterior::of(self, &whitened).estimate(),
            None => {
                let middle = |axis: Axis| axis.at(0.5 * (axis.count - 1) as f64);
                let middle = Position { x_m: middle(self.table.x), y_m: middle(self.table.y) };
                Estimate::of_position(middle, Status::OutsideModel)
            }
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        let (table, channels) = (&self.table, setup.layout.len());
        LocatorFault::check_count("whitened channels", channels, self.whitening.channels())?;
        LocatorFault::check_count("whitening weights", channels * channels, self.whitening.matrix.len())?;
        let axes = [table.x, table.y, table.nuisance];
        let counts = axes.iter().map(|axis| axis.count as f64);
        LocatorFault::check_numbers("axis count", counts, |count| count >= 1.0, "at least 1")?;
        let starts = axes.iter().map(|axis| axis.start);
        LocatorFault::check_numbers("axis start", starts, |_| true, "finite")?;
        let steps = axes.iter().map(|axis| axis.step);
        LocatorFault::check_numbers("axis step", steps, |step| step > 0.0, "finite and greater than 0")?;
        let places = table.x.count.saturating_mul(table.y.count);
        let nodes = places.saturating_mul(table.nuisance.count);
        LocatorFault::check_count("table variances", nodes, table.variances.len())?;
        LocatorFault::check_count("table means", nodes.saturating_mul(channels), table.means.len())?;
        LocatorFault::check_count("table reaches", places, table.reaches.len())?;
        LocatorFault::check_numbers(
            "table part",
            [table.parts as f64],
            |p| (1.0..=64.0).contains(&p),
            "1 to 64",
        )?;
        let matrix = self.whitening.matrix.iter().copied();
        LocatorFault::check_numbers("whitening weight", matrix, |_| true, "finite")?;
        LocatorFault::check_numbers("table mean", table.means.iter().copied(), |_| true, "finite")?;
        let positive = [&table.variances, &table.reaches, &self.whitening.signal];
        for (what, values) in ["table variance", "table reach", "signal variance"].into_iter().zip(positive) {
            LocatorFault::check_numbers(what, values.iter().copied(), |v| v >= 0.0, "finite and at least 0")?;
        }
        LocatorFault::check_numbers("residual limit", [self.residual_limit], |v| v > 0.0, "greater than 0")?;
        LocatorFault::check_numbers("force", self.force_n, |force| force > 0.0, "finite and greater than 0")
    }
}

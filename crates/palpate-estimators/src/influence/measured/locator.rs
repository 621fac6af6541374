//! The locator of a measured surface: what it knows, and the estimate that its search gives.

use super::config::Scale;
use super::search::Search;
use super::table::Table;
use crate::fit::{Locate, LocatorFault};
use crate::influence::grid::{ToldForce, check_axes, middle};
use crate::influence::noise::Whitening;
use crate::setup::Setup;
use palpate_core::{Estimate, Status};
use std::sync::OnceLock;

/// Role of the nuisance coordinate.
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
    /// Whitening of scaled readings to channels of unit noise.
    pub whitening: Whitening,
    /// The learnt readings.
    pub table: Table,
    /// Role of the nuisance coordinate.
    pub role: NuisanceRole,
    /// On which scale it is held.
    pub nuisance: Scale,
    /// The squared residual, in variances, from which on no contact explains a reading.
    pub residual_limit: f64,
    /// The contact's force in newtons, where it is known.
    pub force_n: Option<f64>,
    /// The table as it is searched.
    #[serde(skip)]
    pub(super) search: MadeFromTable,
}

/// A search that is made when it is first asked for; two of the same table are the same.
#[derive(Clone, Debug, Default)]
pub(super) struct MadeFromTable(OnceLock<Box<Search>>);

impl PartialEq for MadeFromTable {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl MeasuredLocator {
    /// The table as it is searched.
    pub(super) fn search(&self) -> &Search {
        self.search.0.get_or_init(|| Box::new(Search::new(self)))
    }

    /// Mean and variance of the force, off its scale, from those of the nuisance coordinate in nodes.
    fn force(&self, node: f64, variance: f64) -> (f64, f64) {
        match self.role {
            NuisanceRole::Force => (self.force_at(node), self.force_spread(node, variance)),
            NuisanceRole::None | NuisanceRole::Other => (0.0, 0.0),
        }
    }

    /// Source of the force of an estimate.
    pub(super) fn told_force(&self) -> ToldForce {
        match (self.role, self.force_n) {
            (NuisanceRole::Force, _) => ToldForce::Estimated,
            (_, Some(force_n)) => ToldForce::Known(force_n),
            (_, None) => ToldForce::Untold,
        }
    }

    /// The nuisance coordinate at `node`, off its scale.
    fn force_at(&self, node: f64) -> f64 {
        self.nuisance.undo(self.table.nuisance.value(node))
    }

    /// The variance of the nuisance coordinate, off its scale, when that of `node` is `variance`.
    fn force_spread(&self, node: f64, variance: f64) -> f64 {
        let slope = self.table.nuisance.step
            * match self.nuisance {
                Scale::Linear => 1.0,
                Scale::Logarithm => self.force_at(node),
            };
        variance * slope * slope
    }

    /// The reading on its scale, whitened; `None` where it is off the scale.
    pub(super) fn whitened(&self, reading: &[f64]) -> Option<Vec<f64>> {
        let scaled =
            reading.iter().map(|value| self.readings.scaled(*value)).collect::<Option<Vec<f64>>>()?;
        let mut whitened = vec![0.0; self.whitening.channels()];
        self.whitening.apply(&scaled, &mut whitened);
        Some(whitened)
    }
}

impl Locate for MeasuredLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        match self.whitened(reading) {
            Some(whitened) => {
                let force = |node: f64, variance: f64| self.force(node, variance);
                self.search().posterior(&whitened, self.told_force(), force).estimate(self.residual_limit)
            }
            None => Estimate::of_position(middle([self.table.x, self.table.y]), Status::OutsideModel),
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        let (table, channels) = (&self.table, setup.layout().len());
        LocatorFault::check_count("whitened channels", channels, self.whitening.channels())?;
        LocatorFault::check_count("whitening weights", channels * channels, self.whitening.matrix.len())?;
        check_axes(&[table.x, table.y, table.nuisance])?;
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

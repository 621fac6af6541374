//! The locator of a measured surface: probabilities of places, gathered cell by cell of the table, and the estimate that they give.

use super::config::Scale;
use super::table::{Line, LineBuffer, Table};
use crate::fit::{Locate, LocatorFault};
use crate::influence::grid::{CUT, GridPosterior, PartOfCell, ToldForce, check_axes, middle, parts_of};
use crate::influence::noise::Whitening;
use crate::setup::Setup;
use palpate_core::{Estimate, Status};

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
}

impl MeasuredLocator {
    /// The least squared residual of a whitened reading, over the variances.
    pub(super) fn residual(&self, whitened: &[f64]) -> f64 {
        posterior(self, whitened).residual
    }

    /// Source of the force of an estimate.
    fn told_force(&self) -> ToldForce {
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
            Some(whitened) => posterior(self, &whitened).estimate(self.residual_limit),
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

/// A place, and how well it explains the reading.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    place: usize,
    residual: f64,
}

impl Candidate {
    /// Whether somewhere `reach` closer, in deviations, could matter beside the residual `least`.
    fn within(&self, reach: f64, least: f64) -> bool {
        let closest = (self.residual.sqrt() - reach).max(0.0);
        closest * closest <= least + CUT
    }
}

/// Posterior of a whitened reading: the middles of blocks of places first, then the places of blocks that could matter, and of
/// those the cells that could, cut finely.
fn posterior(locator: &MeasuredLocator, reading: &[f64]) -> GridPosterior {
    let (table, noise) = (&locator.table, &locator.whitening);
    let look = |place: usize| Candidate { place, residual: table.line(place).residual(reading, noise) };
    let nearest = |candidate: &mut dyn Iterator<Item = Candidate>| {
        candidate.min_by(|a, b| a.residual.total_cmp(&b.residual))
    };
    let mut posterior = GridPosterior::new([table.x, table.y], locator.told_force());
    let blocks: Vec<Candidate> = table.blocks().map(look).collect();
    let Some(block) = nearest(&mut blocks.iter().copied()) else { return posterior };
    let Some(best) = nearest(&mut table.block(block.place).map(look)) else { return posterior };
    let mut buffer = LineBuffer::default();
    let mut least = best.residual;
    for (x, y) in parts_of([table.x, table.y], table.parts, best.place) {
        least = least.min(table.line_between(x, y, &mut buffer).residual(reading, noise));
    }
    // From a block's middle to its other places is twice the reach, and from there half as far as that again.
    for block in blocks.iter().filter(|block| block.within(3.5 * table.reaches[block.place], least)) {
        for candidate in table.block(block.place).map(look) {
            if candidate.within(table.reaches[candidate.place], least) {
                let part =
                    |x, y| part_of_cell(locator, table.line_between(x, y, &mut buffer), reading, least);
                posterior.add_cell(candidate.place, table.parts, part);
            }
        }
    }
    posterior
}

/// Weight, force and residual of a part of a cell, relative to the residual `reference`.
fn part_of_cell(locator: &MeasuredLocator, line: Line, reading: &[f64], reference: f64) -> PartOfCell {
    let marginal = line.marginal(reading, &locator.whitening, reference);
    if marginal.weight <= 0.0 {
        return PartOfCell::default();
    }
    let node = marginal.nuisance / marginal.weight;
    let spread = (marginal.nuisance_square / marginal.weight - node * node).max(0.0);
    PartOfCell {
        weight: marginal.weight,
        force_n: locator.force_at(node),
        force_variance_n2: locator.force_spread(node, spread),
        residual: line.residual(reading, &locator.whitening),
    }
}

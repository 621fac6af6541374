//! The locator of a measured surface: probabilities of places, gathered cell by cell of the table, and the estimate that they give.

use super::config::Scale;
use super::noise::Whitening;
use super::table::{LineBuffer, Table};
use crate::fit::{Locate, LocatorFault};
use crate::influence::moments::Moments;
use crate::setup::Setup;
use crate::status::OTHER_PLACE;
use palpate_core::{BoundedList, ContactEstimate, Estimate, Mode, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::normal_interval_95;

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
        Posterior::new(self, whitened).residual
    }

    /// Whether the estimate tells the force.
    fn locates_force(&self) -> bool {
        self.role == NuisanceRole::Force
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
            Some(whitened) => Posterior::new(self, &whitened).estimate(),
            None => Estimate::of_position(self.table.middle(), Status::OutsideModel),
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        let (table, channels) = (&self.table, setup.layout().len());
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

/// Squared residuals further than this above the least have no probability worth adding up: e⁻¹⁰.
const CUT: f64 = 20.0;
/// A cell belongs to a mode when its density is at least this share of the greatest.
const VALLEY: f64 = 0.01;

/// A part of a cell, and its weight.
#[derive(Clone, Copy, Debug)]
struct Part {
    x_m: f64,
    y_m: f64,
    weight: f64,
}

/// A cell of the table that has some probability.
#[derive(Clone, Copy, Debug)]
struct Cell {
    place: usize,
    moments: Moments,
    /// The greatest weight among its parts.
    peak: f64,
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

/// The posterior of one reading.
#[derive(Debug)]
struct Posterior<'a> {
    locator: &'a MeasuredLocator,
    cells: Vec<Cell>,
    parts: Vec<Part>,
    /// The least residual of any part.
    residual: f64,
}

impl<'a> Posterior<'a> {
    /// Posterior of a whitened reading: the middles of blocks of places first, then the places of blocks that could matter, and of
    /// those the cells that could, cut finely.
    fn new(locator: &'a MeasuredLocator, reading: &[f64]) -> Self {
        let (table, noise) = (&locator.table, &locator.whitening);
        let look = |place: usize| Candidate { place, residual: table.line(place).residual(reading, noise) };
        let nearest = |candidate: &mut dyn Iterator<Item = Candidate>| {
            candidate.min_by(|a, b| a.residual.total_cmp(&b.residual))
        };
        let mut posterior = Self { locator, cells: Vec::new(), parts: Vec::new(), residual: f64::INFINITY };
        let blocks: Vec<Candidate> = table.blocks().map(look).collect();
        let Some(block) = nearest(&mut blocks.iter().copied()) else { return posterior };
        let Some(best) = nearest(&mut table.block(block.place).map(look)) else { return posterior };
        let mut buffer = LineBuffer::default();
        let mut least = best.residual;
        for (x, y) in parts_of(table, best.place) {
            least = least.min(table.line_between(x, y, &mut buffer).residual(reading, noise));
        }
        // From a block's middle to its other places is twice the reach, and from there half as far as that again.
        for block in blocks.iter().filter(|block| block.within(3.5 * table.reaches[block.place], least)) {
            for candidate in table.block(block.place).map(look) {
                if candidate.within(table.reaches[candidate.place], least) {
                    posterior.add_cell(candidate.place, reading, least, &mut buffer);
                }
            }
        }
        posterior
    }

    fn add_cell(&mut self, place: usize, reading: &[f64], reference: f64, buffer: &mut LineBuffer) {
        let (table, noise) = (&self.locator.table, &self.locator.whitening);
        let mut cell = Cell { place, moments: Moments::default(), peak: 0.0 };
        for (x, y) in parts_of(table, place) {
            let line = table.line_between(x, y, buffer);
            let marginal = line.marginal(reading, noise, reference);
            if marginal.weight > 0.0 {
                self.residual = self.residual.min(line.residual(reading, noise));
                let part = Part { x_m: table.x.value(x), y_m: table.y.value(y), weight: marginal.weight };
                let node = marginal.nuisance / marginal.weight;
                let spread = (marginal.nuisance_square / marginal.weight - node * node).max(0.0);
                cell.moments.add(part.weight, [part.x_m, part.y_m, self.locator.force_at(node)]);
                cell.moments.add_force_variance(part.weight, self.locator.force_spread(node, spread));
                cell.peak = cell.peak.max(part.weight);
                self.parts.push(part);
            }
        }
        if cell.moments.weight > 0.0 {
            self.cells.push(cell);
        }
    }

    /// The posterior's mean and covariance; the most probable mode alone where there are several.
    fn estimate(mut self) -> Estimate {
        let total = Moments::total(self.cells.iter().map(|cell| cell.moments));
        if !(total.weight > 0.0 && total.weight.is_finite()) {
            return Estimate::of_position(self.locator.table.middle(), Status::OutsideModel);
        }
        let (x_95_m, y_95_m) = self.intervals(total.weight);
        let mut contact = self.contact(total);
        let covariance = contact.uncertainty.unwrap_or_default().covariance;
        contact.uncertainty = Some(Uncertainty { covariance, x_95_m, y_95_m });
        if self.residual.is_nan() || self.residual > self.locator.residual_limit {
            return Estimate::of_contact(contact, Status::OutsideModel);
        }
        let modes = self.modes();
        let Some((first, others)) = modes.split_first().filter(|(_, others)| !others.is_empty()) else {
            return Estimate::of_contact(contact, Status::Located);
        };
        // The most probable place, with the uncertainty of all.
        let most_probable = ContactEstimate { uncertainty: contact.uncertainty, ..self.contact(*first) };
        let mut estimate = Estimate::of_contact(most_probable, Status::Ambiguous);
        estimate.modes = BoundedList::none(Mode::default());
        for moments in others {
            let probability = moments.weight / total.weight;
            let mode = Mode { contact: self.contact(*moments), probability };
            if !estimate.modes.push(mode) {
                break;
            }
        }
        estimate
    }

    /// The contact that some of the probability describes, its intervals those of a normal distribution.
    fn contact(&self, moments: Moments) -> ContactEstimate {
        let ([x_m, y_m, force_n], covariance) = moments.mean_and_covariance();
        let known = self.locator.locates_force();
        let covariance = match known {
            true => covariance,
            false => [covariance[0], covariance[1], 0.0, covariance[3], 0.0, 0.0],
        };
        let uncertainty = Uncertainty {
            covariance,
            x_95_m: normal_interval_95(x_m, covariance[0].sqrt()),
            y_95_m: normal_interval_95(y_m, covariance[3].sqrt()),
        };
        let force_n = if known { Some(force_n) } else { self.locator.force_n };
        ContactEstimate { position: Position { x_m, y_m }, force_n, uncertainty: Some(uncertainty) }
    }

    /// Connected groups of cells that are dense enough, most probable first; only those that are noticeable.
    fn modes(&self) -> Vec<Moments> {
        let peak = self.cells.iter().map(|cell| cell.peak).fold(0.0, f64::max);
        let mut left: Vec<Cell> = self.cells.iter().filter(|c| c.peak >= VALLEY * peak).copied().collect();
        let across = self.locator.table.y.count;
        let apart =
            |a: usize, b: usize| (a / across).abs_diff(b / across).max((a % across).abs_diff(b % across));
        let mut modes = Vec::new();
        while let Some(seed) = left.pop() {
            let mut group = vec![seed];
            let mut grown = 0;
            while grown < group.len() {
                let at = group[grown].place;
                let (near, far) = left.into_iter().partition(|cell| apart(cell.place, at) <= 1);
                left = far;
                group.extend::<Vec<Cell>>(near);
                grown += 1;
            }
            modes.push(Moments::total(group.iter().map(|cell| cell.moments)));
        }
        modes.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let total: f64 = self.cells.iter().map(|cell| cell.moments.weight).sum();
        modes.retain(|mode| mode.weight >= OTHER_PLACE * total);
        modes
    }

    /// The 95 % intervals along x and y.
    fn intervals(&mut self, total: f64) -> ((f64, f64), (f64, f64)) {
        let table = &self.locator.table;
        let half = |step: f64| 0.5 * step / table.parts as f64;
        self.parts.sort_by(|a, b| a.x_m.total_cmp(&b.x_m));
        let x = quantiles(&self.parts, |part| part.x_m, total, half(table.x.step));
        if table.y.count == 1 {
            return (x, (0.0, 0.0));
        }
        self.parts.sort_by(|a, b| a.y_m.total_cmp(&b.y_m));
        (x, quantiles(&self.parts, |part| part.y_m, total, half(table.y.step)))
    }
}

/// Quantiles below which 2.5 % and 97.5 % of the weight lie, of parts in rising order whose weight is spread evenly over `half`
/// to either side.
fn quantiles(parts: &[Part], coordinate: impl Fn(&Part) -> f64, total: f64, half: f64) -> (f64, f64) {
    let find = |share: f64| {
        let (mut below, wanted) = (0.0, share * total);
        for slice in parts.chunk_by(|a, b| coordinate(b) - coordinate(a) < 0.5 * half) {
            let weight: f64 = slice.iter().map(|part| part.weight).sum();
            if below + weight >= wanted {
                return coordinate(&slice[0]) - half + 2.0 * half * (wanted - below) / weight;
            }
            below += weight;
        }
        parts.last().map_or(0.0, |part| coordinate(part) + half)
    };
    (find(0.025), find(0.975))
}

/// The middles of the parts of a place's cell, in nodes; what would lie beyond the table's edge is left out.
fn parts_of(table: &Table, place: usize) -> impl Iterator<Item = (f64, f64)> + use<> {
    let (x, y) = (place / table.y.count, place % table.y.count);
    let along = cut(x, table.x.count, table.parts);
    let across = cut(y, table.y.count, table.parts);
    along.into_iter().flat_map(move |x| across.clone().into_iter().map(move |y| (x, y)))
}

fn cut(node: usize, count: usize, parts: usize) -> Vec<f64> {
    if count == 1 {
        return vec![0.0];
    }
    let middles = (0..parts).map(|k| node as f64 + (k as f64 + 0.5) / parts as f64 - 0.5);
    middles.filter(|place| (0.0..=(count - 1) as f64).contains(place)).collect()
}

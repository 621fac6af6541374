//! The locator of a measured surface: its table, and what the places and nuisance coordinates of the table explain of a reading.

use super::config::Scale;
use super::scan::Scan;
use super::table::{Line, Marginal, Stretch, Table, WhiteNoise};
use crate::fit::{Locate, LocatorFault};
use crate::influence::grid::{Axis, check_axes, greatest_distances, middle};
use crate::influence::inversion::{
    Cells, Explain, Explained, Inversion, Layers, Look, Slopes, ToldForce, look_at_cells,
};
use crate::influence::lanes::{LANES, Lanes, in_lanes};
use crate::influence::levenberg::{Equations, Unknowns};
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

/// The part of a locator that its file holds.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stored {
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

/// Readings as a learnt function of position and nuisance coordinate, and its inversion.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct MeasuredLocator {
    stored: Stored,
    search: Search,
}

/// A table that is ready to be searched.
#[derive(Clone, Debug, PartialEq)]
struct Search {
    /// Means, a layer a node of the nuisance coordinate.
    means: Layers,
    /// v, the nodes of the nuisance coordinate in the place of channels.
    variances: Layers,
    noise: WhiteNoise,
    cells: Cells,
    scan: Scan,
    /// Greatest way of the reading from a place to the next along and across, for each node of the nuisance coordinate.
    lengths: Vec<[f64; 2]>,
}

/// Nodes of a cell along either axis of a plane, where every place has a line of nodes; elsewhere 1.
const STRIDE: usize = 3;
/// Nodes of the nuisance coordinate that are looked at first, to either side of where it is thought to be.
const NEAR: usize = 1;
/// Beyond a node whose squared residual is this much above the least, the nuisance coordinate has no probability worth adding up: e⁻¹⁰.
const NEGLIGIBLE: f64 = 20.0;
/// A gain beyond this many standard deviations is not looked for.
const MOST_GAIN: f64 = 6.0;

impl Search {
    fn new(table: &Table, whitening: &Whitening) -> Self {
        let Table { x, y, nuisance, .. } = table;
        let axes = [*x, *y];
        let stride = if y.count > 1 && nuisance.count > 1 { STRIDE } else { 1 };
        let cells = Cells::new([x.count, y.count], stride);
        let mut search = Self {
            means: Layers::new(axes, nuisance.count, table.channels(), |place, node, c| {
                table.mean(place, node, c)
            }),
            variances: Layers::new(axes, 1, nuisance.count, |place, _, node| {
                table.variances[place * nuisance.count + node]
            }),
            noise: WhiteNoise::new(whitening),
            cells,
            scan: Scan::new(table, whitening, cells),
            lengths: Vec::new(),
        };
        search.find_lengths(axes, nuisance.count);
        search
    }

    /// The nodes of a place.
    fn line(&self, place: usize, nodes: usize) -> Line<'_> {
        Line {
            means: self.means.groups_of(place, 0..nodes),
            variances: &self.variances.groups_of(place, 0..1).as_flattened()[..nodes],
        }
    }

    /// From each node of a place to the lines of its neighbours.
    fn find_lengths(&mut self, axes: [Axis; 2], nodes: usize) {
        let unit = self.noise.unit();
        let mut stretches = Vec::new();
        self.lengths = (0..axes[0].count * axes[1].count * nodes)
            .map(|i| {
                let (place, node) = (i / nodes, i % nodes);
                let mean = self.means.groups_of(place, node..node + 1);
                greatest_distances(axes, place, |other| {
                    self.line(other, nodes).residual(mean, &unit, &mut stretches).sqrt()
                })
            })
            .collect();
    }
}

impl MeasuredLocator {
    /// The learnt readings.
    pub fn table(&self) -> &Table {
        &self.stored.table
    }

    /// Whitening of scaled readings to channels of unit noise.
    pub fn whitening(&self) -> &Whitening {
        &self.stored.whitening
    }

    /// Scale on which readings are compared.
    pub fn readings(&self) -> Scale {
        self.stored.readings
    }

    /// Role of the nuisance coordinate.
    pub fn role(&self) -> NuisanceRole {
        self.stored.role
    }

    /// Scale on which the nuisance coordinate is held.
    pub fn nuisance(&self) -> Scale {
        self.stored.nuisance
    }

    /// The same, which takes readings of a greater squared residual for none of a contact.
    pub(super) fn with_residual_limit(mut self, limit: f64) -> Self {
        self.stored.residual_limit = limit;
        self
    }

    /// The least squared residual of a reading, over the variances; NaN where the reading is off its scale.
    pub(super) fn misfit(&self, reading: &[f64]) -> f64 {
        self.seen(reading).map_or(f64::NAN, |seen| Inversion::new(seen).misfit())
    }

    /// The contact of a reading, summed over the whole grid.
    #[cfg(test)]
    pub(super) fn summed_everywhere(
        &self,
        reading: &[f64],
        per_node: usize,
    ) -> palpate_core::ContactEstimate {
        Inversion::new(self.seen(reading).expect("on its scale"))
            .summed_everywhere(self.told_force(), per_node)
    }

    /// Source of the force of an estimate.
    fn told_force(&self) -> ToldForce {
        match (self.stored.role, self.stored.force_n) {
            (NuisanceRole::Force, _) => ToldForce::Estimated,
            (_, Some(force_n)) => ToldForce::Known(force_n),
            (_, None) => ToldForce::Untold,
        }
    }

    /// The reading on its scale, whitened; `None` where it is off the scale.
    fn seen(&self, reading: &[f64]) -> Option<Seen<'_>> {
        let Stored { readings, whitening, .. } = &self.stored;
        let scaled = reading.iter().map(|value| readings.scaled(*value)).collect::<Option<Vec<f64>>>()?;
        let mut whitened = vec![0.0; whitening.channels()];
        whitening.apply(&scaled, &mut whitened);
        Some(Seen {
            locator: self,
            reading: in_lanes(&whitened),
            means: Vec::new(),
            variances: Vec::new(),
            slopes: Vec::new(),
            stretches: Vec::new(),
        })
    }
}

impl Locate for MeasuredLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let Stored { table, residual_limit, .. } = &self.stored;
        match self.seen(reading) {
            Some(seen) => Inversion::new(seen).estimate(self.told_force(), *residual_limit),
            None => Estimate::of_position(middle([table.x, table.y]), Status::OutsideModel),
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("whitened channels", setup.layout().len(), self.stored.whitening.channels())
    }
}

impl Stored {
    pub fn into_locator(self) -> MeasuredLocator {
        MeasuredLocator { search: Search::new(&self.table, &self.whitening), stored: self }
    }

    /// Checks what a file may have got wrong.
    fn check(&self) -> Result<(), LocatorFault> {
        let Self { table, whitening, .. } = self;
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        let channels = whitening.channels();
        LocatorFault::check_count("whitening weights", channels * channels, whitening.matrix.len())?;
        check_axes(&[table.x, table.y, table.nuisance])?;
        let nodes = table.x.count.saturating_mul(table.y.count).saturating_mul(table.nuisance.count);
        LocatorFault::check_count("table variances", nodes, table.variances.len())?;
        LocatorFault::check_count("table means", nodes.saturating_mul(channels), table.means.len())?;
        numbers("whitening weight", &whitening.matrix, |_| true, "finite")?;
        numbers("table mean", &table.means, |_| true, "finite")?;
        numbers("table variance", &table.variances, |v| v >= 0.0, "finite and at least 0")?;
        numbers("signal variance", &whitening.signal, |v| v >= 0.0, "finite and at least 0")?;
        numbers("gain", &[whitening.gain], |gain| gain >= 0.0, "finite and at least 0")?;
        numbers("residual limit", &[self.residual_limit], |v| v > 0.0, "greater than 0")?;
        LocatorFault::check_numbers("force", self.force_n, |force| force > 0.0, "finite and greater than 0")
    }
}

impl TryFrom<Stored> for MeasuredLocator {
    type Error = LocatorFault;

    fn try_from(stored: Stored) -> Result<Self, LocatorFault> {
        stored.check()?;
        Ok(stored.into_locator())
    }
}

impl From<MeasuredLocator> for Stored {
    fn from(locator: MeasuredLocator) -> Self {
        locator.stored
    }
}

/// A whitened reading, and room for what is interpolated to explain it.
#[derive(Debug)]
struct Seen<'a> {
    locator: &'a MeasuredLocator,
    reading: Vec<Lanes>,
    means: Vec<Lanes>,
    variances: Vec<Lanes>,
    slopes: Vec<Slopes>,
    stretches: Vec<Stretch>,
}

impl Seen<'_> {
    /// The least squared residual of a place and the integral over some nodes of its line; `None` where others may matter.
    fn explain_by(&mut self, place: [f64; 2], nodes: std::ops::Range<usize>) -> Option<(f64, Marginal)> {
        let Search { means, noise, .. } = &self.locator.search;
        means.interpolate(place, nodes.clone(), &mut self.means);
        let variances = &self.variances.as_flattened()[nodes.clone()];
        let line = Line { means: &self.means, variances };
        let (misfit, mut marginal) = line.explain(&self.reading, noise, &mut self.stretches);
        let negligible = misfit + NEGLIGIBLE;
        let (Some(below), Some(above)) = (self.stretches.first(), self.stretches.last()) else { return None };
        let is_open = nodes.start > 0 && below.residual_at(0.0) < negligible
            || nodes.end < self.nodes() && above.residual_at(1.0) < negligible;
        marginal.shift(nodes.start as f64);
        (!is_open).then_some((misfit, marginal))
    }

    /// The stretch of a line that a node of the nuisance coordinate is in, and where in it.
    fn stretch(&self, node: f64) -> (usize, f64) {
        let first = (node.max(0.0) as usize).min(self.nodes().saturating_sub(2));
        (first, node - first as f64)
    }

    /// The equations where the latent number is the nuisance coordinate, straight between two nodes; `variances` are those of a line, and
    /// taken at the node `near`.
    fn equations_of_line(&mut self, [x, y, latent]: Unknowns, variances: &[f64], near: f64) -> Equations {
        let Search { means, noise, .. } = &self.locator.search;
        let (first, t) = self.stretch(latent);
        means.interpolate_slopes([x, y], first..first + 2, &mut self.slopes);
        let (of_near, share) = self.stretch(near);
        let v = variances[of_near] + share * (variances[of_near + 1] - variances[of_near]);
        let (from, to) = self.slopes.split_at(self.reading.len());
        let channels = (0..self.reading.len()).map(|g| {
            let weights = noise.signal[g].map(|signal| 1.0 / (1.0 + v * signal));
            let mut between = from[g];
            for k in 0..3 {
                for l in 0..LANES {
                    between[k][l] += t * (to[g][k][l] - from[g][k][l]);
                }
            }
            let [mean, along, across] = between;
            let residual = std::array::from_fn(|l| self.reading[g][l] - mean[l]);
            let by_node = std::array::from_fn(|l| to[g][0][l] - from[g][0][l]);
            (weights, residual, [along, across, by_node])
        });
        Equations::new(channels)
    }

    /// The equations where the latent number is a gain, in standard deviations.
    fn equations_of_gain(&mut self, [x, y, latent]: Unknowns, v: f64) -> Equations {
        let Search { means, noise, .. } = &self.locator.search;
        means.interpolate_slopes([x, y], 0..1, &mut self.slopes);
        let scale = 1.0 + noise.gain * latent;
        let channels = (0..self.reading.len()).map(|g| {
            let [mean, along, across] = &self.slopes[g];
            let weights = noise.signal[g].map(|signal| 1.0 / (1.0 + v * signal));
            let residual = std::array::from_fn(|l| self.reading[g][l] - scale * mean[l]);
            let times = |slopes: &Lanes, factor: f64| slopes.map(|slope| factor * slope);
            (weights, residual, [times(along, scale), times(across, scale), times(mean, noise.gain)])
        });
        Equations::new(channels).with_expected(latent, [0.0, 1.0])
    }

    /// Nodes of the nuisance coordinate.
    fn nodes(&self) -> usize {
        self.locator.stored.table.nuisance.count
    }
}

impl Explain for Seen<'_> {
    fn axes(&self) -> [Axis; 2] {
        let Table { x, y, .. } = &self.locator.stored.table;
        [*x, *y]
    }

    fn cells(&self) -> Cells {
        self.locator.search.cells
    }

    fn scan(&self, looks: &mut Vec<Look>) {
        look_at_cells(
            &self.locator.search.scan,
            &self.reading,
            self.locator.stored.whitening.channels(),
            looks,
        );
    }

    fn lengths(&self, [x, y]: [usize; 2], latent: f64) -> [f64; 2] {
        let nodes = self.nodes();
        let place = x * self.locator.stored.table.y.count + y;
        let lengths = &self.locator.search.lengths[place * nodes..(place + 1) * nodes];
        let [below, above] =
            [latent.floor(), latent.ceil()].map(|node| lengths[(node.max(0.0) as usize).min(nodes - 1)]);
        [0, 1].map(|k| below[k].max(above[k]))
    }

    /// Of the nuisance coordinate, in nodes, or of a gain, in standard deviations.
    fn range(&self) -> Option<(f64, f64)> {
        let nodes = self.nodes();
        let gain = self.locator.search.noise.gain > 0.0;
        if nodes > 1 { Some((0.0, (nodes - 1) as f64)) } else { gain.then_some((-MOST_GAIN, MOST_GAIN)) }
    }

    fn equations(&mut self, at: Unknowns, near: Unknowns) -> Equations {
        let place = near[0].round() as usize * self.axes()[1].count + near[1].round() as usize;
        let variances = self.locator.search.variances.groups_of(place, 0..1).as_flattened();
        if self.nodes() > 1 {
            self.equations_of_line(at, variances, near[2])
        } else {
            self.equations_of_gain(at, variances[0])
        }
    }

    fn explain(&mut self, place: [f64; 2], latent: f64) -> Explained {
        let nodes = self.nodes();
        self.locator.search.variances.interpolate(place, 0..1, &mut self.variances);
        self.variances.as_flattened_mut().iter_mut().for_each(|v| *v = v.max(0.0));
        let (first, _) = self.stretch(latent);
        let near = first.saturating_sub(NEAR)..(first + NEAR + 2).min(nodes);
        let (misfit, marginal) =
            self.explain_by(place, near).or_else(|| self.explain_by(place, 0..nodes)).unwrap_or_default();
        let Marginal { weight, nuisance, nuisance_square } = marginal;
        let latent = nuisance / weight;
        let [x, y] = self.axes();
        Explained {
            misfit,
            cost: misfit - 2.0 * weight.ln() + x.margin_cost(place[0]) + y.margin_cost(place[1]),
            latent: if nodes > 1 { latent } else { 0.0 },
            latent_variance: (nuisance_square / weight - latent * latent).max(0.0),
        }
    }

    /// The nuisance coordinate off its scale, where it is the force.
    fn force(&self, latent: f64, variance: f64) -> (f64, f64) {
        let Stored { table, nuisance, role, .. } = &self.locator.stored;
        if *role != NuisanceRole::Force {
            return (0.0, 0.0);
        }
        let force_n = nuisance.undo(table.nuisance.value(latent));
        let slope = table.nuisance.step
            * match nuisance {
                Scale::Linear => 1.0,
                Scale::Logarithm => force_n,
            };
        (force_n, variance * slope * slope)
    }
}

//! Locator of a measured surface.

use super::config::Scale;
use super::curve::{Curve, Window};
use super::line::{Line, Marginal, Stretch, WhiteNoise};
use super::scan::Scan;
use super::table::Table;
use crate::fit::{Locate, LocatorFault, NoCheck};
use crate::force_prior::PriorTerms;
use crate::influence::grid::{Axis, check_axes, greatest_distances, middle};
use crate::influence::inversion::{
    CellFit, Cells, ContactLikelihood, ForceKnowledge, Inversion, Layers, Limits, PlaceFit, Slopes, Stencil,
    fit_cells,
};
use crate::influence::lanes::{LANES, Lanes, in_lanes};
use crate::influence::levenberg::{EquationSums, Equations, Unknowns};
use crate::influence::noise::Whitening;
use crate::setup::Setup;
use palpate_core::{Estimate, Status};
use palpate_numerics::simd::{Arithmetic, InstructionSet, Kernel, Simd, Vector};

/// Role of the nuisance coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NuisanceRole {
    /// Absent.
    None,
    /// Contact force, in newtons.
    Force,
    /// Another quantity.
    Other,
}

#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeasuredContents {
    pub readings: Scale,
    pub whitening: Whitening,
    pub table: Table,
    pub role: NuisanceRole,
    pub nuisance: Scale,
    /// Squared residual, in variances, from which a reading is `outside_model`.
    pub residual_limit: f64,
    pub force_n: Option<f64>,
    /// Disabled channels, from 0; the whitening is of the others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<usize>,
}

/// Locator by learnt readings.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "MeasuredContents", into = "MeasuredContents")]
pub struct MeasuredLocator {
    pub(super) stored: MeasuredContents,
    search: Search,
}

#[derive(Clone, Debug, PartialEq)]
struct Search {
    /// Means, one layer per nuisance node.
    means: Layers,
    /// v, with nuisance nodes as channels.
    variances: Layers,
    noise: WhiteNoise,
    cells: Cells,
    scan: Scan,
    /// Greatest distances from neighbours' readings over the standard deviations, per nuisance node.
    lengths: Vec<[f64; 2]>,
}

/// Nodes of a cell along an axis, with a nuisance coordinate.
const STRIDE: usize = 3;
/// Straight segments between nodes.
const PARTS: usize = 4;
/// Windows around successive minima.
const MOST_WINDOWS: usize = 3;
/// In standard deviations.
const MOST_GAIN: f64 = 6.0;

impl Search {
    fn new(table: &Table, whitening: &Whitening) -> Self {
        let Table { x, y, nuisance, .. } = table;
        let axes = [*x, *y];
        let stride = if nuisance.count > 1 { STRIDE } else { 1 };
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

    fn line(&self, place: usize, nodes: usize) -> Line<'_> {
        Line {
            means: self.means.groups_of(place, 0..nodes),
            variances: &self.variances.groups_of(place, 0..1).as_flattened()[..nodes],
        }
    }

    fn find_lengths(&mut self, axes: [Axis; 2], nodes: usize) {
        let noise = self.noise.without_gain();
        let mut stretches = Vec::new();
        self.lengths = (0..axes[0].count * axes[1].count * nodes)
            .map(|i| {
                let (place, node) = (i / nodes, i % nodes);
                let mean = self.means.groups_of(place, node..node + 1);
                greatest_distances(axes, place, |other| {
                    self.line(other, nodes).residual(mean, &noise, &mut stretches).sqrt()
                })
            })
            .collect();
    }
}

impl MeasuredLocator {
    /// Learnt readings.
    pub fn table(&self) -> &Table {
        &self.stored.table
    }

    /// Whitening of scaled readings to unit noise.
    pub fn whitening(&self) -> &Whitening {
        &self.stored.whitening
    }

    /// Scale of the readings.
    pub fn readings(&self) -> Scale {
        self.stored.readings
    }

    /// Role of the nuisance coordinate.
    pub fn role(&self) -> NuisanceRole {
        self.stored.role
    }

    /// Scale of the nuisance coordinate.
    pub fn nuisance(&self) -> Scale {
        self.stored.nuisance
    }

    pub(super) fn with_residual_limit(mut self, limit: f64) -> Self {
        self.stored.residual_limit = limit;
        self
    }

    /// Least squared residual over the variances; NaN off the scale.
    pub(super) fn misfit(&self, reading: &[f64]) -> f64 {
        self.likelihood(reading).map_or(f64::NAN, |likelihood| Inversion::new(likelihood).misfit())
    }

    /// Contact by summation over the grid.
    #[cfg(test)]
    pub(super) fn summed_everywhere(
        &self,
        reading: &[f64],
        per_node: usize,
    ) -> palpate_core::ContactEstimate {
        Inversion::new(self.likelihood(reading).expect("on its scale"))
            .summed_everywhere(self.force_knowledge(), per_node)
    }

    /// Returns whether estimates have a force.
    pub fn estimates_force(&self) -> bool {
        self.force_knowledge() != ForceKnowledge::Unknown
    }

    fn force_knowledge(&self) -> ForceKnowledge {
        match (self.stored.role, self.stored.force_n) {
            (NuisanceRole::Force, _) => ForceKnowledge::Estimated,
            (_, Some(force_n)) => ForceKnowledge::Known(force_n),
            (_, None) => ForceKnowledge::Unknown,
        }
    }

    /// Whitened reading; `None` off its scale.
    fn likelihood(&self, reading: &[f64]) -> Option<ReadingLikelihood<'_>> {
        let MeasuredContents { readings, whitening, .. } = &self.stored;
        let in_use = self.stored.channels_in_use().map(|channel| readings.scaled(reading[channel]));
        let scaled = in_use.collect::<Option<Vec<f64>>>()?;
        let mut whitened = vec![0.0; whitening.channels()];
        whitening.apply(&scaled, &mut whitened);
        Some(ReadingLikelihood {
            locator: self,
            reading: in_lanes(&whitened),
            means: Vec::new(),
            variances: Vec::new(),
            slopes: Vec::new(),
            weights: Vec::new(),
            parts: Vec::new(),
            parts_variances: Vec::new(),
            stretches: Vec::new(),
        })
    }
}

impl Locate for MeasuredLocator {
    type Check = NoCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        let MeasuredContents { table, residual_limit, .. } = &self.stored;
        match self.likelihood(reading) {
            Some(likelihood) => {
                let limits = Limits { misfit: *residual_limit, spread: f64::INFINITY };
                Inversion::new(likelihood).estimate(self.force_knowledge(), limits)
            }
            None => Estimate::of_position(middle([table.x, table.y]), Status::OutsideModel),
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        let MeasuredContents { whitening, missing, .. } = &self.stored;
        LocatorFault::check_count(
            "whitened channels",
            setup.layout().len(),
            whitening.channels() + missing.len(),
        )
    }
}

impl MeasuredContents {
    pub fn into_locator(self) -> MeasuredLocator {
        MeasuredLocator { search: Search::new(&self.table, &self.whitening), stored: self }
    }

    fn check(&self) -> Result<(), LocatorFault> {
        let Self { table, whitening, .. } = self;
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        let channels = whitening.channels();
        LocatorFault::check_count("channels in use", channels, self.channels_in_use().count())?;
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

impl TryFrom<MeasuredContents> for MeasuredLocator {
    type Error = LocatorFault;

    fn try_from(stored: MeasuredContents) -> Result<Self, LocatorFault> {
        stored.check()?;
        Ok(stored.into_locator())
    }
}

impl From<MeasuredLocator> for MeasuredContents {
    fn from(locator: MeasuredLocator) -> Self {
        locator.stored
    }
}

#[derive(Debug)]
struct ReadingLikelihood<'a> {
    locator: &'a MeasuredLocator,
    reading: Vec<Lanes>,
    means: Vec<Lanes>,
    variances: Vec<Lanes>,
    slopes: Vec<Slopes>,
    weights: Vec<Lanes>,
    parts: Vec<Lanes>,
    parts_variances: Vec<f64>,
    stretches: Vec<Stretch>,
}

impl ReadingLikelihood<'_> {
    /// Least squared residual and integral near a node; `None` where other parts of the line matter.
    fn explain_near(&mut self, place: [f64; 2], mut near: f64) -> Option<(f64, Marginal)> {
        let nodes = self.nodes();
        for _ in 0..MOST_WINDOWS {
            let window = Window::around(near, nodes);
            let Search { means, noise, .. } = &self.locator.search;
            means.interpolate(place, window.first..window.first + window.nodes, &mut self.means);
            let v = self.variance(near);
            let weights = |group: usize| noise.weights(v, group);
            match Curve::new(&self.reading, &self.means, weights, window).integral(near) {
                Ok(found) => return Some(found),
                Err(node) => near = node.filter(|node| Window::around(*node, nodes) != window)?,
            }
        }
        None
    }

    /// [`Self::explain_near`] over the whole line.
    fn explain_line(&mut self, place: [f64; 2]) -> (f64, Marginal) {
        let nodes = self.nodes();
        let Search { means, noise, .. } = &self.locator.search;
        means.interpolate(place, 0..nodes, &mut self.means);
        let groups = means.groups();
        let parts = if nodes > 1 { PARTS } else { 1 };
        self.parts.clear();
        self.parts_variances.clear();
        for part in 0..=(nodes - 1) * parts {
            let node = part as f64 / parts as f64;
            let Stencil { first, used, weights, .. } = Stencil::new(node, nodes);
            for g in 0..groups {
                let mut sum = [0.0; LANES];
                for (k, weight) in weights[..used].iter().enumerate() {
                    let mean = &self.means[(first + k) * groups + g];
                    (0..LANES).for_each(|l| sum[l] += weight * mean[l]);
                }
                self.parts.push(sum);
            }
            let v = self.variance(node);
            self.parts_variances.push(v);
        }
        let line = Line { means: &self.parts, variances: &self.parts_variances };
        let (misfit, Marginal { weight, mean, variance }) =
            line.marginal(&self.reading, noise, &mut self.stretches);
        let scale = 1.0 / parts as f64;
        (misfit, Marginal { weight: weight * scale, mean: mean * scale, variance: variance * scale * scale })
    }

    fn interpolate_variances(&mut self, place: [f64; 2]) {
        self.locator.search.variances.interpolate(place, 0..1, &mut self.variances);
        self.variances.as_flattened_mut().iter_mut().for_each(|v| *v = v.max(0.0));
    }

    fn variance(&self, node: f64) -> f64 {
        let variances = self.variances.as_flattened();
        let (first, share) = self.stretch(node);
        let next = (first + 1).min(self.nodes() - 1);
        variances[first] + share * (variances[next] - variances[first])
    }

    /// Segment, and the fraction within it.
    fn stretch(&self, node: f64) -> (usize, f64) {
        let first = (node.max(0.0) as usize).min(self.nodes().saturating_sub(2));
        (first, node - first as f64)
    }

    /// Equations with the nuisance coordinate as latent variable.
    fn equations_of_line(&mut self, [x, y, latent]: Unknowns) -> Equations {
        let Search { means, .. } = &self.locator.search;
        let stencil = Stencil::new(latent, self.nodes());
        means.interpolate_slopes([x, y], stencil.first..stencil.first + stencil.used, &mut self.slopes);
        InstructionSet::best().run(LineEquations {
            reading: &self.reading,
            weights: &self.weights,
            slopes: &self.slopes,
            stencil,
        })
    }

    /// Equations with a gain, in standard deviations, as latent variable.
    fn equations_of_gain(&mut self, [x, y, latent]: Unknowns) -> Equations {
        let Search { means, noise, .. } = &self.locator.search;
        means.interpolate_slopes([x, y], 0..1, &mut self.slopes);
        let scale = 1.0 + noise.gain * latent;
        let equations = Equations::new((0..self.reading.len()).map(|g| {
            let [mean, along, across] = &self.slopes[g];
            let residual = std::array::from_fn(|l| self.reading[g][l] - scale * mean[l]);
            let times = |slopes: &Lanes, factor: f64| slopes.map(|slope| factor * slope);
            (self.weights[g], residual, [times(along, scale), times(across, scale), times(mean, noise.gain)])
        }));
        equations.with_prior(PriorTerms { cost: latent * latent, slope: latent, precision: 1.0 })
    }

    fn nodes(&self) -> usize {
        self.locator.stored.table.nuisance.count
    }
}

struct LineEquations<'a> {
    reading: &'a [Lanes],
    /// 1/V.
    weights: &'a [Lanes],
    slopes: &'a [Slopes],
    stencil: Stencil,
}

impl Kernel for LineEquations<'_> {
    type Output = Equations;
    const FUSED: bool = true;

    #[inline(always)] // Compiled for the instructions of its caller.
    fn run<S: Simd>(self) -> Equations {
        let Self { reading, weights, slopes, stencil } = self;
        let groups = reading.len();
        let mut sums = EquationSums::new();
        for (g, (z, weights)) in reading.iter().zip(weights).enumerate() {
            let [mut mean, mut along, mut across, mut by_node] = [S::F64::splat(0.0); 4];
            for (k, at_node) in slopes[g..].iter().step_by(groups).enumerate() {
                let [value, x, y] = at_node.each_ref().map(S::F64::load);
                let share = S::F64::splat(stencil.weights[k]);
                mean = value.mul_add(share, mean);
                along = x.mul_add(share, along);
                across = y.mul_add(share, across);
                by_node = value.mul_add(S::F64::splat(stencil.slopes[k]), by_node);
            }
            let [z, weights] = [z, weights].map(S::F64::load);
            sums.add(weights, z - mean, [along, across, by_node]);
        }
        sums.equations()
    }
}

impl ContactLikelihood for ReadingLikelihood<'_> {
    fn axes(&self) -> [Axis; 2] {
        let Table { x, y, .. } = &self.locator.stored.table;
        [*x, *y]
    }

    fn cells(&self) -> Cells {
        self.locator.search.cells
    }

    fn scan(&self, fits: &mut Vec<CellFit>) {
        fit_cells(&self.locator.search.scan, &self.reading, self.locator.stored.whitening.channels(), fits);
    }

    fn bounds_are_loose(&self) -> bool {
        false
    }

    fn lengths(&self, [x, y]: [usize; 2], latent: f64) -> [f64; 2] {
        let nodes = self.nodes();
        let place = x * self.locator.stored.table.y.count + y;
        let lengths = &self.locator.search.lengths[place * nodes..(place + 1) * nodes];
        let [below, above] =
            [latent.floor(), latent.ceil()].map(|node| lengths[(node.max(0.0) as usize).min(nodes - 1)]);
        [0, 1].map(|k| below[k].max(above[k]))
    }

    /// Nuisance coordinate in nodes, or gain in standard deviations.
    fn range(&self) -> Option<(f64, f64)> {
        let nodes = self.nodes();
        let gain = self.locator.search.noise.gain > 0.0;
        if nodes > 1 { Some((0.0, (nodes - 1) as f64)) } else { gain.then_some((-MOST_GAIN, MOST_GAIN)) }
    }

    fn weigh(&mut self, [x, y, latent]: Unknowns) {
        self.interpolate_variances([x, y]);
        let v = self.variance(if self.nodes() > 1 { latent } else { 0.0 });
        let noise = &self.locator.search.noise;
        self.weights.clear();
        self.weights.extend((0..self.reading.len()).map(|group| noise.weights(v, group)));
    }

    fn equations(&mut self, at: Unknowns) -> Equations {
        if self.nodes() > 1 { self.equations_of_line(at) } else { self.equations_of_gain(at) }
    }

    /// Zero, as logarithms do not add.
    fn spread(&mut self, _: Unknowns) -> f64 {
        0.0
    }

    fn fit_place(&mut self, place: [f64; 2], latent: f64) -> PlaceFit {
        let nodes = self.nodes();
        self.interpolate_variances(place);
        let near = if nodes > 1 { self.explain_near(place, latent) } else { None };
        let (misfit, Marginal { weight, mean, variance }) = near.unwrap_or_else(|| self.explain_line(place));
        let [x, y] = self.axes();
        PlaceFit {
            misfit,
            cost: misfit - 2.0 * weight.ln() + x.margin_cost(place[0]) + y.margin_cost(place[1]),
            latent: if nodes > 1 { mean } else { 0.0 },
            latent_variance: variance,
        }
    }

    fn force(&self, latent: f64, variance: f64) -> (f64, f64) {
        let MeasuredContents { table, nuisance, role, .. } = &self.locator.stored;
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

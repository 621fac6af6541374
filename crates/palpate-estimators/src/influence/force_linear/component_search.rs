//! Search for the components of a recording: neighbours on grids of length scales, from each family's best
//! until their probability is small.

use super::component::Component;
use super::evidence::ALL_DECADES;
use super::noise_prior::NoisePrior;
use super::prior::{Prior, Source};
use super::source_grid::SourceGrid;
use crate::influence::calibration::CalibrationRows;
use palpate_mechanics::surface::Extent;
use palpate_numerics::regression::Kernel;
use palpate_numerics::watch::{Cancelled, Watch};
use std::collections::{HashMap, VecDeque};
use std::ops::RangeInclusive;

/// Ratio of neighbouring length scales.
const STEP: f64 = 1.6;
/// Least log probability over the best component's: a thousandth.
const LEAST_LOG: f64 = -6.9;
/// Log evidence from which a kind of source or a radius is not searched further.
const HOPELESS: f64 = -30.0;
/// Load radii along a line, in lengths of the surface.
const RADII: [f64; 4] = [0.0, 0.01, 0.02, 0.035];

pub(super) struct ComponentSearch<'a> {
    pub presses: &'a CalibrationRows,
    pub noises: &'a [NoisePrior],
    pub sources: &'a SourceGrid,
    pub watch: Watch<'a>,
}

impl ComponentSearch<'_> {
    /// Components of the structure of `prior`, with `lengths_m` of its smooth influence functions.
    pub fn found(&self, prior: &Prior, lengths_m: &[f64]) -> Result<Vec<Component>, Cancelled> {
        let smooth = |kernel: Kernel| Prior {
            kernel,
            lengths_m: lengths_m.to_vec(),
            smooth_part: 1.0,
            source: None,
            load_radius: 0.0,
            ..prior.clone()
        };
        let mut found = Vec::new();
        for kernel in [Kernel::Matern32, Kernel::Matern52] {
            found.extend(self.neighbours(self.component(smooth(kernel))?)?);
        }
        if prior.is_separable() {
            for start in self.source_families(prior)? {
                found.extend(self.neighbours(Some(start))?);
            }
        }
        retain_probable(&mut found);
        let refined = found.into_iter().map(|component| self.refined(component));
        Ok(refined.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }

    /// First components of the kinds of sources and of the radii that are not hopeless.
    fn source_families(&self, prior: &Prior) -> Result<Vec<Component>, Cancelled> {
        const LENGTH: f64 = 0.2;
        let (extent, dimensions) = (prior.extent, prior.extent.dimensions());
        let family = |source: Source, load_radius: f64| Prior {
            kernel: Kernel::Matern52,
            smooth_part: 1.0,
            lengths_m: vec![LENGTH * extent.length_m(); dimensions],
            source: Some(source),
            load_radius,
            ..prior.clone()
        };
        // With fewer, nearly each position is a coefficient, and residuals do not determine the noise.
        if self.presses.positions_m().len() < 2 * family(Source::Strain, 0.0).polynomials() {
            return Ok(Vec::new());
        }
        let radii = if matches!(extent, Extent::Line { .. }) { &RADII[..] } else { &RADII[..1] };
        let mut found = Vec::new();
        for source in Source::all(extent) {
            for radius in radii {
                found.extend(self.component(family(*source, *radius))?);
            }
        }
        let best = most_probable(&found);
        found.retain(|component| component.log_evidence() >= best + HOPELESS);
        Ok(found)
    }

    fn component(&self, prior: Prior) -> Result<Option<Component>, Cancelled> {
        self.of_ratios(prior, self.sources, decades(*ALL_DECADES.start(), *ALL_DECADES.end()))
    }

    fn of_ratios(
        &self,
        prior: Prior,
        grid: &SourceGrid,
        ratios: Vec<f64>,
    ) -> Result<Option<Component>, Cancelled> {
        self.watch.round()?;
        let found = Component::new(self.presses, prior, self.noises, grid, ratios);
        Ok(found.filter(|component| component.log_evidence().is_finite()))
    }

    /// The component of each neighbour on the grid of length scales about `start`, and of their neighbours,
    /// down to [`LEAST_LOG`].
    fn neighbours(&self, start: Option<Component>) -> Result<Vec<Component>, Cancelled> {
        let Some(start) = start else { return Ok(Vec::new()) };
        let first = start.prior.clone();
        let range_m = length_range_m(&first);
        let origin = vec![0; if first.source.is_some() { 1 } else { first.lengths_m.len() }];
        let mut best = start.log_evidence();
        let mut found: HashMap<Vec<i32>, Option<Component>> = HashMap::from([(origin.clone(), Some(start))]);
        let mut queue = VecDeque::from([origin]);
        while let Some(at) = queue.pop_front() {
            let Some(Some(component)) = found.get(&at) else { continue };
            if component.log_evidence() < best + LEAST_LOG {
                continue;
            }
            let (low, high) = component.probable_ratios(1e-3);
            let power = |ratio: f64| ratio.log10().round() as i32;
            let (low, high) = (power(component.ratios[low]) - 1, power(component.ratios[high]) + 1);
            let ratios = decades(low.max(*ALL_DECADES.start()), high.min(*ALL_DECADES.end()));
            for axis in 0..at.len() {
                for step in [-1, 1] {
                    let mut next = at.clone();
                    next[axis] += step;
                    if found.contains_key(&next) {
                        continue;
                    }
                    let mut prior = first.clone();
                    for (k, length_m) in prior.lengths_m.iter_mut().enumerate() {
                        *length_m *= STEP.powi(next[k.min(next.len() - 1)]);
                    }
                    let is_within = |length_m: &f64| range_m.contains(length_m);
                    let component = match prior.lengths_m.iter().all(is_within) {
                        true => self.of_ratios(prior, self.sources, ratios.clone())?,
                        false => None,
                    };
                    if let Some(component) = &component {
                        best = best.max(component.log_evidence());
                        queue.push_back(next.clone());
                    }
                    found.insert(next, component);
                }
            }
        }
        let mut found: Vec<(Vec<i32>, Component)> = found
            .into_iter()
            .filter_map(|(at, component)| component.map(|component| (at, component)))
            .collect();
        found.sort_by(|a, b| a.0.cmp(&b.0));
        Ok(found.into_iter().map(|(_, component)| component).collect())
    }

    /// The component with twice as many ratios and four times as many places, where few are probable.
    fn refined(&self, component: Component) -> Result<Option<Component>, Cancelled> {
        const FEW: usize = 4;
        let (low, high) = component.probable_ratios(1e-3);
        let divided = component.coarse_places().map(|places| self.sources.divided(&places));
        let is_fine = high - low >= FEW;
        if is_fine && divided.is_none() {
            return Ok(Some(component));
        }
        // Middles of the halves of each decade.
        let halves_of = |ratio: &f64| [-0.25, 0.25].map(|half| ratio * 10f64.powf(half));
        let halves = component.ratios[low..=high].iter().flat_map(halves_of);
        let ratios = if is_fine { component.ratios.clone() } else { halves.collect() };
        self.of_ratios(component.prior, divided.as_ref().unwrap_or(self.sources), ratios)
    }
}

/// Length scales with other influence functions than their limits, white noise and polynomials.
fn length_range_m(prior: &Prior) -> RangeInclusive<f64> {
    let length_m = prior.extent.length_m();
    match prior.source {
        Some(_) => 0.05 * length_m..=2.0 * length_m,
        None => 1e-3 * length_m..=10.0 * length_m,
    }
}

fn decades(first: i32, last: i32) -> Vec<f64> {
    (first..=last).map(|decade| 10f64.powi(decade)).collect()
}

fn most_probable(components: &[Component]) -> f64 {
    components.iter().map(Component::log_evidence).fold(f64::NEG_INFINITY, f64::max)
}

fn retain_probable(components: &mut Vec<Component>) {
    let best = most_probable(components);
    components.retain(|component| component.log_evidence() >= best + LEAST_LOG);
}

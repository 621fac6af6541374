//! Patches as uniform loads, with likelihood-ratio intervals that do not depend on a prior.
//!
//! A patch is a force F, uniform over a width w around a centre c. The 95 % intervals of forces, centres and
//! centres of pressure are those of the [profile likelihood](super::profile_likelihood) of ‖y − Σ F·m(c, w)‖²,
//! with mean influences m over noise.
//!
//! Minima are by Levenberg–Marquardt with clamped unknowns. Readings are linear in the square of a small
//! width, so the unknown is s in w² = w_min² + s·(w_max(c)² − w_min²), with w_min the node distance.

use super::cells::Cells;
use super::cumulative::CumulativeInfluence;
use super::profile_likelihood::{FREE_INCREASE, Profile, ProfilePoint};
use ndarray::{Array1, Array2, ArrayView1};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::{Extent, UniformLoad};
use palpate_numerics::{Cholesky, chi_squared_critical_value};

/// Least share of a whole side.
const WHOLE: f64 = 0.95;
/// Points for a median.
const LOOKED_AT: usize = 16;
const NEGLIGIBLE: f64 = 1e-3;
/// Damping of the score test.
const SCORE_DAMPING: f64 = 1e-9;
/// A dozen is usual.
const MOST_STEPS: usize = 200;
/// Relative damping of the normal equations.
const FIRST_DAMPING: f64 = 1e-4;
const LEAST_DAMPING: f64 = 1e-12;
const MOST_DAMPING: f64 = 1e6;

/// Uniform loads, one per patch.
pub(super) struct EvenLoads<'a> {
    table: &'a CumulativeInfluence,
    y: &'a Array1<f64>,
    dimensions: usize,
    best: Minimum,
}

/// Per load the force, then per axis the centre and width share s.
#[derive(Clone)]
struct Minimum {
    unknowns: Vec<f64>,
    chi_squared: f64,
}

/// Value with an interval.
#[derive(Clone, Copy)]
pub(super) enum LoadQuantity {
    /// Of a load, in newtons.
    Force(usize),
    /// In newtons.
    Total,
    /// Of a load along an axis, in metres.
    Centre(usize, usize),
    /// Along an axis, in metres.
    CentreOfPressure(usize),
}

/// Value, target t and ρ².
type Drawn = (LoadQuantity, f64, f64);

impl<'a> EvenLoads<'a> {
    /// Fits from a profile's loads.
    pub fn new(
        table: &'a CumulativeInfluence,
        y: &'a Array1<f64>,
        extent: Extent,
        starts: &[UniformLoad],
    ) -> Option<Self> {
        let no_loads = Minimum { unknowns: Vec::new(), chi_squared: f64::INFINITY };
        let loads = Self { table, y, dimensions: extent.dimensions(), best: no_loads };
        // The profile's prior moves loads inwards; a larger force nearer to the support may have the same
        // moment.
        let nearer = [1.0, 0.5, 0.25].into_iter();
        let starts = nearer.map(|nearer| {
            starts.iter().flat_map(|start| loads.unknowns_of(start, nearer)).collect::<Vec<f64>>()
        });
        loads.fit_from(starts.filter(|start| !start.is_empty()).collect())
    }

    /// Best of several starts, along x.
    fn fit_from(&self, starts: Vec<Vec<f64>>) -> Option<Self> {
        let fits = starts.into_iter().map(|start| self.minimum(start, None, &[]));
        let best = fits
            .min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared))
            .filter(|best| best.chi_squared.is_finite())?;
        let mut loads: Vec<&[f64]> = best.unknowns.chunks(self.each()).collect();
        loads.sort_by(|a, b| a[1].total_cmp(&b[1]));
        let best = Minimum { unknowns: loads.concat(), chi_squared: best.chi_squared };
        Some(Self { table: self.table, y: self.y, dimensions: self.dimensions, best })
    }

    /// Starts from halves of each load, and from maxima of the score test; `influence` is channels × cells.
    pub fn with_one_more(&self, cells: &Cells, influence: &Array2<f64>) -> Option<Self> {
        let loads: Vec<UniformLoad> = (0..self.count()).map(|number| self.fitted_load(number)).collect();
        let mut starts = Vec::new();
        for (number, load) in loads.iter().enumerate() {
            for halves in self.halves(load) {
                let others = loads.iter().enumerate().filter(|(other, _)| *other != number);
                let start = others.map(|(_, other)| other).chain(&halves);
                starts.push(start.flat_map(|load| self.unknowns_of(load, 1.0)).collect());
            }
        }
        for load in self.additions(cells, influence) {
            starts.push([&self.best.unknowns[..], &self.unknowns_of(&load, 1.0)].concat());
        }
        self.fit_from(starts)
    }

    fn halves(&self, load: &UniformLoad) -> Vec<[UniformLoad; 2]> {
        let (from, to, middle) = (load.from(), load.to(), load.centre());
        let half = |from, to| UniformLoad::new(from, to, 0.5 * load.force_n());
        let mut halves = vec![[
            half(from, Position { x_m: middle.x_m, ..to }),
            half(Position { x_m: middle.x_m, ..from }, to),
        ]];
        if self.dimensions > 1 {
            halves.push([
                half(from, Position { y_m: middle.y_m, ..to }),
                half(Position { y_m: middle.y_m, ..from }, to),
            ]);
        }
        halves
    }

    /// Single-cell loads with the greatest misfit reduction to first order (Rao's score test): (a′·r)²/|a′|²
    /// for a′·r > 0, with r the residual and a′ the influence minus its projection on the reading's
    /// derivatives.
    fn additions(&self, cells: &Cells, influence: &Array2<f64>) -> Vec<UniformLoad> {
        let (residuals, slopes) = self.residuals(&self.best.unknowns);
        let hessian = slopes.dot(&slopes.t());
        let everything: Vec<usize> = (0..slopes.nrows()).collect();
        let force_and_gain = |column: ArrayView1<f64>| {
            let projected = solve(&hessian, &everything, SCORE_DAMPING, &slopes.dot(&column))?;
            let across = &column - &slopes.t().dot(&projected);
            let (slope, square) = (-across.dot(&residuals), across.dot(&across));
            (slope > 0.0 && square > 0.0).then(|| (slope / square, slope * slope / square))
        };
        let found: Vec<(f64, f64)> = influence
            .columns()
            .into_iter()
            .map(|column| force_and_gain(column).unwrap_or((0.0, 0.0)))
            .collect();
        let is_maximum = |cell: &usize| {
            found[*cell].1 > NEGLIGIBLE
                && cells.neighbours(*cell).all(|beside| found[beside].1 <= found[*cell].1)
        };
        let load = |cell: usize| {
            let (from, to) = cells.corners(cell);
            UniformLoad::new(from, to, found[cell].0)
        };
        (0..cells.len()).filter(is_maximum).map(load).collect()
    }

    pub fn count(&self) -> usize {
        self.best.unknowns.len() / self.each()
    }

    pub fn unknowns(&self) -> usize {
        self.best.unknowns.len()
    }

    pub fn fitted_load(&self, number: usize) -> UniformLoad {
        self.load(&self.best.unknowns[number * self.each()..][..self.each()])
    }

    pub fn chi_squared(&self) -> f64 {
        self.best.chi_squared
    }

    /// Load at the posterior median of its centre, with a flat prior over the interval and the others
    /// refitted. The load of least misfit depends on chance where force and place trade off.
    pub fn middle_load(&self, number: usize) -> UniformLoad {
        let mut middle = self.best.unknowns.clone();
        let centres: Vec<usize> =
            (0..self.dimensions).map(|axis| number * self.each() + 1 + 2 * axis).collect();
        for (axis, centre) in centres.iter().enumerate() {
            middle[*centre] = self.median(*centre, self.interval_95(LoadQuantity::Centre(number, axis)));
        }
        let found = self.minimum(middle, None, &centres);
        self.load(&found.unknowns[number * self.each()..][..self.each()])
    }

    fn median(&self, unknown: usize, (low, high): (f64, f64)) -> f64 {
        let (least, most) = self.range(unknown);
        let step = (high - low) / LOOKED_AT as f64;
        let values = (0..LOOKED_AT).map(|i| (low + (i as f64 + 0.5) * step).clamp(least, most));
        let mut unknowns = self.best.unknowns.clone();
        let likelihoods: Vec<f64> = values
            .map(|value| {
                unknowns[unknown] = value;
                let found = self.minimum(unknowns.clone(), None, &[unknown]);
                unknowns.clone_from(&found.unknowns);
                (0.5 * (self.best.chi_squared - found.chi_squared)).exp()
            })
            .collect();
        let half = 0.5 * likelihoods.iter().sum::<f64>();
        let mut below = 0.0;
        for (i, likelihood) in likelihoods.iter().enumerate() {
            if below + likelihood >= half {
                return low + step * (i as f64 + (half - below) / likelihood);
            }
            below += likelihood;
        }
        self.best.unknowns[unknown]
    }

    fn load(&self, unknowns: &[f64]) -> UniformLoad {
        let [[left, right], [low, high]] = self.ends_m(unknowns);
        let corner = |x_m, y_m| Position { x_m, y_m: if self.dimensions > 1 { y_m } else { 0.0 } };
        UniformLoad::new(corner(left, low), corner(right, high), unknowns[0])
    }

    /// Upper ends may be infinite.
    pub fn interval_95(&self, aim: LoadQuantity) -> (f64, f64) {
        let whole = match aim {
            LoadQuantity::Force(_) | LoadQuantity::Total => (0.0, f64::INFINITY),
            LoadQuantity::Centre(_, axis) | LoadQuantity::CentreOfPressure(axis) => {
                (0.0, self.table.side_m(axis))
            }
        };
        let Some(sd) = self.sd(aim) else { return whole };
        let [low, high] = [-sd, sd].map(|step| self.end(aim, step));
        (low.unwrap_or(whole.0), high.unwrap_or(whole.1))
    }

    fn each(&self) -> usize {
        1 + 2 * self.dimensions
    }

    fn unknowns_of(&self, load: &UniformLoad, nearer: f64) -> Vec<f64> {
        let (centre, from, to) = (load.centre(), load.from(), load.to());
        let along = [(centre.x_m, to.x_m - from.x_m), (centre.y_m, to.y_m - from.y_m)];
        let mut unknowns = vec![load.force_n() / nearer];
        for (axis, (centre_m, width_m)) in along.into_iter().take(self.dimensions).enumerate() {
            let side_m = self.table.side_m(axis);
            let centre_m = if centre_m < 0.5 * side_m {
                nearer * centre_m
            } else {
                side_m - nearer * (side_m - centre_m)
            };
            let nearest_m = 0.5 * self.table.part_m(axis);
            let centre_m = centre_m.clamp(nearest_m, side_m - nearest_m);
            let widest_m = 2.0 * centre_m.min(side_m - centre_m);
            unknowns.extend([centre_m, (nearer * width_m / widest_m).powi(2).clamp(0.0, 1.0)]);
        }
        unknowns
    }

    /// Width in metres, with derivatives by centre and share.
    fn width_m(&self, axis: usize, centre_m: f64, share: f64) -> (f64, f64, f64) {
        let (side_m, least_m) = (self.table.side_m(axis), self.table.part_m(axis));
        let widest_m = 2.0 * centre_m.min(side_m - centre_m);
        let inwards = if centre_m < 0.5 * side_m { 2.0 } else { -2.0 };
        let (least, spread) = (least_m * least_m, widest_m * widest_m - least_m * least_m);
        let width_m = (least + share * spread).sqrt();
        (width_m, share * widest_m * inwards / width_m, 0.5 * spread / width_m)
    }

    fn ends_m(&self, unknowns: &[f64]) -> [[f64; 2]; 2] {
        let mut ends_m = [0, 1].map(|axis| [0.0, self.table.side_m(axis)]);
        for (axis, place) in unknowns[1..].chunks(2).enumerate() {
            let (width_m, ..) = self.width_m(axis, place[0], place[1]);
            ends_m[axis] = [place[0] - 0.5 * width_m, place[0] + 0.5 * width_m];
        }
        ends_m
    }

    /// Derivatives are unknowns × channels.
    fn residuals(&self, unknowns: &[f64]) -> (Array1<f64>, Array2<f64>) {
        let mut residuals = -self.y.clone();
        let mut slopes = Array2::zeros((unknowns.len(), self.y.len()));
        for (k, load) in unknowns.chunks(self.each()).enumerate() {
            let (first, force_n) = (k * self.each(), load[0]);
            let mean = self.table.mean(self.ends_m(load));
            let places: Vec<_> = load[1..]
                .chunks(2)
                .enumerate()
                .map(|(axis, place)| self.width_m(axis, place[0], place[1]))
                .collect();
            for i in 0..self.y.len() {
                residuals[i] += force_n * mean.value[i];
                slopes[[first, i]] = mean.value[i];
                for (axis, (_, by_centre, by_share)) in places.iter().enumerate() {
                    let [from, to] = [0, 1].map(|end| mean.slopes[axis][end][i]);
                    let wider = 0.5 * (to - from);
                    slopes[[first + 1 + 2 * axis, i]] = force_n * (from + to + wider * by_centre);
                    slopes[[first + 2 + 2 * axis, i]] = force_n * wider * by_share;
                }
            }
        }
        (residuals, slopes)
    }

    fn value_at(&self, aim: LoadQuantity, unknowns: &[f64]) -> f64 {
        match aim {
            LoadQuantity::Force(load) => unknowns[load * self.each()],
            LoadQuantity::Total => unknowns.chunks(self.each()).map(|load| load[0]).sum(),
            LoadQuantity::Centre(load, axis) => unknowns[load * self.each() + 1 + 2 * axis],
            LoadQuantity::CentreOfPressure(axis) => {
                let loads = || unknowns.chunks(self.each());
                let force_n: f64 = loads().map(|load| load[0]).sum();
                loads().map(|load| load[0] * load[1 + 2 * axis]).sum::<f64>() / force_n
            }
        }
    }

    fn slope_of(&self, aim: LoadQuantity, unknowns: &[f64]) -> Array1<f64> {
        let mut slope = Array1::zeros(unknowns.len());
        match aim {
            LoadQuantity::Force(load) => slope[load * self.each()] = 1.0,
            LoadQuantity::Total => slope.iter_mut().step_by(self.each()).for_each(|slope| *slope = 1.0),
            LoadQuantity::Centre(load, axis) => slope[load * self.each() + 1 + 2 * axis] = 1.0,
            LoadQuantity::CentreOfPressure(axis) => {
                let force_n: f64 = unknowns.chunks(self.each()).map(|load| load[0]).sum();
                let centre_m = self.value_at(aim, unknowns);
                for (k, load) in unknowns.chunks(self.each()).enumerate() {
                    let (first, at) = (k * self.each(), 1 + 2 * axis);
                    slope[first] = (load[at] - centre_m) / force_n;
                    slope[first + at] = load[0] / force_n;
                }
            }
        }
        slope
    }

    /// A force of 0 would have no centre.
    fn range(&self, unknown: usize) -> (f64, f64) {
        match unknown % self.each() {
            0 => (LEAST_FORCE_N, f64::INFINITY),
            i if i % 2 == 1 => {
                let axis = (i - 1) / 2;
                let nearest_m = 0.5 * self.table.part_m(axis);
                (nearest_m, self.table.side_m(axis) - nearest_m)
            }
            _ => (0.0, 1.0),
        }
    }

    /// Local minimum with the unknowns `held` fixed.
    fn minimum(&self, mut unknowns: Vec<f64>, drawn: Option<Drawn>, held: &[usize]) -> Minimum {
        let mut damping = FIRST_DAMPING;
        let mut here = self.normal_equations(&unknowns, drawn);
        for _ in 0..MOST_STEPS {
            let tried = self.step(&unknowns, &here, damping, held);
            let there = tried.as_ref().map(|tried| self.normal_equations(tried, drawn));
            let gain = there.as_ref().map_or(f64::NEG_INFINITY, |there| here.cost - there.cost);
            // Where unknowns trade off, such as force and width, a damped step gains little.
            let is_there = gain.abs() < 0.01 * NEGLIGIBLE && damping <= LEAST_DAMPING;
            if let (Some(tried), Some(there), true) = (tried, there, gain > 0.0) {
                (unknowns, here) = (tried, there);
                damping = f64::max(0.1 * damping, LEAST_DAMPING);
            } else {
                damping *= 10.0;
            }
            if is_there || damping > MOST_DAMPING {
                break;
            }
        }
        Minimum { chi_squared: here.chi_squared, unknowns }
    }

    fn normal_equations(&self, unknowns: &[f64], drawn: Option<Drawn>) -> NormalEquations {
        let (residuals, slopes) = self.residuals(unknowns);
        let misfit = residuals.dot(&residuals);
        let mut found = NormalEquations {
            chi_squared: misfit,
            cost: misfit,
            gradient: slopes.dot(&residuals),
            hessian: slopes.dot(&slopes.t()),
        };
        if let Some((aim, t, stiffness)) = drawn {
            let (off, slope) = (self.value_at(aim, unknowns) - t, self.slope_of(aim, unknowns));
            found.cost += stiffness * off * off;
            found.gradient.scaled_add(stiffness * off, &slope);
            for (i, mut row) in found.hessian.outer_iter_mut().enumerate() {
                row.scaled_add(stiffness * slope[i], &slope);
            }
        }
        found
    }

    /// Levenberg–Marquardt step within the ranges.
    fn step(
        &self,
        unknowns: &[f64],
        here: &NormalEquations,
        damping: f64,
        held: &[usize],
    ) -> Option<Vec<f64>> {
        let mut free: Vec<usize> = (0..unknowns.len()).filter(|i| !held.contains(i)).collect();
        loop {
            let found = solve(&here.hessian, &free, damping, &here.gradient)?;
            let stays = |(i, value): (&usize, &f64)| {
                let (least, most) = self.range(*i);
                unknowns[*i] <= least && *value > 0.0 || unknowns[*i] >= most && *value < 0.0
            };
            let inwards: Vec<usize> =
                free.iter().zip(&found).filter(|pair| !stays(*pair)).map(|(i, _)| *i).collect();
            if inwards.len() == free.len() {
                let mut tried = unknowns.to_vec();
                for (i, value) in free.iter().zip(&found) {
                    let (least, most) = self.range(*i);
                    tried[*i] = (tried[*i] - value).clamp(least, most);
                }
                return tried.iter().all(|value| value.is_finite()).then_some(tried);
            }
            free = inwards;
        }
    }

    /// To first order; `None` if undetermined.
    pub fn sd(&self, aim: LoadQuantity) -> Option<f64> {
        let unknowns = &self.best.unknowns;
        let here = self.normal_equations(unknowns, None);
        let slope = self.slope_of(aim, unknowns);
        let everything: Vec<usize> = (0..unknowns.len()).collect();
        let sd = slope.dot(&solve(&here.hessian, &everything, 1e-9, &slope)?).sqrt();
        Some(sd.min(self.value_at(aim, unknowns))).filter(|sd| sd.is_finite() && *sd > 0.0)
    }

    /// Value with the critical misfit; `None` without an end on the surface.
    fn end(&self, aim: LoadQuantity, step: f64) -> Option<f64> {
        let end = self.end_at(aim, step, FREE_INCREASE)?;
        if end.load.chunks(self.each()).any(|load| self.is_whole(load)) {
            // The force of a load over the whole surface is unique, so it also determines centres and widths.
            let increase = chi_squared_critical_value(0.05, self.each());
            return self.end_at(aim, step, increase).map(|end| end.value);
        }
        Some(end.value)
    }

    /// True over the whole surface.
    fn is_whole(&self, load: &[f64]) -> bool {
        let ends_m = self.ends_m(load);
        (0..self.dimensions).all(|axis| ends_m[axis][1] - ends_m[axis][0] >= WHOLE * self.table.side_m(axis))
    }

    /// End for misfits up to the least plus `increase`.
    fn end_at(&self, aim: LoadQuantity, step: f64, increase: f64) -> Option<ProfilePoint<Vec<f64>>> {
        let stiffness = 1.0 / (step * step);
        let point = |Minimum { unknowns, chi_squared }| ProfilePoint {
            value: self.value_at(aim, &unknowns),
            load: unknowns,
            chi_squared,
        };
        let profile = Profile {
            most: self.best.chi_squared + increase,
            minimum: |target, near: &Vec<f64>| {
                point(self.minimum(near.clone(), Some((aim, target, stiffness)), &[]))
            },
            // A value that moves little may be determined far better than to first order, such as the force of a
            // load of greatest width.
            is_stationary: |before: &ProfilePoint<_>, after: &ProfilePoint<_>, way: f64| {
                way.abs() > 8.0 * step.abs() && (after.value - before.value).abs() < 1e-9 * step.abs()
            },
        };
        profile.end(point(self.best.clone()), 2.0 * step).filter(|end| !self.is_at_edge(aim, &end.load))
    }

    /// At an end of the centre's range the value is unbounded: a narrower load could be nearer to the edge,
    /// with a larger force.
    fn is_at_edge(&self, aim: LoadQuantity, unknowns: &[f64]) -> bool {
        let is_at_end = |i: usize| {
            let (least, most) = self.range(i);
            unknowns[i] <= least || unknowns[i] >= most
        };
        let mut loads = 0..unknowns.len() / self.each();
        let is_at_edge =
            |load: usize| (0..self.dimensions).any(|axis| is_at_end(load * self.each() + 1 + 2 * axis));
        match aim {
            LoadQuantity::Force(load) => is_at_edge(load),
            LoadQuantity::Centre(load, axis) => is_at_end(load * self.each() + 1 + 2 * axis),
            LoadQuantity::Total | LoadQuantity::CentreOfPressure(_) => loads.any(is_at_edge),
        }
    }
}

const LEAST_FORCE_N: f64 = 1e-12;

/// Half of the misfit's derivatives, by Gauss–Newton.
struct NormalEquations {
    chi_squared: f64,
    /// Misfit with penalty.
    cost: f64,
    gradient: Array1<f64>,
    hessian: Array2<f64>,
}

/// Solves the listed rows with a relatively increased diagonal.
fn solve(hessian: &Array2<f64>, listed: &[usize], share: f64, right: &Array1<f64>) -> Option<Array1<f64>> {
    if listed.is_empty() {
        return None;
    }
    // In units of each unknown, so that newtons and metres have equal weight.
    let scales: Vec<f64> = listed.iter().map(|i| hessian[[*i, *i]].sqrt().max(f64::MIN_POSITIVE)).collect();
    let scaled = Array2::from_shape_fn((listed.len(), listed.len()), |(i, j)| {
        let value = hessian[[listed[i], listed[j]]] / scales[i] / scales[j];
        if i == j { 1.0 + share } else { value }
    });
    let right: Array1<f64> = listed.iter().zip(&scales).map(|(i, scale)| right[*i] / scale).collect();
    let mut solution = Cholesky::factor(scaled).ok()?.solve(&right);
    solution.iter_mut().zip(&scales).for_each(|(value, scale)| *value /= scale);
    Some(solution)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{beam, clean};
    use super::super::{LoadSensors, cumulative};
    use super::*;
    use palpate_mechanics::sensing::{Layout, SensorKind};

    /// A beam's deflection is a·F times a quadratic in a², with a the place of F on the near side of the
    /// sensor. It determines F·c and R² = c² + w²/4, but not w alone. The centre ranges from R/√2, with the
    /// load beginning at the support, to R, with w = 0; the force is at least F·c/R.
    #[test]
    fn loads_that_read_alike_are_in_the_interval() {
        let beam = beam();
        let mut layout = Layout::even(SensorKind::Deflection, 8, 0.4);
        layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 2e-6)).unwrap();
        let sensors = LoadSensors::new(&beam, &layout).unwrap();
        let table = cumulative::CumulativeInfluence::new(&sensors, &Cells::new(sensors.extent));
        let load = UniformLoad::along(0.01, 0.03, 2000.0);
        let y = clean(&sensors, &[load]).iter().map(|value| value / 2e-6).collect();
        let even = EvenLoads::new(&table, &y, sensors.extent, &[load]).unwrap();
        assert!(even.chi_squared() < 1.0, "{}", even.chi_squared());
        let (moment, farthest_m) = (2000.0 * 0.02, (0.02_f64.powi(2) + 0.02_f64.powi(2) / 4.0).sqrt());
        let near = |(low, high): (f64, f64), expected: (f64, f64)| {
            let off = (low / expected.0 - 1.0).abs().max((high / expected.1 - 1.0).abs());
            assert!(off < 0.02, "{low} to {high}, not {expected:?}");
        };
        let root = 2.0_f64.sqrt();
        near(even.interval_95(LoadQuantity::Centre(0, 0)), (farthest_m / root, farthest_m));
        near(even.interval_95(LoadQuantity::CentreOfPressure(0)), (farthest_m / root, farthest_m));
        near(even.interval_95(LoadQuantity::Force(0)), (moment / farthest_m, moment / farthest_m * root));
        near(even.interval_95(LoadQuantity::Total), (moment / farthest_m, moment / farthest_m * root));
        let middle = even.middle_load(0);
        assert!(
            (middle.centre().x_m / 0.02 - 1.0).abs() < 0.15 && (middle.force_n() / 2000.0 - 1.0).abs() < 0.15,
            "{middle:?}"
        );
    }
}

//! Gauss–Newton refinement of the place of one contact, and of the force where it is not known.
//!
//! Symbols as in [`super::search`]; `V` are eight channels of a reading, `N` one value of one or eight
//! readings.
//!
//! Termination (weighted; m step and σ² variance of the position, |e|² = χ²): at the best force,
//! f′ = c·f + g. A step omits W·|g|·(½f″·g/|g|² − c)·m² along g, and m·(e·f″)/(W·|g|²) by the rotation of g:
//! with κ the larger of |½f″·g/|g|² − c| and |f″ across f and g|/|g|, an error below κ|m|·(|m| + σ|e|). Along
//! f, with the force W/(1 + c·m), a step omits W·|f|·λ·m², λ = |½f″·f|/|f|².

use super::table::{Cell, InfluenceTable, Spacing};
use crate::influence::config::ForceBelief;
use palpate_numerics::simd::{EightLanes, Number, RowLanes};
use palpate_numerics::small::add_outer;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct GaussNewton {
    pub spacing: Spacing,
    pub groups: usize,
    /// f and f′ by node and group.
    pub rows: Vec<[[f64; 8]; 2]>,
    /// 1/(1 + v) by cell and group, v the calibration's variance over the noise's.
    pub weights: Vec<[f64; 8]>,
    curvatures: Vec<Curvature>,
    pub ends_m: [f64; 2],
    length_m: f64,
    force: ForceBelief,
    /// Mean force of the calibration.
    reference_force_n: f64,
    inverse_reference: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Minimum<N = f64> {
    pub x_m: N,
    pub force_n: N,
    pub misfit: N,
    /// Variance of position, covariance, variance of force.
    pub covariance: [N; 3],
}

/// Limit of the variances' growth: an immense force next to a support would otherwise explain every reading.
const MOST_GROWTH: f64 = 10.0;

impl GaussNewton {
    pub fn new(table: &InfluenceTable, force: ForceBelief, reference_force_n: f64) -> Self {
        let weights = weights(table, force.weights_force_n(reference_force_n));
        let group = |numbers: &[f64]| grouped(numbers, table.sensors, 0.0);
        Self {
            spacing: table.spacing(),
            groups: table.sensors.div_ceil(8),
            rows: paired(group(&table.values), group(&table.slopes)),
            curvatures: curvatures(table, &weights, force),
            weights,
            ends_m: ends_m(table, force),
            length_m: table.length_m,
            force,
            reference_force_n,
            inverse_reference: 1.0 / reference_force_n,
        }
    }

    /// Factor of the variances at forces above the calibration's.
    #[inline(always)]
    pub fn grown<N: Number>(&self, force_n: N) -> N {
        let ratio =
            (force_n * N::splat(self.inverse_reference)).max(N::splat(1.0)).min(N::splat(MOST_GROWTH));
        ratio * ratio
    }

    /// Factor of the table's variances, which are per newton.
    pub fn variance_scale(&self, force_n: f64) -> f64 {
        self.grown(force_n) * self.reference_force_n * self.reference_force_n
    }

    pub fn reference_force_n(&self) -> f64 {
        self.reference_force_n
    }

    /// 1/(1 + v) of each channel in a cell.
    pub fn weights_at(&self, cell: &Cell<f64>, force_n: f64) -> impl Fn(usize) -> f64 {
        let first = cell.node as usize * self.groups;
        let grown = self.weights_grown(force_n);
        move |channel| {
            let weight = self.weights[first + channel / 8][channel % 8];
            weight / (weight + grown * (1.0 - weight))
        }
    }

    /// Returns the minima near `start`, and a bit for each converged reading.
    #[inline(always)]
    pub fn minimum<V: EightLanes, N: RowLanes<V>>(
        &self,
        whitened: &[[f64; 8]],
        start: (N, N),
        steps: usize,
    ) -> (Minimum<N>, u8) {
        let n = N::splat;
        let ([low, high], reach) = (self.ends_m, n(2.0 * self.spacing.h_m));
        let least = n((1e-9 * self.length_m).powi(2));
        let (mut x_m, mut force_n) = start;
        let mut line_search = Backtracking { x_m, force_n, misfit: n(f64::INFINITY), pace: n(1.0) };
        let mut minimum = Minimum::nowhere();
        let mut arrived = 0;
        for taken in 1..=steps {
            let cell = self.spacing.cell(x_m);
            let sums = self.sums::<V, N>(whitened, cell, force_n);
            let normal = Normal::new(&sums, force_n, self.force);
            let step_m = normal.step_m.max(n(0.0) - reach).min(reach);
            let next_m = (x_m + step_m).max(n(low)).min(n(high));
            let moved = next_m - x_m;
            let here = Minimum {
                x_m: next_m,
                force_n: normal.force_after(moved),
                misfit: normal.misfit_after(moved),
                covariance: normal.covariance,
            };
            let step = normal.step(moved, &here);
            let allowed = self.curvature::<V, N>(cell.node).allows(&step, self.weights_grown(force_n));
            let small = (allowed | step.square.at_most(least)) & self.weighs_alike(force_n, normal.force_n);
            let now = if taken == steps { N::ALL } else { small };
            minimum = here.or(now & !arrived, minimum);
            arrived |= small;
            if arrived == N::ALL {
                break;
            }
            (x_m, force_n) = line_search.next((x_m, force_n), &normal, moved);
        }
        (minimum, arrived)
    }

    #[inline(always)]
    fn curvature<V: EightLanes, N: RowLanes<V>>(&self, node: N) -> Curvature<N> {
        let (mut kappa_square, mut lambda_square) = (N::each(0.0), N::each(0.0));
        let curvatures = kappa_square.as_mut().iter_mut().zip(lambda_square.as_mut());
        for ((kappa_square, lambda_square), node) in curvatures.zip(node.lanes().as_ref()) {
            let curvature = &self.curvatures[*node as u32 as usize];
            (*kappa_square, *lambda_square) = (curvature.kappa_square, curvature.lambda_square);
        }
        Curvature { kappa_square: N::from_lanes(&kappa_square), lambda_square: N::from_lanes(&lambda_square) }
    }

    /// True where the calibration's variances at both forces agree to 5 %.
    #[inline(always)]
    fn weighs_alike<N: Number>(&self, a_n: N, b_n: N) -> u8 {
        let (a, b) = (self.weights_grown(a_n), self.weights_grown(b_n));
        a.max(b).at_most(N::splat(1.05) * a.min(b))
    }

    /// Growth of the variance relative to `weights`.
    #[inline(always)]
    pub fn weights_grown<N: Number>(&self, force_n: N) -> N {
        match self.force {
            ForceBelief::Known(_) => N::splat(1.0),
            _ => self.grown(force_n),
        }
    }

    #[inline(always)]
    fn sums<V: EightLanes, N: RowLanes<V>>(
        &self,
        whitened: &[[f64; 8]],
        cell: Cell<N>,
        force_n: N,
    ) -> Sums<N> {
        let points = Points::new::<V, N>(cell, force_n);
        if let ForceBelief::Known(_) = self.force {
            let mut vectors = N::each([V::splat(0.0); 3]);
            for (reading, of_reading) in vectors.as_mut().iter_mut().enumerate() {
                let [square, gg, eg, ..] = self.sums_by_channel::<V>(whitened, &points.point(reading), None);
                *of_reading = [square, gg, eg];
            }
            let [square, gg, eg] = N::sums(&vectors);
            return Sums { square, gg, eg, ff: N::splat(0.0), fg: N::splat(0.0), ef: N::splat(0.0) };
        }
        let grown = self.grown(force_n).lanes();
        let mut vectors = N::each([V::splat(0.0); 6]);
        for (reading, of_reading) in vectors.as_mut().iter_mut().enumerate() {
            let grown = Some(grown.as_ref()[reading]);
            *of_reading = self.sums_by_channel::<V>(whitened, &points.point(reading), grown);
        }
        let [square, gg, eg, ff, fg, ef] = N::sums(&vectors);
        Sums { square, gg, eg, ff, fg, ef }
    }

    /// Sums of e², g², eg, f², fg and ef; `grown` multiplies the calibration's variance.
    #[inline(always)]
    fn sums_by_channel<V: EightLanes>(
        &self,
        whitened: &[[f64; 8]],
        place: &Point,
        grown: Option<f64>,
    ) -> [V; 6] {
        let [mut square, mut gg, mut eg, mut ff, mut fg, mut ef] = [V::splat(0.0); 6];
        let Point { reading, cell, force_n } = place;
        let (groups, force, node) = (self.groups, V::splat(*force_n), cell.node as u32 as usize);
        let (left, right) = self.rows[node * groups..][..2 * groups].split_at(groups);
        let weights = &self.weights[node * groups..][..groups];
        let whitened = &whitened[reading * groups..][..groups];
        for ((d, weight), (left, right)) in whitened.iter().zip(weights).zip(left.iter().zip(right)) {
            let (f, g) = interpolate::<V>(cell, left, right);
            let mut weight = V::load(weight);
            if let Some(grown) = grown {
                weight = grow(weight, V::splat(grown));
            }
            let e = V::load(d) - force * f;
            let (we, wg) = (weight * e, weight * g);
            square = square + we * e;
            gg = gg + wg * g;
            eg = eg + wg * e;
            ff = ff + weight * f * f;
            fg = fg + wg * f;
            ef = ef + we * f;
        }
        [square, gg, eg, ff, fg, ef]
    }
}

impl<N: Number> Minimum<N> {
    #[inline(always)]
    pub fn nowhere() -> Self {
        let (zero, infinity) = (N::splat(0.0), N::splat(f64::INFINITY));
        Self { x_m: zero, force_n: zero, misfit: infinity, covariance: [infinity, zero, infinity] }
    }

    /// Selects `self` where the reading's bit is set.
    #[inline(always)]
    pub fn or(self, bits: u8, other: Self) -> Self {
        let [xx, xf, ff] = self.covariance;
        Self {
            x_m: self.x_m.or(bits, other.x_m),
            force_n: self.force_n.or(bits, other.force_n),
            misfit: self.misfit.or(bits, other.misfit),
            covariance: [
                xx.or(bits, other.covariance[0]),
                xf.or(bits, other.covariance[1]),
                ff.or(bits, other.covariance[2]),
            ],
        }
    }
}

struct Backtracking<N> {
    x_m: N,
    force_n: N,
    misfit: N,
    pace: N,
}

impl<N: Number> Backtracking<N> {
    /// After a rise of χ², half way back with shorter steps.
    #[inline(always)]
    fn next(&mut self, (x_m, force_n): (N, N), normal: &Normal<N>, step_m: N) -> (N, N) {
        let (half, fell) = (N::splat(0.5), normal.misfit.at_most(self.misfit));
        let back = (half * (self.x_m + x_m), half * (self.force_n + force_n));
        self.pace = self.pace.or(fell, half * self.pace);
        self.x_m = x_m.or(fell, self.x_m);
        self.force_n = normal.force_n.or(fell, self.force_n);
        self.misfit = normal.misfit.or(fell, self.misfit);
        let part_m = self.pace * step_m;
        ((x_m + part_m).or(fell, back.0), normal.force_after(part_m).or(fell, back.1))
    }
}

struct Point {
    reading: usize,
    cell: Cell<f64>,
    force_n: f64,
}

struct Points<L> {
    cell: Cell<L>,
    force_n: L,
}

impl<L: AsRef<[f64]>> Points<L> {
    #[inline(always)]
    fn new<V: Copy, N: RowLanes<V, Each<f64> = L>>(cell: Cell<N>, force_n: N) -> Self {
        let ([v0, v1, v2, v3], [s0, s1, s2, s3]) = (cell.value, cell.slope);
        let cell = Cell {
            node: cell.node.lanes(),
            value: [v0.lanes(), v1.lanes(), v2.lanes(), v3.lanes()],
            slope: [s0.lanes(), s1.lanes(), s2.lanes(), s3.lanes()],
        };
        Self { cell, force_n: force_n.lanes() }
    }

    #[inline(always)]
    fn point(&self, reading: usize) -> Point {
        let at = |lanes: &L| lanes.as_ref()[reading];
        let Cell { node, value: [v0, v1, v2, v3], slope: [s0, s1, s2, s3] } = &self.cell;
        let cell = Cell {
            node: at(node),
            value: [at(v0), at(v1), at(v2), at(v3)],
            slope: [at(s0), at(s1), at(s2), at(s3)],
        };
        Point { reading, cell, force_n: at(&self.force_n) }
    }
}

#[inline(always)]
pub(super) fn interpolate<V: EightLanes>(
    cell: &Cell<f64>,
    left: &[[f64; 8]; 2],
    right: &[[f64; 8]; 2],
) -> (V, V) {
    let at = [V::load(&left[0]), V::load(&right[0]), V::load(&left[1]), V::load(&right[1])];
    (mix(&cell.value, &at), mix(&cell.slope, &at))
}

#[inline(always)]
fn mix<V: EightLanes>(weights: &[f64; 4], at: &[V; 4]) -> V {
    let values = V::splat(weights[0]) * at[0] + V::splat(weights[1]) * at[1];
    values + (V::splat(weights[2]) * at[2] + V::splat(weights[3]) * at[3])
}

/// 1/(1 + g·v) from w = 1/(1 + v).
#[inline(always)]
fn grow<V: EightLanes>(weight: V, grown: V) -> V {
    weight / (weight + grown * (V::splat(1.0) - weight))
}

/// Weighted sums over channels: e = d − W·f, g = f′.
#[derive(Clone, Copy)]
struct Sums<N> {
    square: N,
    ff: N,
    fg: N,
    gg: N,
    ef: N,
    eg: N,
}

struct Normal<N> {
    force_n: N,
    misfit: N,
    /// −½·dχ²/da and ½·d²χ²/da².
    fall: N,
    curvature: N,
    /// Cramér–Rao covariance; infinite where undetermined.
    covariance: [N; 3],
    step_m: N,
    /// c, and W²·|f|²; 0 at a known force.
    along_f: N,
    signal: N,
}

impl<N: Number> Normal<N> {
    #[inline(always)]
    fn new(sums: &Sums<N>, force_n: N, belief: ForceBelief) -> Self {
        match belief {
            ForceBelief::Known(_) => Self::at_known_force(sums, force_n),
            _ => Self::at_best_force(sums, force_n, belief),
        }
    }

    #[inline(always)]
    fn at_known_force(sums: &Sums<N>, force_n: N) -> Self {
        let zero = N::splat(0.0);
        let (curvature, fall) = (force_n * force_n * sums.gg, force_n * sums.eg);
        let variance = N::splat(1.0) / curvature;
        Self {
            force_n,
            misfit: sums.square,
            fall,
            curvature,
            covariance: [variance, zero, zero],
            step_m: zero.or(curvature.at_most(zero), fall * variance),
            along_f: zero,
            signal: zero,
        }
    }

    /// Uses the linearity of the residual in the force.
    #[inline(always)]
    fn at_best_force(sums: &Sums<N>, some_n: N, belief: ForceBelief) -> Self {
        let (zero, one, infinity) = (N::splat(0.0), N::splat(1.0), N::splat(f64::INFINITY));
        let (mean, precision) = belief.mean_and_precision();
        let (off, precision) = (some_n - N::splat(mean), N::splat(precision));
        let (score, ww) = (sums.ef - precision * off, sums.ff + precision);
        let inverse_ww = zero.or(ww.at_most(zero), one / ww);
        let force_n = (some_n + score * inverse_ww).max(zero);
        let change = force_n - some_n;
        let misfit = sums.square + precision * off * off - change * (N::splat(2.0) * score - ww * change);
        // Information about the position, about both, and about the position at unknown force.
        let (aa, aw) = (force_n * force_n * sums.gg, force_n * sums.fg);
        let along_w = aw * inverse_ww;
        let curvature = aa - aw * along_w;
        let untold = curvature.at_most(N::splat(1e-14) * aa);
        let (fall, xx) = (force_n * (sums.eg - change * sums.fg), one / curvature);
        let (xw, wforce) = (zero - along_w * xx, inverse_ww + along_w * along_w * xx);
        Self {
            force_n,
            misfit,
            fall,
            curvature,
            covariance: [infinity.or(untold, xx), zero.or(untold, xw), infinity.or(untold, wforce)],
            step_m: zero.or(untold, fall * xx),
            along_f: sums.fg * inverse_ww,
            signal: force_n * force_n * sums.ff,
        }
    }

    /// Best force after a step: |f| grows by 1 + c·m.
    #[inline(always)]
    fn force_after(&self, step_m: N) -> N {
        self.force_n / (N::splat(1.0) + self.along_f * step_m).max(N::splat(0.25))
    }

    #[inline(always)]
    fn misfit_after(&self, step_m: N) -> N {
        self.misfit - step_m * (N::splat(2.0) * self.fall - self.curvature * step_m)
    }

    #[inline(always)]
    fn step(&self, step_m: N, to: &Minimum<N>) -> Step<N> {
        let variance = self.covariance[0];
        Step { square: step_m * step_m, variance, misfit: to.misfit, signal: self.signal }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Curvature<N = f64> {
    /// κ², in m⁻².
    pub kappa_square: N,
    /// λ², in m⁻⁴; 0 at a known force.
    pub lambda_square: N,
}

#[derive(Clone, Copy, Debug)]
struct Step<N> {
    /// m².
    pub square: N,
    /// σ².
    pub variance: N,
    pub misfit: N,
    /// W²·|f|²; 0 at a known force.
    pub signal: N,
}

impl<N: Number> Curvature<N> {
    /// Bits of the readings with a final step: an error below a twentieth of σ along g, and below 0.1 of χ²
    /// along f.
    #[inline(always)]
    pub fn allows(&self, step: &Step<N>, grown: N) -> u8 {
        const SHARE_OF_SD: f64 = 0.05;
        const MISFIT: f64 = 0.1;
        // (a + b)² ≤ 2·(a² + b²).
        let share = N::splat(SHARE_OF_SD * SHARE_OF_SD / 2.0);
        let off =
            self.kappa_square * grown * grown * step.square * (step.square + step.variance * step.misfit);
        let along = step.signal * self.lambda_square * step.square * step.square;
        off.at_most(share * step.variance) & along.at_most(N::splat(MISFIT))
    }
}

fn curvatures(table: &InfluenceTable, weights: &[[f64; 8]], force: ForceBelief) -> Vec<Curvature> {
    const PARTS: usize = 4;
    let groups = table.sensors.div_ceil(8);
    let cells = weights.chunks_exact(groups).enumerate();
    cells
        .map(|(cell, weights)| {
            let at = |part: usize| {
                curvature(table, weights.as_flattened(), force, cell, part as f64 / PARTS as f64)
            };
            (0..=PARTS).map(at).fold(Curvature::<f64> { kappa_square: 0.0, lambda_square: 0.0 }, |a, b| {
                Curvature {
                    kappa_square: a.kappa_square.max(b.kappa_square),
                    lambda_square: a.lambda_square.max(b.lambda_square),
                }
            })
        })
        .collect()
}

/// Curvature at part `t` of a cell; infinite where the position is undetermined.
fn curvature(table: &InfluenceTable, weights: &[f64], force: ForceBelief, cell: usize, t: f64) -> Curvature {
    let h_m = table.spacing_m();
    let place = Cell { node: cell as f64, ..table.spacing().cell(t * h_m) };
    // Products of f, f′ and f″.
    let mut products = [[0.0; 3]; 3];
    table.for_each(place, |s, f, slope| {
        let rise = (table.at_node(cell + 1)[s] - table.at_node(cell)[s]) / h_m;
        let [left, right] = [cell, cell + 1].map(|node| table.slopes[node * table.sensors + s]);
        let bent = ((6.0 - 12.0 * t) * rise + (6.0 * t - 4.0) * left + (6.0 * t - 2.0) * right) / h_m;
        add_outer(&mut products, weights[s], &[f, slope, bent]);
    });
    let [[ff, fs, fb], [_, ss, sb], [.., bb]] = products;
    // Parts of f′ and f″ along f, per f.
    let [c, along_f] = match force {
        ForceBelief::Known(_) => [0.0; 2],
        _ => [fs / ff, fb / ff],
    };
    let (gg, gb) = (ss - c * fs, sb - c * fb);
    let across = (bb - along_f * fb - gb * gb / gg).max(0.0) / gg;
    let curvature = Curvature {
        kappa_square: (0.5 * gb / gg - c).powi(2).max(across),
        lambda_square: (0.5 * along_f).powi(2),
    };
    let told = gg > 0.0 && curvature.kappa_square.is_finite() && curvature.lambda_square.is_finite();
    if told { curvature } else { Curvature { kappa_square: f64::INFINITY, lambda_square: f64::INFINITY } }
}

/// Ends of the search: at unknown force, a tenth of a spacing is excluded next to a support, where the best
/// force diverges.
fn ends_m(table: &InfluenceTable, force: ForceBelief) -> [f64; 2] {
    let last = table.nodes() - 1;
    let square = |node: usize| table.at_node(node).iter().map(|f| f * f).sum::<f64>();
    let kept = |end: usize, next: usize| match force {
        ForceBelief::Unknown if square(end) < 1e-2 * square(next) => 0.1 * table.spacing_m(),
        _ => 0.0,
    };
    [kept(0, 1), table.length_m - kept(last, last - 1)]
}

fn weights(table: &InfluenceTable, force_n: f64) -> Vec<[f64; 8]> {
    let (left, right) = (&table.variances[..], &table.variances[table.sensors..]);
    let cells = left.iter().zip(right);
    let weights: Vec<f64> = cells.map(|(a, b)| 1.0 / (1.0 + 0.5 * force_n * force_n * (a + b))).collect();
    grouped(&weights, table.sensors, 1.0)
}

/// Splits rows of `width` numbers into padded groups of eight.
pub(super) fn grouped(numbers: &[f64], width: usize, filler: f64) -> Vec<[f64; 8]> {
    let rows = numbers.chunks_exact(width).flat_map(|row| row.chunks(8));
    let group = |part: &[f64]| std::array::from_fn(|i| part.get(i).copied().unwrap_or(filler));
    rows.map(group).collect()
}

pub(super) fn paired(first: Vec<[f64; 8]>, second: Vec<[f64; 8]>) -> Vec<[[f64; 8]; 2]> {
    first.into_iter().zip(second).map(|(a, b)| [a, b]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_bends_as_its_radius_says() {
        // Two channels on a circle with a circumference of 40 m: f″ is across f′ and (2π/40)² of f, which a
        // change of the force compensates.
        let turn = std::f64::consts::TAU / 40.0;
        let nodes = || (0..401).map(|node| f64::from(node) * 0.1 * turn);
        let table = InfluenceTable {
            sensors: 2,
            length_m: 40.0,
            values: nodes().flat_map(|angle| [angle.cos(), angle.sin()]).collect(),
            slopes: nodes().flat_map(|angle| [-turn * angle.sin(), turn * angle.cos()]).collect(),
            variances: vec![0.0; 802],
        };
        let weights = vec![[1.0; 8]; 400];
        for (force, kappa, lambda) in
            [(ForceBelief::Known(1.0), turn, 0.0), (ForceBelief::Unknown, 0.0, 0.5 * turn * turn)]
        {
            for curvature in curvatures(&table, &weights, force) {
                assert!(
                    (curvature.kappa_square.sqrt() - kappa).abs() < 1e-2 * turn,
                    "{curvature:?}, {force:?}"
                );
                assert!(
                    (curvature.lambda_square.sqrt() - lambda).abs() < 1e-2 * turn * turn,
                    "{curvature:?}, {force:?}"
                );
            }
        }
    }
}

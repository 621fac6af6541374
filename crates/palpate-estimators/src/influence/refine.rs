//! Gauss–Newton on the place of one contact, and on its force where that is not known: of one reading, or of eight at
//! once.
//!
//! Symbols as in [`super::search`]. `V` holds eight channels of a reading, `N` a number each of one or eight readings.

use super::belief::ForceBelief;
use super::bend::{Bend, Step};
use super::lanes::{Abreast, Eight, Number};
use super::search::{Minimum, Search};
use super::table::Cell;

impl Search {
    /// The minima near `x_m`, by at most so many `steps`, and the bits of those readings that came to theirs.
    ///
    /// `whitened` holds the readings one after the other.
    #[inline(always)]
    pub fn refine<V: Eight, N: Abreast<V>>(
        &self,
        whitened: &[[f64; 8]],
        start: (N, N),
        steps: usize,
    ) -> (Minimum<N>, u8) {
        let n = N::splat;
        let ([low, high], reach) = (self.ends_m, n(2.0 * self.spacing.h_m));
        let least = n((1e-9 * self.table.length_m).powi(2));
        let (mut x_m, mut force_n) = start;
        let mut way = Way { x_m, force_n, misfit: n(f64::INFINITY), pace: n(1.0) };
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
            let allowed = self.bend::<V, N>(cell.node).allows(&step, self.weights_grown(force_n));
            let small = (allowed | step.square.at_most(least)) & self.weighs_alike(force_n, normal.force_n);
            let now = if taken == steps { N::ALL } else { small };
            minimum = here.or(now & !arrived, minimum);
            arrived |= small;
            if arrived == N::ALL {
                break;
            }
            (x_m, force_n) = way.on((x_m, force_n), &normal, moved);
        }
        (minimum, arrived)
    }

    /// How the influences bend in the cell after a node.
    #[inline(always)]
    fn bend<V: Eight, N: Abreast<V>>(&self, node: N) -> Bend<N> {
        let (mut kappa_square, mut lambda_square) = (N::each(0.0), N::each(0.0));
        let bends = kappa_square.as_mut().iter_mut().zip(lambda_square.as_mut());
        for ((kappa_square, lambda_square), node) in bends.zip(node.lanes().as_ref()) {
            let bend = &self.bends[*node as u32 as usize];
            (*kappa_square, *lambda_square) = (bend.kappa_square, bend.lambda_square);
        }
        Bend { kappa_square: N::of(&kappa_square), lambda_square: N::of(&lambda_square) }
    }

    /// Whether the calibration's variance counts alike, to a twentieth, for two forces.
    #[inline(always)]
    fn weighs_alike<N: Number>(&self, a_n: N, b_n: N) -> u8 {
        let (a, b) = (self.weights_grown(a_n), self.weights_grown(b_n));
        a.max(b).at_most(N::splat(1.05) * a.min(b))
    }

    /// How much more than in the weights the calibration's variance counts.
    #[inline(always)]
    fn weights_grown<N: Number>(&self, force_n: N) -> N {
        match self.force {
            ForceBelief::Known(_) => N::splat(1.0),
            _ => self.grown(force_n),
        }
    }

    /// The sums of the normal equations at a place; of those about the force only where it is not known.
    #[inline(always)]
    fn sums<V: Eight, N: Abreast<V>>(&self, whitened: &[[f64; 8]], cell: Cell<N>, force_n: N) -> Sums<N> {
        let places = Places::new::<V, N>(cell, force_n);
        if let ForceBelief::Known(_) = self.force {
            let mut vectors = N::each([V::splat(0.0); 3]);
            for (reading, of_reading) in vectors.as_mut().iter_mut().enumerate() {
                let [square, gg, eg, ..] = self.sums_by_channel::<V>(whitened, &places.of(reading), None);
                *of_reading = [square, gg, eg];
            }
            let [square, gg, eg] = N::sums(&vectors);
            return Sums { square, gg, eg, ff: N::splat(0.0), fg: N::splat(0.0), ef: N::splat(0.0) };
        }
        let grown = self.grown(force_n).lanes();
        let mut vectors = N::each([V::splat(0.0); 6]);
        for (reading, of_reading) in vectors.as_mut().iter_mut().enumerate() {
            let grown = Some(grown.as_ref()[reading]);
            *of_reading = self.sums_by_channel::<V>(whitened, &places.of(reading), grown);
        }
        let [square, gg, eg, ff, fg, ef] = N::sums(&vectors);
        Sums { square, gg, eg, ff, fg, ef }
    }

    /// Of one reading: e², g², eg, f², fg and ef, summed over groups of eight channels. The calibration's variance counts
    /// `grown` times; not given where the force is known, as the weights are then those for that force.
    #[inline(always)]
    fn sums_by_channel<V: Eight>(&self, whitened: &[[f64; 8]], place: &Place, grown: Option<f64>) -> [V; 6] {
        let [mut square, mut gg, mut eg, mut ff, mut fg, mut ef] = [V::splat(0.0); 6];
        let Place { reading, cell, force_n } = place;
        let (groups, force, node) = (self.groups(), V::splat(*force_n), cell.node as u32 as usize);
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

/// The lowest misfit so far, where it was, and how much of a step is taken.
struct Way<N> {
    x_m: N,
    force_n: N,
    misfit: N,
    pace: N,
}

impl<N: Number> Way<N> {
    /// The next place and force to try after a place, where the best step of the position is `step_m`: where the misfit
    /// has risen, half way back, and steps are shorter from then on.
    #[inline(always)]
    fn on(&mut self, (x_m, force_n): (N, N), normal: &Normal<N>, step_m: N) -> (N, N) {
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

/// Where a reading is looked for, and with which force.
struct Place {
    reading: usize,
    cell: Cell<f64>,
    force_n: f64,
}

/// The places of all readings, number by number.
struct Places<L> {
    cell: Cell<L>,
    force_n: L,
}

impl<L: AsRef<[f64]>> Places<L> {
    #[inline(always)]
    fn new<V: Copy, N: Abreast<V, Each<f64> = L>>(cell: Cell<N>, force_n: N) -> Self {
        let ([v0, v1, v2, v3], [s0, s1, s2, s3]) = (cell.value, cell.slope);
        let cell = Cell {
            node: cell.node.lanes(),
            value: [v0.lanes(), v1.lanes(), v2.lanes(), v3.lanes()],
            slope: [s0.lanes(), s1.lanes(), s2.lanes(), s3.lanes()],
        };
        Self { cell, force_n: force_n.lanes() }
    }

    #[inline(always)]
    fn of(&self, reading: usize) -> Place {
        let at = |lanes: &L| lanes.as_ref()[reading];
        let Cell { node, value: [v0, v1, v2, v3], slope: [s0, s1, s2, s3] } = &self.cell;
        let cell = Cell {
            node: at(node),
            value: [at(v0), at(v1), at(v2), at(v3)],
            slope: [at(s0), at(s1), at(s2), at(s3)],
        };
        Place { reading, cell, force_n: at(&self.force_n) }
    }
}

/// f and f′ in a cell, from values and slopes at its ends.
#[inline(always)]
fn interpolate<V: Eight>(cell: &Cell<f64>, left: &[[f64; 8]; 2], right: &[[f64; 8]; 2]) -> (V, V) {
    let at = [V::load(&left[0]), V::load(&right[0]), V::load(&left[1]), V::load(&right[1])];
    (mix(&cell.value, &at), mix(&cell.slope, &at))
}

#[inline(always)]
fn mix<V: Eight>(weights: &[f64; 4], at: &[V; 4]) -> V {
    let values = V::splat(weights[0]) * at[0] + V::splat(weights[1]) * at[1];
    values + (V::splat(weights[2]) * at[2] + V::splat(weights[3]) * at[3])
}

/// 1/(1 + g·v) from w = 1/(1 + v).
#[inline(always)]
fn grow<V: Eight>(weight: V, grown: V) -> V {
    weight / (weight + grown * (V::splat(1.0) - weight))
}

/// Sums over channels at a place: e = d − W·f the residual, g = f′, each weighted by the calibration's own variance.
#[derive(Clone, Copy)]
struct Sums<N> {
    square: N,
    ff: N,
    fg: N,
    gg: N,
    ef: N,
    eg: N,
}

/// The normal equations of the position, the force being known or the best there.
struct Normal<N> {
    force_n: N,
    /// χ².
    misfit: N,
    /// Half of how χ² falls along the position, and its curvature.
    fall: N,
    curvature: N,
    /// Cramér–Rao: variance of position, covariance, variance of force; infinite where nothing is told.
    covariance: [N; 3],
    /// The best step of the position.
    step_m: N,
    /// c, and W²·|f|²; 0 where the force is known.
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

    /// The sums were taken with some force; as the residual is linear in it, they tell the best, and what they are there.
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
        // Information about the position, about both, and about the position when the force is not known.
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

    /// The best force after a step: |f| has then grown by 1 + c·m.
    #[inline(always)]
    fn force_after(&self, step_m: N) -> N {
        self.force_n / (N::splat(1.0) + self.along_f * step_m).max(N::splat(0.25))
    }

    /// χ² after a step.
    #[inline(always)]
    fn misfit_after(&self, step_m: N) -> N {
        self.misfit - step_m * (N::splat(2.0) * self.fall - self.curvature * step_m)
    }

    /// What tells whether a step to `to` may be the last.
    #[inline(always)]
    fn step(&self, step_m: N, to: &Minimum<N>) -> Step<N> {
        let variance = self.covariance[0];
        Step { square: step_m * step_m, variance, misfit: to.misfit, signal: self.signal }
    }
}

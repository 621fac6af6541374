//! Gauss–Newton on the place of one contact, and on its force where that is not known.
//!
//! Symbols as in [`super::search`].

use super::belief::ForceBelief;
use super::lanes::Eight;
use super::search::{Minimum, Search};
use super::table::Cell;

impl Search {
    /// The minimum near `x_m`.
    #[inline(always)]
    pub fn refine<V: Eight>(&self, whitened: &[[f64; 8]], mut x_m: f64) -> Minimum {
        const MOST_STEPS: usize = 16;
        let reach = 2.0 * self.spacing.h_m;
        let cell = self.spacing.cell(x_m);
        let mut force_n = match self.force {
            ForceBelief::Known(force_n) => force_n,
            _ => self.best_force::<V>(whitened, cell),
        };
        let mut sums = self.sums::<V>(whitened, cell, force_n);
        for _ in 0..MOST_STEPS {
            let (step_m, step_n) = sums.step(self.force);
            let next = (x_m + step_m.clamp(-reach, reach)).clamp(0.0, self.table.length_m);
            let moved = next - x_m;
            x_m = next;
            force_n = (sums.force_n + step_n).max(0.0);
            // The error that a step leaves is of the order of its square, so the last step, of a fiftieth of a
            // standard deviation, is taken on trust.
            let covariance = sums.covariance(self.force);
            let small = moved * moved <= 4e-4 * covariance[0] || moved.abs() <= 1e-9 * self.table.length_m;
            if small {
                let misfit = self.misfit(&sums) - moved * moved / covariance[0];
                return Minimum { x_m, force_n, misfit, covariance };
            }
            sums = self.sums::<V>(whitened, self.spacing.cell(x_m), force_n);
        }
        let covariance = sums.covariance(self.force);
        Minimum { x_m, force_n, misfit: self.misfit(&sums), covariance }
    }

    #[inline(always)]
    fn misfit(&self, sums: &Sums) -> f64 {
        match self.force {
            ForceBelief::Normal { mean_n, sd_n } => sums.square + ((sums.force_n - mean_n) / sd_n).powi(2),
            _ => sums.square,
        }
    }

    /// The sums of the normal equations at a place; of those about the force only where it is not known.
    #[inline(always)]
    fn sums<V: Eight>(&self, whitened: &[[f64; 8]], cell: Cell, force_n: f64) -> Sums {
        let zero = V::splat(0.0);
        let (mut square, mut gg, mut eg) = (zero, zero, zero);
        let (mut ff, mut fg, mut ef) = (zero, zero, zero);
        let known = matches!(self.force, ForceBelief::Known(_));
        let (groups, force) = (whitened.len(), V::splat(force_n));
        let (left, right) = self.rows[cell.node * groups..][..2 * groups].split_at(groups);
        let weights = &self.weights[cell.node * groups..][..groups];
        let grown = V::splat(self.grown(force_n));
        for ((d, weight), (left, right)) in whitened.iter().zip(weights).zip(left.iter().zip(right)) {
            let (f, g) = interpolate::<V>(&cell, left, right);
            let mut weight = V::load(weight);
            if !known {
                weight = grow(weight, grown);
            }
            let e = V::load(d).sub(force.mul(f));
            let (we, wg) = (weight.mul(e), weight.mul(g));
            square = square.add(we.mul(e));
            gg = gg.add(wg.mul(g));
            eg = eg.add(wg.mul(e));
            if !known {
                ff = ff.add(weight.mul(f).mul(f));
                fg = fg.add(wg.mul(f));
                ef = ef.add(we.mul(f));
            }
        }
        let about_force = if known { [0.0; 3] } else { [ff.sum(), fg.sum(), ef.sum()] };
        let [ff, fg, ef] = about_force;
        Sums { force_n, square: square.sum(), gg: gg.sum(), eg: eg.sum(), ff, fg, ef }
    }

    /// The best force at a place, as far as the noise alone is concerned.
    #[inline(always)]
    fn best_force<V: Eight>(&self, whitened: &[[f64; 8]], cell: Cell) -> f64 {
        let (mut product, mut norm) = (V::splat(0.0), V::splat(0.0));
        let groups = whitened.len();
        let (left, right) = self.rows[cell.node * groups..][..2 * groups].split_at(groups);
        for (d, (left, right)) in whitened.iter().zip(left.iter().zip(right)) {
            let (f, _) = interpolate::<V>(&cell, left, right);
            product = product.add(V::load(d).mul(f));
            norm = norm.add(f.mul(f));
        }
        let (mean, precision) = self.force.mean_and_precision();
        let (product, norm) = (product.sum() + mean * precision, norm.sum() + precision);
        if norm > 0.0 { (product / norm).max(0.0) } else { 0.0 }
    }
}

/// f and f′ in a cell, from values and slopes at its ends.
#[inline(always)]
fn interpolate<V: Eight>(cell: &Cell, left: &[[f64; 8]; 2], right: &[[f64; 8]; 2]) -> (V, V) {
    let at = [V::load(&left[0]), V::load(&right[0]), V::load(&left[1]), V::load(&right[1])];
    (mix(&cell.value, &at), mix(&cell.slope, &at))
}

#[inline(always)]
fn mix<V: Eight>(weights: &[f64; 4], at: &[V; 4]) -> V {
    let values = V::splat(weights[0]).mul(at[0]).add(V::splat(weights[1]).mul(at[1]));
    values.add(V::splat(weights[2]).mul(at[2]).add(V::splat(weights[3]).mul(at[3])))
}

/// 1/(1 + g·v) from w = 1/(1 + v).
#[inline(always)]
fn grow<V: Eight>(weight: V, grown: V) -> V {
    weight.div(weight.add(grown.mul(V::splat(1.0).sub(weight))))
}

/// Sums over channels at a place: e = d − W·f the residual, g = f′, each weighted by the calibration's own variance.
#[derive(Clone, Copy)]
struct Sums {
    force_n: f64,
    square: f64,
    ff: f64,
    fg: f64,
    gg: f64,
    ef: f64,
    eg: f64,
}

impl Sums {
    /// The information about position and force: aa, aW, WW.
    #[inline(always)]
    fn information(&self, precision: f64) -> [f64; 3] {
        let w = self.force_n;
        [w * w * self.gg, w * self.fg, self.ff + precision]
    }

    /// The Gauss–Newton step of position and force.
    #[inline(always)]
    fn step(&self, belief: ForceBelief) -> (f64, f64) {
        let along = self.force_n * self.eg;
        if let ForceBelief::Known(_) = belief {
            let [aa, ..] = self.information(0.0);
            return (if aa > 0.0 { along * (1.0 / aa) } else { 0.0 }, 0.0);
        }
        let (mean, precision) = belief.mean_and_precision();
        let pull = self.ef - precision * (self.force_n - mean);
        let [aa, aw, ww] = self.information(precision);
        let determinant = aa * ww - aw * aw;
        if determinant <= 1e-14 * aa * ww {
            return (0.0, 0.0);
        }
        let inverse = 1.0 / determinant;
        ((along * ww - pull * aw) * inverse, (pull * aa - along * aw) * inverse)
    }

    /// The Cramér–Rao covariance: variance of position, covariance, variance of force; infinite where nothing is told.
    #[inline(always)]
    fn covariance(&self, belief: ForceBelief) -> [f64; 3] {
        if let ForceBelief::Known(_) = belief {
            return [1.0 / self.information(0.0)[0], 0.0, 0.0];
        }
        let [aa, aw, ww] = self.information(belief.mean_and_precision().1);
        let determinant = aa * ww - aw * aw;
        if determinant <= 1e-14 * aa * ww {
            return [f64::INFINITY, 0.0, f64::INFINITY];
        }
        let inverse = 1.0 / determinant;
        [ww * inverse, -aw * inverse, aa * inverse]
    }
}

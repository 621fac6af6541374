//! Gauss–Newton on the place of one contact, and on its force where that is not known: of one reading, or of eight at
//! once.
//!
//! Symbols as in [`super::search`]. `V` holds eight channels of a reading, `N` a number each of one or eight readings.

use super::belief::ForceBelief;
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
        (mut x_m, mut force_n): (N, N),
        steps: usize,
    ) -> (Minimum<N>, u8) {
        let n = N::splat;
        let (length, reach) = (n(self.table.length_m), n(2.0 * self.spacing.h_m));
        let least = n((1e-9 * self.table.length_m).powi(2));
        let mut minimum = Minimum::nowhere();
        let mut arrived = 0;
        for step in 0..steps {
            let sums = self.sums::<V, N>(whitened, self.spacing.cell(x_m), force_n);
            let normal = Normal::new(&sums, force_n, self.force);
            let step_m = normal.step_m.max(n(0.0) - reach).min(reach);
            let next_m = (x_m + step_m).max(n(0.0)).min(length);
            let moved = next_m - x_m;
            let next_n = (force_n + normal.step_n(moved)).max(n(0.0));
            let misfit = normal.misfit(moved, next_n - force_n);
            let here = Minimum { x_m: next_m, force_n: next_n, misfit, covariance: normal.covariance };
            // The error that a step leaves is of the order of its square, so the last step, of a fiftieth of a
            // standard deviation, is taken on trust.
            let square = moved * moved;
            let small = square.at_most(n(4e-4) * normal.covariance[0]) | square.at_most(least);
            let now = if step + 1 == steps { N::ALL } else { small };
            minimum = here.or(now & !arrived, minimum);
            arrived |= small;
            if arrived == N::ALL {
                break;
            }
            (x_m, force_n) = (here.x_m, here.force_n);
        }
        (minimum, arrived)
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

/// The normal equations of position and force.
struct Normal<N> {
    /// χ² where they were drawn up.
    square: N,
    /// Information about position and force: aa, aW, WW.
    information: [N; 3],
    /// Half of how χ² falls along the position and along the force.
    fall: [N; 2],
    /// Cramér–Rao: variance of position, covariance, variance of force; infinite where nothing is told.
    covariance: [N; 3],
    /// The best step of the position.
    step_m: N,
    /// One over WW; 0 where the force takes no step.
    inverse_ww: N,
}

impl<N: Number> Normal<N> {
    #[inline(always)]
    fn new(sums: &Sums<N>, force_n: N, belief: ForceBelief) -> Self {
        match belief {
            ForceBelief::Known(_) => Self::of_position(sums, force_n),
            _ => Self::of_both(sums, force_n, belief),
        }
    }

    #[inline(always)]
    fn of_position(sums: &Sums<N>, force_n: N) -> Self {
        let zero = N::splat(0.0);
        let (aa, along) = (force_n * force_n * sums.gg, force_n * sums.eg);
        let variance = N::splat(1.0) / aa;
        Self {
            square: sums.square,
            information: [aa, zero, zero],
            fall: [along, zero],
            covariance: [variance, zero, zero],
            step_m: zero.or(aa.at_most(zero), along * variance),
            inverse_ww: zero,
        }
    }

    #[inline(always)]
    fn of_both(sums: &Sums<N>, force_n: N, belief: ForceBelief) -> Self {
        let (zero, one, infinity) = (N::splat(0.0), N::splat(1.0), N::splat(f64::INFINITY));
        let (mean, precision) = belief.mean_and_precision();
        let (off, precision) = (force_n - N::splat(mean), N::splat(precision));
        let (along, pull) = (force_n * sums.eg, sums.ef - precision * off);
        let (aa, aw, ww) = (force_n * force_n * sums.gg, force_n * sums.fg, sums.ff + precision);
        let determinant = aa * ww - aw * aw;
        let untold = determinant.at_most(N::splat(1e-14) * aa * ww);
        let inverse = one / determinant;
        let (xx, xw, wforce) = (ww * inverse, zero - aw * inverse, aa * inverse);
        Self {
            square: sums.square + precision * off * off,
            information: [aa, aw, ww],
            fall: [along, pull],
            covariance: [infinity.or(untold, xx), zero.or(untold, xw), infinity.or(untold, wforce)],
            step_m: zero.or(untold, along * xx + pull * xw),
            inverse_ww: zero.or(untold, one / ww),
        }
    }

    /// The best step of the force when the position takes a step.
    #[inline(always)]
    fn step_n(&self, step_m: N) -> N {
        (self.fall[1] - self.information[1] * step_m) * self.inverse_ww
    }

    /// χ² after a step.
    #[inline(always)]
    fn misfit(&self, step_m: N, step_n: N) -> N {
        let ([aa, aw, ww], [along, pull]) = (self.information, self.fall);
        let two = N::splat(2.0);
        let by_position = step_m * (two * (along - aw * step_n) - aa * step_m);
        self.square - by_position - step_n * (two * pull - ww * step_n)
    }
}

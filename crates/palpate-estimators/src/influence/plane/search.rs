//! Search for one contact on a plane: coarse search, then Levenberg–Marquardt steps.
//!
//! Symbols: d whitened reading (minus offsets, over the noise), f whitened influence, W force, (x, y)
//! position, e = d − W·f, w = 1/(1 + v) with v the calibration's variance over the noise's,
//! χ²(x, y, W) = Σ w·e² (+ the term of a normal prior of the force).

use super::coarse::{Coarse, MOST_VALLEYS, Profile};
use super::edges::Edges;
use super::table::{Patches, PlaneTable};
use crate::distributed_contact::{BoundedContact, distributed_contact_bound, distributed_contact_score};
use crate::influence::channels::Channels;
use crate::influence::config::ForceBelief;
use crate::influence::lanes::{LANES, Lanes};
use crate::influence::levenberg::{Equations, Unknowns, descend};
use crate::status::{StatusRule, unknowns};
use palpate_mechanics::contact::{Contact, Position};
use palpate_numerics::small::{Matrix, add_outer};

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Search {
    pub live: Vec<usize>,
    offsets: Vec<f64>,
    inverse_sd: Vec<f64>,
    pub patches: Patches,
    /// Variance of f by node and group.
    variances: Vec<Lanes>,
    /// 1/(1 + v) by node and group, at `weights_force_n`.
    weights: Vec<Lanes>,
    /// Σ ln(1 + v).
    spreads: Vec<f64>,
    least_weights: Vec<f64>,
    weights_force_n: f64,
    pub coarse: Coarse,
    /// Only for an unknown force.
    pub edges: Edges,
    pub force: ForceBelief,
    /// Infinite unless the force is unknown.
    pub greatest_force_n: f64,
    pub size_m: [f64; 2],
    pub rule: StatusRule,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Minimum {
    pub at: Unknowns,
    pub misfit: f64,
    /// JᵀwJ, J the derivatives of W·f by x, y and W.
    pub information: Matrix<3>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ForceProfile {
    pub force_n: f64,
    pub misfit: f64,
    /// Best force without bounds.
    free_n: f64,
    /// 1/variance of the force; infinite for a known force.
    precision: f64,
}

impl ForceProfile {
    pub fn sd_n(&self) -> f64 {
        self.precision.sqrt().recip()
    }

    pub fn misfit_with(&self, force_n: f64) -> f64 {
        let square = |force_n: f64| (force_n - self.free_n).powi(2);
        self.misfit + self.precision * (square(force_n) - square(self.force_n))
    }
}

/// Greatest whitened value, beyond any contact.
const LOUDEST: f64 = 1e15;

/// A minimum this far above the best has e⁻¹² of its probability.
const NEGLIGIBLE: f64 = 24.0;

impl Search {
    pub fn new(table: &PlaneTable, channels: &Channels, force: ForceBelief) -> Self {
        let Channels { offsets, noise_sd, reference_force_n, false_alarm_rate, .. } = channels;
        let live = channels.live();
        let inverse_sd: Vec<f64> = live.iter().map(|s| 1.0 / noise_sd[*s]).collect();
        let patches = Patches::new(table, &live, &inverse_sd);
        let mut variances = vec![[0.0; 8]; table.nodes() * patches.groups];
        for node in 0..table.nodes() {
            for (i, (s, inverse)) in live.iter().zip(&inverse_sd).enumerate() {
                variances[node * patches.groups + i / 8][i % 8] =
                    table.variances[node * table.sensors + s] * inverse * inverse;
            }
        }
        let weights_force_n = force.weights_force_n(*reference_force_n);
        let weight = |v: f64| 1.0 / (1.0 + weights_force_n * weights_force_n * v);
        let weights: Vec<Lanes> = variances.iter().map(|lanes| lanes.map(weight)).collect();
        let greatest_force_n =
            if force == ForceBelief::Unknown { channels.greatest_force_n() } else { f64::INFINITY };
        let coarse = Coarse::new(table, &patches, live.len(), force);
        // Padding channels have v = 0 and weight 1.
        let node = |node: usize| weights[node * patches.groups..][..patches.groups].as_flattened().iter();
        let spreads = (0..table.nodes()).map(|n| node(n).map(|w| -w.ln()).sum()).collect();
        let least = |cell: usize| {
            let [x_m, y_m] = coarse.middle_m(cell);
            node(patches.nearest(x_m, y_m)).copied().fold(1.0, f64::min)
        };
        let least_weights = (0..coarse.cells()).map(least).collect();
        let edges = if force == ForceBelief::Unknown {
            Edges::new(table, &patches, &weights)
        } else {
            Edges::default()
        };
        Self {
            edges,
            offsets: live.iter().map(|s| offsets[*s]).collect(),
            rule: StatusRule::new(
                live.len(),
                unknowns(2, force.known_n()),
                coarse.cells(),
                *false_alarm_rate,
            ),
            size_m: [table.length_m, table.width_m],
            live,
            inverse_sd,
            patches,
            variances,
            weights,
            spreads,
            least_weights,
            weights_force_n,
            coarse,
            force,
            greatest_force_n,
        }
    }

    /// Writes d and returns |d|²; extreme readings are scaled down.
    pub fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>) -> f64 {
        whitened.clear();
        let channels = self.live.iter().zip(&self.offsets).zip(&self.inverse_sd);
        let finite = |d: f64| d.clamp(f64::MIN, f64::MAX);
        whitened.extend(channels.map(|((s, offset), inverse)| finite((reading[*s] - offset) * inverse)));
        let loudest = whitened.iter().fold(0.0, |most: f64, d| most.max(d.abs()));
        if loudest > LOUDEST {
            let scale = LOUDEST / loudest;
            whitened.iter_mut().for_each(|d| *d *= scale);
        }
        whitened.iter().map(|d| d * d).sum()
    }

    /// Relevant minima, best first; `square` is |d|².
    pub fn minima(
        &self,
        square: f64,
        whitened: &[f64],
        profile: &mut Profile,
    ) -> ([Minimum; MOST_VALLEYS], usize) {
        self.coarse.scan(whitened, square, self.force, profile);
        let (valleys, count) = self.coarse.valleys(profile);
        let mut found = [NOWHERE; MOST_VALLEYS];
        let (mut kept, mut best) = (0, f64::INFINITY);
        for valley in &valleys[..count] {
            if self.floor(profile, valley.cell) > best + NEGLIGIBLE {
                continue;
            }
            let minimum = self.refine(whitened, self.coarse.middle_m(valley.cell));
            best = best.min(minimum.misfit);
            match found[..kept].iter().position(|other| self.same(whitened, other, &minimum)) {
                Some(i) if minimum.misfit < found[i].misfit => found[i] = minimum,
                Some(_) => {}
                None => {
                    found[kept] = minimum;
                    kept += 1;
                }
            }
        }
        found[..kept].sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
        let matters = |minimum: &&Minimum| minimum.misfit <= found[0].misfit + NEGLIGIBLE;
        (found, found[..kept].iter().take_while(matters).count().max(1))
    }

    pub fn is_explained(&self, misfit: f64, minima: &[Minimum], whitened: &[f64]) -> bool {
        self.rule.is_explained(misfit) && minima.iter().any(|minimum| !self.is_spread(whitened, minimum))
    }

    /// Distributed-contact test.
    fn is_spread(&self, whitened: &[f64], Minimum { at, misfit, .. }: &Minimum) -> bool {
        // χ² is at least as large as the score.
        if *misfit <= distributed_contact_bound(2) {
            return false;
        }
        let [x_m, y_m, force_n] = *at;
        let scale = force_n.max(self.weights_force_n).powi(2);
        let variances = self.nearest_groups(&self.variances, [x_m, y_m]).as_flattened();
        let roots: Vec<f64> =
            variances[..self.live.len()].iter().map(|v| (1.0 + scale * v).sqrt().recip()).collect();
        let reads = |[x_m, y_m, force_n]: Unknowns| -> Vec<f64> {
            let place = self.patches.place(x_m, y_m);
            let f = (0..self.patches.groups).flat_map(|group| self.patches.value(&place, group));
            f.zip(&roots).map(|(f, root)| root * force_n * f).collect()
        };
        let force = self.force.known_n().map_or((0.0, self.greatest_force_n), |force_n| (force_n, force_n));
        let about = BoundedContact { at: *at, ends: [(0.0, self.size_m[0]), (0.0, self.size_m[1]), force] };
        let reading = whitened.iter().zip(&roots).map(|(d, root)| root * d);
        distributed_contact_score(about, reading, reads) > distributed_contact_bound(2)
    }

    /// Approximate lower bound of χ² in a coarse cell.
    pub fn floor(&self, profile: &Profile, cell: usize) -> f64 {
        let reach = profile.force_n(cell, self.force) * self.coarse.reaches[cell];
        let closest = (profile.misfits()[cell].max(0.0).sqrt() - reach).max(0.0);
        self.least_weights[cell] * closest * closest
    }

    /// True where χ² rises by at most 1 on the line between both.
    fn same(&self, whitened: &[f64], a: &Minimum, b: &Minimum) -> bool {
        const STEPS: usize = 8;
        const RISE: f64 = 1.0;
        let close = (0..2).all(|k| (a.at[k] - b.at[k]).abs() < 0.1 * self.coarse.cell_m[k]);
        close
            || (1..STEPS).all(|step| {
                let t = step as f64 / STEPS as f64;
                let at = |k: usize| a.at[k] + t * (b.at[k] - a.at[k]);
                let [x_m, y_m] = [at(0), at(1)];
                self.profiled(whitened, [x_m, y_m]).misfit <= a.misfit.max(b.misfit) + RISE
            })
    }

    #[inline]
    pub fn profiled(&self, whitened: &[f64], [x_m, y_m]: [f64; 2]) -> ForceProfile {
        let place = self.patches.place(x_m, y_m);
        let weights = self.nearest_groups(&self.weights, [x_m, y_m]);
        let mut sums = [[0.0; 8]; 3];
        for (group, (chunk, weights)) in whitened.chunks(8).zip(weights).enumerate() {
            let f = self.patches.value(&place, group);
            let mut d = [0.0; 8];
            d[..chunk.len()].copy_from_slice(chunk);
            for lane in 0..8 {
                let (weighted_d, weighted_f) = (weights[lane] * d[lane], weights[lane] * f[lane]);
                sums[0][lane] += weighted_d * d[lane];
                sums[1][lane] += weighted_d * f[lane];
                sums[2][lane] += weighted_f * f[lane];
            }
        }
        let [square, product, norm] = sums.map(|lanes| lanes.iter().sum::<f64>());
        if let ForceBelief::Known(force_n) = self.force {
            let misfit = square + force_n * (force_n * norm - 2.0 * product);
            return ForceProfile { force_n, misfit, free_n: force_n, precision: f64::INFINITY };
        }
        let (mean, precision) = self.force.mean_and_precision();
        let (score, norm) = (product + mean * precision, norm + precision);
        let free_n = if norm > 0.0 { score / norm } else { 0.0 };
        let force_n = free_n.clamp(0.0, self.greatest_force_n);
        let misfit = square + mean * mean * precision + force_n * (force_n * norm - 2.0 * score);
        ForceProfile { force_n, misfit, free_n, precision: norm }
    }

    /// Σ ln(1 + v), a term of −2·ln of the likelihood.
    pub fn spread(&self, [x_m, y_m]: [f64; 2]) -> f64 {
        self.spreads[self.patches.nearest(x_m, y_m)]
    }

    pub fn best_force(&self, whitened: &[f64], at: [f64; 2]) -> f64 {
        self.force.known_n().unwrap_or_else(|| self.profiled(whitened, at).force_n)
    }

    #[inline]
    fn nearest_groups<'a>(&self, groups: &'a [Lanes], [x_m, y_m]: [f64; 2]) -> &'a [Lanes] {
        &groups[self.patches.nearest(x_m, y_m) * self.patches.groups..][..self.patches.groups]
    }

    /// Σ (W·f)².
    pub fn signal(&self, contact: Contact) -> f64 {
        let place = self.patches.place(contact.position.x_m, contact.position.y_m);
        let squares = (0..self.patches.groups).flat_map(|group| self.patches.value(&place, group));
        contact.force_n.powi(2) * squares.map(|f| f * f).sum::<f64>()
    }

    /// f, gradient and W²·v of every channel.
    pub fn linearised(&self, contact: Contact) -> impl Iterator<Item = [f64; 4]> {
        let Contact { position: Position { x_m, y_m }, force_n } = contact;
        let place = self.patches.place(x_m, y_m);
        let scale = force_n.max(self.weights_force_n).powi(2);
        let groups = self.nearest_groups(&self.variances, [x_m, y_m]).iter().enumerate();
        groups.flat_map(move |(group, variances)| {
            let values = self.patches.values(&place, group);
            std::array::from_fn::<_, LANES, _>(|lane| {
                [values.f[lane], values.along[lane], values.across[lane], scale * variances[lane]]
            })
        })
    }

    /// Σ w·j·jᵀ and Σ w²·v·j·jᵀ.
    pub fn calibration(&self, contact: Contact) -> [Matrix<3>; 2] {
        let Contact { position: Position { x_m, y_m }, force_n } = contact;
        let place = self.patches.place(x_m, y_m);
        let variances = self.nearest_groups(&self.variances, [x_m, y_m]);
        let scale = force_n.max(self.weights_force_n).powi(2);
        let mut sums = [[[0.0; 3]; 3]; 2];
        for (group, variances) in variances.iter().enumerate() {
            let values = self.patches.values(&place, group);
            for (lane, own) in variances.iter().enumerate() {
                let variance = scale * own;
                let weight = 1.0 / (1.0 + variance);
                let j = [force_n * values.along[lane], force_n * values.across[lane], values.f[lane]];
                for (sum, factor) in sums.iter_mut().zip([weight, weight * weight * variance]) {
                    add_outer(sum, factor, &j);
                }
            }
        }
        sums
    }

    /// Normal equations with the calibration's variances `near` a place, by default at the contact.
    pub fn equations(&self, whitened: &[f64], at: Unknowns, near: Option<[f64; 2]>) -> Equations {
        let [x_m, y_m, force_n] = at;
        let place = self.patches.place(x_m, y_m);
        let near = near.unwrap_or([x_m, y_m]);
        let (weights, variances) =
            (self.nearest_groups(&self.weights, near), self.nearest_groups(&self.variances, near));
        let harder = (force_n > self.weights_force_n).then_some(force_n * force_n);
        let channels = whitened.chunks(LANES).enumerate().map(|(group, chunk)| {
            let values = self.patches.values(&place, group);
            let mut e = [0.0; LANES];
            e[..chunk.len()].copy_from_slice(chunk);
            e.iter_mut().zip(values.f).for_each(|(e, f)| *e -= force_n * f);
            let weights = match harder {
                None => weights[group],
                Some(scale) => variances[group].map(|v| 1.0 / (1.0 + scale * v)),
            };
            (weights, e, [values.along.map(|g| force_n * g), values.across.map(|g| force_n * g), values.f])
        });
        let mut equations = Equations::new(channels);
        if let ForceBelief::Normal { mean_n, sd_n } = self.force {
            equations.misfit += ((force_n - mean_n) / sd_n).powi(2);
            equations.right[2] -= (force_n - mean_n) / (sd_n * sd_n);
            equations.information[2][2] += 1.0 / (sd_n * sd_n);
        }
        equations
    }
}

const NOWHERE: Minimum = Minimum { at: [0.0; 3], misfit: f64::INFINITY, information: [[0.0; 3]; 3] };

/// Least decrease of χ² per step: a fiftieth of a standard deviation, squared.
const SMALL: f64 = 4e-4;

impl Search {
    pub fn refine(&self, whitened: &[f64], start_m: [f64; 2]) -> Minimum {
        let start = [start_m[0], start_m[1], self.best_force(whitened, start_m)];
        let force = self.force.known_n().map_or((0.0, self.greatest_force_n), |force_n| (force_n, force_n));
        let ends = [(0.0, self.size_m[0]), (0.0, self.size_m[1]), force];
        // Constant variances within one refinement make χ² comparable.
        let (at, _) = descend(start, ends, SMALL, |at| self.equations(whitened, at, Some(start_m)));
        let Equations { misfit, information, .. } = self.equations(whitened, at, None);
        Minimum { at, misfit, information }
    }
}

//! From the positions that explain a reading to an estimate: how well each does, how sure, and which others.

use super::locator::Noise;
use super::segment::Segment;
use palpate_core::{ContactEstimate, Estimate, Mode, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::small::Ldl;
use palpate_numerics::{NORMAL_95, chi_squared_bound, held_interval};

/// Modes whose probabilities sum to less than this are not spoken of.
const NEGLIGIBLE: f64 = 0.05;

/// A reading that noise gives as rarely as this has another cause.
pub(super) const RARE: f64 = 1e-3;

/// Squared residuals that differ by less than this share of the reading are the same in double precision.
const ROUNDING: f64 = 1e-13;

/// What is asked: a whitened reading, and the force in newtons where it is known.
pub(super) struct Posterior<'a> {
    pub(super) segments: &'a [Segment],
    pub(super) reading: &'a [f64],
    pub(super) force_n: Option<f64>,
    pub(super) noise: Noise,
}

/// A position that explains the reading better than its neighbours do, or a stretch of positions that explain it alike.
#[derive(Clone, Copy, Debug)]
struct Explanation {
    from_m: f64,
    to_m: f64,
    position_m: f64,
    force_n: f64,
    chi_squared: f64,
    /// Covariance of position and force: xx, xf, ff.
    covariance: [f64; 3],
}

impl Posterior<'_> {
    pub(super) fn estimate(&self) -> Estimate {
        let mut found = self.explanations();
        found.sort_by(|a, b| self.log_weight(b).total_cmp(&self.log_weight(a)));
        let Some(best) = found.first() else {
            return Estimate::of_position(Position::default(), Status::OutsideModel);
        };
        let mut estimate = Estimate::of_contact(self.contact(best), Status::Located);
        if best.force_n <= 0.0 || best.chi_squared > self.tolerated() {
            estimate.status = Status::OutsideModel;
            return estimate;
        }
        let shares: Vec<f64> =
            found.iter().map(|e| (self.log_weight(e) - self.log_weight(best)).exp()).collect();
        let total: f64 = shares.iter().sum();
        if 1.0 - 1.0 / total > NEGLIGIBLE || best.to_m - best.from_m > 0.01 * self.length_m() {
            estimate.status = Status::Ambiguous;
            for (other, share) in found.iter().zip(&shares).skip(1) {
                let mode = Mode { contact: self.contact(other), probability: share / total };
                if mode.probability < 0.1 * NEGLIGIBLE || !estimate.modes.push(mode) {
                    break;
                }
            }
        }
        estimate
    }

    fn length_m(&self) -> f64 {
        self.segments.last().map_or(0.0, |segment| segment.to_m)
    }

    fn size(&self) -> f64 {
        self.reading.iter().map(|r| r * r).sum()
    }

    /// Local minima of the squared residual over the beam. Between neighbouring candidates it is monotone, as all its turns
    /// and all the ends of segments are candidates.
    fn explanations(&self) -> Vec<Explanation> {
        let mut candidates: Vec<Explanation> = Vec::new();
        for segment in self.segments {
            let places = segment.candidates(self.reading, self.force_n);
            candidates.extend(places.into_iter().map(|position_m| self.explanation(segment, position_m)));
        }
        candidates.sort_by(|a, b| a.position_m.total_cmp(&b.position_m));
        let same = ROUNDING * self.size();
        let mut stretches: Vec<Explanation> = Vec::new();
        for next in candidates {
            match stretches.last_mut() {
                Some(last) if (last.chi_squared - next.chi_squared).abs() <= same => {
                    last.to_m = next.to_m;
                    // The middle of a stretch that one position explains as well as the next.
                    last.position_m = 0.5 * (last.from_m + last.to_m);
                }
                _ => stretches.push(next),
            }
        }
        let chi =
            |i: Option<usize>| i.and_then(|i| stretches.get(i)).map_or(f64::INFINITY, |e| e.chi_squared);
        let lowest = |i: &usize| chi(Some(*i)) < chi(i.checked_sub(1)) && chi(Some(*i)) < chi(Some(i + 1));
        (0..stretches.len()).filter(lowest).map(|i| stretches[i]).collect()
    }

    fn explanation(&self, segment: &Segment, position_m: f64) -> Explanation {
        let influence = segment.influence_at(position_m);
        let (mut n, mut d) = (0.0, 0.0);
        for ((h, _), r) in influence.iter().zip(self.reading) {
            n += r * h;
            d += h * h;
        }
        let best = if d > 0.0 { (n / d).max(0.0) } else { 0.0 };
        let force_n = self.force_n.unwrap_or(best);
        let residual = influence.iter().zip(self.reading).map(|((h, _), r)| (r - force_n * h).powi(2));
        Explanation {
            from_m: position_m,
            to_m: position_m,
            position_m,
            force_n,
            chi_squared: residual.sum(),
            covariance: self.covariance(&influence, force_n),
        }
    }

    /// Inverse of the Fisher information of (a, W), whose square root is the Jacobian (W·h̃′, h̃); a position that the reading
    /// does not determine is given the variance of one anywhere on the beam, l²/12.
    fn covariance(&self, influence: &[(f64, f64)], force_n: f64) -> [f64; 3] {
        let (mut xx, mut xf, mut ff) = (0.0, 0.0, 0.0);
        for (h, slope) in influence {
            xx += (force_n * slope).powi(2);
            xf += force_n * slope * h;
            ff += h * h;
        }
        let most = self.length_m().powi(2) / 12.0;
        if self.force_n.is_some() {
            return [most.min(1.0 / xx), 0.0, 0.0];
        }
        match Ldl::new(&[[ff, xf], [xf, xx]]) {
            Some(factors) => {
                let [_, [_, of_position]] = factors.inverse();
                let (variance, slope) = (most.min(of_position), -xf / ff);
                // cov(a, W) = slope·var a and var W = 1/ff + slope²·var a, whatever var a is.
                [variance, slope * variance, 1.0 / ff + slope * slope * variance]
            }
            None => [most, 0.0, if ff > 0.0 { 1.0 / ff } else { 0.0 }],
        }
    }

    /// Logarithm of the probability around an explanation, up to a constant, by Laplace's method. Where the noise is unknown
    /// only explanations as good as exact share in it.
    fn log_weight(&self, explanation: &Explanation) -> f64 {
        match self.noise {
            Noise::Known => {
                let width = (explanation.to_m - explanation.from_m).powi(2) / 12.0;
                let [xx, xf, ff] = explanation.covariance;
                let volume = if self.force_n.is_some() { xx } else { (xx * ff - xf * xf).max(0.0) };
                -0.5 * explanation.chi_squared + 0.5 * volume.max(width * ff).max(f64::MIN_POSITIVE).ln()
            }
            Noise::Unknown => -0.5 * explanation.chi_squared / (1e-10 * self.size()),
        }
    }

    fn tolerated(&self) -> f64 {
        let unknowns = 1 + usize::from(self.force_n.is_none());
        match self.noise {
            Noise::Known => chi_squared_bound(RARE, self.reading.len().saturating_sub(unknowns).max(1)),
            Noise::Unknown => 0.01 * self.size(),
        }
    }

    fn contact(&self, explanation: &Explanation) -> ContactEstimate {
        let Explanation { from_m, to_m, position_m, covariance: [xx, xf, ff], .. } = *explanation;
        let half_m = NORMAL_95 * xx.sqrt();
        let uncertainty = Uncertainty {
            covariance: [xx.max((to_m - from_m).powi(2) / 12.0), 0.0, xf, 0.0, 0.0, ff],
            x_95_m: held_interval((from_m - half_m, to_m + half_m), self.length_m()),
            y_95_m: (0.0, 0.0),
        };
        ContactEstimate {
            position: Position::along(position_m),
            force_n: Some(explanation.force_n),
            uncertainty: (self.noise == Noise::Known).then_some(uncertainty),
        }
    }
}

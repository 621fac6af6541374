//! Where the influence functions are polynomials, and the positions in there that explain a reading best.
//!
//! Symbols: r̃ reading and h̃(a) influence at position a, both whitened; W force; N = r̃ᵀh̃, D = h̃ᵀh̃. Within a segment the
//! squared residual is
//!
//! ```text
//! |r̃|² − N²/D            best force,  stationary where 2·N′·D − N·D′ = 0   (degree 8)
//! |r̃|² − 2·W·N + W²·D    known force, stationary where W·D′ − 2·N′ = 0     (degree 5)
//! ```

use super::polynomial::Polynomial;

/// A stretch of the beam between neighbouring sensors or supports.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Segment {
    pub(super) from_m: f64,
    pub(super) to_m: f64,
    /// h̃ of each channel, a polynomial of t = (a − from)/(to − from).
    influence: Vec<Polynomial>,
    /// The same for the unknown force, divided by t or 1 − t where every influence is 0 at that end: there N²/D would
    /// be 0/0, and the division leaves it as it is.
    reduced: Vec<Polynomial>,
    /// Whether `reduced` is in 1 − t.
    mirrored: bool,
    /// Where `reduced` begins: at 0, or just beside an end where no sensor reads anything and only an infinite force would.
    start: f64,
}

/// Share of a segment that is just beside its end.
const BESIDE: f64 = 1e-6;

impl Segment {
    /// The segment from `from_m` to `to_m`, where `influence(channel, a)` is cubic in a.
    pub(super) fn new(
        from_m: f64,
        to_m: f64,
        channels: usize,
        influence: impl Fn(usize, f64) -> f64,
    ) -> Self {
        let at = |t: f64| from_m + t * (to_m - from_m);
        let cubic = |channel: usize| {
            Polynomial::cubic_through([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|t| influence(channel, at(t))))
        };
        let polynomials: Vec<Polynomial> = (0..channels).map(cubic).collect();
        let vanish = |t: f64| polynomials.iter().all(|p| p.at(t).abs() <= 1e-12 * p.size());
        let mirrored = vanish(1.0) && !vanish(0.0);
        let mut reduced = polynomials.clone();
        if mirrored {
            reduced = reduced.iter().map(Polynomial::mirrored).collect();
        }
        if mirrored || vanish(0.0) {
            reduced = reduced.iter().map(Polynomial::over_t).collect();
        }
        let start = if mirrored || vanish(0.0) { BESIDE } else { 0.0 };
        Self { from_m, to_m, influence: polynomials, reduced, mirrored, start }
    }

    /// Positions at which the squared residual is stationary, its ends always among them.
    pub(super) fn candidates(&self, reading: &[f64], force_n: Option<f64>) -> Vec<f64> {
        let functions = if force_n.is_some() { &self.influence } else { &self.reduced };
        let (mut n, mut d) = (Polynomial::zero(), Polynomial::zero());
        for (h, r) in functions.iter().zip(reading) {
            n = n.plus(*r, h);
            d = d.plus(1.0, &h.times(h));
        }
        let stationary = match force_n {
            Some(force_n) => n.derivative().plus(-0.5 * force_n, &d.derivative()),
            None => n.derivative().times(&d).plus(-0.5, &n.times(&d.derivative())),
        };
        let mirrored = self.mirrored && force_n.is_none();
        let place = |t: f64| self.from_m + (self.to_m - self.from_m) * if mirrored { 1.0 - t } else { t };
        let start = if force_n.is_some() { 0.0 } else { self.start };
        let turns = stationary.sign_changes().into_iter().filter(|t| *t > start);
        [start, 1.0].into_iter().chain(turns).map(place).collect()
    }

    /// h̃ of every channel at `position_m`, and its derivative by the position in 1/m.
    pub(super) fn influence_at(&self, position_m: f64) -> Vec<(f64, f64)> {
        let length_m = self.to_m - self.from_m;
        let t = (position_m - self.from_m) / length_m;
        self.influence.iter().map(|h| (h.at(t), h.derivative().at(t) / length_m)).collect()
    }
}

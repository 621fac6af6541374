//! Likelihood of contacts on a force-linear surface, for tracking; symbols as in [`super::seen`].
//!
//! Contacts of the forces F_k at a_k read Σ φ(F_k)·f(a_k), over the noise, with w = ω + Σ (2φ_k·β(a_k) +
//! φ_k²·v(a_k)), S = m + r·w, the common-mode error g = u·√w and V = diag(S) + g·gᵀ. The log-likelihood is
//! −½·(eᵀ·V⁻¹·e + ln|V|) over the overdispersion κ, with e the residual. Derivatives of V have a score of
//! mean 0, and are left out of the normal equations.
//!
//! Saturating readings are linearized; their drift then counts as that of the linearized readings.

use super::locator::{COVARIANCES, ForceLinearLocator, LAYERS, VARIANCES};
use crate::fit::Locate;
use crate::force_prior::{ForcePrior, ForceRange, NormalPrior};
use crate::influence::lanes::LANES;
use crate::likelihood::{
    CalibrationVariance, ContactFit, Geometry, Likelihood, LineLikelihood, Linearisation, LocatorChecks,
    PlaneLikelihood,
};
use palpate_core::Estimate;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::surface::Extent;
use palpate_numerics::small::{Ldl, add_outer, form};
use palpate_numerics::{NORMAL_99, SharedError};

/// Likelihood of a [`ForceLinearLocator`].
#[derive(Clone, Debug, PartialEq)]
pub struct ForceLinearLikelihood {
    locator: ForceLinearLocator,
    /// `None` for a known force.
    force_range: Option<ForceRange>,
    checks: LocatorChecks,
}

/// Unknowns of a contact: x, y and force.
const PER_CONTACT: usize = 3;
/// Of two contacts.
const MOST_UNKNOWNS: usize = 2 * PER_CONTACT;
/// Indices of x and force.
const X: usize = 0;
const FORCE: usize = 2;

impl ForceLinearLikelihood {
    /// Builds the likelihood of the channels in use; `None` for an unknown force whose prior has a mean of 0 or
    /// less, as tracked contacts press.
    pub fn new(locator: &ForceLinearLocator) -> Option<Self> {
        let is_known = locator.stored.known_force_n.is_some();
        let force_range = if is_known { None } else { Some(locator.pressing_forces()?) };
        Some(Self { locator: locator.clone(), force_range, checks: LocatorChecks::default() })
    }

    /// Replaces the checks of the locator.
    #[must_use]
    pub fn with_checks(self, checks: LocatorChecks) -> Self {
        Self { checks, ..self }
    }

    /// φ and dφ/dF; the slope of a power is bounded at the least force of the range.
    fn response(&self, force_n: f64) -> [f64; 2] {
        let prior = &self.locator.stored.prior;
        let steepest_n = self.force_range.map_or(force_n, |range| force_n.max(range.ends_n().0));
        [prior.response_n(force_n), prior.response * prior.response_n(steepest_n) / steepest_n]
    }

    fn predict(&self, contacts: &[Contact]) -> Prediction {
        let ForceLinearLocator { layers, offset_variances, .. } = &self.locator;
        let channels = self.locator.stored.live.len();
        let root = self.locator.noise().sqrt().recip();
        let mut prediction = Prediction {
            reading: vec![0.0; channels],
            derivatives: vec![vec![0.0; channels]; PER_CONTACT * contacts.len()],
            spreads: offset_variances.as_flattened()[..channels].to_vec(),
            noise: 1.0,
        };
        let force_is_free = if self.force_range.is_some() { 1.0 } else { 0.0 };
        let (mut slopes, mut between) = (Vec::new(), Vec::new());
        for (k, contact) in contacts.iter().enumerate() {
            let [response_n, growth] = self.response(contact.force_n);
            let nodes = self.locator.nodes_at(contact.position);
            self.locator.slopes_at(contact.position, &mut slopes);
            layers.interpolate(nodes, VARIANCES..LAYERS, &mut between);
            let of_layer = |layer: usize| between[(layer - VARIANCES) * layers.groups()..].as_flattened();
            let (variances, covariances) = (of_layer(VARIANCES), of_layer(COVARIANCES));
            prediction.noise *= self.locator.noise_at(nodes);
            for c in 0..channels {
                let [f, along, across] = slopes[c / LANES].map(|lanes| root * lanes[c % LANES]);
                prediction.reading[c] += response_n * f;
                let by = [response_n * along, response_n * across, force_is_free * growth * f];
                for (i, derivative) in by.into_iter().enumerate() {
                    prediction.derivatives[PER_CONTACT * k + i][c] = derivative;
                }
                prediction.spreads[c] +=
                    response_n * (2.0 * covariances[c] + response_n * variances[c].max(0.0));
            }
        }
        prediction.spreads.iter_mut().for_each(|spread| *spread = root * root * spread.max(0.0));
        prediction
    }

    /// Covariance V of a prediction.
    fn covariance(&self, prediction: &Prediction) -> Covariance {
        let ForceLinearLocator { own, shared, stored, .. } = &self.locator;
        let shares = own.as_flattened().iter().zip(&prediction.spreads);
        let independent: Vec<f64> = shares.map(|(share, spread)| prediction.noise + share * spread).collect();
        let loadings = shared.as_flattened().iter().zip(&prediction.spreads);
        let common: Vec<f64> = loadings.map(|(loading, spread)| loading * spread.sqrt()).collect();
        let relative = common.iter().zip(&independent).map(|(error, own)| error / own.sqrt()).collect();
        Covariance {
            common,
            whitening: SharedError::new(relative),
            independent,
            overdispersion: stored.channels_as_one,
        }
    }

    /// Fit of contacts; `unknowns` are indices of derivatives, and `None` for a first mode, which is unknown.
    fn fit<const K: usize>(
        &self,
        whitened: &[f64],
        contacts: &[Contact],
        unknowns: [Option<usize>; K],
    ) -> ContactFit<K> {
        let prediction = self.predict(contacts);
        let covariance = self.covariance(&prediction);
        let residual = |c: usize| [whitened[c] - prediction.reading[c]];
        let derivatives =
            |c: usize| unknowns.map(|unknown| unknown.map_or(0.0, |i| prediction.derivatives[i][c]));
        let residuals = covariance.whitened((0..whitened.len()).map(residual));
        let rows = covariance.whitened((0..whitened.len()).map(derivatives));
        let mut fit = ContactFit::NOTHING;
        for ([residual], derivatives) in residuals.into_iter().zip(&rows) {
            fit.add(residual, derivatives, 1.0);
        }
        fit.misfit += covariance.log_determinant();
        fit.mirrored()
    }
}

impl ForceLinearLocator {
    /// Range of an unknown pressing force: that of the prior, or, for a normal prior of φ, 99 % of the
    /// log-normal distribution with its mean and variance; `None` for a mean of 0 or less.
    fn pressing_forces(&self) -> Option<ForceRange> {
        let ForcePrior::Normal(NormalPrior { mean_n, precision, .. }) = &self.force_prior else {
            return self.stored.force_range;
        };
        let variance = (precision * mean_n * mean_n).recip().ln_1p();
        let middle = mean_n.ln() - 0.5 * variance;
        let end_n = |sign: f64| {
            let response_n = (middle + sign * NORMAL_99 * variance.sqrt()).exp();
            self.stored.prior.force_of_response(response_n, 0.0).0
        };
        ForceRange::new(end_n(-1.0), end_n(1.0)).ok()
    }
}

/// Reading of contacts over the noise.
#[derive(Clone, Debug, PartialEq)]
struct Prediction {
    /// Σ φ·f.
    reading: Vec<f64>,
    /// By x, y and force of each contact; 0 for a known force.
    derivatives: Vec<Vec<f64>>,
    /// w.
    spreads: Vec<f64>,
    /// m.
    noise: f64,
}

/// κ·V.
#[derive(Clone, Debug, PartialEq)]
struct Covariance {
    /// S.
    independent: Vec<f64>,
    /// g.
    common: Vec<f64>,
    /// By g over √S.
    whitening: SharedError,
    /// κ.
    overdispersion: f64,
}

impl Covariance {
    /// Rows times (κ·V)^(−½).
    fn whitened<const N: usize>(&self, rows: impl Iterator<Item = [f64; N]>) -> Vec<[f64; N]> {
        let scaled = rows.zip(&self.independent).map(|(row, variance)| {
            let root = (self.overdispersion * variance).sqrt().recip();
            row.map(|value| root * value)
        });
        let mut rows: Vec<[f64; N]> = scaled.collect();
        self.whitening.whiten(&mut rows);
        rows
    }

    /// ln|V|/κ.
    fn log_determinant(&self) -> f64 {
        let independent: f64 = self.independent.iter().map(|variance| variance.ln()).sum();
        (independent + self.whitening.log_determinant()) / self.overdispersion
    }

    /// Variance of each channel.
    fn variances(&self) -> impl Iterator<Item = f64> {
        let both = self.independent.iter().enumerate();
        both.map(|(c, own)| {
            self.overdispersion * (own + self.common.get(c).map_or(0.0, |error| error * error))
        })
    }
}

impl LineLikelihood for ForceLinearLikelihood {
    fn fit_one(&self, whitened: &[f64], contact: Contact, _mode_n: Option<f64>) -> ContactFit<3> {
        self.fit(whitened, &[contact], [None, Some(X), Some(FORCE)])
    }

    fn fit_two(&self, whitened: &[f64], contacts: [Contact; 2], _mode_n: Option<f64>) -> ContactFit<5> {
        let of = |k: usize| [X, FORCE].map(|i| Some(PER_CONTACT * k + i));
        let ([x, force], [other_x, other_force]) = (of(0), of(1));
        self.fit(whitened, &contacts, [None, x, force, other_x, other_force])
    }

    /// 0: unknown without a model.
    fn first_mode(&self, _x_m: f64) -> [f64; 2] {
        [0.0; 2]
    }
}

impl PlaneLikelihood for ForceLinearLikelihood {
    fn fit_on_plane(&self, whitened: &[f64], contact: Contact) -> ContactFit<3> {
        self.fit(whitened, &[contact], [0, 1, 2].map(Some))
    }
}

impl Likelihood for ForceLinearLikelihood {
    fn geometry(&self) -> Geometry<'_> {
        match self.extent() {
            Extent::Line { .. } => Geometry::Line(self),
            Extent::Plane { .. } => Geometry::Plane(self),
        }
    }

    fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>) {
        let root = self.locator.noise().sqrt().recip();
        whitened.clear();
        whitened.extend(self.locator.relative(reading).into_iter().map(|d| root * d));
    }

    fn fit_untouched(&self, whitened: &[f64], _mode_n: f64) -> ContactFit<1> {
        self.fit(whitened, &[], [None])
    }

    fn signal(&self, contact: Contact) -> f64 {
        self.predict(&[contact]).reading.iter().map(|own| own * own).sum()
    }

    /// A⁻¹·B·A⁻¹, A = Jᵀ·V⁻¹·J, B = Jᵀ·V⁻¹·(V − m)·V⁻¹·J, J the derivatives, with κ·V for V.
    fn calibration_variance(&self, contacts: &[Contact]) -> [CalibrationVariance; 2] {
        let prediction = self.predict(contacts);
        let covariance = self.covariance(&prediction);
        let derivatives = |c: usize| -> [f64; MOST_UNKNOWNS] {
            std::array::from_fn(|i| prediction.derivatives.get(i).map_or(0.0, |column| column[c]))
        };
        let rows = covariance.whitened((0..prediction.reading.len()).map(derivatives));
        let mut again = rows.clone();
        covariance.whitening.whiten(&mut again);
        let (mut a, mut b) = ([[0.0; MOST_UNKNOWNS]; MOST_UNKNOWNS], [[0.0; MOST_UNKNOWNS]; MOST_UNKNOWNS]);
        for ((row, again), variance) in rows.iter().zip(&again).zip(&covariance.independent) {
            add_outer(&mut a, 1.0, row);
            add_outer(&mut b, 1.0, row);
            add_outer(&mut b, -prediction.noise / (covariance.overdispersion * variance), again);
        }
        let is_plane = self.extent().width_m().is_some();
        let free = std::array::from_fn(|i| {
            let is_unknown = [true, is_plane, self.force_range.is_some()][i % PER_CONTACT];
            i < PER_CONTACT * contacts.len() && is_unknown
        });
        let Some(factors) = Ldl::of_free(&a, free) else { return [CalibrationVariance::default(); 2] };
        let inverse = factors.inverse();
        std::array::from_fn(|k| {
            let of =
                |i: usize, j: usize| form(&inverse[PER_CONTACT * k + i], &b, &inverse[PER_CONTACT * k + j]);
            CalibrationVariance { position_m2: [of(0, 0), of(0, 1), of(1, 1)], force_n2: of(2, 2) }
        })
    }

    fn linearised(&self, contacts: &[Contact]) -> Linearisation {
        let prediction = self.predict(contacts);
        // Whitened readings have a noise of 1.
        let variance = self.covariance(&prediction).variances().map(|all| (all - 1.0).max(0.0)).collect();
        Linearisation { reading: prediction.reading, derivatives: prediction.derivatives, variance }
    }

    fn single_estimate(&self, reading: &[f64]) -> Estimate {
        self.locator.locate(reading)
    }

    fn checks(&self) -> Option<&LocatorChecks> {
        Some(&self.checks)
    }

    fn extent(&self) -> Extent {
        self.locator.extent()
    }

    /// The grid: beyond it the table is constant.
    fn position_ranges_m(&self) -> [(f64, f64); 2] {
        self.locator.axes().map(|axis| (axis.start, axis.value((axis.count - 1) as f64)))
    }

    fn known_force_n(&self) -> Option<f64> {
        self.locator.stored.known_force_n
    }

    fn force_range(&self) -> Option<ForceRange> {
        self.force_range
    }

    fn most_contacts(&self) -> usize {
        1
    }
}

//! Likelihood of contacts on a plane, for tracking; symbols as in [`super::search`].

use super::locator::PlaneLocator;
use super::search::Search;
use crate::fit::Locate;
use crate::force_prior::ForceRange;
use crate::influence::config::ForceBelief;
use crate::likelihood::{
    CalibrationVariance, ContactFit, Geometry, Likelihood, Linearisation, LocatorChecks, PlaneLikelihood,
};
use palpate_core::Estimate;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::surface::Extent;
use palpate_numerics::small::{Ldl, form};

/// Likelihood of a [`PlaneLocator`].
#[derive(Clone, Debug, PartialEq)]
pub struct PlateLikelihood {
    locator: PlaneLocator,
    /// Search without the normal prior of the force, which tracking applies once.
    search: Search,
    checks: LocatorChecks,
}

impl PlateLikelihood {
    /// Builds the likelihood of the channels in use.
    pub fn new(locator: &PlaneLocator) -> Self {
        let force = locator.force().known_n().map_or(ForceBelief::Unknown, ForceBelief::Known);
        Self {
            locator: locator.clone(),
            search: locator.search_with(force),
            checks: LocatorChecks::default(),
        }
    }

    /// Replaces the checks of the locator.
    #[must_use]
    pub fn with_checks(self, checks: LocatorChecks) -> Self {
        Self { checks, ..self }
    }
}

impl PlaneLikelihood for PlateLikelihood {
    fn fit_on_plane(&self, whitened: &[f64], contact: Contact) -> ContactFit<3> {
        let at = [contact.position.x_m, contact.position.y_m, contact.force_n];
        let equations = self.search.equations(whitened, at, None);
        ContactFit { misfit: equations.misfit, score: equations.right, information: equations.information }
    }
}

impl Likelihood for PlateLikelihood {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Plane(self)
    }

    fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>) {
        self.search.whiten(reading, whitened);
    }

    fn fit_untouched(&self, whitened: &[f64], _mode_n: f64) -> ContactFit<1> {
        ContactFit { misfit: whitened.iter().map(|d| d * d).sum(), ..ContactFit::NOTHING }
    }

    fn signal(&self, contact: Contact) -> f64 {
        self.search.signal(contact)
    }

    /// A⁻¹·B·A⁻¹, A = Σ w·j·jᵀ, B = Σ w²·v·j·jᵀ, j the derivatives of W·f.
    fn calibration_variance(&self, contacts: &[Contact]) -> [CalibrationVariance; 2] {
        let mut left = [CalibrationVariance::default(); 2];
        let free = [true, true, self.known_force_n().is_none()];
        for (left, contact) in left.iter_mut().zip(contacts) {
            let [a, b] = self.search.calibration(*contact);
            if let Some(factors) = Ldl::of_free(&a, free) {
                let [x, y, force] = factors.inverse();
                *left = CalibrationVariance {
                    position_m2: [form(&x, &b, &x), form(&x, &b, &y), form(&y, &b, &y)],
                    force_n2: form(&force, &b, &force),
                };
            }
        }
        left
    }

    fn linearised(&self, contacts: &[Contact]) -> Linearisation {
        let channels = self.search.live.len();
        let mut at = Linearisation {
            reading: vec![0.0; channels],
            derivatives: vec![vec![0.0; channels]; 3 * contacts.len()],
            variance: vec![0.0; channels],
        };
        for (contact, derivatives) in contacts.iter().zip(at.derivatives.chunks_mut(3)) {
            let own = self.search.linearised(*contact);
            for (s, [f, along, across, variance]) in own.take(channels).enumerate() {
                at.reading[s] += contact.force_n * f;
                at.variance[s] += variance;
                derivatives[0][s] = contact.force_n * along;
                derivatives[1][s] = contact.force_n * across;
                derivatives[2][s] = if self.known_force_n().is_none() { f } else { 0.0 };
            }
        }
        at
    }

    fn single_estimate(&self, reading: &[f64]) -> Estimate {
        self.locator.locate(reading)
    }

    fn checks(&self) -> Option<&LocatorChecks> {
        Some(&self.checks)
    }

    fn extent(&self) -> Extent {
        let [length_m, width_m] = self.search.size_m;
        Extent::plane(length_m, width_m).expect("a table is longer and wider than 0")
    }

    fn known_force_n(&self) -> Option<f64> {
        self.search.force.known_n()
    }

    fn force_range(&self) -> Option<ForceRange> {
        self.known_force_n().is_none().then(|| self.locator.channels().force_range())?
    }

    fn most_contacts(&self) -> usize {
        1
    }
}

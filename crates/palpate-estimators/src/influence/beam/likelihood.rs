//! Likelihood of contacts on a line, for tracking.
//!
//! d whitened reading, f whitened influence, f′ its slope, W force, v variance of f from calibration; u the
//! first mode's force, φ its shape, g the reading per newton of it: χ² = Σ w·(d − Σ W·f − (u − Σ W·φ)·g)²,
//! w = 1/(1 + Σ W²·v).
//!
//! As f(x) = Σ_k s_k·φ_k(x)/(m_k·ω_k²), with s_k the reading of mode k, g = s₁/(m₁·ω₁²) = (2/l)·∫f·φ dx.

use super::locator::BeamLocator;
use super::multi_contact::{contact_fit, first_mode};
use super::table::InfluenceTable;
use crate::fit::Locate;
use crate::force_prior::ForceRange;
use crate::likelihood::{
    CalibrationVariance, ContactFit, Geometry, Likelihood, LineLikelihood, Linearisation, LocatorChecks,
};
use palpate_core::Estimate;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::surface::Extent;
use palpate_numerics::simd::Array;
use palpate_numerics::small::{Ldl, add_outer, form};

/// Likelihood of a [`BeamLocator`].
#[derive(Clone, Debug, PartialEq)]
pub struct BeamLikelihood {
    locator: BeamLocator,
    /// g of the channels in use.
    first_mode: Vec<f64>,
    checks: LocatorChecks,
}

impl BeamLikelihood {
    /// Builds the likelihood of the channels in use.
    pub fn new(locator: &BeamLocator) -> Self {
        let table = &locator.search().table;
        let first_mode = (0..table.sensors).map(|s| share_of_first_mode(table, s)).collect();
        Self { locator: locator.clone(), first_mode, checks: LocatorChecks::default() }
    }

    /// Replaces the checks of the locator.
    #[must_use]
    pub fn with_checks(self, checks: LocatorChecks) -> Self {
        Self { checks, ..self }
    }

    fn table(&self) -> &InfluenceTable {
        &self.locator.search().table
    }

    fn fit<const C: usize, const K: usize>(
        &self,
        whitened: &[f64],
        contacts: [Contact; C],
        mode_n: Option<f64>,
    ) -> ContactFit<K> {
        let mode = mode_n.map(|mode_n| (mode_n, self.first_mode.as_slice()));
        contact_fit(self.table(), whitened, contacts, |contact| self.scale(contact), mode)
    }

    /// Factor of v; forces below the calibration's are not more certain.
    fn scale(&self, contact: Contact) -> f64 {
        contact.force_n.max(self.locator.channels().reference_force_n).powi(2)
    }
}

/// g of one sensor, by Simpson's rule over an odd number of nodes.
fn share_of_first_mode(table: &InfluenceTable, sensor: usize) -> f64 {
    let last = table.nodes() - 1;
    let weight = |node: usize| match node {
        0 => 1.0,
        node if node == last => 1.0,
        node if node % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let at =
        |node: usize| (std::f64::consts::PI * node as f64 / last as f64).sin() * table.at_node(node)[sensor];
    let sum: f64 = (0..=last).map(|node| weight(node) * at(node)).sum();
    2.0 / (3.0 * last as f64) * sum
}

impl LineLikelihood for BeamLikelihood {
    fn fit_one(&self, whitened: &[f64], contact: Contact, mode_n: Option<f64>) -> ContactFit<3> {
        self.fit(whitened, [contact], mode_n)
    }

    fn fit_two(&self, whitened: &[f64], contacts: [Contact; 2], mode_n: Option<f64>) -> ContactFit<5> {
        self.fit(whitened, contacts, mode_n)
    }

    fn first_mode(&self, x_m: f64) -> [f64; 2] {
        first_mode(self.table().length_m, x_m)
    }
}

impl Likelihood for BeamLikelihood {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Line(self)
    }

    fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>) {
        let search = self.locator.search();
        whitened.resize(8 * search.groups(), 0.0);
        search.whiten::<Array<f64, 8, false>>(reading, whitened.as_chunks_mut().0);
        whitened.truncate(search.live.len());
    }

    fn fit_untouched(&self, whitened: &[f64], mode_n: f64) -> ContactFit<1> {
        self.fit(whitened, [], Some(mode_n))
    }

    fn signal(&self, contact: Contact) -> f64 {
        let cell = self.table().cell(contact.position.x_m);
        let own = |s| contact.force_n * self.table().value_and_slope(&cell, s).0;
        (0..self.table().sensors).map(|s| own(s).powi(2)).sum()
    }

    /// A⁻¹·B·A⁻¹, A = Σ w·j·jᵀ, B = Σ (w·j)·var·(w·j)ᵀ, j the derivatives in balance, var = Σ W²·v.
    fn calibration_variance(&self, contacts: &[Contact]) -> [CalibrationVariance; 2] {
        let force_is_free = self.known_force_n().is_none();
        let cells: Vec<_> = contacts.iter().map(|contact| self.table().cell(contact.position.x_m)).collect();
        let (mut a, mut b) = ([[0.0; 4]; 4], [[0.0; 4]; 4]);
        let mut j = [0.0; 4];
        for s in 0..self.table().sensors {
            let mut variance = 0.0;
            for (k, (contact, cell)) in contacts.iter().zip(&cells).enumerate() {
                let (f, slope) = self.table().value_and_slope(cell, s);
                (j[2 * k], j[2 * k + 1]) = (contact.force_n * slope, f);
                variance += self.scale(*contact) * self.table().variances_near(contact.position.x_m)[s];
            }
            let weight = 1.0 / (1.0 + variance);
            add_outer(&mut a, weight, &j);
            add_outer(&mut b, weight * weight * variance, &j);
        }
        let mut left = [CalibrationVariance::default(); 2];
        let free = std::array::from_fn(|i| i / 2 < contacts.len() && (i % 2 == 0 || force_is_free));
        if let Some(factors) = Ldl::of_free(&a, free) {
            let inverse = factors.inverse();
            for (left, place) in left.iter_mut().zip([0, 2]) {
                left.position_m2[0] = form(&inverse[place], &b, &inverse[place]);
                left.force_n2 = form(&inverse[place + 1], &b, &inverse[place + 1]);
            }
        }
        left
    }

    fn linearised(&self, contacts: &[Contact]) -> Linearisation {
        let sensors = self.table().sensors;
        let force_is_free = self.known_force_n().is_none();
        let mut at = Linearisation {
            reading: vec![0.0; sensors],
            derivatives: vec![vec![0.0; sensors]; 3 * contacts.len()],
            variance: vec![0.0; sensors],
        };
        for (contact, derivatives) in contacts.iter().zip(at.derivatives.chunks_mut(3)) {
            let cell = self.table().cell(contact.position.x_m);
            let variances = self.table().variances_near(contact.position.x_m);
            for s in 0..sensors {
                let (f, slope) = self.table().value_and_slope(&cell, s);
                at.reading[s] += contact.force_n * f;
                at.variance[s] += self.scale(*contact) * variances[s];
                derivatives[0][s] = contact.force_n * slope;
                derivatives[2][s] = if force_is_free { f } else { 0.0 };
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
        Extent::line(self.table().length_m).expect("a table is longer than 0")
    }

    fn known_force_n(&self) -> Option<f64> {
        self.locator.force().known_n()
    }

    fn force_range(&self) -> Option<ForceRange> {
        self.known_force_n().is_none().then(|| self.locator.channels().force_range())?
    }

    fn most_contacts(&self) -> usize {
        self.locator.contacts()
    }
}

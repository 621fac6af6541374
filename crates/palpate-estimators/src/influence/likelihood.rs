//! How well contacts explain a reading, by the table of influence functions.
//!
//! Symbols: d whitened reading (less offsets, over the noise), f whitened influence and f′ its slope, W force, v variance
//! of f from calibration; u the first mode's force, φ its shape and g what the sensors read per newton of it.
//! χ² = Σ w·(d − Σ W·f − (u − Σ W·φ)·g)², with w = 1/(1 + Σ W²·v), as where a single reading is located.
//!
//! g needs no mechanics: a sensor's influence function is f(x) = Σ_k s_k·φ_k(x)/(m_k·ω_k²), with s_k what it reads of mode k,
//! so g = s₁/(m₁·ω₁²) = (2/l)·∫f·φ dx is the share of the first mode in the table itself.

use std::f64::consts::PI;

use super::belief::ForceBelief;
use super::locator::BeamLocator;
use super::table::InfluenceTable;
use crate::fit::Locate;
use crate::likelihood::{ContactFit, Geometry, Likelihood, LineLikelihood};
use ndarray::Array2;
use palpate_core::Estimate;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::surface::Extent;
use palpate_numerics::Cholesky;

/// The likelihood of a [`BeamLocator`], ready to be asked often.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamLikelihood {
    locator: BeamLocator,
    /// The channels in use.
    live: Vec<usize>,
    /// Of those: the offset.
    offsets: Vec<f64>,
    /// Of those: one over the noise.
    inverse_sd: Vec<f64>,
    /// f, f′ and v of those.
    table: InfluenceTable,
    /// g of those.
    first_mode: Vec<f64>,
}

impl BeamLikelihood {
    /// Whitens the table of a locator, without the channels that it leaves out.
    pub fn new(locator: &BeamLocator) -> Self {
        let (parts, dead) = locator.parts();
        let live: Vec<usize> = (0..parts.table.sensors).filter(|s| !dead[*s]).collect();
        let offsets = live.iter().map(|s| parts.offsets[*s]).collect();
        let inverse_sd: Vec<f64> = live.iter().map(|s| 1.0 / parts.noise_sd[*s]).collect();
        let table = parts.table.whitened(&live, &inverse_sd);
        let first_mode = (0..live.len()).map(|s| share_of_first_mode(&table, s)).collect();
        Self { locator: locator.clone(), live, offsets, inverse_sd, table, first_mode }
    }

    fn fit<const C: usize, const K: usize>(
        &self,
        whitened: &[f64],
        contacts: [Contact; C],
        mode_n: Option<f64>,
    ) -> ContactFit<K> {
        let at = contacts.map(|contact| {
            let x_m = contact.position.x_m;
            (contact.force_n, self.table.cell(x_m), self.table.variances_near(x_m), self.scale(contact))
        });
        let shapes = contacts.map(|contact| self.first_mode(contact.position.x_m));
        let balance_n: f64 =
            contacts.iter().zip(shapes).map(|(contact, [shape, _])| contact.force_n * shape).sum();
        let departure_n = mode_n.map_or(0.0, |mode_n| mode_n - balance_n);
        let mut fit = ContactFit::NOTHING;
        for (s, (d, g)) in whitened.iter().zip(&self.first_mode).enumerate() {
            let g = if mode_n.is_some() { *g } else { 0.0 };
            let mut residual = d - departure_n * g;
            let mut variance = 1.0;
            let mut derivatives = [0.0; K];
            derivatives[0] = g;
            for k in 0..C {
                let (force_n, cell, variances, scale) = &at[k];
                let (f, slope) = self.table.value_and_slope(cell, s);
                residual -= force_n * f;
                variance += scale * variances[s];
                derivatives[1 + 2 * k] = force_n * (slope - shapes[k][1] * g);
                derivatives[2 + 2 * k] = f - shapes[k][0] * g;
            }
            fit.add(residual, &derivatives, 1.0 / variance);
        }
        fit.mirrored()
    }

    /// By what v is multiplied; a force that is hardly there was not calibrated better for that.
    fn scale(&self, contact: Contact) -> f64 {
        contact.force_n.max(self.locator.reference_force_n()).powi(2)
    }
}

/// g of one sensor, by Simpson's rule over the nodes, whose number is odd.
fn share_of_first_mode(table: &InfluenceTable, sensor: usize) -> f64 {
    let last = table.nodes() - 1;
    let weight = |node: usize| match node {
        0 => 1.0,
        node if node == last => 1.0,
        node if node % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let at = |node: usize| (PI * node as f64 / last as f64).sin() * table.at_node(node)[sensor];
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
        let wave = PI / self.table.length_m;
        let (sin, cos) = (wave * x_m).sin_cos();
        [sin, wave * cos]
    }
}

impl Likelihood for BeamLikelihood {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Line(self)
    }

    fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>) {
        whitened.clear();
        let channels = self.live.iter().zip(self.offsets.iter().zip(&self.inverse_sd));
        whitened.extend(channels.map(|(s, (offset, inverse))| (reading[*s] - offset) * inverse));
    }

    fn fit_nothing(&self, whitened: &[f64], mode_n: f64) -> ContactFit<1> {
        self.fit(whitened, [], Some(mode_n))
    }

    fn signal(&self, contact: Contact) -> f64 {
        let cell = self.table.cell(contact.position.x_m);
        let own = |s| contact.force_n * self.table.value_and_slope(&cell, s).0;
        (0..self.table.sensors).map(|s| own(s).powi(2)).sum()
    }

    /// A⁻¹·B·A⁻¹ with A = Σ w·j·jᵀ and B = Σ (w·j)·var·(w·j)ᵀ, j the derivatives by places and unknown forces in balance
    /// and var = Σ W²·v.
    fn calibration_m2(&self, contacts: &[Contact]) -> [[f64; 3]; 2] {
        let free = if self.known_force_n().is_some() { 1 } else { 2 };
        let unknowns = free * contacts.len();
        let cells: Vec<_> = contacts.iter().map(|contact| self.table.cell(contact.position.x_m)).collect();
        let (mut a, mut b) = (Array2::zeros((unknowns, unknowns)), Array2::zeros((unknowns, unknowns)));
        let mut j = [0.0; 4];
        for s in 0..self.table.sensors {
            let mut variance = 0.0;
            for (k, (contact, cell)) in contacts.iter().zip(&cells).enumerate() {
                let (f, slope) = self.table.value_and_slope(cell, s);
                j[free * k] = contact.force_n * slope;
                if free == 2 {
                    j[free * k + 1] = f;
                }
                variance += self.scale(*contact) * self.table.variances_near(contact.position.x_m)[s];
            }
            let weight = 1.0 / (1.0 + variance);
            for p in 0..unknowns {
                for q in 0..unknowns {
                    a[[p, q]] += weight * j[p] * j[q];
                    b[[p, q]] += weight * weight * variance * j[p] * j[q];
                }
            }
        }
        let mut left = [[0.0; 3]; 2];
        if let Ok(cholesky) = Cholesky::factor(a) {
            let inverse = cholesky.inverse();
            let spread = inverse.dot(&b).dot(&inverse);
            left.iter_mut()
                .zip(0..contacts.len())
                .for_each(|(left, k)| left[0] = spread[[free * k, free * k]]);
        }
        left
    }

    fn locate_alone(&self, reading: &[f64]) -> Estimate {
        self.locator.locate(reading)
    }

    fn extent(&self) -> Extent {
        Extent { length_m: self.table.length_m, width_m: None }
    }

    fn known_force_n(&self) -> Option<f64> {
        match self.locator.force() {
            ForceBelief::Known(force_n) => Some(force_n),
            ForceBelief::Unknown | ForceBelief::Normal { .. } => None,
        }
    }

    fn most_contacts(&self) -> usize {
        self.locator.contacts()
    }
}

//! How well a contact explains a reading, by the table of influence functions.
//!
//! Symbols: d whitened reading (less offsets, over the noise), f whitened influence and f′ its slope, W force, v variance
//! of f from calibration. χ² = Σ w·(d − W·f)², with w = 1/(1 + W²·v), as where a single reading is located.

use super::belief::ForceBelief;
use super::locator::BeamLocator;
use super::table::InfluenceTable;
use crate::contact::Contact;
use crate::method::{ContactFit, Likelihood, Locate};
use palpate_core::Estimate;

/// The likelihood of a [`BeamLocator`], ready to be asked often.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamLikelihood {
    locator: BeamLocator,
    /// The channels in use.
    live: Vec<usize>,
    /// Of those: offset and one over the noise.
    scaling: Vec<(f64, f64)>,
    /// f, f′ and v of those.
    table: InfluenceTable,
    /// f″ at the nodes, from f′ at their neighbours.
    curvatures: Vec<f64>,
}

impl BeamLikelihood {
    /// Whitens the table of a locator, without the channels that it leaves out.
    pub fn new(locator: &BeamLocator) -> Self {
        let (parts, dead) = locator.parts();
        let live: Vec<usize> = (0..parts.table.sensors).filter(|s| !dead[*s]).collect();
        let scaling: Vec<(f64, f64)> =
            live.iter().map(|s| (parts.offsets[*s], 1.0 / parts.noise_sd[*s])).collect();
        let whitened = |values: &[f64], power: i32| -> Vec<f64> {
            let rows = values.chunks_exact(parts.table.sensors);
            rows.flat_map(|row| {
                live.iter().zip(&scaling).map(|(s, (_, inverse))| row[*s] * inverse.powi(power))
            })
            .collect()
        };
        let table = InfluenceTable {
            sensors: live.len(),
            length_m: parts.table.length_m,
            values: whitened(&parts.table.values, 1),
            slopes: whitened(&parts.table.slopes, 1),
            variances: whitened(&parts.table.variances, 2),
        };
        let curvatures = curvatures(&table);
        Self { locator: locator.clone(), live, scaling, table, curvatures }
    }
}

/// f″ at every node, by central differences of f′, and one-sided at the ends.
fn curvatures(table: &InfluenceTable) -> Vec<f64> {
    let (s, last) = (table.sensors, table.nodes() - 1);
    let at = |node: usize| {
        let (left, right) = (node.saturating_sub(1), (node + 1).min(last));
        let run_m = table.node_m(right) - table.node_m(left);
        (0..s).map(move |i| (table.slopes[right * s + i] - table.slopes[left * s + i]) / run_m)
    };
    (0..=last).flat_map(at).collect()
}

impl Likelihood for BeamLikelihood {
    fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>) -> f64 {
        whitened.clear();
        let channels = self.live.iter().zip(&self.scaling);
        whitened.extend(channels.map(|(s, (offset, inverse))| (reading[*s] - offset) * inverse));
        whitened.iter().map(|d| d * d).sum()
    }

    fn fit_at(&self, whitened: &[f64], contact: Contact, inertia_m2: f64) -> ContactFit {
        let (x_m, force_n) = (contact.position.x_m, contact.force_n);
        let variances = self.table.variances_near(x_m);
        let scale = force_n.max(self.locator.reference_force_n()).powi(2);
        let cell = self.table.cell(x_m);
        let left = cell.node as usize;
        let nearer_right = x_m - self.table.node_m(left) > 0.5 * self.table.spacing_m();
        let node = left + usize::from(nearer_right);
        let curvatures = &self.curvatures[node * self.table.sensors..];
        let mut fit = ContactFit::default();
        let mut uncertain = 0.0;
        self.table.for_each(cell, |s, f, slope| {
            let f = f - inertia_m2 * curvatures[s];
            let weight = 1.0 / (1.0 + scale * variances[s]);
            let (residual, g) = (whitened[s] - force_n * f, force_n * slope);
            fit.misfit += weight * residual * residual;
            fit.pull[0] += weight * residual * g;
            fit.pull[1] += weight * residual * f;
            fit.information[0] += weight * g * g;
            fit.information[1] += weight * g * f;
            fit.information[2] += weight * f * f;
            uncertain += (weight * g).powi(2) * scale * variances[s];
        });
        fit.calibration_m2 = uncertain / fit.information[0].powi(2).max(f64::MIN_POSITIVE);
        fit
    }

    fn locate_alone(&self, reading: &[f64]) -> Estimate {
        self.locator.locate(reading)
    }

    fn length_m(&self) -> f64 {
        self.table.length_m
    }

    fn known_force_n(&self) -> Option<f64> {
        match self.locator.force() {
            ForceBelief::Known(force_n) => Some(force_n),
            ForceBelief::Unknown | ForceBelief::Normal { .. } => None,
        }
    }
}

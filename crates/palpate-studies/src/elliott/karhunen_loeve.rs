//! Karhunen–Loève reduction of readings.

use ndarray::{Array1, Array2};

use palpate_estimators::recording::{Recording, Row};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::SimulateError;
use palpate_mechanics::limit::Bound;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::ResponseGradient;
use palpate_numerics::symmetric_eigen;

/// Components Vᵀ·d of whitened readings d less their mean, with Σ d·dᵀ = V·Λ·Vᵀ and independent noise of
/// variance 1.
#[derive(Clone, Debug, PartialEq)]
pub struct KarhunenLoeve {
    /// m, in channel units.
    mean: Array1<f64>,
    inverse_sd: Array1<f64>,
    /// V, one component per column.
    components: Array2<f64>,
    /// Λ over the number of rows, in noise variances; descending.
    variances: Vec<f64>,
}

impl KarhunenLoeve {
    /// Computes the components of a recording with at least one row.
    pub fn new(recording: &Recording, noise_sd: &[f64]) -> Self {
        let (rows, channels) = (recording.rows.len(), recording.channels.len());
        let at = |(row, channel): (usize, usize)| recording.rows[row].reading[channel];
        let readings = Array2::from_shape_fn((rows, channels), at);
        let mean = readings.sum_axis(ndarray::Axis(0)) / rows as f64;
        let inverse_sd: Array1<f64> = noise_sd.iter().map(|sd| 1.0 / sd).collect();
        let whitened = (readings - &mean) * &inverse_sd;
        let (squares, components) = symmetric_eigen(&whitened.t().dot(&whitened));
        let variances = squares.iter().map(|square| square.max(0.0) / rows as f64).collect();
        Self { mean, inverse_sd, components, variances }
    }

    /// Share of the variance of each component, %.
    pub fn variance_percent(&self) -> Vec<f64> {
        let all: f64 = self.variances.iter().sum();
        self.variances.iter().map(|variance| 100.0 * variance / all).collect()
    }

    /// Returns the first `count` components of every reading.
    pub fn reduced(&self, recording: &Recording, count: usize) -> Recording {
        let row = |row: &Row| {
            let reading: Array1<f64> = row.reading.iter().copied().collect();
            Row {
                reading: self.first_components(&((reading - &self.mean) * &self.inverse_sd), count),
                ..row.clone()
            }
        };
        let layout = raw_layout(count);
        Recording {
            channels: layout.names(),
            kinds: layout.kinds(),
            rows: recording.rows.iter().map(row).collect(),
            provenance: recording.provenance.clone(),
        }
    }

    /// Cramér–Rao bound of the first `count` components at known force; `None` for an undetermined position.
    pub fn bound(&self, gradients: &[ResponseGradient], count: usize) -> Option<Bound> {
        let by = |k: usize| -> Array1<f64> {
            let slopes: Array1<f64> = gradients.iter().map(|gradient| gradient.position[k]).collect();
            slopes * &self.inverse_sd
        };
        Bound::of_columns([self.first_components(&by(0), count), self.first_components(&by(1), count)])
    }

    fn first_components(&self, whitened: &Array1<f64>, count: usize) -> Vec<f64> {
        let all = self.components.t().dot(whitened);
        all.iter().take(count).copied().collect()
    }
}

pub(super) fn raw_layout(count: usize) -> Layout {
    Layout::even(SensorKind::Raw, count, 0.0)
}

pub(super) fn without_model(setup: &Setup, layout: Layout) -> Result<Setup, SimulateError> {
    Ok(Setup::new(setup.surface().extent()).with_layout(layout)?.with_force(setup.force_n())?)
}

//! Choice of features and hyperparameters by log evidence and held-out errors.
//!
//! The evidence treats repeats as independent, and thus prefers functions that are flat about few positions.
//! Held-out errors reveal this but scatter, so only a margin overrides the evidence.

use ndarray::Array2;

use super::GaussianProcessError;
use crate::features::Features;
use crate::recording::{Fold, Recording};
use crate::thinning::thinned;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean;
use palpate_numerics::regression::{GaussianProcess, Hyperparameters, Regression, Samples};
use palpate_numerics::watch::Watch;

pub(super) struct Candidate {
    pub features: Features,
    pub hyperparameters: Hyperparameters,
    pub process: Option<GaussianProcess>,
}

pub(super) struct Points {
    coordinates: Array2<f64>,
    outputs_m: Array2<f64>,
}

impl Points {
    pub fn new(recording: &Recording, features: &Features, extent: Extent) -> Self {
        let rows = &recording.rows;
        let mut coordinates = Array2::zeros((rows.len(), features.len()));
        for (row, mut out) in rows.iter().zip(coordinates.outer_iter_mut()) {
            out.iter_mut().zip(features.apply(&row.reading)).for_each(|(out, feature)| *out = feature);
        }
        let outputs_m = Array2::from_shape_fn((rows.len(), extent.dimensions()), |(row, j)| {
            let position = rows[row].position;
            if j == 0 { position.x_m } else { position.y_m }
        });
        Self { coordinates, outputs_m }
    }

    pub fn samples(&self) -> Samples<'_> {
        Samples { coordinates: self.coordinates.view(), outputs: self.outputs_m.view(), noise_variance: None }
    }
}

pub(super) struct Selection<'a> {
    pub recording: &'a Recording,
    pub regression: Regression,
    pub extent: Extent,
    pub watch: Watch<'a>,
}

impl Selection<'_> {
    /// Greatest log evidence, unless another held-out error is less by [`MARGIN`].
    pub fn best(&self, mut candidates: Vec<Candidate>) -> Result<Candidate, GaussianProcessError> {
        const MOST: usize = 500;
        const MARGIN: f64 = 1.25;
        const FOLDS: usize = 5;
        if candidates.len() == 1 {
            return Ok(candidates.remove(0));
        }
        let evidence = |candidate: &Candidate| {
            candidate.process.as_ref().map_or(f64::NEG_INFINITY, GaussianProcess::log_evidence)
        };
        candidates.sort_by(|a, b| evidence(b).total_cmp(&evidence(a)));
        let few: Vec<usize> = thinned(self.recording.rows.len(), MOST).collect();
        let recording = self.recording.subset(&few);
        let folds = folds_between(&recording, FOLDS);
        let mut best = (f64::INFINITY, 0);
        for (i, candidate) in candidates.iter().enumerate() {
            let margin = if i == 0 { 1.0 } else { MARGIN };
            let error_m = margin * self.held_out_error_m(candidate, &recording, &folds)?;
            if error_m < best.0 {
                best = (error_m, i);
            }
        }
        Ok(candidates.swap_remove(best.1))
    }

    fn held_out_error_m(
        &self,
        Candidate { features, hyperparameters, .. }: &Candidate,
        recording: &Recording,
        folds: &[Fold],
    ) -> Result<f64, GaussianProcessError> {
        let mut errors_m = Vec::with_capacity(recording.rows.len());
        for fold in folds {
            self.watch.round()?;
            let points = Points::new(&recording.subset(&fold.training), features, self.extent);
            let process = self.regression.condition(points.samples(), hyperparameters, self.watch)?;
            for row in fold.held_out.iter().map(|i| &recording.rows[*i]) {
                let (means_m, _) = process.predict(&features.apply(&row.reading));
                let at_m = [row.position.x_m, row.position.y_m];
                let off_m = means_m.iter().zip(at_m).map(|(mean, at)| mean - at);
                errors_m.push(off_m.map(|off| off * off).sum::<f64>().sqrt());
            }
        }
        Ok(if errors_m.is_empty() { f64::INFINITY } else { mean(errors_m) })
    }
}

/// A position beyond all others of its fold stays in, as contacts rarely lie there.
pub(super) fn folds_between(recording: &Recording, most: usize) -> Vec<Fold> {
    let mut folds = recording.folds(recording.distinct_positions().len().min(most)).unwrap_or_default();
    for Fold { training, held_out } in &mut folds {
        let range = |along: fn(Position) -> f64| {
            let left = training.iter().map(|i| along(recording.rows[*i].position));
            left.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), at| (least.min(at), most.max(at)))
        };
        let (x_m, y_m) = (range(|position| position.x_m), range(|position| position.y_m));
        held_out.retain(|i| {
            let Position { x_m: x, y_m: y } = recording.rows[*i].position;
            (x_m.0..=x_m.1).contains(&x) && (y_m.0..=y_m.1).contains(&y)
        });
    }
    folds
}

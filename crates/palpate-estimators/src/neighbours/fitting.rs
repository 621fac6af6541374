//! Choosing how many neighbours to ask.

use super::search::{means, nearest};
use super::{Neighbour, NeighboursLocator};
use crate::features::{FeatureKind, Features, NoFeatures};
use crate::fit::{ChannelMismatch, Fit, FitTask};
use crate::held_out::HeldOutSpread;
use crate::recording::{Row, TooFewPositions};
use palpate_mechanics::contact::Position;
use palpate_numerics::watch::{Cancelled, Watch};

/// The k nearest neighbours, weighted by their inverse distance, in the space of the reading's [`Features`], each of which
/// has variance 1. Whitening by their full covariance would blow directions of mere noise up to the size of the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Neighbours {
    /// Most neighbours to try, at least 1. Of k = 1, 2, … that which is nearest to the training rows in the root mean square
    /// is taken, each row located by the rows at other positions.
    pub most: usize,
}

impl Default for Neighbours {
    fn default() -> Self {
        Self { most: 64 }
    }
}

/// Why neighbours cannot be asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NeighboursFitError {
    /// No position has another one to be judged by.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// Nothing to compare readings by.
    #[error(transparent)]
    Features(#[from] NoFeatures),
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for Neighbours {
    type Method = NeighboursLocator;
    type Error = NeighboursFitError;

    fn fit_method(&self, task: FitTask) -> Result<NeighboursLocator, NeighboursFitError> {
        let recording = task.recording;
        recording.check_distinct_positions(2)?;
        let features = Features::fit(FeatureKind::for_setup(task.setup), recording)?;
        let neighbour =
            |row: &Row| Neighbour { features: features.apply(&row.reading), position: row.position };
        let rows: Vec<Neighbour> = recording.rows.iter().map(neighbour).collect();
        let errors = held_out_errors(&rows, self.most.max(1), task.watch)?;
        let square = |errors: &Vec<[f64; 2]>| errors.iter().flatten().map(|e| e * e).sum::<f64>();
        let best = (0..errors.len()).min_by(|a, b| square(&errors[*a]).total_cmp(&square(&errors[*b])));
        let best = best.unwrap_or(0);
        Ok(NeighboursLocator {
            extent: task.setup.surface.extent(),
            features,
            count: best + 1,
            rows,
            force_n: task.setup.force_n,
            spread: errors.get(best).and_then(|errors| HeldOutSpread::of(errors)),
        })
    }
}

/// Errors (x, y) in metres of every row by 1, 2, … neighbours at other positions, up to `most` or as many as every row has.
fn held_out_errors(rows: &[Neighbour], most: usize, watch: Watch) -> Result<Vec<Vec<[f64; 2]>>, Cancelled> {
    let mut errors: Vec<Vec<[f64; 2]>> = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        watch.round()?;
        let others = rows.iter().filter(|other| other.position != row.position);
        let means = means(&nearest(others, &row.features, most));
        if i == 0 {
            errors = vec![Vec::with_capacity(rows.len()); means.len()];
        }
        errors.truncate(means.len());
        let off = |mean: &Position| [mean.x_m - row.position.x_m, mean.y_m - row.position.y_m];
        errors.iter_mut().zip(&means).for_each(|(errors, mean)| errors.push(off(mean)));
    }
    Ok(errors)
}

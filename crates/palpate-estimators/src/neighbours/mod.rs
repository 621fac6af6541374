//! k-nearest-neighbours estimator.

use serde::{Deserialize, Serialize};

use crate::features::{FeatureKind, Features, NoFeatures};
use crate::fit::{ChannelMismatch, Fit, FitTask, Locate, LocatorFault, NoCheck};
use crate::held_out::HeldOutErrors;
use crate::recording::{Row, TooFewPositions};
use crate::setup::Setup;
use crate::status::{NO_CONTACT, on_surface};
use crate::thinning::thinned;
use palpate_core::{ContactEstimate, Estimate};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};

/// k nearest neighbours weighted by inverse distance, over [`Features`]; whitening would amplify noise.
///
/// ```
/// use palpate_estimators::{arrangement::Training, fit::Fit, setup::Setup, neighbours::Neighbours};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(20), 0)?;
/// let estimate = Neighbours::default().fit(&setup, &presses)?.locate(&presses.rows[9].reading)?;
/// assert!((estimate.contact.position.x_m - mm(190.0)).abs() < mm(1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Neighbours {
    /// Upper limit of k, at least 1; k and features minimize held-out error.
    pub most: usize,
}

impl Default for Neighbours {
    fn default() -> Self {
        Self { most: 64 }
    }
}

/// Recording that neighbours do not suit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NeighboursFitError {
    /// Too few positions.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// Constant readings.
    #[error(transparent)]
    Features(#[from] NoFeatures),
    /// Channel mismatch.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for Neighbours {
    type Method = NeighboursLocator;
    type Error = NeighboursFitError;

    fn fit_method(&self, task: FitTask) -> Result<NeighboursLocator, NeighboursFitError> {
        let recording = task.recording;
        recording.check_distinct_positions(2)?;
        let mut best: Option<(f64, NeighboursLocator)> = None;
        for kind in FeatureKind::contenders(task.setup, recording) {
            let (square, fitted) = self.with_features(kind, task)?;
            if best.as_ref().is_none_or(|(least, _)| square < *least) {
                best = Some((square, fitted));
            }
        }
        let none = NoFeatures { channels: recording.channels.len(), rows: recording.rows.len() };
        // The list of contenders is never empty.
        Ok(best.ok_or(none)?.1)
    }
}

impl Neighbours {
    fn with_features(
        &self,
        kind: FeatureKind,
        task: FitTask,
    ) -> Result<(f64, NeighboursLocator), NeighboursFitError> {
        let recording = task.recording;
        let features = Features::fit(kind, recording)?;
        let neighbour =
            |row: &Row| Neighbour { features: features.apply(&row.reading), position: row.position };
        let rows: Vec<Neighbour> = recording.rows.iter().map(neighbour).collect();
        let errors = held_out_errors(&rows, self.most.max(1), task.watch)?;
        let square = |errors: &Vec<[f64; 2]>| errors.iter().flatten().map(|e| e * e).sum::<f64>();
        let best = (0..errors.len()).min_by(|a, b| square(&errors[*a]).total_cmp(&square(&errors[*b])));
        let best = best.unwrap_or(0);
        let locator = NeighboursLocator {
            extent: task.setup.surface().extent(),
            features,
            count: best + 1,
            rows,
            force_n: task.setup.force_n(),
            held_out_errors: errors.get(best).and_then(|errors| HeldOutErrors::from_errors(errors)),
        };
        Ok((errors.get(best).map_or(f64::INFINITY, square), locator))
    }
}

pub(crate) const MOST_HELD_OUT: usize = 4000;

fn held_out_errors(rows: &[Neighbour], most: usize, watch: Watch) -> Result<Vec<Vec<[f64; 2]>>, Cancelled> {
    let mut errors: Vec<Vec<[f64; 2]>> = Vec::new();
    let picked = thinned(rows.len(), MOST_HELD_OUT);
    for (i, row) in picked.clone().map(|i| &rows[i]).enumerate() {
        watch.counted("holding presses out", "presses", i, picked.len())?;
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

/// Fitted [`Neighbours`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NeighboursLocator {
    /// Surface.
    pub extent: Extent,
    /// Features.
    pub features: Features,
    /// Number k of neighbours.
    pub count: usize,
    /// Training rows.
    pub rows: Vec<Neighbour>,
    /// Known force.
    pub force_n: Option<f64>,
    /// Held-out errors.
    #[serde(rename = "spread")]
    pub held_out_errors: Option<HeldOutErrors>,
}

/// Training row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Neighbour {
    /// Features.
    pub features: Vec<f64>,
    /// Position of the contact.
    pub position: Position,
}

impl Locate for NeighboursLocator {
    type Check = NoCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        let found = nearest(self.rows.iter(), &self.features.apply(reading), self.count);
        let Some(position) = means(&found).pop() else {
            return NO_CONTACT;
        };
        let uncertainty = self.held_out_errors.map(|spread| spread.uncertainty(position));
        on_surface(ContactEstimate { position, force_n: self.force_n, uncertainty }, self.extent)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.features.check(setup.layout().len())?;
        let rows = self.rows.len() as f64;
        LocatorFault::check_numbers("count of rows", [rows], |n| n >= 1.0, "at least 1")?;
        let is_of_rows = |k: f64| (1.0..=rows).contains(&k);
        let bound = "at least 1 and at most the number of rows";
        LocatorFault::check_numbers("count of neighbours", [self.count as f64], is_of_rows, bound)?;
        for row in &self.rows {
            let (needed, found) = (self.features.len(), row.features.len());
            LocatorFault::check_count("features of a row", needed, found)?;
            LocatorFault::check_numbers("feature of a row", &row.features, |_| true, "a finite number")?;
            let place = [row.position.x_m, row.position.y_m];
            LocatorFault::check_numbers("position", place, |_| true, "a finite number")?;
        }
        self.held_out_errors.map_or(Ok(()), |spread| spread.check())
    }
}

/// Ties go to the earlier row.
fn nearest<'a>(
    rows: impl Iterator<Item = &'a Neighbour>,
    place: &[f64],
    most: usize,
) -> Vec<(f64, &'a Neighbour)> {
    let squared =
        |row: &Neighbour| row.features.iter().zip(place).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let mut found: Vec<(f64, &Neighbour)> = Vec::with_capacity(most + 1);
    for row in rows {
        let distance = squared(row);
        if found.len() == most && found.last().is_some_and(|(last, _)| distance >= *last) {
            continue;
        }
        let after = found.partition_point(|(other, _)| *other <= distance);
        found.insert(after, (distance, row));
        found.truncate(most);
    }
    found
}

/// Σ p_i/d_i / Σ 1/d_i; distance 0 outweighs all others.
fn means(found: &[(f64, &Neighbour)]) -> Vec<Position> {
    let exact = found.iter().take_while(|(squared, _)| *squared == 0.0).count();
    let (mut x, mut y, mut total) = (0.0, 0.0, 0.0);
    let mut means = Vec::with_capacity(found.len());
    for (i, (squared, row)) in found.iter().enumerate() {
        if exact == 0 || i < exact {
            let weight = if exact == 0 { 1.0 / squared.sqrt() } else { 1.0 };
            x += weight * row.position.x_m;
            y += weight * row.position.y_m;
            total += weight;
        }
        means.push(Position { x_m: x / total, y_m: y / total });
    }
    means
}

#[cfg(test)]
mod tests;

//! Presses of the regression, with repeats averaged.

use super::config::{MeasuredError, MeasuredInfluence, Scale};
use super::locator::NuisanceRole;
use crate::influence::calibration::{Averaging, CalibrationRows, Observation, groups};
use crate::recording::Recording;
use crate::setup::Setup;
use ndarray::Array2;
use palpate_numerics::mean;

/// Nuisance coordinates row by row: named columns, or a recorded force that the setup does not fix.
pub(super) fn nuisance_coordinates(
    setup: &Setup,
    recording: &Recording,
) -> Result<(NuisanceRole, Vec<Vec<f64>>), MeasuredError> {
    // Every row needs as many as the longest one.
    let all = |what, values: Vec<Vec<f64>>| {
        let most = values.iter().map(Vec::len).max().unwrap_or_default();
        match values.iter().position(|values| values.len() < most) {
            Some(i) => Err(MeasuredError::NuisanceMissing { what, row: i + 1 }),
            None => Ok(values),
        }
    };
    let rows = &recording.rows;
    if rows.iter().any(|row| !row.nuisances.is_empty()) {
        let named = all("nuisance coordinate", rows.iter().map(|row| row.nuisances.clone()).collect())?;
        return Ok((NuisanceRole::Other, named));
    }
    // A known or unrecorded force is not a coordinate.
    if setup.force_n().is_some() || rows.iter().all(|row| row.force_n.is_none()) {
        return Ok((NuisanceRole::None, vec![Vec::new(); rows.len()]));
    }
    let force = all("force", rows.iter().map(|row| row.force_n.into_iter().collect()).collect())?;
    Ok((NuisanceRole::Force, force))
}

/// Nuisance coordinate beyond the first, not estimated in use.
#[derive(Clone, Copy, Debug)]
pub(super) struct Further {
    index: usize,
    pub mean: f64,
    /// Greater than 0.
    pub variance: f64,
}

impl Further {
    /// Nuisance coordinates beyond the first that vary.
    fn of_rows(nuisances: &[Vec<f64>]) -> Vec<Self> {
        let count = nuisances.first().map_or(0, Vec::len);
        let of = |index: usize| {
            let values = || nuisances.iter().map(|row| row[index]);
            let center = mean(values());
            let variance = mean(values().map(|value| (value - center).powi(2)));
            let is_one = values().all(|value| value == nuisances[0][index]);
            (!is_one && variance > 0.0).then_some(Self { index, mean: center, variance })
        };
        (1..count).filter_map(of).collect()
    }
}

/// Averages of rows with equal coordinates.
///
/// Texture that repeats at a position is noise to interpolation; the scatter of repeats is noise of a
/// reading.
pub(super) struct Presses {
    pub readings: Scale,
    pub nuisance: Scale,
    /// Position, nuisance coordinate and further ones, n × d.
    pub coordinates: Array2<f64>,
    /// Mean scaled readings, n × m.
    pub means: Array2<f64>,
    /// Press of each row.
    pub places: Vec<usize>,
    pub outputs: Array2<f64>,
    pub has_nuisance: bool,
    pub further: Vec<Further>,
}

impl Presses {
    pub fn average(
        config: &MeasuredInfluence,
        setup: &Setup,
        recording: &Recording,
        nuisances: &[Vec<f64>],
    ) -> Result<Self, MeasuredError> {
        let rows = &recording.rows;
        let values = || rows.iter().flat_map(|row| row.reading.iter().copied());
        let readings = config.readings.unwrap_or_else(|| Scale::for_values(values()));
        let nuisance_values = || nuisances.iter().filter_map(|row| row.first().copied());
        let nuisance_scale = config.nuisance.unwrap_or_else(|| Scale::for_values(nuisance_values()));

        let channels = rows.first().map_or(0, |row| row.reading.len());
        let mut outputs = Array2::zeros((rows.len(), channels));
        for ((i, j), output) in outputs.indexed_iter_mut() {
            *output = scaled(readings, "a reading", i, rows[i].reading[j])?;
        }
        let extent = setup.surface().extent();
        let further = Further::of_rows(nuisances);
        let mut observations = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let mut position_m: Vec<f64> = extent.coordinates_m(row.position).collect();
            if let Some(first) = nuisances[i].first() {
                position_m.push(scaled(nuisance_scale, "the nuisance coordinate", i, *first)?);
            }
            position_m.extend(further.iter().map(|further| nuisances[i][further.index]));
            // −0 is 0.
            position_m.iter_mut().for_each(|value| *value += 0.0);
            let reading = outputs.row(i).to_slice().expect("a new array is contiguous");
            let (force_n, time, relative_variance) = (1.0, 0.0, 1.0);
            observations.push(Observation { position_m, force_n, time, row: i, relative_variance, reading });
        }
        let groups = groups(&observations, Averaging::ByFirstRow);
        let averaged = CalibrationRows::averaged(&observations, &groups, vec![0.0; channels]);
        let mut places = vec![0; rows.len()];
        for (place, group) in groups.iter().enumerate() {
            group.iter().for_each(|row| places[*row] = place);
        }
        let searched = averaged.positions_m.first().map_or(0, Vec::len);
        let coordinates =
            Array2::from_shape_fn((averaged.len(), searched), |(i, k)| averaged.positions_m[i][k]);
        let has_nuisance = nuisances.first().is_some_and(|row| !row.is_empty());
        Ok(Self {
            readings,
            nuisance: nuisance_scale,
            coordinates,
            means: averaged.means,
            places,
            outputs,
            has_nuisance,
            further,
        })
    }

    /// Number of table coordinates.
    pub fn searched(&self) -> usize {
        self.coordinates.ncols() - self.further.len()
    }

    pub fn dimensions(&self) -> usize {
        self.searched() - usize::from(self.has_nuisance)
    }
}

fn scaled(scale: Scale, what: &'static str, row: usize, value: f64) -> Result<f64, MeasuredError> {
    scale.scaled(value).ok_or(MeasuredError::NoLogarithm { what, row: row + 1, value })
}

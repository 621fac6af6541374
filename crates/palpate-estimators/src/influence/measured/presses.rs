//! Presses of the regression, with repeats averaged.

use super::config::{MeasuredError, MeasuredInfluence, Scale};
use super::locator::NuisanceRole;
use crate::recording::Recording;
use crate::setup::Setup;
use ndarray::Array2;
use palpate_numerics::mean;
use std::collections::HashMap;

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
        let mut distinct: Vec<Vec<f64>> = Vec::new();
        let mut known: HashMap<Vec<u64>, usize> = HashMap::new();
        let mut places = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let mut at: Vec<f64> = extent.coordinates_m(row.position).collect();
            if let Some(first) = nuisances[i].first() {
                at.push(scaled(nuisance_scale, "the nuisance coordinate", i, *first)?);
            }
            at.extend(further.iter().map(|further| nuisances[i][further.index]));
            let bits = at.iter().map(|value| (value + 0.0).to_bits()).collect();
            places.push(*known.entry(bits).or_insert_with(|| {
                distinct.push(at);
                distinct.len() - 1
            }));
        }
        let coordinates =
            Array2::from_shape_fn((distinct.len(), distinct.first().map_or(0, Vec::len)), |(i, k)| {
                distinct[i][k]
            });
        let mut means = Array2::<f64>::zeros((distinct.len(), channels));
        let mut counts = vec![0.0; distinct.len()];
        for (place, output) in places.iter().zip(outputs.outer_iter()) {
            means.row_mut(*place).scaled_add(1.0, &output);
            counts[*place] += 1.0;
        }
        for (mut mean, count) in means.outer_iter_mut().zip(counts) {
            mean /= count;
        }
        let has_nuisance = nuisances.first().is_some_and(|row| !row.is_empty());
        Ok(Self {
            readings,
            nuisance: nuisance_scale,
            coordinates,
            means,
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

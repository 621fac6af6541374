//! The recording as the regression sees it: repeats of a press averaged, readings and nuisance coordinate on their scales.

use super::config::{MeasuredError, MeasuredInfluence, Scale};
use super::locator::NuisanceRole;
use crate::recording::Recording;
use crate::setup::Setup;
use ndarray::Array2;
use std::collections::HashMap;

/// Coordinate that shapes the readings besides the position, row by row: the named column, or a force that is not always the same.
pub(super) fn nuisance_coordinate(
    setup: &Setup,
    recording: &Recording,
) -> Result<(NuisanceRole, Option<Vec<f64>>), MeasuredError> {
    let all = |what, values: Vec<Option<f64>>| {
        if values.iter().all(Option::is_none) {
            return Ok(None);
        }
        let known = values
            .iter()
            .enumerate()
            .map(|(i, value)| value.ok_or(MeasuredError::NuisanceMissing { what, row: i + 1 }));
        known.collect::<Result<Vec<f64>, _>>().map(Some)
    };
    let named = all("nuisance coordinate", recording.rows.iter().map(|row| row.nuisance).collect())?;
    if named.is_some() {
        return Ok((NuisanceRole::Other, named));
    }
    // A force that is known, or always the same, shapes nothing.
    if setup.force_n().is_some() {
        return Ok((NuisanceRole::None, None));
    }
    let force = all("force", recording.rows.iter().map(|row| row.force_n).collect())?;
    Ok((if force.is_some() { NuisanceRole::Force } else { NuisanceRole::None }, force))
}

/// The recording as the process sees it: repeats of a press, at the same position and nuisance coordinate, are one.
///
/// Texture of the surface that repeats itself at a place but is not smooth, as a press a little off, is noise to
/// interpolation, and its process finds it; how repeats scatter about their mean is the noise of a reading.
pub(super) struct Presses {
    pub readings: Scale,
    pub nuisance: Scale,
    /// Position along, across where the surface has a width, and the nuisance coordinate where there is one: n×d.
    pub coordinates: Array2<f64>,
    /// Mean scaled readings, n×m.
    pub means: Array2<f64>,
    /// To which press each row belongs.
    pub places: Vec<usize>,
    /// Scaled readings, row by row.
    pub outputs: Array2<f64>,
    pub has_nuisance: bool,
}

impl Presses {
    pub fn average(
        config: &MeasuredInfluence,
        setup: &Setup,
        recording: &Recording,
        nuisance: Option<&[f64]>,
    ) -> Result<Self, MeasuredError> {
        let rows = &recording.rows;
        let values = || rows.iter().flat_map(|row| row.reading.iter().copied());
        let readings = config.readings.unwrap_or_else(|| Scale::for_values(values()));
        let nuisance_values = || nuisance.unwrap_or_default().iter().copied();
        let nuisance_scale = config.nuisance.unwrap_or_else(|| Scale::for_values(nuisance_values()));

        let channels = rows.first().map_or(0, |row| row.reading.len());
        let mut outputs = Array2::zeros((rows.len(), channels));
        for ((i, j), output) in outputs.indexed_iter_mut() {
            *output = scaled(readings, "a reading", i, rows[i].reading[j])?;
        }
        let extent = setup.surface().extent();
        let mut distinct: Vec<Vec<f64>> = Vec::new();
        let mut known: HashMap<Vec<u64>, usize> = HashMap::new();
        let mut places = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let mut at: Vec<f64> = extent.coordinates_m(row.position).collect();
            if let Some(nuisance) = nuisance {
                at.push(scaled(nuisance_scale, "the nuisance coordinate", i, nuisance[i])?);
            }
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
        let has_nuisance = nuisance.is_some();
        Ok(Self { readings, nuisance: nuisance_scale, coordinates, means, places, outputs, has_nuisance })
    }
}

fn scaled(scale: Scale, what: &'static str, row: usize, value: f64) -> Result<f64, MeasuredError> {
    scale.scaled(value).ok_or(MeasuredError::NoLogarithm { what, row: row + 1, value })
}

//! Posterior of the influence functions given the calibration rows.
//!
//! Rows of one place and force are averaged. Sensors of one kind share the hyperparameters, which maximize
//! the log evidence of the Gaussian processes of [`super::prior`].

use super::calibration::{Averaging, CalibrationRows, Observation, groups};
use super::channels::Channels;
use super::config::{Influence, InfluenceFitError, InfluenceSource};
use super::prior::{Hyperparameters, Mean, Parts, Prior, Remainders};
use super::untouched_rows::UntouchedRows;
use crate::fit::FitTask;
use crate::recording::{Recording, Row, is_one_force};
use crate::thinning::thinned;
use ndarray::{Array1, Array2, ArrayView1};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::{Extent, Surface};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{Cholesky, NotPositiveDefinite, mean};

pub(super) struct LearntInfluence<'s, 'a> {
    posterior: Posterior<'s, 'a>,
    prior: &'s Prior<'a>,
    remainders: &'s Remainders,
    places: &'s [Position],
}

impl LearntInfluence<'_, '_> {
    /// Posterior mean of the reading per newton.
    pub fn mean(&self, place: usize) -> f64 {
        let parts = self.prior.parts(self.places[place]);
        self.posterior.mean(parts, &self.remainders.places.row(place))
    }

    pub fn variance(&self, place: usize) -> f64 {
        let parts = self.prior.parts(self.places[place]);
        let (row, own) = (self.remainders.places.row(place), self.remainders.own[place]);
        self.posterior.variance(parts, &row, own)
    }
}

/// Nodes filled per check of the watch.
pub(super) const NODES_EACH: usize = 16;

/// Consumer of a sensor's index and influence function.
pub(super) type Take<'t> = dyn FnMut(usize, &LearntInfluence) -> Result<(), Cancelled> + 't;

/// Learns the influence functions of all enabled sensors at `places`.
pub(super) fn learn(
    Influence { source, false_alarm_rate, .. }: Influence,
    task: FitTask,
    places: &[Position],
    take: &mut Take,
) -> Result<Channels, InfluenceFitError> {
    let surface = task.setup.surface().model().ok_or(InfluenceFitError::NoModel)?;
    let layout = task.setup.layout();
    check_sensors(layout)?;
    let untouched = UntouchedRows::of_recording(task.recording);
    let rows = calibration_rows(task.recording, surface.extent(), untouched.as_ref())?;
    let needed = match (source, surface.extent().dimensions()) {
        (InfluenceSource::Recording, 1) => 3,
        // A quadratic surface has six coefficients.
        (InfluenceSource::Recording, _) => 6,
        _ => 1,
    };
    let found = rows.positions_m().len();
    if found < needed {
        return Err(InfluenceFitError::TooFewPositions { needed, found });
    }
    let mut channels = Channels {
        offsets: untouched.map_or_else(|| vec![0.0; layout.len()], |untouched| untouched.mean),
        noise_sd: vec![1.0; layout.len()],
        dead: layout.sensors().iter().map(|sensor| sensor.channel.disabled).collect(),
        reference_force_n: mean_force_n(&rows),
        greatest_force_n: task.setup.greatest_force_n(),
        least_force_n: task.setup.force_range().map(|range| range.ends_n().0),
        false_alarm_rate,
    };
    let learning = Learning { source, surface, layout, rows: &rows, places };
    for kind in SensorKind::ALL {
        let is_meant = |s: &usize| {
            let sensor = &layout.sensors()[*s];
            sensor.kind == kind && !sensor.channel.disabled
        };
        let living: Vec<usize> = (0..layout.len()).filter(is_meant).collect();
        if living.is_empty() {
            continue;
        }
        learning.learn_kind(kind, &living, task.watch, &mut channels, take)?;
    }
    Ok(channels)
}

fn check_sensors(layout: &Layout) -> Result<(), InfluenceFitError> {
    if let Some(raw) = layout.sensors().iter().position(|sensor| sensor.kind == SensorKind::Raw) {
        return Err(InfluenceFitError::RawSensor { sensor: raw + 1 });
    }
    if layout.sensors().iter().all(|sensor| sensor.channel.disabled) {
        return Err(InfluenceFitError::AllDead { sensors: layout.len() });
    }
    Ok(())
}

struct Learning<'a> {
    source: InfluenceSource,
    surface: &'a dyn Surface,
    layout: &'a Layout,
    rows: &'a CalibrationRows,
    places: &'a [Position],
}

impl<'a> Learning<'a> {
    fn learn_kind(
        &self,
        kind: SensorKind,
        living: &[usize],
        watch: Watch,
        channels: &mut Channels,
        take: &mut Take,
    ) -> Result<(), InfluenceFitError> {
        let Self { source, surface, layout, rows, places } = *self;
        let mean = if source == InfluenceSource::Recording { Mean::Zero } else { Mean::Model };
        let pressed: Vec<Position> = (0..rows.len()).map(|row| rows.position(row)).collect();
        let remainders = Remainders::new(surface, kind, &pressed, places, watch)?;
        let prior = |s: &usize| Prior::new(surface, &layout.sensors()[*s], mean, watch);
        let priors: Vec<Prior<'a>> = living.iter().map(prior).collect::<Result<_, _>>()?;
        let with = |(prior, &s): (&Prior<'a>, &usize), kept: &[usize]| {
            let noise = noise_variance(rows, layout, s);
            SensorRows::new(prior.clone(), rows, s, noise, kept, &remainders.presses)
        };
        let all: Vec<usize> = (0..pressed.len()).collect();
        let few = rows_of_search(rows);
        let searched: Vec<SensorRows> = priors.iter().zip(living).map(|sensor| with(sensor, &few)).collect();
        let noise_is_measured = living.iter().all(|s| noise_variance(rows, layout, *s).is_some());
        // Rows of one force confound offset and influence of a reaction: no support makes it 0 everywhere.
        let touched = rows.touched();
        let has_one_force = is_one_force(touched.iter().map(|row| rows.force_n[*row]));
        let offset_is_open = has_one_force && touched.len() == rows.len();
        let is_reaction_alone = mean == Mean::Zero && kind == SensorKind::Reaction && offset_is_open;
        let identifiable = Identifiability { noise: noise_is_measured, offset: is_reaction_alone };
        let mut hyper = most_probable(&searched, mean, surface.length_m(), identifiable, watch)?;
        if source == InfluenceSource::Mechanics {
            hyper = Hyperparameters { noise: hyper.noise, ..Hyperparameters::NONE };
        }
        for (done, (prior, &s)) in priors.iter().zip(living).enumerate() {
            watch.counted("learning what sensors read", "sensors", done, living.len())?;
            let sensor = with((prior, &s), &all);
            let posterior = sensor
                .posterior(hyper)
                .map_err(|problem| InfluenceFitError::Singular { sensor: s + 1, problem })?;
            channels.offsets[s] += posterior.offset();
            channels.noise_sd[s] = sensor.noise_variance(&hyper).sqrt();
            take(s, &LearntInfluence { posterior, prior, remainders: &remainders, places })?;
        }
        Ok(())
    }
}

/// Weight of the rig's stated noise, in readings.
const STATED_FREEDOM: f64 = 20.0;

/// Averages and thins the rows of a recording; untouched rows become the last one, of force 0.
///
/// # Errors
/// [`InfluenceFitError::NoForce`] for a row without a force greater than 0.
fn calibration_rows(
    recording: &Recording,
    extent: Extent,
    untouched: Option<&UntouchedRows>,
) -> Result<CalibrationRows, InfluenceFitError> {
    let rows: Vec<(usize, Row, f64)> = match untouched {
        Some(untouched) => untouched.tared_rows(recording),
        None => recording.rows.iter().enumerate().map(|(i, row)| (i, row.clone(), 1.0)).collect(),
    };
    let mut observations = Vec::with_capacity(rows.len());
    for (i, row, relative_variance) in &rows {
        let force_n = row.force_n.filter(|force_n| *force_n > 0.0);
        observations.push(Observation {
            position_m: extent.coordinates_m(row.position).collect(),
            force_n: force_n.ok_or(InfluenceFitError::NoForce { row: i + 1 })?,
            time: 0.0,
            row: *i,
            relative_variance: *relative_variance,
            reading: &row.reading,
        });
    }
    let groups = groups(&observations, Averaging::ByPlace);
    let zeros = vec![0.0; recording.channels.len()];
    let mut averaged = CalibrationRows::averaged(&observations, &groups, zeros.clone()).thinned(MOST_LEARNT);
    if let Some(UntouchedRows { count, scatter, freedom, .. }) = untouched {
        averaged.push_untouched(&zeros, *count, scatter, *freedom);
    }
    Ok(averaged)
}

/// Rows of the search for hyperparameters, always with the untouched ones.
fn rows_of_search(rows: &CalibrationRows) -> Vec<usize> {
    let touched = rows.touched().len();
    thinned(touched, MOST_PRESSES).chain(touched..rows.len()).collect()
}

fn mean_force_n(rows: &CalibrationRows) -> f64 {
    mean(rows.touched().into_iter().map(|row| rows.force_n[row]))
}

/// Variance of a sensor's noise from repeats and the rig's statement; `None` without either.
///
/// Quantization to steps q adds q²/12 to the stated variance.
fn noise_variance(rows: &CalibrationRows, layout: &Layout, sensor: usize) -> Option<f64> {
    let channel = &layout.sensors()[sensor].channel;
    let stated = channel.noise_sd.powi(2) + channel.resolution.powi(2) / 12.0;
    let belief = if stated > 0.0 { STATED_FREEDOM } else { 0.0 };
    let scatter = rows.repeats.squares.column(sensor).sum();
    let freedom = rows.repeats.degrees_of_freedom.iter().sum::<f64>() + belief;
    (freedom > 0.0).then(|| (scatter + belief * stated) / freedom)
}

/// Least variance relative to full scale squared, for posteriors within the precision of f64.
const FLOOR: f64 = 1e-18;

struct SensorRows<'a> {
    pub prior: Prior<'a>,
    force_n: Vec<f64>,
    count: Vec<f64>,
    parts: Vec<Parts>,
    /// Mean reading minus the prior's mean.
    residual: Array1<f64>,
    remainder: Array2<f64>,
    /// Noise variance, where repeats or the rig determine it.
    noise: Option<f64>,
    /// Full-scale reading at the mean force.
    scale: f64,
    mean_force_n: f64,
}

struct Posterior<'s, 'a> {
    rows: &'s SensorRows<'a>,
    hyper: Hyperparameters,
    cholesky: Cholesky,
    weights: Array1<f64>,
}

impl<'a> SensorRows<'a> {
    pub fn new(
        prior: Prior<'a>,
        rows: &CalibrationRows,
        index: usize,
        noise: Option<f64>,
        kept: &[usize],
        remainder: &Array2<f64>,
    ) -> Self {
        let parts: Vec<Parts> = kept.iter().map(|row| prior.parts(rows.position(*row))).collect();
        let residual = |(row, parts): (&usize, &Parts)| {
            rows.means[[*row, index]] - rows.force_n[*row] * prior.mean(*parts)
        };
        let mean_force_n = mean_force_n(rows);
        Self {
            force_n: kept.iter().map(|row| rows.force_n[*row]).collect(),
            count: kept.iter().map(|row| rows.count[*row]).collect(),
            residual: kept.iter().zip(&parts).map(residual).collect(),
            remainder: Array2::from_shape_fn((kept.len(), kept.len()), |(j, k)| {
                remainder[[kept[j], kept[k]]]
            }),
            parts,
            noise,
            scale: prior.full_scale * mean_force_n,
            mean_force_n,
            prior,
        }
    }

    pub fn noise_variance(&self, hyper: &Hyperparameters) -> f64 {
        let least = FLOOR * self.scale * self.scale;
        self.noise.unwrap_or((hyper.noise * self.scale).powi(2)).max(least)
    }

    fn offset_variance(&self, hyper: &Hyperparameters) -> f64 {
        (hyper.offset * self.scale).powi(2)
    }

    fn covariance(&self, hyper: &Hyperparameters) -> Array2<f64> {
        let (offset, noise) = (self.offset_variance(hyper), self.noise_variance(hyper));
        let n = self.parts.len();
        let mut covariance = Array2::zeros((n, n));
        for j in 0..n {
            for k in 0..=j {
                let (a, b) = (self.parts[j], self.parts[k]);
                let influence = self.prior.covariance(hyper, a, b, self.remainder[[j, k]]);
                covariance[[j, k]] = self.force_n[j] * self.force_n[k] * influence + offset;
            }
            covariance[[j, j]] += noise / self.count[j] + 1e-14 * covariance[[j, j]];
        }
        covariance
    }

    /// Log evidence without its constant; −∞ where the covariance cannot be factored.
    pub fn log_evidence(&self, hyper: &Hyperparameters) -> f64 {
        let Ok(cholesky) = Cholesky::factor(self.covariance(hyper)) else { return f64::NEG_INFINITY };
        let whitened = cholesky.solve_lower(&self.residual);
        -0.5 * (whitened.dot(&whitened) + cholesky.log_determinant())
    }

    pub fn posterior(&self, hyper: Hyperparameters) -> Result<Posterior<'_, 'a>, NotPositiveDefinite> {
        let cholesky = Cholesky::factor(self.covariance(&hyper))?;
        let weights = cholesky.solve(&self.residual);
        Ok(Posterior { rows: self, hyper, cholesky, weights })
    }
}

impl Posterior<'_, '_> {
    pub fn offset(&self) -> f64 {
        self.rows.offset_variance(&self.hyper) * self.weights.sum()
    }

    fn with_presses(&self, at: Parts, remainders: &ArrayView1<f64>) -> Array1<f64> {
        let SensorRows { prior, parts, force_n, .. } = self.rows;
        let presses = parts.iter().zip(force_n).zip(remainders);
        let covariance = |((press, force_n), remainder): ((&Parts, &f64), &f64)| {
            force_n * prior.covariance(&self.hyper, at, *press, *remainder)
        };
        presses.map(covariance).collect()
    }

    pub fn mean(&self, at: Parts, remainders: &ArrayView1<f64>) -> f64 {
        self.rows.prior.mean(at) + self.with_presses(at, remainders).dot(&self.weights)
    }

    /// Posterior variance of influence plus offset/mean force; `own` is the remainder's variance.
    pub fn variance(&self, at: Parts, remainders: &ArrayView1<f64>, own: f64) -> f64 {
        let force_n = self.rows.mean_force_n;
        let offset = self.rows.offset_variance(&self.hyper);
        let covariance = self.with_presses(at, remainders) + offset / force_n;
        let explained = self.cholesky.solve_lower(&covariance);
        let before = self.rows.prior.covariance(&self.hyper, at, at, own);
        (before + offset / (force_n * force_n) - explained.dot(&explained)).max(0.0)
    }
}

/// More rows change the hyperparameters little.
const MOST_PRESSES: usize = 60;

/// The error of such a calibration adds less than 1 % to that of a reading; time grows with the cube of the
/// rows.
pub(crate) const MOST_LEARNT: usize = 800;

/// Starts and bounds of log₁₀ of the hyperparameters; the lower bounds mean 0.
const START: [f64; 5] = [-2.0, -3.0, -3.0, -4.0, -4.0];
const LOWEST: [f64; 5] = [-6.0, -8.0, -7.0, -9.0, -9.0];
const HIGHEST: [f64; 5] = [0.0, -1.0, 2.0, 0.0, 0.0];

#[derive(Clone, Copy)]
struct Identifiability {
    noise: bool,
    offset: bool,
}

/// Maximizes the log evidence by coordinate ascent in the logarithms.
fn most_probable(
    sensors: &[SensorRows],
    mean: Mean,
    length_m: f64,
    identifiable: Identifiability,
    watch: Watch,
) -> Result<Hyperparameters, Cancelled> {
    let hyper = |logs: &[f64; 5]| {
        let power = |i: usize| if logs[i] <= LOWEST[i] { 0.0 } else { 10f64.powf(logs[i]) };
        match mean {
            Mean::Model => Hyperparameters {
                gain: power(0),
                shift_m: power(1) * length_m,
                remainder: power(2),
                offset: power(3),
                noise: power(4),
            },
            Mean::Zero => Hyperparameters {
                gain: 0.0,
                shift_m: 0.0,
                remainder: power(2),
                offset: power(3),
                noise: power(4),
            },
        }
    };
    let evidence = |logs: &[f64; 5]| {
        watch.round()?;
        Ok(sensors.iter().map(|s| s.log_evidence(&hyper(logs))).sum::<f64>())
    };
    let mut free = vec![2];
    if !identifiable.offset {
        free.push(3);
    }
    if mean == Mean::Model {
        free.extend([0, 1]);
    }
    if !identifiable.noise {
        free.push(4);
    }
    let mut logs = START;
    if identifiable.offset {
        logs[3] = LOWEST[3];
    }
    if mean == Mean::Zero {
        logs[2] = 0.0;
    }
    let mut best = evidence(&logs)?;
    for step in [1.0, 0.5, 0.25] {
        climb(&mut logs, &mut best, &free, step, &evidence)?;
    }
    Ok(hyper(&logs))
}

fn climb(
    logs: &mut [f64; 5],
    best: &mut f64,
    free: &[usize],
    step: f64,
    evidence: &dyn Fn(&[f64; 5]) -> Result<f64, Cancelled>,
) -> Result<(), Cancelled> {
    const MOST_ROUNDS: usize = 8;
    for _ in 0..MOST_ROUNDS {
        let before = *best;
        for &i in free {
            for direction in [step, -step] {
                loop {
                    let mut candidate = *logs;
                    candidate[i] = (candidate[i] + direction).clamp(LOWEST[i], HIGHEST[i]);
                    let value = evidence(&candidate)?;
                    if value <= *best {
                        break;
                    }
                    (*logs, *best) = (candidate, value);
                }
            }
        }
        if *best <= before {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Provenance;
    use palpate_mechanics::sensing::SensorKind;

    fn average(rows: &[(f64, f64, f64)]) -> Result<CalibrationRows, InfluenceFitError> {
        calibration_rows(&recording(rows), Extent::line(0.4).unwrap(), None)
    }

    fn recording(rows: &[(f64, f64, f64)]) -> Recording {
        let rows = rows.iter().map(|(x_m, force_n, value)| Row {
            position: Position::along(*x_m),
            force_n: (*force_n > 0.0).then_some(*force_n),
            nuisances: Vec::new(),
            time_s: None,
            reading: vec![*value],
        });
        let provenance = Provenance {
            source: "test".into(),
            rows: 0,
            digests: vec![],
            dialects: vec![],
            repeats: None,
            seed: None,
            placement_sd_m: None,
            bench: None,
        };
        let kinds = vec![SensorKind::Deflection];
        Recording { channels: vec!["d".into()], kinds, rows: rows.collect(), provenance }
    }

    #[test]
    fn thinned_rows_have_all_forces_and_places() {
        let forces_n = [1.5, 3.0, 6.0];
        let presses = (0..120).flat_map(|i| forces_n.map(|force_n| (0.003 * f64::from(i), force_n, 1.0)));
        let few = average(&presses.collect::<Vec<_>>()).unwrap().thinned(120);
        assert_eq!((few.len(), few.positions_m().len()), (120, 120));
        let of_force = |force_n: f64| few.force_n.iter().filter(|of_row| **of_row == force_n).count();
        assert!(forces_n.iter().all(|force_n| of_force(*force_n) >= 20), "{few:?}");
    }

    #[test]
    fn averages_repeats_and_keeps_their_scatter() {
        let rows = [(0.1, 3.0, 1.0), (0.2, 3.0, 5.0), (0.1, 3.0, 3.0), (0.1, 2.0, 9.0)];
        let presses = average(&rows).unwrap();
        let of_row =
            |i: usize| (presses.position(i).x_m, presses.force_n[i], presses.count[i], presses.means[[i, 0]]);
        let found: Vec<_> = (0..presses.len()).map(of_row).collect();
        assert_eq!(found, [(0.1, 2.0, 1.0, 9.0), (0.1, 3.0, 2.0, 2.0), (0.2, 3.0, 1.0, 5.0)]);
        let mut layout = Layout::even(SensorKind::Deflection, 1, 0.4);
        assert_eq!(noise_variance(&presses, &layout, 0), Some(2.0));
        layout.edit(|sensors| sensors[0].channel.noise_sd = 1.0).unwrap();
        let blended = noise_variance(&presses, &layout, 0).unwrap();
        assert!((blended - 22.0 / 21.0).abs() < 1e-15);
    }

    #[test]
    fn refuses_a_row_without_force_by_its_number_in_the_recording() {
        let error = average(&[(0.1, 3.0, 1.0), (0.2, -1.0, 1.0)]).unwrap_err();
        assert_eq!(error, InfluenceFitError::NoForce { row: 2 });
        let mut recording = recording(&[(0.0, 3.0, 0.1), (0.1, 3.0, 1.0), (0.2, -1.0, 1.0)]);
        recording.rows[0].force_n = Some(0.0);
        let untouched = UntouchedRows::of_recording(&recording).unwrap();
        let error = calibration_rows(&recording, Extent::line(0.4).unwrap(), Some(&untouched)).unwrap_err();
        assert_eq!(error, InfluenceFitError::NoForce { row: 3 });
    }

    #[test]
    fn noise_is_unknown_without_repeats_or_a_statement() {
        let presses = average(&[(0.1, 3.0, 1.0)]).unwrap();
        assert_eq!(noise_variance(&presses, &Layout::even(SensorKind::Deflection, 1, 0.4), 0), None);
    }
}

//! Posterior of the influence functions given the calibration rows.
//!
//! Rows of one place and force are averaged. Sensors of one kind share the hyperparameters, which maximize
//! the log evidence of the Gaussian processes of [`super::prior`].

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
use palpate_mechanics::surface::Surface;
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
    let presses = Presses::of_recording(task.recording, untouched.as_ref())?;
    let needed = match (source, surface.extent().dimensions()) {
        (InfluenceSource::Recording, 1) => 3,
        // A quadratic surface has six coefficients.
        (InfluenceSource::Recording, _) => 6,
        _ => 1,
    };
    let found = presses.distinct_positions();
    if found < needed {
        return Err(InfluenceFitError::TooFewPositions { needed, found });
    }
    let mut channels = Channels {
        offsets: untouched.map_or_else(|| vec![0.0; layout.len()], |untouched| untouched.mean),
        noise_sd: vec![1.0; layout.len()],
        dead: layout.sensors().iter().map(|sensor| sensor.channel.disabled).collect(),
        reference_force_n: presses.mean_force_n(),
        greatest_force_n: task.setup.greatest_force_n(),
        least_force_n: task.setup.force_range().map(|range| range.ends_n().0),
        false_alarm_rate,
    };
    let learning = Learning { source, surface, layout, presses: &presses, places };
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
    presses: &'a Presses,
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
        let Self { source, surface, layout, presses, places } = *self;
        let mean = if source == InfluenceSource::Recording { Mean::Zero } else { Mean::Model };
        let pressed: Vec<Position> = presses.presses.iter().map(|press| press.position).collect();
        let remainders = Remainders::new(surface, kind, &pressed, places, watch)?;
        let prior = |s: &usize| Prior::new(surface, &layout.sensors()[*s], mean, watch);
        let priors: Vec<Prior<'a>> = living.iter().map(prior).collect::<Result<_, _>>()?;
        let with = |(prior, &s): (&Prior<'a>, &usize), kept: &[usize]| {
            let noise = presses.noise_variance(layout, s);
            SensorPresses::new(prior.clone(), presses, s, noise, kept, &remainders.presses)
        };
        let all: Vec<usize> = (0..pressed.len()).collect();
        let few = presses.few();
        let searched: Vec<SensorPresses> =
            priors.iter().zip(living).map(|sensor| with(sensor, &few)).collect();
        let noise_is_told = living.iter().all(|s| presses.noise_variance(layout, *s).is_some());
        // Rows of one force confound offset and influence of a reaction: no support makes it 0 everywhere.
        let has_one_force = is_one_force(presses.touching().map(|press| press.force_n));
        let offset_is_open = has_one_force && !presses.is_untouched();
        let is_reaction_alone = mean == Mean::Zero && kind == SensorKind::Reaction && offset_is_open;
        let told = Told { noise: noise_is_told, offset: is_reaction_alone };
        let mut hyper = most_probable(&searched, mean, surface.length_m(), told, watch)?;
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

/// Mean of the rows of one position and force; untouched rows have force 0.
#[derive(Clone, Debug, PartialEq)]
struct Press {
    pub position: Position,
    pub force_n: f64,
    /// Noise variance of one reading over that of the mean.
    pub count: f64,
    pub mean: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq)]
struct Presses {
    pub presses: Vec<Press>,
    /// Squared deviations of repeats, per sensor.
    scatter: Vec<f64>,
    /// Readings minus means.
    freedom: f64,
}

/// Weight of the rig's stated noise, in readings.
const STATED_FREEDOM: f64 = 20.0;

impl Presses {
    /// Averages and thins the rows of a recording; untouched rows become one row of force 0.
    ///
    /// # Errors
    /// [`InfluenceFitError::NoForce`] for a row without a force greater than 0.
    pub fn of_recording(
        recording: &Recording,
        untouched: Option<&UntouchedRows>,
    ) -> Result<Self, InfluenceFitError> {
        let Some(untouched) = untouched else {
            let rows: Vec<(Row, f64)> = recording.rows.iter().map(|row| (row.clone(), 1.0)).collect();
            return Ok(Self::average(&rows)?.thinned(MOST_LEARNT));
        };
        let mut presses = Self::average(&untouched.tared_presses(recording))?.thinned(MOST_LEARNT);
        presses.scatter.iter_mut().zip(&untouched.scatter).for_each(|(sum, scatter)| *sum += scatter);
        presses.freedom += untouched.freedom;
        if let Some(Press { position, mean, .. }) = presses.presses.last() {
            let (position, mean) = (*position, vec![0.0; mean.len()]);
            presses.presses.push(Press { position, force_n: 0.0, count: untouched.count, mean });
        }
        Ok(presses)
    }

    fn average(recording: &[(Row, f64)]) -> Result<Self, InfluenceFitError> {
        let sensors = recording.first().map_or(0, |(row, _)| row.reading.len());
        let mut rows: Vec<(Position, f64, &[f64], f64)> = Vec::with_capacity(recording.len());
        for (i, (row, variance)) in recording.iter().enumerate() {
            let force_n = row.force_n.filter(|force_n| *force_n > 0.0);
            let force_n = force_n.ok_or(InfluenceFitError::NoForce { row: i + 1 })?;
            rows.push((row.position, force_n, &row.reading, *variance));
        }
        rows.sort_by(|a, b| a.0.cmp_by_x_then_y(&b.0).then(a.1.total_cmp(&b.1)));
        let mut presses = Vec::new();
        let (mut scatter, mut freedom) = (vec![0.0; sensors], 0.0);
        for group in rows.chunk_by(|a, b| a.0 == b.0 && a.1 == b.1) {
            let count = group.len() as f64;
            let column = |s: usize| group.iter().map(move |(_, _, reading, _)| reading[s]);
            let mean: Vec<f64> = (0..sensors).map(|s| column(s).sum::<f64>() / count).collect();
            for (s, scatter) in scatter.iter_mut().enumerate() {
                *scatter += column(s).map(|value| (value - mean[s]).powi(2)).sum::<f64>();
            }
            freedom += count - 1.0;
            let known = group.iter().map(|(.., variance)| variance).sum::<f64>() / count;
            presses.push(Press { position: group[0].0, force_n: group[0].1, count: count / known, mean });
        }
        Ok(Self { presses, scatter, freedom })
    }

    fn thinned(self, most: usize) -> Self {
        let presses = thinned(self.presses.len(), most).map(|i| self.presses[i].clone()).collect();
        Self { presses, ..self }
    }

    /// Indices for the search, always with the untouched rows.
    fn few(&self) -> Vec<usize> {
        let touching = self.touching().count();
        thinned(touching, MOST_PRESSES).chain(touching..self.presses.len()).collect()
    }

    fn touching(&self) -> impl Iterator<Item = &Press> {
        self.presses.iter().filter(|press| press.force_n > 0.0)
    }

    fn is_untouched(&self) -> bool {
        self.presses.iter().any(|press| press.force_n == 0.0)
    }

    pub fn distinct_positions(&self) -> usize {
        self.presses.chunk_by(|a, b| a.position == b.position).count()
    }

    pub fn mean_force_n(&self) -> f64 {
        mean(self.touching().map(|press| press.force_n))
    }

    /// Variance of a sensor's noise from repeats and the rig's statement; `None` without either.
    ///
    /// Quantization to steps q adds q²/12 to the stated variance.
    pub fn noise_variance(&self, layout: &Layout, sensor: usize) -> Option<f64> {
        let channel = &layout.sensors()[sensor].channel;
        let stated = channel.noise_sd.powi(2) + channel.resolution.powi(2) / 12.0;
        let belief = if stated > 0.0 { STATED_FREEDOM } else { 0.0 };
        let freedom = self.freedom + belief;
        (freedom > 0.0).then(|| (self.scatter[sensor] + belief * stated) / freedom)
    }
}

/// Least variance relative to full scale squared, for posteriors within the precision of f64.
const FLOOR: f64 = 1e-18;

struct SensorPresses<'a> {
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
    presses: &'s SensorPresses<'a>,
    hyper: Hyperparameters,
    cholesky: Cholesky,
    weights: Array1<f64>,
}

impl<'a> SensorPresses<'a> {
    pub fn new(
        prior: Prior<'a>,
        presses: &Presses,
        index: usize,
        noise: Option<f64>,
        kept: &[usize],
        remainder: &Array2<f64>,
    ) -> Self {
        let of = |j: usize| &presses.presses[kept[j]];
        let indices = 0..kept.len();
        let parts: Vec<Parts> = indices.clone().map(|j| prior.parts(of(j).position)).collect();
        let residual = |j: usize| of(j).mean[index] - of(j).force_n * prior.mean(parts[j]);
        let mean_force_n = presses.mean_force_n();
        Self {
            force_n: indices.clone().map(|j| of(j).force_n).collect(),
            count: indices.clone().map(|j| of(j).count).collect(),
            residual: indices.map(residual).collect(),
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
        Ok(Posterior { presses: self, hyper, cholesky, weights })
    }
}

impl Posterior<'_, '_> {
    pub fn offset(&self) -> f64 {
        self.presses.offset_variance(&self.hyper) * self.weights.sum()
    }

    fn with_presses(&self, at: Parts, remainders: &ArrayView1<f64>) -> Array1<f64> {
        let SensorPresses { prior, parts, force_n, .. } = self.presses;
        let presses = parts.iter().zip(force_n).zip(remainders);
        let covariance = |((press, force_n), remainder): ((&Parts, &f64), &f64)| {
            force_n * prior.covariance(&self.hyper, at, *press, *remainder)
        };
        presses.map(covariance).collect()
    }

    pub fn mean(&self, at: Parts, remainders: &ArrayView1<f64>) -> f64 {
        self.presses.prior.mean(at) + self.with_presses(at, remainders).dot(&self.weights)
    }

    /// Posterior variance of influence plus offset/mean force; `own` is the remainder's variance.
    pub fn variance(&self, at: Parts, remainders: &ArrayView1<f64>, own: f64) -> f64 {
        let force_n = self.presses.mean_force_n;
        let offset = self.presses.offset_variance(&self.hyper);
        let covariance = self.with_presses(at, remainders) + offset / force_n;
        let explained = self.cholesky.solve_lower(&covariance);
        let before = self.presses.prior.covariance(&self.hyper, at, at, own);
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
struct Told {
    noise: bool,
    offset: bool,
}

/// Maximizes the log evidence by coordinate ascent in the logarithms.
fn most_probable(
    sensors: &[SensorPresses],
    mean: Mean,
    length_m: f64,
    told: Told,
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
    if !told.offset {
        free.push(3);
    }
    if mean == Mean::Model {
        free.extend([0, 1]);
    }
    if !told.noise {
        free.push(4);
    }
    let mut logs = START;
    if told.offset {
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

    fn average(rows: &[(f64, f64, f64)]) -> Result<Presses, InfluenceFitError> {
        Presses::of_recording(&recording(rows), None)
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
    fn few_presses_have_all_forces_and_places() {
        let forces_n = [1.5, 3.0, 6.0];
        let presses = (0..120).flat_map(|i| forces_n.map(|force_n| (0.003 * f64::from(i), force_n, 1.0)));
        let few = average(&presses.collect::<Vec<_>>()).unwrap().thinned(120);
        assert_eq!((few.presses.len(), few.distinct_positions()), (120, 120));
        let of_force = |force_n: f64| few.presses.iter().filter(|press| press.force_n == force_n).count();
        assert!(forces_n.iter().all(|force_n| of_force(*force_n) >= 20), "{few:?}");
    }

    #[test]
    fn repeats_are_averaged_and_their_scatter_kept() {
        let rows = [(0.1, 3.0, 1.0), (0.2, 3.0, 5.0), (0.1, 3.0, 3.0), (0.1, 2.0, 9.0)];
        let presses = average(&rows).unwrap();
        let found: Vec<_> =
            presses.presses.iter().map(|p| (p.position.x_m, p.force_n, p.count, p.mean[0])).collect();
        assert_eq!(found, [(0.1, 2.0, 1.0, 9.0), (0.1, 3.0, 2.0, 2.0), (0.2, 3.0, 1.0, 5.0)]);
        let mut layout = Layout::even(SensorKind::Deflection, 1, 0.4);
        assert_eq!(presses.noise_variance(&layout, 0), Some(2.0));
        layout.edit(|sensors| sensors[0].channel.noise_sd = 1.0).unwrap();
        let blended = presses.noise_variance(&layout, 0).unwrap();
        assert!((blended - 22.0 / 21.0).abs() < 1e-15);
    }

    #[test]
    fn a_press_without_force_is_refused() {
        let error = average(&[(0.1, 3.0, 1.0), (0.2, -1.0, 1.0)]).unwrap_err();
        assert_eq!(error, InfluenceFitError::NoForce { row: 2 });
    }

    #[test]
    fn nothing_is_known_of_noise_without_repeats() {
        let presses = average(&[(0.1, 3.0, 1.0)]).unwrap();
        assert_eq!(presses.noise_variance(&Layout::even(SensorKind::Deflection, 1, 0.4), 0), None);
    }
}

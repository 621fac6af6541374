//! Learning of influence functions from presses.
//!
//! The structure, of drift, scatter and response, is that of the most probable prior: smooth functions and point
//! sensors at unknown positions ([`Prior::source`]) compete at held-out positions. Influence functions of this
//! structure are averaged over their hyperparameters ([`super::averaging`]).

use super::averaging::Average;
use super::component_search::ComponentSearch;
use super::drift::{DriftCourse, END, START};
use super::drift_fit::DriftFit;
use super::evidence::{ALL_DECADES, ChannelFit, Evidence};
use super::noise_prior::NoisePrior;
use super::outliers::OutlierTest;
use super::place_noise::PlaceNoise;
use super::place_noise_search::PlaceNoiseSearch;
use super::posterior::{Conditions, Functions, of_equal_ratio, offsets, readings};
use super::prior::{Prior, Source};
use super::shared_errors::loadings;
use super::source_grid::SourceGrid;
use crate::fit::FitTask;
use crate::influence::calibration::{Averaging, CalibrationRows, compare};
use crate::influence::config::Structure;
use crate::influence::measured::MeasuredError;
use crate::recording::Recording;
use crate::setup::Setup;
use palpate_mechanics::surface::Extent;
use palpate_numerics::bisect;
use palpate_numerics::regression::Kernel;
use palpate_numerics::watch::{Cancelled, Watch};
use std::sync::Arc;

/// Most presses of the hyperparameter search.
pub(crate) const MOST_SEARCHED: usize = 150;
/// Most presses of a fit, with time cubic in their number; more are condensed.
pub(crate) const MOST_PRESSES: usize = 1000;
const LEAST_TO_JUDGE: usize = 6;
/// With fewer positions, the hyperparameters' uncertainty determines the errors.
const LEAST_TO_WIDEN: usize = 19;
/// Every fifth position is held out.
pub(crate) const FOLDS: usize = 5;

pub(super) struct InfluenceModel {
    /// All presses.
    pub pressed: CalibrationRows,
    /// Presses of the fit.
    presses: CalibrationRows,
    drift: Option<DriftFit>,
    pub prior: Prior,
    /// Changing channels, from 0.
    pub live: Vec<usize>,
    fits: Vec<ChannelFit>,
    sensors_m: Vec<Vec<f64>>,
    /// Of the most probable smooth functions.
    lengths_m: Vec<f64>,
    average: Average,
    sources: SourceGrid,
    /// Variance factor of the process.
    widening: f64,
    pub set_aside: Vec<usize>,
}

impl InfluenceModel {
    /// Learns, or returns an earlier result of the task; `None` where forces do not separate influences from
    /// offsets, or no channel changes.
    pub fn of_task(
        task: FitTask,
        structure: Structure,
        most_presses: usize,
    ) -> Result<Option<Arc<Self>>, MeasuredError> {
        let FitTask { setup, recording, watch, memo, .. } = task;
        let learn =
            || Self::new(setup, recording, structure, most_presses, watch).map(|learnt| learnt.map(Arc::new));
        match memo {
            Some(memo) => {
                let options = (structure, most_presses);
                Ok((*memo.get_or_compute((setup, recording), options, learn)?).clone())
            }
            None => learn(),
        }
    }

    fn new(
        setup: &Setup,
        recording: &Recording,
        structure: Structure,
        most_presses: usize,
        watch: Watch,
    ) -> Result<Option<Self>, MeasuredError> {
        let learn = |noise: Option<&PlaceNoise>| {
            Self::without_outliers(setup, recording, structure, most_presses, noise, watch)
        };
        let Some(mut learnt) = learn(None)? else { return Ok(None) };
        // Outliers resemble local noise and vice versa: noise is estimated without outliers, and outliers
        // with this noise.
        if let Some(noise) = learnt.noise_by_place(watch)? {
            let Some(with_noise) = learn(Some(&noise))? else { return Ok(None) };
            learnt = with_noise;
        }
        learnt.average = learnt.averaged(watch)?;
        if learnt.average.is_empty() {
            return no_functions(structure, learnt.pressed.len());
        }
        Ok(Some(learnt))
    }

    /// Averages the components of the structure.
    fn averaged(&self, watch: Watch) -> Result<Average, MeasuredError> {
        let searched = self.pressed.thinned(MOST_SEARCHED);
        let noises = NoisePrior::candidates(&searched);
        let search = ComponentSearch { presses: &searched, noises: &noises, sources: &self.sources, watch };
        Ok(Average::new(&search.found(&self.prior, &self.lengths_m)?, &noises))
    }

    fn without_outliers(
        setup: &Setup,
        recording: &Recording,
        structure: Structure,
        most_presses: usize,
        noise: Option<&PlaceNoise>,
        watch: Watch,
    ) -> Result<Option<Self>, MeasuredError> {
        const ROUNDS: usize = 4;
        const MOST_SET_ASIDE: f64 = 0.1;
        let learn = |set_aside: &[usize]| {
            Self::without_rows(setup, recording, structure, most_presses, noise, set_aside, watch)
        };
        let mut set_aside = Vec::new();
        for _ in 0..ROUNDS {
            let Some(learnt) = learn(&set_aside)? else { return Ok(None) };
            let outliers = learnt.outliers(watch)?;
            let most = (MOST_SET_ASIDE * recording.rows.len() as f64) as usize;
            if outliers.is_empty() || set_aside.len() + outliers.len() > most {
                return Ok(Some(learnt));
            }
            set_aside.extend(outliers);
            set_aside.sort_unstable();
        }
        learn(&set_aside)
    }

    fn without_rows(
        setup: &Setup,
        recording: &Recording,
        structure: Structure,
        most_presses: usize,
        noise: Option<&PlaceNoise>,
        set_aside: &[usize],
        watch: Watch,
    ) -> Result<Option<Self>, MeasuredError> {
        let presses_of = |repeats| CalibrationRows::of_recording(setup, recording, repeats, set_aside);
        let Some(pressed) = presses_of(Averaging::Consecutive) else { return Ok(None) };
        let live = pressed.changing_channels();
        if pressed.distinct_forces() < 2 || live.is_empty() {
            return Ok(None);
        }
        let pressed = pressed.of_channels(&live);
        let searched = pressed.thinned(MOST_SEARCHED);
        let extent = setup.surface().extent();
        let decades = (*ALL_DECADES.start(), *ALL_DECADES.end());
        let mut search = Search { presses: &searched, extent, structure, noise, watch, decades };
        let smooth = search.smooth()?;
        if smooth.fits.is_empty() {
            return no_functions(structure, pressed.len());
        }
        if structure == Structure::Auto && !smooth.prior.has_response() {
            return Ok(None);
        }
        let (presses, drift) = if pressed.len() <= most_presses {
            (pressed.clone(), None)
        } else if smooth.prior.drift > 0.0 {
            let (presses, drift) =
                pressed.condensed_under_drift(&smooth.prior, &smooth.fits, most_presses, watch)?;
            (presses, Some(drift))
        } else {
            // Repeats of one position determine the noise; neighbouring positions do not.
            let merged = presses_of(Averaging::ByPlace).map(|merged| merged.of_channels(&live));
            let merged = merged.as_ref().unwrap_or(&pressed);
            (merged.condensed(&smooth.prior, &smooth.fits, most_presses, watch)?, None)
        };
        let mut scored = vec![ScoredFit::new(smooth, &presses, watch)?];
        if presses.positions_m().len() >= LEAST_TO_JUDGE
            && let Some(sources) = search.sources(&scored[0].fit.prior)?
        {
            match ScoredFit::new(sources, &presses, watch) {
                Ok(sources) => scored.push(sources),
                // Without the held-out positions the polynomials are unidentifiable: the prior has no score.
                Err(MeasuredError::Noise(_)) => {}
                Err(error) => return Err(error),
            }
        }
        let lengths_m = scored[0].fit.prior.lengths_m.clone();
        let best = scored.into_iter().max_by(|a, b| a.score.total_cmp(&b.score));
        let Some(ScoredFit { fit: StructureFit { prior, fits, sensors_m }, widening, .. }) = best else {
            return Ok(None);
        };
        let set_aside = set_aside.to_vec();
        Ok(Some(Self {
            pressed,
            presses,
            drift,
            prior,
            live,
            fits,
            sensors_m,
            lengths_m,
            average: Average::default(),
            sources: SourceGrid::new(extent),
            widening,
            set_aside,
        }))
    }

    pub fn shared_errors(&self) -> Result<Vec<f64>, MeasuredError> {
        Ok(loadings(&self.presses, &self.prior, &self.fits, &self.sensors_m)?)
    }

    /// Length scale of the finest influence functions along an axis; 0 with point sensors, which have none.
    pub fn finest_m(&self, k: usize) -> f64 {
        if self.average.has_source() { 0.0 } else { self.average.shortest_m(k) }
    }

    /// Offsets, and influences per newton of φ.
    pub fn functions(&self, places_m: &[Vec<f64>], watch: Watch) -> Result<Vec<Functions>, MeasuredError> {
        let mut functions = self.average.functions(&self.presses, &self.sources.places_m, places_m, watch)?;
        let per_newton = 1.0 / self.prior.force_scale_n;
        if let Some(drift) = &self.drift {
            for (functions, variance) in functions.iter_mut().zip(drift.variances_at_the_end()?) {
                functions.offset_variance += variance;
            }
        }
        for functions in &mut functions {
            functions.offset_variance *= self.widening;
            functions.values.iter_mut().for_each(|value| *value *= per_newton);
            functions.variances.iter_mut().for_each(|v| *v *= self.widening * per_newton * per_newton);
            functions.covariances.iter_mut().for_each(|c| *c *= self.widening * per_newton);
        }
        Ok(functions)
    }

    /// Offsets at `times`, as fractions of the recording; `None` without drift.
    pub fn offsets_at(&self, times: &[f64]) -> Result<Option<Vec<Vec<f64>>>, MeasuredError> {
        if self.prior.drift == 0.0 {
            return Ok(None);
        }
        // `presses` are corrected to the last row.
        let ends = vec![END; times.len()];
        let asked = if self.drift.is_some() { &ends } else { times };
        let found = offsets(&self.prior, &self.presses, &self.fits, &self.sensors_m, asked)?;
        let mut all: Vec<Vec<f64>> =
            found.into_iter().map(|offsets| offsets.into_iter().map(|(mean, _)| mean).collect()).collect();
        if let Some(drift) = &self.drift {
            for (offsets, drifts) in all.iter_mut().zip(drift.until_the_end(times)?) {
                offsets.iter_mut().zip(drifts).for_each(|(offset, drift)| *offset -= drift);
            }
        }
        Ok(Some(all))
    }

    /// Changes of offsets from the first row to the last; empty without drift.
    pub fn drifts(&self) -> Result<Vec<f64>, MeasuredError> {
        let ends = self.offsets_at(&[START, END])?.unwrap_or_default();
        Ok(ends.into_iter().map(|offsets| offsets[1] - offsets[0]).collect())
    }

    pub fn offsets_at_or_constant(&self, times: &[f64]) -> Result<Vec<Vec<f64>>, MeasuredError> {
        if let Some(drifting) = self.offsets_at(times)? {
            return Ok(drifting);
        }
        let constant = offsets(&self.prior, &self.presses, &self.fits, &self.sensors_m, &[END])?;
        Ok(constant.into_iter().map(|offsets| vec![offsets[0].0; times.len()]).collect())
    }

    /// Log evidence of other readings, maximized over the scatter.
    pub fn log_evidence(
        &self,
        setup: &Setup,
        recording: &Recording,
        watch: Watch,
    ) -> Result<f64, MeasuredError> {
        const ONE_OF: usize = 5;
        let Some(presses) = CalibrationRows::of_recording(setup, recording, Averaging::Consecutive, &[])
        else {
            return Ok(f64::NEG_INFINITY);
        };
        let presses = presses.of_channels(&self.live);
        let (extent, structure) = (setup.surface().extent(), Structure::ForceLinear);
        let decades = (*ALL_DECADES.start(), *ALL_DECADES.end());
        let mut search = Search { presses: &presses, extent, structure, noise: None, watch, decades };
        let few: Vec<Vec<f64>> = self.sensors_m.iter().step_by(ONE_OF).cloned().collect();
        let scatters = std::iter::once(0.0).chain(SCATTERS);
        let priors = scatters.map(|scatter| Prior { scatter, ..self.prior.clone() });
        Ok(search.best_of(priors, &few)?.0)
    }

    fn outliers(&self, watch: Watch) -> Result<Vec<usize>, MeasuredError> {
        /// One by one would take long.
        const AT_ONCE: usize = 3;
        let test = OutlierTest { prior: &self.prior, fits: &self.fits, sensors_m: &self.sensors_m };
        if self.presses.len() == self.pressed.len() {
            Ok(test.worst(&self.pressed, self.pressed.len(), AT_ONCE)?)
        } else {
            test.by_parts(&self.pressed, watch)
        }
    }

    fn noise_by_place(&self, watch: Watch) -> Result<Option<PlaceNoise>, MeasuredError> {
        const ONE_OF: usize = 5;
        let searched = self.pressed.thinned(MOST_SEARCHED);
        let few: Vec<Vec<f64>> = self.sensors_m.iter().step_by(ONE_OF).cloned().collect();
        PlaceNoiseSearch { presses: &searched, prior: &self.prior, sensors_m: &few, watch }.found()
    }
}

/// Result where presses do not determine offsets and influence functions.
fn no_functions(structure: Structure, presses: usize) -> Result<Option<InfluenceModel>, MeasuredError> {
    if structure == Structure::Auto { Ok(None) } else { Err(MeasuredError::TooFewPresses { presses }) }
}

struct StructureFit {
    prior: Prior,
    fits: Vec<ChannelFit>,
    sensors_m: Vec<Vec<f64>>,
}

struct ScoredFit {
    fit: StructureFit,
    score: f64,
    widening: f64,
}

impl ScoredFit {
    fn new(fit: StructureFit, presses: &CalibrationRows, watch: Watch) -> Result<Self, MeasuredError> {
        let mut errors: Vec<[f64; 3]> = Vec::new();
        for (held, kept) in folds(presses) {
            watch.round()?;
            fit.add_errors(presses, &held, &presses.select(&kept), &mut errors, watch)?;
        }
        let score = |[square, noise, process]: &[f64; 3]| {
            let variance = noise + process;
            -0.5 * (variance.ln() + square / variance)
        };
        let score = errors.iter().map(score).sum();
        let is_judged = presses.positions_m().len() >= LEAST_TO_WIDEN;
        let widening = if is_judged { widening(&errors) } else { 1.0 };
        Ok(Self { fit, score, widening })
    }
}

/// Factor of the process's variance that makes squared errors as large as their variances.
fn widening(errors: &[[f64; 3]]) -> f64 {
    const MOST: f64 = 25.0;
    let too_small = |widening: f64| {
        let standardized =
            errors.iter().map(|[square, noise, process]| square / (noise + widening * process));
        standardized.sum::<f64>() > errors.len() as f64
    };
    bisect((1.0, MOST), 30, too_small)
}

/// Presses held out and the others, by [`FOLDS`] positions; empty with few positions.
fn folds(presses: &CalibrationRows) -> Vec<(Vec<usize>, Vec<usize>)> {
    let positions_m = presses.positions_m();
    if positions_m.len() < LEAST_TO_JUDGE {
        return Vec::new();
    }
    let fold_of = |i: usize| {
        let place = positions_m.partition_point(|other| compare(other, &presses.positions_m[i]).is_lt());
        (presses.force_n[i] != 0.0).then_some(place % FOLDS)
    };
    (0..FOLDS).map(|fold| (0..presses.len()).partition(|i| fold_of(*i) == Some(fold))).collect()
}

impl StructureFit {
    /// Adds squared errors of presses `held`, predicted from `kept`, and their variances.
    fn add_errors(
        &self,
        presses: &CalibrationRows,
        held: &[usize],
        kept: &CalibrationRows,
        errors: &mut Vec<[f64; 3]>,
        watch: Watch,
    ) -> Result<(), MeasuredError> {
        let others = presses.select(held);
        for channels in of_equal_ratio(&self.fits) {
            watch.round()?;
            let conditions = Conditions::of_fits(&self.prior, &self.fits, &channels);
            let found = readings(&conditions, kept, &self.sensors_m, &others)?;
            for (c, readings) in channels.into_iter().zip(found) {
                for (k, (reading, process)) in readings.into_iter().enumerate() {
                    let error = others.means[[k, c]] + others.centre[c] - reading;
                    let noise = self.fits[c].noise_variance() * self.prior.relative_noise_of(&others, k);
                    errors.push([error * error, noise / others.count[k], process]);
                }
            }
        }
        Ok(())
    }
}

/// Candidates of δ.
const NONLINEARITIES: [f64; 5] = [0.03, 0.1, 0.3, 1.0, 3.0];
/// Candidates of κ.
const DRIFTS: [f64; 3] = [10.0, 100.0, 1e3];
/// Least gain of log evidence for a tenfold drift.
const LEAST_MORE: f64 = 3.0;
/// Candidates of μ.
const SCATTERS: [f64; 5] = [1.0, 4.0, 16.0, 64.0, 256.0];
/// Candidates of γ.
const RESPONSES: [f64; 4] = [0.5, 0.75, 1.33, 2.0];
/// Least gain for a smoother kernel, which claims more certainty between presses.
const LEAST_SMOOTHER: f64 = 10.0;
/// Least gain for a departure from offset + force × influence.
const LEAST_GAIN: f64 = 10.0;

struct Search<'a> {
    presses: &'a CalibrationRows,
    extent: Extent,
    structure: Structure,
    noise: Option<&'a PlaceNoise>,
    watch: Watch<'a>,
    /// Powers of ten of ρ, near the last prior's.
    decades: (i32, i32),
}

impl Search<'_> {
    /// Log evidence of all channels, with ρ near the last prior's.
    fn total(&mut self, prior: &Prior, sensors_m: &[Vec<f64>]) -> Result<f64, Cancelled> {
        /// In powers of ten.
        const ABOUT: i32 = 2;
        self.watch.round()?;
        let (from, to) = self.decades;
        let Some(fits) = Evidence::new(self.presses, prior, sensors_m).best_decades(from..=to) else {
            return Ok(f64::NEG_INFINITY);
        };
        let decades = || fits.iter().map(|fit| fit.ratio.log10().round() as i32);
        let (least, most) = (decades().min().unwrap_or(0), decades().max().unwrap_or(0));
        self.decades = ((least - ABOUT).max(*ALL_DECADES.start()), (most + ABOUT).min(*ALL_DECADES.end()));
        Ok(fits.iter().map(|fit| fit.evidence).sum())
    }

    /// [`Self::total`] over the full range of ρ.
    fn total_anew(&mut self, prior: &Prior, sensors_m: &[Vec<f64>]) -> Result<f64, Cancelled> {
        self.decades = (*ALL_DECADES.start(), *ALL_DECADES.end());
        self.total(prior, sensors_m)
    }

    /// Searches kernel, length scales, drift, scatter, response and nonlinearity in turn.
    fn smooth(&mut self) -> Result<StructureFit, Cancelled> {
        let noise_by_place = self.noise.cloned();
        let rough = Prior { noise_by_place, ..Prior::smooth(self.extent, self.presses) };
        self.total_anew(&rough, &[])?;
        let (mut best, mut prior) = self.climb_lengths(rough)?;
        let (smooth_best, smooth) =
            self.climb_lengths(Prior { kernel: Kernel::Matern52, ..prior.clone() })?;
        if smooth_best > best + LEAST_SMOOTHER {
            (best, prior) = (smooth_best, smooth);
        }
        if let Some((_, drifting)) = self.drift(best, &prior, &[])? {
            (best, prior) = self.climb_lengths(drifting)?;
        }
        if let Some((_, scattered)) = self.scatter(best, &prior, &[])? {
            (best, prior) = self.climb_lengths(scattered)?;
        }
        if matches!(self.structure, Structure::Auto | Structure::ForceMonotone) {
            (best, prior) = self.response(best, prior)?;
        }
        if self.structure == Structure::Auto {
            let changed = NONLINEARITIES.map(|nonlinearity| Prior { nonlinearity, ..prior.clone() });
            let (found, nonlinear) = self.best_of(changed, &[])?;
            // Scatter that grows with force resembles influences that change with force.
            let scatters = SCATTERS.map(|scatter| Prior { scatter, ..prior.clone() });
            let (scattered, _) = self.best_of(scatters, &[])?;
            // Wrong forces and positions move all channels together: every channel repeats their evidence.
            let repeats = if prior.scatter > 0.0 { self.presses.centre.len() } else { 1 };
            if found > best.max(scattered) + LEAST_GAIN * repeats as f64 {
                prior = nonlinear;
            }
        }
        Ok(self.found(prior, &[]))
    }

    /// Prior with a drift that is identifiable and gains [`LEAST_GAIN`].
    fn drift(
        &mut self,
        best: f64,
        prior: &Prior,
        sensors_m: &[Vec<f64>],
    ) -> Result<Option<(f64, Prior)>, Cancelled> {
        if !self.presses.identifies_drift() {
            return Ok(None);
        }
        let drifts = DriftCourse::ALL
            .into_iter()
            .flat_map(|drift_course| DRIFTS.map(|drift| Prior { drift, drift_course, ..prior.clone() }));
        let coarse = self.best_of(drifts, sensors_m)?;
        let times = |factor: f64| Prior { drift: coarse.1.drift * factor, ..coarse.1.clone() };
        let more = self.best_of([times(10.0)], sensors_m)?;
        let less = self.best_of([times(0.1)], sensors_m)?;
        // Large drift leaves little noise, which few presses do not bound: a tenfold drift needs more
        // evidence.
        let found = [less, coarse, more]
            .into_iter()
            .reduce(|found, next| if next.0 > found.0 + LEAST_MORE { next } else { found });
        Ok(found.filter(|(total, _)| *total > best + LEAST_GAIN))
    }

    /// Prior with a scatter that gains [`LEAST_GAIN`].
    fn scatter(
        &mut self,
        best: f64,
        prior: &Prior,
        sensors_m: &[Vec<f64>],
    ) -> Result<Option<(f64, Prior)>, Cancelled> {
        let found = self.best_of(SCATTERS.map(|scatter| Prior { scatter, ..prior.clone() }), sensors_m)?;
        Ok(Some(found).filter(|(total, _)| *total > best + LEAST_GAIN))
    }

    fn best_of(
        &mut self,
        priors: impl IntoIterator<Item = Prior>,
        sensors_m: &[Vec<f64>],
    ) -> Result<(f64, Prior), Cancelled> {
        let mut best = None;
        for prior in priors {
            let total = self.total(&prior, sensors_m)?;
            if best.as_ref().is_none_or(|(most, _)| total > *most) {
                best = Some((total, prior));
            }
        }
        Ok(best.expect("at least one prior is tried"))
    }

    /// Linear, unless another exponent gains [`LEAST_GAIN`].
    fn response(&mut self, best: f64, linear: Prior) -> Result<(f64, Prior), Cancelled> {
        let (mut found, mut prior) =
            self.best_of(RESPONSES.map(|response| Prior { response, ..linear.clone() }), &[])?;
        if found < best + LEAST_GAIN && self.structure != Structure::ForceMonotone {
            return Ok((best, linear));
        }
        for step in [1.15, 1.05, 1.015] {
            for factor in [step, 1.0 / step] {
                loop {
                    let candidate = Prior { response: prior.response * factor, ..prior.clone() };
                    let total = self.total(&candidate, &[])?;
                    if total <= found || !prior.has_response() {
                        break;
                    }
                    (found, prior) = (total, candidate);
                }
            }
        }
        self.climb_lengths(prior)
    }

    /// Maximizes the evidence of point sensors; `None` with too few presses or positions for the polynomials.
    fn sources(&mut self, smooth: &Prior) -> Result<Option<StructureFit>, Cancelled> {
        /// η² and ℓ, in lengths of the surface; a plane needs a smooth part.
        const SHARES: [f64; 4] = [0.0, 1e-4, 1e-2, 1.0];
        const LENGTHS: [f64; 4] = [0.1, 0.2, 0.4, 0.8];
        const ONE_OF: usize = 5;
        let sensors_m = SourceGrid::new(self.extent).places_m;
        // With fewer, nearly each press or position is a coefficient, and residuals do not determine the
        // variance.
        let polynomials = Prior { source: Some(Source::Strain), ..smooth.clone() }.polynomials();
        let (presses, places) = (self.presses.len(), self.presses.positions_m().len());
        if presses < 2 * (1 + polynomials) || places < 2 * polynomials {
            return Ok(None);
        }
        let (dimensions, length_m) = (self.extent.dimensions(), self.extent.length_m());
        let plane = dimensions == 2;
        let of_length = |source: Source, share: f64, length: f64| Prior {
            source: Some(source),
            // On a plane a squared exponential has more evidence but is overconfident between few positions.
            kernel: Kernel::Matern52,
            smooth_part: share,
            lengths_m: vec![length * length_m; dimensions],
            ..smooth.clone()
        };
        let mut best: Option<(f64, Prior)> = None;
        let mut keep = |total: f64, prior: Prior| {
            if total.is_finite() && best.as_ref().is_none_or(|(most, _)| total > *most) {
                best = Some((total, prior));
            }
        };
        let shares = if plane { &SHARES[3..] } else { &SHARES[..] };
        let mut kinds = Vec::new();
        for source in Source::all(self.extent) {
            let prior = of_length(*source, shares[shares.len() / 2], 0.4);
            let total = self.total_anew(&prior, &sensors_m)?;
            keep(total, prior);
            kinds.push((total, *source));
        }
        let Some((_, source)) = kinds.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(None) };
        for share in shares {
            let lengths = if *share == 0.0 { &LENGTHS[..1] } else { &LENGTHS[..] };
            self.decades = (*ALL_DECADES.start(), *ALL_DECADES.end());
            for length in lengths {
                let prior = of_length(source, *share, *length);
                keep(self.total(&prior, &sensors_m)?, prior);
            }
        }
        let Some((_, mut prior)) = best else { return Ok(None) };
        // Noise absorbed by the smooth prior makes a drift look too small: it is estimated again.
        let few: Vec<Vec<f64>> = sensors_m.iter().step_by(ONE_OF).cloned().collect();
        let mut total = self.total(&prior, &few)?;
        if let Some(drifting) = self.drift(total, &prior, &few)? {
            (total, prior) = drifting;
        }
        if let Some((_, scattered)) = self.scatter(total, &prior, &few)? {
            prior = scattered;
        }
        Ok(Some(self.found(prior, &sensors_m)))
    }

    fn found(&self, prior: Prior, sensors_m: &[Vec<f64>]) -> StructureFit {
        let evidence = Evidence::new(self.presses, &prior, sensors_m);
        let fits = evidence.best_decades(ALL_DECADES).map(|fits| evidence.refined(fits)).unwrap_or_default();
        StructureFit { prior, fits, sensors_m: sensors_m.to_vec() }
    }

    /// Climbs along one length scale at a time.
    fn climb_lengths(&mut self, mut prior: Prior) -> Result<(f64, Prior), Cancelled> {
        let (shortest_m, longest_m) = (1e-3 * self.extent.length_m(), 10.0 * self.extent.length_m());
        let mut best = self.total(&prior, &[])?;
        for step in [2.0, std::f64::consts::SQRT_2, 1.2] {
            for k in 0..prior.lengths_m.len() {
                for factor in [step, 1.0 / step] {
                    let from_m = prior.lengths_m[k];
                    loop {
                        let mut candidate = prior.clone();
                        candidate.lengths_m[k] =
                            (candidate.lengths_m[k] * factor).clamp(shortest_m, longest_m);
                        let total = self.total(&candidate, &[])?;
                        if total <= best {
                            break;
                        }
                        (best, prior) = (total, candidate);
                    }
                    // The evidence rose in this direction: it is less in the opposite one.
                    if prior.lengths_m[k] != from_m {
                        break;
                    }
                }
            }
        }
        Ok((best, prior))
    }
}

//! Channel drift and surface creep.
//!
//! Symbols, over each channel's noise: y reading minus calibrated offsets, h(θ) contacts' reading, d drift
//! with rate v, z creep state with share c and time τ, n white noise.
//!
//!   y = s + c·z + d + n,  s = h(θ),  τ·ż = s − z,  ḋ = v + w·ξ,  v̇ = −v/τ_v + r·√(2/τ_v)·η
//!
//! with ξ and η white. Calibration learns s, the fresh reading (standard linear solid: W. N. Findley and
//! others, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976, chapter 5).
//!
//! **Creep**: in a step T, z moves by the share a = 1 − exp(−T/τ) to s, so s = (y − d − c·(1 − a)·z)/(1 +
//! c·a).
//!
//! **Drift** along ∂h/∂θ is unidentifiable. Each block's θ has a flat prior (consider filter: S. F. Schmidt,
//! Application of State-Space Methods to Navigation Problems, 1966); the covariance of d, projected on θ, is
//! added to that of contacts.
//!
//! Nine filters, three walks w times three rates r, are weighted by untouched readings (D. T. Magill, IEEE
//! Trans. Autom. Control 10, 1965).

use super::TrackedContact;
use crate::likelihood::{Likelihood, Linearisation};
use crate::untouched_drift::UntouchedDrift;
use ndarray::{Array1, Array2, s};
use palpate_mechanics::contact::{Contact, Position};
use palpate_numerics::small::{Ldl, Matrix, dot, form};
use palpate_numerics::{Cholesky, push_rest};

/// Drift of offsets, in units of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Candidate random walks, standard deviation after a second.
    pub walks_per_root_s: [f64; 3],
    /// Candidate standard deviations of the rate, in 1/s.
    pub rates_per_s: [f64; 3],
    /// Correlation time of the rate, in seconds.
    pub rate_s: f64,
}

impl Drift {
    /// Greatest walk of at least `walk_per_root_s`.
    pub(super) fn up_to(walk_per_root_s: f64) -> Self {
        let mut drift = Self::default();
        let [.., greatest] = &mut drift.walks_per_root_s;
        *greatest = greatest.max(walk_per_root_s);
        drift
    }
}

impl Default for Drift {
    /// Up to a tenth of the noise in a second; rates correlate over minutes.
    fn default() -> Self {
        Self { walks_per_root_s: [1e-3, 0.01, 0.1], rates_per_s: [0.0, 0.01, 0.1], rate_s: 300.0 }
    }
}

/// Creep of a soft surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Creep {
    /// Final growth over the fresh reading, 0 to 1.
    pub share: f64,
    /// Time constant in seconds, positive.
    pub time_s: f64,
}

/// Duration of an observation.
const BLOCK_S: f64 = 0.2;
/// Longest prediction without observations.
const UNSEEN_S: f64 = 600.0;
/// Prior variance of θ over the noise.
const FLAT: f64 = 1e8;
/// Least independent share of a derivative.
const PARALLEL: f64 = 1e-9;
/// Blocks with a common calibration error, with the information of one.
const ALIKE: f64 = 300.0;
/// Evidence kept per block, some minutes.
const KEPT: f64 = 0.999;
/// Least probability of the number for an update.
const SURE: f64 = 0.95;

#[derive(Clone, Debug)]
pub(super) struct SlowState {
    /// Channel and noise per value.
    noise: Vec<(usize, f64)>,
    drift: Option<DriftFilter>,
    creep: Option<(Creep, Vec<f64>)>,
    block: Block,
    time_s: f64,
}

#[derive(Clone, Debug, Default)]
struct Block {
    count: f64,
    start_s: f64,
    times_s: f64,
    offsets: Vec<f64>,
    /// x, y and force of each contact.
    contacts: Vec<[f64; 3]>,
}

#[derive(Clone, Debug)]
struct DriftFilter {
    config: Drift,
    models: Vec<Model>,
    time_s: Option<f64>,
    /// d, v and covariance of d.
    offset: Array1<f64>,
    rate: Array1<f64>,
    covariance: Array2<f64>,
}

/// One walk and rate, with state (d, v).
#[derive(Clone, Debug)]
struct Model {
    walk: f64,
    rate: f64,
    log_weight: f64,
    mean: Array1<f64>,
    covariance: Array2<f64>,
}

impl SlowState {
    pub fn new(
        likelihood: &dyn Likelihood,
        channels: usize,
        drift: Option<Drift>,
        creep: Option<Creep>,
    ) -> Self {
        let noise = noise(likelihood, channels);
        let count = noise.len();
        let shown = likelihood.untouched_drift();
        let in_noise = |values: &[f64]| -> Vec<f64> {
            noise
                .iter()
                .map(|(channel, noise)| values.get(*channel).copied().unwrap_or(0.0) / noise.abs())
                .collect()
        };
        let follow = |shown: &UntouchedDrift| {
            Drift::up_to(in_noise(&shown.walk_per_root_s).into_iter().fold(0.0, f64::max))
        };
        // Standard deviation of an offset that is uniform over the range.
        let within = |shown: &UntouchedDrift| {
            in_noise(&shown.range).iter().map(|range| range / 12f64.sqrt()).collect()
        };
        let offset_sd: Vec<f64> = shown.map_or_else(|| vec![1.0; count], within);
        Self {
            drift: drift.or_else(|| shown.map(follow)).map(|config| DriftFilter::new(config, &offset_sd)),
            creep: creep.map(|creep| (creep, vec![0.0; count])),
            noise,
            block: Block::default(),
            time_s: 0.0,
        }
    }

    /// Corrects a reading and its whitened values.
    pub fn subtract(
        &mut self,
        time_s: f64,
        duration_s: Option<f64>,
        whitened: &mut [f64],
        reading: &mut [f64],
    ) {
        self.time_s = time_s;
        for (i, value) in whitened.iter_mut().enumerate() {
            let before = *value;
            if let Some(drift) = &self.drift {
                *value -= drift.offset_at(i, time_s);
            }
            if let Some((Creep { share, time_s }, states)) = &mut self.creep {
                // The surface is assumed untouched long before the first reading.
                let way = duration_s.map_or(0.0, |duration_s| -(-duration_s / *time_s).exp_m1());
                let state = &mut states[i];
                *value = (*value - *share * (1.0 - way) * *state) / (1.0 + *share * way);
                *state += way * (*value - *state);
            }
            let (channel, noise) = self.noise[i];
            reading[channel] += noise * (*value - before);
        }
    }

    /// Updates by a corrected reading; `probability` is that of the number of contacts.
    pub fn learn(
        &mut self,
        likelihood: &dyn Likelihood,
        whitened: &[f64],
        contacts: &[TrackedContact],
        probability: f64,
    ) {
        let Some(drift) = &mut self.drift else { return };
        let contacts: Vec<Contact> = contacts.iter().map(contact_of).collect();
        if self.block.count > 0.0
            && (self.block.contacts.len() != contacts.len() || self.block.is_full(self.time_s))
        {
            drift.observe(likelihood, &std::mem::take(&mut self.block));
        }
        if probability < SURE {
            return;
        }
        let predicted = likelihood.linearised(&contacts).reading;
        let time_s = self.time_s;
        let shown = whitened.iter().zip(&predicted).enumerate();
        self.block.add(
            time_s,
            shown.map(|(i, (value, own))| value - own + drift.offset_at(i, time_s)),
            &contacts,
        );
    }

    /// Over the noise.
    pub fn drift_covariance(&self) -> Option<&Array2<f64>> {
        self.drift.as_ref().map(|drift| &drift.covariance)
    }

    pub fn move_baseline(&mut self, by: &[f64]) {
        let moved: Vec<f64> = self.noise.iter().map(|(channel, noise)| by[*channel] / noise).collect();
        let is_new = moved.iter().any(|moved| moved.abs() > 1.0);
        if is_new {
            self.creep.iter_mut().for_each(|(_, states)| states.fill(0.0));
        }
        let Some(drift) = &mut self.drift else { return };
        if is_new {
            self.block = Block::default();
            // A new baseline, with the noise of its readings.
            *drift = DriftFilter::new(drift.config, &vec![1.0; self.noise.len()]);
        } else {
            drift.move_by(&moved);
            self.block
                .offsets
                .iter_mut()
                .zip(&moved)
                .for_each(|(sum, moved)| *sum -= self.block.count * moved);
        }
    }
}

/// Whitening is affine: 1 in a channel adds 1/noise.
fn noise(likelihood: &dyn Likelihood, channels: usize) -> Vec<(usize, f64)> {
    let (mut reading, mut from, mut to) = (vec![0.0; channels], Vec::new(), Vec::new());
    likelihood.whiten(&reading, &mut from);
    let mut noise = vec![(0, f64::INFINITY); from.len()];
    for channel in 0..channels {
        reading[channel] = 1.0;
        likelihood.whiten(&reading, &mut to);
        reading[channel] = 0.0;
        for (own, (to, from)) in noise.iter_mut().zip(to.iter().zip(&from)) {
            if to != from {
                *own = (channel, 1.0 / (to - from));
            }
        }
    }
    noise
}

fn contact_of(tracked: &TrackedContact) -> Contact {
    let y_m = tracked.transverse.map_or(0.0, |across| across.y_m);
    Contact { position: Position { x_m: tracked.x_m, y_m }, force_n: tracked.force_n }
}

impl Block {
    fn is_full(&self, time_s: f64) -> bool {
        time_s - self.start_s >= BLOCK_S
    }

    fn add(&mut self, time_s: f64, offsets: impl Iterator<Item = f64>, contacts: &[Contact]) {
        if self.count == 0.0 {
            self.start_s = time_s;
            self.contacts = vec![[0.0; 3]; contacts.len()];
        }
        self.count += 1.0;
        self.times_s += time_s;
        for (i, offset) in offsets.enumerate() {
            match self.offsets.get_mut(i) {
                Some(sum) => *sum += offset,
                None => self.offsets.push(offset),
            }
        }
        for (sum, Contact { position, force_n }) in self.contacts.iter_mut().zip(contacts) {
            sum.iter_mut().zip([position.x_m, position.y_m, *force_n]).for_each(|(sum, own)| *sum += own);
        }
    }
}

impl DriftFilter {
    /// Initial standard deviations over the noise, at least 1.
    fn new(config: Drift, offset_sd: &[f64]) -> Self {
        let channels = offset_sd.len();
        let variance = |i: usize| offset_sd[i].powi(2).max(1.0);
        let model = |walk: f64, rate: f64| {
            let variance = |i: usize| if i < channels { variance(i) } else { rate * rate };
            let covariance = Array2::from_diag(&Array1::from_iter((0..2 * channels).map(variance)));
            Model { walk, rate, log_weight: 0.0, mean: Array1::zeros(2 * channels), covariance }
        };
        let walks = config.walks_per_root_s.into_iter();
        Self {
            config,
            models: walks.flat_map(|walk| config.rates_per_s.map(|rate| model(walk, rate))).collect(),
            time_s: None,
            offset: Array1::zeros(channels),
            rate: Array1::zeros(channels),
            covariance: Array2::from_diag(&Array1::from_iter((0..channels).map(variance))),
        }
    }

    fn offset_at(&self, i: usize, time_s: f64) -> f64 {
        let since_s = self.time_s.map_or(0.0, |own_s| (time_s - own_s).clamp(0.0, UNSEEN_S));
        self.offset[i] + since_s * self.rate[i]
    }

    /// Ignores d along θ.
    fn observe(&mut self, likelihood: &dyn Likelihood, block: &Block) {
        let mean = |sum: f64| sum / block.count;
        let time_s = mean(block.times_s);
        let duration_s = self.time_s.map_or(0.0, |own_s| (time_s - own_s).clamp(0.0, UNSEEN_S));
        let shown: Array1<f64> = block.offsets.iter().map(|sum| mean(*sum)).collect();
        let contacts: Vec<Contact> = block
            .contacts
            .iter()
            .map(|sums| {
                let [x_m, y_m, force_n] = sums.map(mean);
                Contact { position: Position { x_m, y_m }, force_n }
            })
            .collect();
        let at = likelihood.linearised(&contacts);
        let mut noise = Array2::from_diag(&Array1::from_elem(shown.len(), 1.0 / block.count));
        for (i, variance) in at.variance.iter().enumerate() {
            noise[[i, i]] += ALIKE * variance;
        }
        let mut basis = Vec::new();
        at.derivatives.into_iter().for_each(|column| push_rest(&mut basis, column, PARALLEL));
        for along in basis.into_iter().map(Array1::from) {
            let column = along.view().insert_axis(ndarray::Axis(1));
            noise += &(column.dot(&column.t()) * FLAT);
        }
        let is_untouched = contacts.is_empty();
        for model in &mut self.models {
            model.predict(duration_s, self.config.rate_s);
            let evidence = model.update(&shown, &noise);
            if is_untouched {
                model.log_weight = KEPT * model.log_weight + evidence.unwrap_or(0.0);
            }
        }
        self.time_s = Some(time_s);
        self.mix();
    }

    fn move_by(&mut self, moved: &[f64]) {
        for mean in self.models.iter_mut().map(|model| &mut model.mean).chain([&mut self.offset]) {
            mean.iter_mut().zip(moved).for_each(|(mean, moved)| *mean -= moved);
        }
    }

    fn mix(&mut self) {
        let channels = self.offset.len();
        let best = self.models.iter().map(|model| model.log_weight).fold(f64::NEG_INFINITY, f64::max);
        let shares: Vec<f64> = self.models.iter().map(|model| (model.log_weight - best).exp()).collect();
        let sum: f64 = shares.iter().sum();
        self.offset.fill(0.0);
        self.rate.fill(0.0);
        self.covariance.fill(0.0);
        for (model, share) in self.models.iter().zip(&shares) {
            self.offset.scaled_add(share / sum, &model.mean.slice(s![..channels]));
            self.rate.scaled_add(share / sum, &model.mean.slice(s![channels..]));
        }
        for (model, share) in self.models.iter().zip(&shares) {
            let off = &model.mean.slice(s![..channels]) - &self.offset;
            let column = off.view().insert_axis(ndarray::Axis(1));
            let own = &model.covariance.slice(s![..channels, ..channels]) + &column.dot(&column.t());
            self.covariance.scaled_add(share / sum, &own);
        }
    }
}

/// Adds the uncertainty by drift.
pub(super) fn widen(covariance: &Array2<f64>, likelihood: &dyn Likelihood, tracked: &mut [TrackedContact]) {
    let contacts: Vec<Contact> = tracked.iter().map(contact_of).collect();
    let greatest_n = likelihood.force_range().map_or(f64::INFINITY, |range| range.ends_n().1);
    let added = covariance_of_contacts(covariance, &likelihood.linearised(&contacts));
    for (k, one) in tracked.iter_mut().enumerate() {
        let of = |i: usize, j: usize| added[3 * k + i][3 * k + j];
        one.widen([of(0, 0), of(0, 1), of(1, 1), of(2, 2)], likelihood.extent(), greatest_n);
    }
}

/// A⁻¹·Jᵀ·P·J·A⁻¹ with A = JᵀJ, J = ∂h/∂θ and P the covariance of d.
fn covariance_of_contacts(covariance: &Array2<f64>, at: &Linearisation) -> Matrix<6> {
    let (mut a, mut b) = ([[0.0; 6]; 6], [[0.0; 6]; 6]);
    let mut added = [[0.0; 6]; 6];
    let columns: Vec<&[f64]> = at.derivatives.iter().map(Vec::as_slice).take(6).collect();
    for (j, right) in columns.iter().enumerate() {
        let spread: Vec<f64> = covariance
            .rows()
            .into_iter()
            .map(|row| row.iter().zip(*right).map(|(own, right)| own * right).sum())
            .collect();
        for (i, left) in columns.iter().enumerate() {
            a[i][j] = dot(left, right);
            b[i][j] = dot(left, &spread);
        }
    }
    let free = std::array::from_fn(|i| i < columns.len() && a[i][i] > 0.0);
    if let Some(factors) = Ldl::of_free(&a, free) {
        let inverse = factors.inverse();
        for i in 0..6 {
            for j in 0..6 {
                added[i][j] = form(&inverse[i], &b, &inverse[j]);
            }
        }
    }
    added
}

impl Model {
    fn predict(&mut self, duration_s: f64, rate_s: f64) {
        let channels = self.mean.len() / 2;
        let (d, v) = (s![..channels], s![channels..]);
        let stays = (-duration_s / rate_s).exp();
        let rate = self.mean.slice(v).to_owned();
        self.mean.slice_mut(d).scaled_add(duration_s, &rate);
        self.mean.slice_mut(v).mapv_inplace(|rate| stays * rate);
        let (dd, dv) = (s![..channels, ..channels], s![..channels, channels..]);
        let (vd, vv) = (s![channels.., ..channels], s![channels.., channels..]);
        let rates = self.covariance.slice(vv).to_owned();
        let cross = self.covariance.slice(dv).to_owned();
        let mut offsets = self.covariance.slice_mut(dd);
        offsets.scaled_add(duration_s, &cross);
        offsets.scaled_add(duration_s, &cross.t());
        offsets.scaled_add(duration_s * duration_s, &rates);
        let mut moved = cross;
        moved.scaled_add(duration_s, &rates);
        moved.mapv_inplace(|cross| stays * cross);
        self.covariance.slice_mut(dv).assign(&moved);
        self.covariance.slice_mut(vd).assign(&moved.t());
        self.covariance.slice_mut(vv).mapv_inplace(|rates| stays * stays * rates);
        // Process noise of the rate in the step, approximated as uniform.
        let unrest = self.rate * self.rate * (1.0 - stays * stays);
        for i in 0..channels {
            let at = channels + i;
            self.covariance[[i, i]] +=
                self.walk * self.walk * duration_s + unrest * duration_s * duration_s / 3.0;
            self.covariance[[i, at]] += 0.5 * unrest * duration_s;
            self.covariance[[at, i]] += 0.5 * unrest * duration_s;
            self.covariance[[at, at]] += unrest;
        }
    }

    /// Log probability; `None`, without update, for an outlier.
    fn update(&mut self, shown: &Array1<f64>, noise: &Array2<f64>) -> Option<f64> {
        let channels = shown.len();
        let off = shown - &self.mean.slice(s![..channels]);
        let sum = &self.covariance.slice(s![..channels, ..channels]) + noise;
        let factor = Cholesky::factor(sum).ok()?;
        let misfit: f64 = factor.solve_lower(&off).iter().map(|off| off * off).sum();
        let most = channels as f64 + 6.0 * (2.0 * channels as f64).sqrt();
        if misfit > most {
            return None;
        }
        // K = P·Hᵀ·S⁻¹, by its transpose.
        let observed = self.covariance.slice(s![.., ..channels]).to_owned();
        let halves = factor.solve_lower_matrix(observed.t().to_owned());
        let moved = halves.t().dot(&factor.solve_lower(&off));
        self.mean += &moved;
        self.covariance -= &halves.t().dot(&halves);
        Some(-0.5 * (misfit + factor.log_determinant()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::likelihood::CalibrationVariance;
    use palpate_mechanics::surface::Extent;

    /// Steady variance of a random walk in noise: (√(q² + 4·q·r) − q)/2.
    #[test]
    fn a_walk_s_variance_is_that_of_the_steady_filter() {
        let (walk, noise, every_s) = (0.3, 0.05, 0.2);
        let mut filter = DriftFilter::new(Drift { walks_per_root_s: [walk; 3], ..Drift::default() }, &[1.0]);
        let model = &mut filter.models[0];
        model.covariance[[1, 1]] = 0.0;
        model.rate = 0.0;
        for _ in 0..200 {
            model.predict(every_s, 300.0);
            model.update(&Array1::from(vec![0.0]), &Array2::from_elem((1, 1), noise)).unwrap();
        }
        let q = walk * walk * every_s;
        let steady = 0.5 * ((q * q + 4.0 * q * noise).sqrt() - q);
        assert!((model.covariance[[0, 0]] / steady - 1.0).abs() < 1e-9);
    }

    /// d integrates v.
    #[test]
    fn one_long_step_is_many_short_ones() {
        let start = || {
            let filter = DriftFilter::new(Drift::default(), &[1.0; 2]);
            let mut model = filter.models[8].clone();
            model.mean.iter_mut().enumerate().for_each(|(i, mean)| *mean = 0.1 * (i + 1) as f64);
            model
        };
        let (mut long, mut short) = (start(), start());
        long.predict(2.0, 300.0);
        (0..200).for_each(|_| short.predict(0.01, 300.0));
        for (long, short) in long.mean.iter().zip(&short.mean) {
            assert!((long - short).abs() < 5e-3 * short.abs(), "{long} {short}");
        }
        for (long, short) in long.covariance.iter().zip(&short.covariance) {
            assert!((long - short).abs() < 0.01 * short.abs() + 1e-12, "{long} {short}");
        }
    }

    #[test]
    fn a_line_is_found_by_its_rate_and_carried_on() {
        let mut filter = DriftFilter::new(Drift::default(), &[1.0; 3]);
        let likelihood = SilentModel(3);
        let mut offset = [0.0; 3];
        for i in 0..600_u32 {
            let time_s = 0.2 * f64::from(i);
            // Noise of a mean of 20 that never repeats.
            let noise = |c: u32| 0.2 * (f64::from((i * (7 + 3 * c)) % 101) / 50.0 - 1.0);
            offset = [0.02, -0.02, 0.0].map(|rate| rate * time_s);
            let offsets = (0..3).map(|c| 20.0 * (offset[c as usize] + noise(c))).collect();
            filter.observe(
                &likelihood,
                &Block {
                    count: 20.0,
                    start_s: time_s,
                    times_s: 20.0 * time_s,
                    offsets,
                    contacts: Vec::new(),
                },
            );
        }
        for (c, rate) in [0.02, -0.02, 0.0].into_iter().enumerate() {
            assert!((filter.rate[c] - rate).abs() < 4e-3, "{}", filter.rate);
            let later = filter.offset_at(c, 119.8 + 30.0);
            assert!((later - offset[c] - 30.0 * rate).abs() < 0.25, "{c}: {later}");
        }
    }

    #[test]
    fn creep_is_subtracted() {
        let creep = Creep { share: 0.08, time_s: 4.0 };
        let mut state = SlowState::new(&SilentModel(2), 2, None, Some(creep));
        let (mut z, every_s) = ([0.0; 2], 0.05);
        for i in 0..2000_u32 {
            let fresh = if (i / 400) % 2 == 1 { [30.0, -4.0] } else { [0.0; 2] };
            let way = -(-every_s / creep.time_s).exp_m1();
            let way = if i == 0 { 0.0 } else { way };
            let mut reading: [f64; 2] = std::array::from_fn(|c| {
                z[c] += way * (fresh[c] - z[c]);
                fresh[c] + creep.share * z[c]
            });
            let mut whitened = reading;
            state.subtract(f64::from(i) * every_s, (i > 0).then_some(every_s), &mut whitened, &mut reading);
            for c in 0..2 {
                assert!((whitened[c] - fresh[c]).abs() < 1e-9 && (reading[c] - fresh[c]).abs() < 1e-9, "{i}");
            }
        }
    }

    struct SilentModel(usize);

    impl Likelihood for SilentModel {
        fn geometry(&self) -> crate::likelihood::Geometry<'_> {
            unreachable!("no tracker asks")
        }

        fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>) {
            whitened.clear();
            whitened.extend(reading);
        }

        fn fit_untouched(&self, _: &[f64], _: f64) -> crate::likelihood::ContactFit<1> {
            unreachable!("no tracker asks")
        }

        fn signal(&self, _: Contact) -> f64 {
            0.0
        }

        fn calibration_variance(&self, _: &[Contact]) -> [CalibrationVariance; 2] {
            [CalibrationVariance::default(); 2]
        }

        fn linearised(&self, _: &[Contact]) -> Linearisation {
            let zeros = vec![0.0; self.0];
            Linearisation { reading: zeros.clone(), derivatives: Vec::new(), variance: zeros }
        }

        fn is_residue(&self, _: &[f64]) -> bool {
            false
        }

        fn interval_check(&self) -> Option<&crate::interval_check::IntervalCheck> {
            None
        }

        fn untouched_drift(&self) -> Option<&UntouchedDrift> {
            None
        }

        fn single_estimate(&self, _: &[f64]) -> palpate_core::Estimate {
            unreachable!("no tracker asks")
        }

        fn extent(&self) -> Extent {
            Extent::line(1.0).unwrap()
        }

        fn known_force_n(&self) -> Option<f64> {
            None
        }

        fn force_range(&self) -> Option<crate::force_prior::ForceRange> {
            None
        }

        fn most_contacts(&self) -> usize {
            1
        }
    }
}

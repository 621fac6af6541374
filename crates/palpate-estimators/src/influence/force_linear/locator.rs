//! Locator of a force-linear surface: posterior over a grid, integrated over the force ([`super::seen`]).

use super::broad_scan::{BroadScan, ChannelAtPlace};
use super::drift::DriftCourse;
use super::posterior::Functions;
use super::prior::{Prior, Source};
use super::saturation::Saturation;
use super::scan::Scan;
use super::shared_errors::own_shares;
use crate::detectable_force::DetectableForce;
use crate::fit::{Locate, LocatorFault, NoCheck};
use crate::force_prior::{ForcePrior, ForceRange, LogNormalPrior, NormalPrior};
use crate::influence::at_nodes::InfluencesAtNodes;
use crate::influence::config::Structure;
use crate::influence::grid::{Axis, check_axes, greatest_distances};
use crate::influence::inversion::Layers;
use crate::influence::lanes::{Lanes, in_lanes};
use crate::recording::LEAST_FREEDOM;
use crate::setup::Setup;
use crate::status::{Detection, Directions, FalseAlarmRate, NoiseBounds, unknowns};
use palpate_core::{Estimate, Status};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::CramerRaoBound;
use palpate_mechanics::surface::{Extent, ResponseFunction, ResponseGradient};
use palpate_numerics::median;
use palpate_numerics::regression::Kernel;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tables {
    offsets: Vec<f64>,
    /// σ, in the channel's unit.
    noise_sd: Vec<f64>,
    /// ω over σ².
    offset_variances: Vec<f64>,
    /// f over σ per newton, at index (x·count_y + y)·channels + c.
    values: Vec<f64>,
    /// v over σ², per newton squared.
    variances: Vec<f64>,
    /// β over σ², per newton.
    covariances: Vec<f64>,
}

impl Tables {
    pub fn new(functions: &[Functions]) -> Self {
        let noise_sd: Vec<f64> = functions.iter().map(|found| found.noise_variance.sqrt()).collect();
        let places = functions.first().map_or(0, |functions| functions.values.len());
        let at_places = |of: fn(&Functions) -> &Vec<f64>, power: i32| -> Vec<f64> {
            let channels = || functions.iter().zip(&noise_sd);
            (0..places)
                .flat_map(|place| channels().map(move |(found, noise)| of(found)[place] / noise.powi(power)))
                .collect()
        };
        let offset_variance = |(found, noise): (&Functions, &f64)| found.offset_variance / (noise * noise);
        Self {
            offsets: functions.iter().map(|found| found.offset).collect(),
            offset_variances: functions.iter().zip(&noise_sd).map(offset_variance).collect(),
            values: at_places(|found| &found.values, 1),
            variances: at_places(|found| &found.variances, 2),
            covariances: at_places(|found| &found.covariances, 2),
            noise_sd,
        }
    }

    /// Removes a channel, counted from 0 among those in use.
    pub fn without_channel(mut self, removed: usize) -> Self {
        let channels = self.offsets.len().max(1);
        let Self { offsets, noise_sd, offset_variances, values, variances, covariances } = &mut self;
        // Every list has the channels of one place after those of another.
        for list in [offsets, noise_sd, offset_variances, values, variances, covariances] {
            let mut index = 0..;
            list.retain(|_| index.next().is_some_and(|i: usize| i % channels != removed));
        }
        self
    }

    /// Returns whether the posterior variance of a contact's reading exceeds the noise at some node.
    fn exceed_noise(&self, force_n: f64) -> bool {
        let channels = self.offsets.len().max(1);
        let variances = self.variances.iter().zip(&self.covariances).enumerate();
        let of_contact = |(i, (v, beta)): (usize, (&f64, &f64))| {
            self.offset_variances[i % channels] + force_n * (2.0 * beta + force_n * v)
        };
        variances.map(of_contact).any(|variance| variance > 1.0)
    }

    /// Returns whether the posterior variance of a contact's reading exceeds two channels' noise at half of
    /// the nodes.
    pub fn are_undetermined(&self, force_n: f64) -> bool {
        const LEAST: f64 = 2.0;
        let ratio = |variances: &[f64]| force_n * force_n * variances.iter().sum::<f64>();
        let places = self.variances.chunks(self.offsets.len().max(1));
        median(places.map(ratio).collect()).is_some_and(|ratio| ratio > LEAST)
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ForceLinearContents {
    pub x: Axis,
    pub y: Axis,
    /// Least and greatest coordinates, in metres; empty in files without them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outermost_m: Vec<(f64, f64)>,
    /// Channels of a reading; below, those in use, from 0.
    pub channels: usize,
    pub live: Vec<usize>,
    pub functions: Tables,
    pub known_force_n: Option<f64>,
    /// Mean and standard deviation of φ of the presses.
    pub mean_force_n: f64,
    pub force_sd_n: f64,
    /// Largest φ of a contact without a range.
    pub hardest_n: f64,
    /// `None` for a normal prior by the presses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_range: Option<ForceRange>,
    /// Squared residual, in variances, from which a reading is `outside_model`.
    pub residual_limit: f64,
    /// Score from which a contact is [distributed](crate::spread).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spread_limit: Option<f64>,
    pub prior: Prior,
    pub set_aside: Vec<usize>,
    #[serde(default)]
    pub structure: Structure,
    pub presses: usize,
    pub noise_freedom: f64,
    #[serde(default)]
    pub false_alarm_rate: FalseAlarmRate,
    /// Overdispersion: divisor of the log-likelihood; 1 but in older files.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub channels_as_one: f64,
    /// Loadings on common-mode errors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shared_errors: Vec<f64>,
    /// Changes from first to last row; empty without drift, and in files without it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drifts: Vec<f64>,
    /// The functions are those of linearized readings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub saturation: Option<Saturation>,
}

const fn one() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

/// Locator by offsets and influence functions without a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ForceLinearContents", into = "ForceLinearContents")]
pub struct ForceLinearLocator {
    pub(super) stored: ForceLinearContents,
    /// Prior of φ.
    pub(super) force_prior: ForcePrior,
    /// f, v and β.
    pub(super) layers: Layers,
    /// ω.
    pub(super) offset_variances: Vec<Lanes>,
    /// r: independent share of the posterior variance.
    pub(super) own: Vec<Lanes>,
    /// u: loadings on common-mode errors.
    pub(super) shared: Vec<Lanes>,
    pub(super) scan: CellScan,
    /// Greatest distances from neighbours' influences, per newton.
    pub(super) lengths: Vec<[f64; 2]>,
    /// Critical value of the square of noise.
    noise_bound: f64,
    /// Critical value of the square's reduction by a contact.
    detection_bound: f64,
    identifies_untouched: bool,
    /// Whether the calibration's variance of a contact exceeds the noise at some node.
    pub(super) is_uncertain: bool,
}

/// Scatter of presses in proportion to their response, added to the noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// Root mean square force, in newtons.
    pub force_n: f64,
    /// Channels in use, from 0, with their standard deviations under this force, in their unit.
    pub sd: Vec<(usize, f64)>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum CellScan {
    /// Bounds by the variances of the largest φ.
    Bounded(Scan),
    /// Costs by the variances of each node's φ.
    Broad(BroadScan),
}

/// Standard deviation of the force prior over the presses'.
const FORCE_SPREAD: f64 = 2.0;
pub(super) const VALUES: usize = 0;
pub(super) const VARIANCES: usize = 1;
pub(super) const COVARIANCES: usize = 2;
pub(super) const LAYERS: usize = 3;

impl ForceLinearContents {
    pub fn into_locator(self) -> ForceLinearLocator {
        let mut locator = ForceLinearLocator {
            force_prior: self.force_prior(),
            layers: Layers::new([self.x, self.y], LAYERS, self.live.len(), |place, layer, channel| {
                let Tables { values, variances, covariances, .. } = &self.functions;
                [values, variances, covariances][layer][place * self.live.len() + channel]
            }),
            offset_variances: in_lanes(&self.functions.offset_variances),
            own: in_lanes(&self.own_shares()),
            shared: in_lanes(&self.shared_errors),
            scan: CellScan::Bounded(Scan::default()),
            lengths: Vec::new(),
            noise_bound: 0.0,
            detection_bound: 0.0,
            identifies_untouched: true,
            is_uncertain: self.functions.exceed_noise(self.mean_force_n),
            stored: self,
        };
        locator.find_lengths();
        locator.scan = locator.new_scan();
        locator.bound_noise();
        locator
    }

    fn force_prior(&self) -> ForcePrior {
        match self.force_range {
            Some(range) => {
                let (least_n, greatest_n) = range.ends_n();
                let [least_n, greatest_n] =
                    [least_n, greatest_n].map(|force_n| self.prior.response_n(force_n));
                ForcePrior::LogNormal(LogNormalPrior::new(least_n, greatest_n))
            }
            None => ForcePrior::Normal(NormalPrior {
                mean_n: self.mean_force_n,
                precision: (FORCE_SPREAD * self.force_sd_n).powi(-2),
                greatest_n: self.hardest_n,
            }),
        }
    }

    fn own_shares(&self) -> Vec<f64> {
        if self.shared_errors.is_empty() {
            return vec![1.0; self.live.len()];
        }
        own_shares(&self.shared_errors, self.prior.extent)
    }

    fn check(&self) -> Result<(), LocatorFault> {
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        check_axes(&[self.x, self.y])?;
        let places = self.x.count.saturating_mul(self.y.count);
        let Tables { offsets, noise_sd, offset_variances, values, variances, covariances } = &self.functions;
        let live = self.live.len();
        let is_channel = |c: &&usize| **c >= self.channels;
        if let Some(c) = self.live.iter().find(is_channel) {
            return Err(LocatorFault::Count {
                what: "channels",
                needed: c.saturating_add(1),
                found: self.channels,
            });
        }
        LocatorFault::check_count("offsets", live, offsets.len())?;
        LocatorFault::check_count("noises", live, noise_sd.len())?;
        LocatorFault::check_count("offset variances", live, offset_variances.len())?;
        for (what, list) in [
            ("influence values", values),
            ("influence variances", variances),
            ("influence covariances", covariances),
        ] {
            LocatorFault::check_count(what, places.saturating_mul(live), list.len())?;
        }
        numbers("offset", offsets, |_| true, "a finite number")?;
        numbers("drift", &self.drifts, |_| true, "a finite number")?;
        let outermost_m = self.outermost_m.iter().flat_map(|(first_m, last_m)| [*first_m, *last_m]);
        LocatorFault::check_numbers("outermost press", outermost_m, |_| true, "a finite number")?;
        numbers("mean force", &[self.mean_force_n], |_| true, "a finite number")?;
        numbers("influence value", values, |_| true, "a finite number")?;
        numbers("influence covariance", covariances, |_| true, "a finite number")?;
        numbers("noise", noise_sd, |sd| sd > 0.0, "finite and greater than 0")?;
        for (what, list) in [("offset variance", offset_variances), ("influence variance", variances)] {
            numbers(what, list, |v| v >= 0.0, "finite and at least 0")?;
        }
        self.prior.check()?;
        numbers("channels as one", &[self.channels_as_one], |count| count >= 1.0, "at least 1")?;
        if !self.shared_errors.is_empty() {
            LocatorFault::check_count("loadings on shared errors", live, self.shared_errors.len())?;
        }
        if let Some(Saturation { share, ranges }) = &self.saturation {
            numbers(
                "saturation",
                &[*share],
                |share| (0.0..1.0).contains(&share),
                "at least 0 and less than 1",
            )?;
            LocatorFault::check_count("ranges of channels", live, ranges.len())?;
            numbers("range of a channel", ranges, |range| range > 0.0, "finite and greater than 0")?;
        }
        let is_share = |loading: f64| (-1.0..=1.0).contains(&loading);
        numbers("loading on shared errors", &self.shared_errors, is_share, "from -1 to 1")?;
        let force = [self.hardest_n, self.force_sd_n, self.known_force_n.unwrap_or(1.0)];
        numbers("force", &force, |force| force > 0.0, "greater than 0")?;
        numbers(
            "degrees of freedom of the noise",
            &[self.noise_freedom],
            |freedom| freedom > 2.0,
            "greater than 2",
        )?;
        numbers("residual limit", &[self.residual_limit], |limit| limit > 0.0, "greater than 0")?;
        LocatorFault::check_numbers("spread limit", self.spread_limit, |limit| limit > 0.0, "greater than 0")
    }
}

impl TryFrom<ForceLinearContents> for ForceLinearLocator {
    type Error = LocatorFault;

    fn try_from(stored: ForceLinearContents) -> Result<Self, LocatorFault> {
        stored.check()?;
        Ok(stored.into_locator())
    }
}

impl From<ForceLinearLocator> for ForceLinearContents {
    fn from(locator: ForceLinearLocator) -> Self {
        locator.stored
    }
}

#[derive(Clone, Copy, Debug)]
struct Place<'a> {
    values: &'a [f64],
    variances: &'a [f64],
    covariances: &'a [f64],
}

impl ForceLinearLocator {
    pub(super) fn with_saturation(mut self, saturation: &Saturation, channels: &[usize]) -> Self {
        let range_of = |c: &usize| channels.binary_search(c).map_or(f64::MAX, |i| saturation.ranges[i]);
        let ranges = self.stored.live.iter().map(range_of).collect();
        self.stored.saturation =
            (saturation.share > 0.0).then_some(Saturation { share: saturation.share, ranges });
        self.stored.structure = Structure::ForceSaturating;
        self
    }

    pub(crate) fn with_false_alarm_rate(mut self, rate: FalseAlarmRate) -> Self {
        self.stored.false_alarm_rate = rate;
        self.bound_noise();
        self
    }

    /// Kernel and length scales, in metres, of the smooth part; `None` without one.
    pub fn correlation(&self) -> Option<(Kernel, &[f64])> {
        (self.stored.prior.smooth_part > 0.0)
            .then_some((self.stored.prior.kernel, &self.stored.prior.lengths_m))
    }

    /// Offset of each channel, in its unit; 0 if not in use.
    pub fn offsets(&self) -> Vec<f64> {
        let mut offsets = vec![0.0; self.stored.channels];
        self.channels().for_each(|(c, offset, _)| offsets[c] = offset);
        offsets
    }

    /// False-alarm rate of untouched readings.
    pub fn false_alarm_rate(&self) -> FalseAlarmRate {
        self.stored.false_alarm_rate
    }

    /// Kind of point sensors; `None` for smooth influences.
    pub fn source(&self) -> Option<Source> {
        self.stored.prior.source
    }

    /// Exponent of the response to force; 1 if linear.
    pub fn response(&self) -> f64 {
        self.stored.prior.response
    }

    /// Relative shortfall of the largest reading; `None` without saturation.
    pub fn saturation_share(&self) -> Option<f64> {
        self.stored.saturation.as_ref().map(|saturation| saturation.share)
    }

    /// Changes of offsets from the first row to the last; empty without drift, and for files without it.
    pub fn drifts(&self) -> Vec<(usize, f64)> {
        self.stored.live.iter().copied().zip(self.stored.drifts.iter().copied()).collect()
    }

    /// Course of the drift; `None` without drift.
    pub fn drift_course(&self) -> Option<DriftCourse> {
        (self.stored.prior.drift > 0.0).then_some(self.stored.prior.drift_course)
    }

    /// Scatter that grows with force; `None` without it.
    pub fn scatter(&self) -> Option<Scatter> {
        let Prior { scatter, force_scale_n, .. } = self.stored.prior;
        let channel = |(c, _, noise): (usize, f64, f64)| (c, scatter.sqrt() * noise);
        (scatter > 0.0)
            .then(|| Scatter { force_n: force_scale_n, sd: self.channels().map(channel).collect() })
    }

    /// Extent of the surface.
    pub fn extent(&self) -> Extent {
        self.stored.prior.extent
    }

    /// Least and greatest noise standard deviation over an untouched board's, with positions; `None` if
    /// uniform.
    pub fn noise_by_place(&self) -> Option<[(f64, Position); 2]> {
        self.stored.prior.noise_by_place.as_ref()?;
        let [x, y] = self.axes();
        let at = |place: usize| {
            let node = self.node(place);
            let position = Position { x_m: x.value(node[0]), y_m: y.value(node[1]) };
            (self.noise_at(node).sqrt(), position)
        };
        let by_noise = |a: &(f64, Position), b: &(f64, Position)| a.0.total_cmp(&b.0);
        let places = || (0..self.places()).map(at);
        Some([places().min_by(by_noise)?, places().max_by(by_noise)?])
    }

    /// Fitted structure.
    pub fn structure(&self) -> Structure {
        match (&self.stored.saturation, self.response() == 1.0) {
            (Some(_), _) => Structure::ForceSaturating,
            (None, true) => Structure::ForceLinear,
            (None, false) => Structure::ForceMonotone,
        }
    }

    /// Requested structure.
    pub fn asked_structure(&self) -> Structure {
        self.stored.structure
    }

    /// Excluded rows, from 0.
    pub fn set_aside(&self) -> &[usize] {
        &self.stored.set_aside
    }

    /// Number of presses of the fit.
    pub fn presses(&self) -> usize {
        self.stored.presses
    }

    /// Returns whether the noise estimate is unreliable, with few repeats and untouched rows.
    pub fn noise_is_hardly_told(&self) -> bool {
        self.stored.noise_freedom <= LEAST_FREEDOM
    }

    /// Index, offset and noise of each channel in use.
    pub fn channels(&self) -> impl Iterator<Item = (usize, f64, f64)> {
        let Tables { offsets, noise_sd, .. } = &self.stored.functions;
        self.stored.live.iter().zip(offsets).zip(noise_sd).map(|((c, offset), noise)| (*c, *offset, *noise))
    }

    /// Influence functions and standard deviations at the nodes, per newton of [`response`](Self::response).
    pub fn influences_at_nodes(&self) -> InfluencesAtNodes {
        let Tables { offsets, noise_sd, values, variances, .. } = &self.stored.functions;
        let [x, y] = self.axes();
        let position = |place: usize| {
            let [i, j] = self.node(place);
            Position { x_m: x.value(i), y_m: y.value(j) }
        };
        let per_noise = |(i, value): (usize, f64)| value * noise_sd[i % noise_sd.len()];
        InfluencesAtNodes {
            positions: (0..self.places()).map(position).collect(),
            channels: self.stored.live.clone(),
            offsets: offsets.clone(),
            noise_sd: noise_sd.clone(),
            values: values.iter().copied().enumerate().map(per_noise).collect(),
            sd: variances.iter().map(|variance| variance.sqrt()).enumerate().map(per_noise).collect(),
        }
    }

    /// Cramér–Rao bound by the fitted influences and noise.
    pub fn cramer_rao_bound(&self, extent: Extent) -> CramerRaoBound<'_> {
        let channel = |channel| {
            let response: Arc<dyn ResponseFunction> = Arc::new(LearntResponse { locator: self, channel });
            response
        };
        CramerRaoBound::of_responses(extent, (0..self.stored.live.len()).map(channel))
    }

    /// Smallest detectable force.
    pub fn lightest_touch(&self) -> DetectableForce<'_> {
        let coordinates = if self.stored.y.count > 1 { 2 } else { 1 };
        let detection = Detection {
            channels: self.stored.live.len(),
            unknowns: unknowns(coordinates, None),
            square: self.noise_bound,
            taken: self.detection_bound,
        };
        let change = move |Contact { position, force_n }: Contact| {
            let values = self.influences_at(position);
            let offset_variances = &self.stored.functions.offset_variances;
            let response_n = self.stored.prior.response_n(force_n);
            values
                .iter()
                .zip(offset_variances)
                .map(|(f, variance)| response_n * f / (1.0 + variance).sqrt())
                .collect()
        };
        let noise_sds = self.noise_of_channels().into_iter().enumerate();
        let noise_sds = noise_sds.filter_map(|(channel, sd)| Some((channel, sd?))).collect();
        DetectableForce::new(detection, self.stored.false_alarm_rate, noise_sds, Box::new(change))
    }

    /// Standard deviations of noise and offset together; `None` for channels not in use.
    pub fn noise_of_channels(&self) -> Vec<Option<f64>> {
        let Tables { noise_sd, offset_variances, .. } = &self.stored.functions;
        let mut sds = vec![None; self.stored.channels];
        for (channel, (sd, variance)) in self.stored.live.iter().zip(noise_sd.iter().zip(offset_variances)) {
            sds[*channel] = Some(sd * (1.0 + variance).sqrt());
        }
        sds
    }

    fn influences_at(&self, position: Position) -> Vec<f64> {
        let mut values = Vec::new();
        self.layers.interpolate(self.nodes_at(position), VALUES..VALUES + 1, &mut values);
        values.as_flattened()[..self.stored.live.len()].to_vec()
    }

    pub(super) fn axes(&self) -> [Axis; 2] {
        [self.stored.x, self.stored.y]
    }

    pub(super) fn unknowns(&self) -> usize {
        unknowns(if self.stored.y.count > 1 { 2 } else { 1 }, self.stored.known_force_n)
    }

    fn place(&self, place: usize) -> Place<'_> {
        let Tables { values, variances, covariances, .. } = &self.stored.functions;
        let live = self.stored.live.len();
        let of = place * live..(place + 1) * live;
        Place {
            values: &values[of.clone()],
            variances: &variances[of.clone()],
            covariances: &covariances[of],
        }
    }

    fn find_lengths(&mut self) {
        let distances =
            |place: usize| greatest_distances(self.axes(), place, |other| self.way_between(place, other));
        self.lengths = (0..self.places()).map(distances).collect();
    }

    fn new_scan(&self) -> CellScan {
        let live = self.stored.live.len();
        let own = self.stored.own_shares();
        let as_one = self.stored.channels_as_one;
        // Bound of the greatest eigenvalue of the errors' correlation.
        let together = 1.0 + self.stored.shared_errors.iter().map(|loading| loading * loading).sum::<f64>();
        let channel = |place: usize, c: usize| {
            let Place { values, variances, covariances } = self.place(place);
            let offset_variance = self.stored.functions.offset_variances[c];
            let noise = self.noise() * self.noise_at(self.node(place));
            let (v, beta) = (variances[c], covariances[c]);
            let explained = if v > 0.0 { beta * beta / v } else { 0.0 };
            let least = (noise + own[c] * (offset_variance - explained).max(0.0)).powf(as_one.recip());
            ChannelAtPlace { f: values[c], noise, offset_variance, beta, v, least }
        };
        let bounded = |expected: [f64; 2], hardest_n: f64| {
            CellScan::Bounded(Scan::new(
                self.places(),
                live,
                expected,
                self.known_response_n(),
                |place, c| {
                    let ChannelAtPlace { f, noise, offset_variance, beta, v, least } = channel(place, c);
                    let hardest = noise
                        + together * (offset_variance + hardest_n * (2.0 * beta + hardest_n * v)).max(0.0);
                    (f, [least, as_one * hardest.max(noise + together * offset_variance)])
                },
            ))
        };
        match (self.known_response_n(), &self.force_prior) {
            (Some(known_n), _) => bounded([0.0; 2], known_n),
            (None, ForcePrior::Normal(prior)) => bounded([prior.mean_n, prior.precision], prior.greatest_n),
            (None, ForcePrior::LogNormal(prior)) => {
                CellScan::Broad(BroadScan::new(self.places(), live, prior.clone(), |place, c| {
                    channel(place, c).scaled(as_one, as_one * together)
                }))
            }
        }
    }

    fn places(&self) -> usize {
        self.stored.x.count * self.stored.y.count
    }

    /// Distance of influences over the noise, up to a factor for an unknown force.
    fn way_between(&self, place: usize, other: usize) -> f64 {
        let pairs = || self.place(place).values.iter().zip(self.place(other).values);
        let (fg, gg): (f64, f64) = pairs().fold((0.0, 0.0), |(fg, gg), (f, g)| (fg + f * g, gg + g * g));
        let scale = if self.stored.known_force_n.is_none() && gg > 0.0 { fg / gg } else { 1.0 };
        pairs().map(|(f, g)| (f - scale * g).powi(2)).sum::<f64>().sqrt()
    }

    /// Detection test by a reading's square and its reduction by the best contact.
    fn is_no_contact(&self, relative: &[f64]) -> bool {
        let offset_variances = &self.stored.functions.offset_variances;
        let square: f64 =
            relative.iter().zip(offset_variances).map(|(d, variance)| d * d / (1.0 + variance)).sum();
        if square > self.noise_bound || !self.identifies_untouched {
            return false;
        }
        let taken = |place: usize| {
            let channels = relative.iter().zip(self.place(place).values).zip(offset_variances);
            let (fd, ff) = channels.fold((0.0, 0.0), |(fd, ff), ((d, f), variance)| {
                let scaled = f / (1.0 + variance);
                (fd + scaled * d, ff + scaled * f)
            });
            if fd > 0.0 { fd * fd / ff } else { 0.0 }
        };
        (0..self.places()).all(|place| taken(place) <= self.detection_bound)
    }

    /// Returns whether contacts of half the mean force are distinguishable from noise.
    ///
    /// Without rows of force 0, uncertain offsets may prevent it: then no reading is `no_contact`.
    pub fn identifies_untouched(&self) -> bool {
        self.identifies_untouched
    }

    /// Returns false where uncertain offsets alone hide such contacts at over a quarter of the nodes, or with a
    /// noise that no repeats measure.
    fn offsets_are_identified(&self) -> bool {
        const SHARE: f64 = 0.5;
        const HIDDEN: usize = 4;
        let force_n = SHARE * self.known_response_n().unwrap_or(self.stored.mean_force_n);
        let is_identified = |offset_variance: &dyn Fn(usize) -> f64| {
            let square = |place: usize| -> f64 {
                let values = self.place(place).values.iter().enumerate();
                force_n * force_n * values.map(|(c, f)| f * f / (1.0 + offset_variance(c))).sum::<f64>()
            };
            let hidden = (0..self.places()).filter(|place| square(*place) <= self.detection_bound).count();
            HIDDEN * hidden <= self.places()
        };
        let noise_is_measured = self.stored.noise_freedom > LEAST_FREEDOM;
        is_identified(&|c| self.stored.functions.offset_variances[c])
            || noise_is_measured && !is_identified(&|_| 0.0)
    }

    fn bound_noise(&mut self) {
        let freedom = self.stored.noise_freedom;
        // Few degrees of freedom ν underestimate the noise: χ² over an estimated variance is F, with a tail
        // about that of χ² at ν·(e^(b/ν) − 1) (Wallace, Ann. Math. Statist. 30, 1959, for t²).
        let learnt = |bound: f64, freedom: f64| freedom * ((bound / freedom).exp() - 1.0);
        let live = self.stored.live.len();
        let bounds = NoiseBounds::new(live, self.directions(), self.stored.false_alarm_rate);
        self.noise_bound = learnt(bounds.square, freedom * live as f64);
        self.detection_bound = learnt(bounds.taken, freedom);
        self.identifies_untouched = self.offsets_are_identified();
    }

    fn directions(&self) -> Directions {
        let [x, y] = self.axes();
        let direction = |i: usize, j: usize| {
            let values = self.place(i * y.count + j).values;
            let length = values.iter().map(|f| f * f).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            values.iter().map(|f| f / length).collect::<Vec<f64>>()
        };
        let step = |from: &[f64], to: &[f64]| from.iter().zip(to).map(|(a, b)| b - a).collect::<Vec<f64>>();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let way = |a: (usize, usize), b: (usize, usize)| {
            let step = step(&direction(a.0, a.1), &direction(b.0, b.1));
            product(&step, &step).sqrt()
        };
        let along = |j: usize| (1..x.count).map(move |i| way((i - 1, j), (i, j))).sum::<f64>();
        let across = |i: usize| (1..y.count).map(move |j| way((i, j - 1), (i, j))).sum::<f64>();
        if y.count == 1 {
            return Directions { length: along(0), area: 0.0 };
        }
        let boundary = along(0) + along(y.count - 1) + across(0) + across(x.count - 1);
        let mut area = 0.0;
        for (i, j) in (1..x.count).flat_map(|i| (1..y.count).map(move |j| (i, j))) {
            let here = direction(i, j);
            let (a, b) = (step(&direction(i - 1, j), &here), step(&direction(i, j - 1), &here));
            area += (product(&a, &a) * product(&b, &b) - product(&a, &b).powi(2)).max(0.0).sqrt();
        }
        Directions { length: 0.5 * boundary, area }
    }

    /// Linearized reading minus the offsets, over the noise.
    pub(super) fn relative(&self, reading: &[f64]) -> Vec<f64> {
        let Tables { offsets, noise_sd, .. } = &self.stored.functions;
        let deviations = self.stored.live.iter().zip(offsets).map(|(c, offset)| reading[*c] - offset);
        let relative = deviations.enumerate().zip(noise_sd);
        match &self.stored.saturation {
            None => relative.map(|((_, deviation), noise)| deviation / noise).collect(),
            Some(saturation) => {
                relative.map(|((c, deviation), noise)| saturation.linearized(c, deviation) / noise).collect()
            }
        }
    }

    /// Variance factor of estimated noise, ν/(ν − 2) as of Student's t.
    pub(super) fn noise(&self) -> f64 {
        self.stored.noise_freedom / (self.stored.noise_freedom - 2.0)
    }

    pub(super) fn noise_at(&self, [x, y]: [f64; 2]) -> f64 {
        self.noise_at_position(Position { x_m: self.stored.x.value(x), y_m: self.stored.y.value(y) })
    }

    fn noise_at_position(&self, Position { x_m, y_m }: Position) -> f64 {
        let prior = &self.stored.prior;
        prior.noise_at(&[x_m, y_m][..prior.extent.dimensions()])
    }

    fn node(&self, place: usize) -> [f64; 2] {
        let across = self.stored.y.count;
        [(place / across) as f64, (place % across) as f64]
    }

    pub(super) fn known_response_n(&self) -> Option<f64> {
        self.stored.known_force_n.map(|force_n| self.stored.prior.response_n(force_n))
    }

    /// Returns whether noise alone explains a reading.
    #[cfg(test)]
    pub fn is_noise(&self, reading: &[f64]) -> bool {
        self.is_no_contact(&self.relative(reading))
    }
}

struct LearntResponse<'a> {
    locator: &'a ForceLinearLocator,
    channel: usize,
}

impl LearntResponse<'_> {
    fn influence(&self, position: Position) -> f64 {
        self.locator.influences_at(position)[self.channel]
    }

    fn noise(&self, position: Position) -> f64 {
        self.locator.noise_at_position(position).sqrt()
    }
}

impl ResponseFunction for LearntResponse<'_> {
    fn at(&self, contact: Contact) -> f64 {
        let response_n = self.locator.stored.prior.response_n(contact.force_n);
        response_n * self.influence(contact.position) / self.noise(contact.position)
    }

    fn gradient(&self, Contact { position, force_n }: Contact) -> ResponseGradient {
        /// In grid steps.
        const REACH: f64 = 0.05;
        let [x, y] = self.locator.axes();
        let response_n = self.locator.stored.prior.response_n(force_n) / self.noise(position);
        let slope = |axis: Axis, moved: &dyn Fn(f64) -> Position| {
            if axis.count < 2 {
                return 0.0;
            }
            let reach_m = REACH * axis.step;
            let change = self.influence(moved(reach_m)) - self.influence(moved(-reach_m));
            response_n * change / (2.0 * reach_m)
        };
        let along = slope(x, &|by_m| Position { x_m: position.x_m + by_m, ..position });
        let across = slope(y, &|by_m| Position { y_m: position.y_m + by_m, ..position });
        // φ is a power of the force.
        let growth = self.locator.stored.prior.response * response_n / force_n;
        ResponseGradient { position: [along, across], force: growth * self.influence(position) }
    }
}

impl Locate for ForceLinearLocator {
    type Check = NoCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        let relative = self.relative(reading);
        let mut estimate = self.estimate(&relative);
        if self.is_no_contact(&relative) {
            // The most probable contact, though below the detection threshold.
            return Estimate::of_contact(estimate.contact, Status::NoContact);
        }
        self.tell_beyond_presses(&relative, &mut estimate);
        estimate
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("channels", setup.layout().len(), self.stored.channels)
    }
}

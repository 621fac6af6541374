//! Test of readings against the surface model.
//!
//! Each channel is regressed on its modelled reading with offset and gain. Unexplained shares of variance u
//! compare explanations by the likelihood ratio (u₀/u₁)^(n/2), with the logarithm averaged over channels,
//! because model errors are common.

use super::{Coordinates, Mismatch, ROUGHLY, UNIT_REMAINDER, force_unit_n};
use crate::recording::Recording;
use crate::recording_check::ForceUnit;
use crate::setup::Setup;
use crate::simulate::CleanSensors;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{Extent, Solving};
use palpate_mechanics::units::{Dimension, Unit};
use palpate_numerics::{mean, median};

/// Likelihood ratio of a reported explanation, by policy.
const DECISIVE: f64 = 1e6;
/// Greatest unexplained variance share.
const UNEXPLAINED: f64 = 0.1;
/// Rounding of variance shares.
const LEAST_UNEXPLAINED: f64 = 1e-12;
/// Greatest solution time in seconds.
const SECONDS: f64 = 1.0;

pub fn compare(setup: &Setup, recording: &Recording) -> Vec<Mismatch> {
    let Some(contacts) = MeanReadings::new(setup, recording) else { return Vec::new() };
    let Some(surface) = setup.surface().model() else { return Vec::new() };
    let sensors = setup.layout().len();
    let cost = surface.solution_cost(sensors, Solving::BySensor);
    if cost.is_some_and(|cost| cost.seconds_once + cost.seconds_each * sensors as f64 > SECONDS)
        || surface.check_solution().is_err()
    {
        return Vec::new();
    }
    let model = CleanSensors::new(surface, setup.layout());
    let modelled = contacts.modelled(&model, |position| position);
    let fits = contacts.fits(&modelled);
    if let Some(found) = contacts.better_coordinates(setup, &model, &fits) {
        return vec![Mismatch::Coordinates(found)];
    }
    if let Some(found) = contacts.better_order(setup, &modelled, &fits) {
        return vec![found];
    }
    if !contacts.has_forces {
        return Vec::new();
    }
    gains(setup, &fits)
}

struct MeanReadings {
    contacts: Vec<Contact>,
    channels: Vec<Vec<f64>>,
    has_forces: bool,
}

/// Regression on the modelled reading.
#[derive(Clone, Copy, Debug)]
struct ChannelFit {
    channel: usize,
    gain: f64,
    unexplained: f64,
}

impl MeanReadings {
    /// `None` for too few contacts.
    fn new(setup: &Setup, recording: &Recording) -> Option<Self> {
        let force_n = |i: usize| recording.rows[i].force_n.or(setup.force_n());
        let touched: Vec<usize> =
            (0..recording.rows.len()).filter(|i| recording.rows[*i].touches()).collect();
        let has_forces = touched.iter().all(|i| force_n(*i).is_some());
        let contact = |i: &usize| Contact {
            position: recording.rows[*i].position,
            force_n: force_n(*i).filter(|_| has_forces).unwrap_or(1.0),
        };
        let key = |contact: &Contact| [contact.position.x_m, contact.position.y_m, contact.force_n];
        let mut order: Vec<(Contact, usize)> = touched.iter().map(|i| (contact(i), *i)).collect();
        order.sort_by(|a, b| key(&a.0).partial_cmp(&key(&b.0)).unwrap_or(std::cmp::Ordering::Equal));
        let groups: Vec<&[(Contact, usize)]> = order.chunk_by(|a, b| key(&a.0) == key(&b.0)).collect();
        let of_channel = |c: usize| {
            let reading =
                |group: &&[(Contact, usize)]| mean(group.iter().map(|(_, i)| recording.rows[*i].reading[c]));
            groups.iter().map(reading).collect()
        };
        (groups.len() > 2).then(|| Self {
            contacts: groups.iter().map(|group| group[0].0).collect(),
            channels: (0..recording.channels.len()).map(of_channel).collect(),
            has_forces,
        })
    }

    /// Modelled readings of each channel.
    fn modelled(&self, model: &CleanSensors, place: impl Fn(Position) -> Position) -> Vec<Vec<f64>> {
        let at = |contact: &Contact| model.reading(Contact { position: place(contact.position), ..*contact });
        let readings: Vec<Vec<f64>> = self.contacts.iter().map(at).collect();
        (0..self.channels.len()).map(|c| readings.iter().map(|reading| reading[c]).collect()).collect()
    }

    /// Skips constant channels.
    fn fits(&self, modelled: &[Vec<f64>]) -> Vec<ChannelFit> {
        (0..self.channels.len()).filter_map(|c| self.fit(c, &modelled[c])).collect()
    }

    fn fit(&self, channel: usize, modelled: &[f64]) -> Option<ChannelFit> {
        let readings = &self.channels[channel];
        let (middle, model_middle) = (mean(readings.iter().copied()), mean(modelled.iter().copied()));
        let (mut own, mut both, mut of_model) = (0.0, 0.0, 0.0);
        for (reading, model) in readings.iter().zip(modelled) {
            let (y, x) = (reading - middle, model - model_middle);
            (own, both, of_model) = (own + y * y, both + x * y, of_model + x * x);
        }
        let fit = ChannelFit {
            channel,
            gain: both / of_model,
            unexplained: (1.0 - both * both / (own * of_model)).max(LEAST_UNEXPLAINED),
        };
        (fit.gain.is_finite() && fit.unexplained.is_finite()).then_some(fit)
    }

    /// True if `new` is good, and decisively better than `old`.
    fn is_better(&self, new: &[ChannelFit], old: &[ChannelFit]) -> bool {
        // An offset and a gain are fitted.
        let freedom = self.contacts.len() as f64 - 2.0;
        let logs = new.iter().zip(old).map(|(new, old)| (old.unexplained / new.unexplained).ln());
        !new.is_empty()
            && new.len() == old.len()
            && mean(new.iter().map(|fit| fit.unexplained)) <= UNEXPLAINED
            && 0.5 * freedom * mean(logs) > DECISIVE.ln()
    }

    fn better_coordinates(
        &self,
        setup: &Setup,
        model: &CleanSensors,
        fits: &[ChannelFit],
    ) -> Option<Coordinates> {
        let extent = setup.surface().extent();
        let unit = setup.recording_columns().position_unit;
        let mut candidates = match extent {
            Extent::Line { .. } => vec![Coordinates::MirroredAlong],
            Extent::Plane { .. } => vec![
                Coordinates::MirroredAlong,
                Coordinates::MirroredAcross,
                Coordinates::Turned,
                Coordinates::Exchanged,
            ],
        };
        candidates.extend(Dimension::Length.units().filter(|other| *other != unit).map(Coordinates::Unit));
        let mut best: Option<(Coordinates, Vec<ChannelFit>)> = None;
        for candidate in candidates {
            let place = |position| candidate.place(position, extent, unit);
            if !self.contacts.iter().all(|contact| extent.contains(place(contact.position))) {
                continue;
            }
            let new = self.fits(&self.modelled(model, place));
            let before = best.as_ref().map_or(fits, |(_, fits)| fits);
            let improves = if best.is_some() { residual_share(&new) < residual_share(before) } else { true };
            if improves && self.is_better(&new, fits) {
                best = Some((candidate, new));
            }
        }
        best.map(|(candidate, _)| candidate)
    }

    fn better_order(&self, setup: &Setup, modelled: &[Vec<f64>], fits: &[ChannelFit]) -> Option<Mismatch> {
        let sensors = setup.layout().sensors();
        let is_alike = |a: usize, b: usize| sensors[a].kind == sensors[b].kind;
        let closest = |fit: &ChannelFit| {
            let others = fits.iter().filter(|other| is_alike(fit.channel, other.channel));
            let fitted = others
                .filter_map(|other| Some((other.channel, self.fit(fit.channel, &modelled[other.channel])?)));
            fitted.min_by(|a, b| a.1.unexplained.total_cmp(&b.1.unexplained))
        };
        let places: Vec<(usize, ChannelFit)> = fits.iter().map(closest).collect::<Option<_>>()?;
        let mut taken: Vec<usize> = places.iter().map(|(place, _)| *place).collect();
        taken.sort_unstable();
        taken.dedup();
        let is_order = taken.len() == places.len();
        let moved = || fits.iter().zip(&places).filter(|(fit, (place, _))| fit.channel != *place);
        let old: Vec<ChannelFit> = moved().map(|(fit, _)| *fit).collect();
        let new: Vec<ChannelFit> = moved().map(|(_, (_, fit))| *fit).collect();
        let name = |c: usize| sensors[c].name.clone();
        let pairs = || moved().map(|(fit, (place, _))| (name(fit.channel), name(*place))).collect();
        (is_order && self.is_better(&new, &old)).then(|| Mismatch::ChannelOrder { pairs: pairs() })
    }
}

fn residual_share(fits: &[ChannelFit]) -> f64 {
    mean(fits.iter().map(|fit| fit.unexplained))
}

impl Coordinates {
    fn place(self, Position { x_m, y_m }: Position, extent: Extent, unit: Unit) -> Position {
        let (length_m, width_m) = (extent.length_m(), extent.width_m().unwrap_or_default());
        match self {
            Self::MirroredAlong => Position { x_m: length_m - x_m, y_m },
            Self::MirroredAcross => Position { x_m, y_m: width_m - y_m },
            Self::Turned => Position { x_m: length_m - x_m, y_m: width_m - y_m },
            Self::Exchanged => Position { x_m: y_m, y_m: x_m },
            Self::Unit(other) => {
                let factor = other.factor() / unit.factor();
                Position { x_m: x_m * factor, y_m: y_m * factor }
            }
        }
    }
}

fn gains(setup: &Setup, fits: &[ChannelFit]) -> Vec<Mismatch> {
    let explained: Vec<ChannelFit> =
        fits.iter().copied().filter(|fit| fit.unexplained <= UNEXPLAINED).collect();
    let names = |fits: &[ChannelFit]| -> Vec<String> {
        fits.iter().map(|fit| setup.layout().sensors()[fit.channel].name.clone()).collect()
    };
    let opposite: Vec<ChannelFit> = explained.iter().copied().filter(|fit| fit.gain < 0.0).collect();
    let all = opposite.len() == fits.len();
    let mut found = Vec::new();
    if !opposite.is_empty() {
        found.push(Mismatch::Sign { channels: names(&opposite), all });
    }
    let is_off = |fit: &ChannelFit| fit.gain.abs().ln().abs() > ROUGHLY.ln();
    let mut off: Vec<ChannelFit> = explained.into_iter().filter(is_off).collect();
    while let Some(first) = off.first().copied() {
        let kind = setup.layout().sensors()[first.channel].kind;
        let is_like_first = |fit: &ChannelFit| {
            setup.layout().sensors()[fit.channel].kind == kind
                && (fit.gain / first.gain).abs().ln().abs() <= UNIT_REMAINDER.ln()
        };
        let (group, rest): (Vec<_>, Vec<_>) = off.into_iter().partition(is_like_first);
        off = rest;
        let Some(factor) = median(group.iter().map(|fit| fit.gain.abs()).collect()) else { break };
        let is_common = group.len() == fits.len() && setup.layout().len() > 1;
        // Forces read as too large make the gain too small.
        let force_unit = ForceUnit::explaining(1.0 / factor, force_unit_n(setup)).filter(|_| is_common);
        let unit = reading_unit(setup, first.channel, kind, factor);
        found.push(Mismatch::Gain { channels: names(&group), factor, unit, force_unit });
    }
    found
}

/// Unit that explains readings too large by `factor`.
fn reading_unit(setup: &Setup, channel: usize, kind: SensorKind, factor: f64) -> Option<Unit> {
    let read = setup.recording_columns().channels.get(channel)?.unit;
    let remainder = |unit: &Unit| (factor * unit.factor() / read.factor()).ln().abs();
    let best = kind.dimension().units().min_by(|a, b| remainder(a).total_cmp(&remainder(b)))?;
    (remainder(&best) <= UNIT_REMAINDER.ln()).then_some(best)
}

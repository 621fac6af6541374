//! From presses to what every sensor reads at given places, on a line as on a plane.

use super::InfluenceFitError;
use super::channels::Channels;
use super::config::InfluenceSource;
use super::hyperparameters::{MOST_PRESSES, most_evident};
use super::posterior::{Posterior, SensorPresses};
use super::presses::Presses;
use super::prior::{Mean, Prior, Remainders, Spread};
use crate::fit::FitTask;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::Surface;

/// One sensor's influence function as the presses tell it, at the places that were asked for.
pub(super) struct Learnt<'s, 'a> {
    posterior: Posterior<'s, 'a>,
    prior: &'s Prior<'a>,
    remainders: &'s Remainders,
    places: &'s [Position],
}

impl Learnt<'_, '_> {
    /// The reading per newton at place number `place`.
    pub fn mean(&self, place: usize) -> f64 {
        let parts = self.prior.parts(self.places[place]);
        self.posterior.mean(parts, &self.remainders.places.row(place))
    }

    /// Its variance, from calibrating with finitely many noisy presses.
    pub fn variance(&self, place: usize) -> f64 {
        let parts = self.prior.parts(self.places[place]);
        let (row, own) = (self.remainders.places.row(place), self.remainders.own[place]);
        self.posterior.variance(parts, &row, own)
    }
}

/// Learns the influence functions of all living sensors at `places`, and hands each, with the sensor's number, to `take`.
pub(super) fn learn(
    from: InfluenceSource,
    task: FitTask,
    places: &[Position],
    take: &mut dyn FnMut(usize, &Learnt),
) -> Result<Channels, InfluenceFitError> {
    let surface = task.setup.surface.model().ok_or(InfluenceFitError::NoModel)?;
    let layout = &task.setup.layout;
    check_sensors(layout)?;
    let presses = Presses::of(task.recording)?;
    let needed = match (from, surface.extent().dimensions()) {
        (InfluenceSource::Recording, 1) => 3,
        // A plane's simplest curved surface has six numbers.
        (InfluenceSource::Recording, _) => 6,
        _ => 1,
    };
    let found = presses.distinct_positions();
    if found < needed {
        return Err(InfluenceFitError::TooFewPositions { needed, found });
    }
    let mut channels = Channels {
        offsets: vec![0.0; layout.len()],
        noise_sd: vec![1.0; layout.len()],
        reference_force_n: presses.mean_force_n(),
    };
    let lesson = Lesson { from, surface, layout, presses: &presses, places };
    for kind in SensorKind::ALL {
        let is_meant = |s: &usize| {
            let sensor = &layout.sensors[*s];
            sensor.kind == kind && !sensor.channel.dead
        };
        let living: Vec<usize> = (0..layout.len()).filter(is_meant).collect();
        if living.is_empty() {
            continue;
        }
        task.watch.round()?;
        lesson.learn_kind(kind, &living, &mut channels, take)?;
    }
    Ok(channels)
}

fn check_sensors(layout: &Layout) -> Result<(), InfluenceFitError> {
    if let Some(raw) = layout.sensors.iter().position(|sensor| sensor.kind == SensorKind::Raw) {
        return Err(InfluenceFitError::RawSensor { sensor: raw + 1 });
    }
    if layout.sensors.iter().all(|sensor| sensor.channel.dead) {
        return Err(InfluenceFitError::AllDead { sensors: layout.len() });
    }
    Ok(())
}

/// What is learnt from, and where.
struct Lesson<'a> {
    from: InfluenceSource,
    surface: &'a dyn Surface,
    layout: &'a Layout,
    presses: &'a Presses,
    places: &'a [Position],
}

impl<'a> Lesson<'a> {
    /// Learns the sensors of one kind, which share their spread.
    fn learn_kind(
        &self,
        kind: SensorKind,
        living: &[usize],
        channels: &mut Channels,
        take: &mut dyn FnMut(usize, &Learnt),
    ) -> Result<(), InfluenceFitError> {
        let Self { from, surface, layout, presses, places } = *self;
        let mean = if from == InfluenceSource::Recording { Mean::Zero } else { Mean::Model };
        let pressed: Vec<Position> = presses.presses.iter().map(|press| press.position).collect();
        let remainders = Remainders::new(surface, kind, &pressed, places);
        let priors: Vec<Prior<'a>> =
            living.iter().map(|s| Prior::new(surface, &layout.sensors[*s], mean)).collect();
        let with = |(prior, &s): (&Prior<'a>, &usize), kept: &[usize]| {
            let noise = presses.noise_variance(layout, s);
            SensorPresses::new(prior.clone(), presses, s, noise, kept, &remainders.presses)
        };
        let all: Vec<usize> = (0..pressed.len()).collect();
        let thinned: Vec<usize> = all.iter().copied().step_by(all.len().div_ceil(MOST_PRESSES)).collect();
        let searched: Vec<SensorPresses> =
            priors.iter().zip(living).map(|sensor| with(sensor, &thinned)).collect();
        let noise_is_told = living.iter().all(|s| presses.noise_variance(layout, *s).is_some());
        let mut spread = most_evident(&searched, mean, surface.length_m(), noise_is_told);
        if from == InfluenceSource::Mechanics {
            spread = Spread { noise: spread.noise, ..Spread::NONE };
        }
        for (prior, &s) in priors.iter().zip(living) {
            let sensor = with((prior, &s), &all);
            let posterior = sensor
                .posterior(spread)
                .map_err(|problem| InfluenceFitError::Singular { sensor: s + 1, problem })?;
            channels.offsets[s] = posterior.offset();
            channels.noise_sd[s] = sensor.noise_variance(&spread).sqrt();
            take(s, &Learnt { posterior, prior, remainders: &remainders, places });
        }
        Ok(())
    }
}

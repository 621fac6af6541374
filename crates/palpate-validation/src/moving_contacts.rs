use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::{Ratio, Sample};
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::estimator::{Swing, Track};
use palpate::estimators::simulate::{MovingContacts, simulate_moving};
use palpate::estimators::track_errors::{SPEED_RATIOS, TrackErrors, track_recording};
use palpate::prelude::{Fit, Rig, TrackerConfig};

pub const EXPERIMENT: Experiment = Experiment {
    name: "moving-contacts",
    title: "Tracks of moving contacts",
    method: "The beam of `examples/moving-load.toml` and the plate of `examples/moving-plate.toml` are calibrated, and one contact that moves to and fro is tracked from 1,000 readings per second, \
             once after each calibration. The tracker assumes static equilibrium or the beam's first mode (inertia); the filter uses the readings so far, and the smoother all of them.",
    seed: 0,
    run,
};

pub const BEAM: &str = include_str!("../../../examples/moving-load.toml");
pub const PLATE: &str = include_str!("../../../examples/moving-plate.toml");
/// Offset of the seeds of moving contacts from calibration seeds.
pub const MOVING: u64 = 1000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Surface {
    Beam,
    Plate,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Speed {
    MetresPerSecond(f64),
    /// Share of the critical speed.
    OfCritical(f64),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Dynamics {
    Equilibrium,
    Inertia,
}

#[derive(Clone, Debug)]
struct Bench {
    surface: Surface,
    is_known: bool,
    speeds: Vec<Speed>,
}

const SPEEDS_M_PER_S: [f64; 4] = [0.1, 0.2, 0.5, 1.0];

fn benches(size: Size) -> Vec<Bench> {
    let (in_si, of_critical) =
        size.pick((&SPEEDS_M_PER_S[..], &SPEED_RATIOS[..]), (&SPEEDS_M_PER_S[3..], &SPEED_RATIOS[..1]));
    let in_si = in_si.iter().copied().map(Speed::MetresPerSecond).collect::<Vec<_>>();
    let of_critical = of_critical.iter().copied().map(Speed::OfCritical).collect::<Vec<_>>();
    let bench = |surface, is_known, speeds: &[Speed]| Bench { surface, is_known, speeds: speeds.to_vec() };
    let all = [&in_si[..], &of_critical].concat();
    let mut benches = vec![bench(Surface::Beam, true, &all), bench(Surface::Beam, false, &in_si)];
    // The fit of a plate takes most of the time.
    if size == Size::Full {
        benches.extend([true, false].map(|is_known| bench(Surface::Plate, is_known, &in_si)));
    }
    benches
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let calibrations = size.pick(12, 4);
    let benches = benches(size);
    let seeds = || EXPERIMENT.seed..EXPERIMENT.seed + calibrations;
    let cases: Vec<(&Bench, u64)> =
        benches.iter().flat_map(|bench| seeds().map(move |seed| (bench, seed))).collect();
    let name = |(bench, seed): &(&Bench, u64)| format!("{}, calibration {seed}", bench.name());
    let errors = in_parallel(&cases, |(bench, seed)| bench.errors(*seed), name, progress);
    let mut errors = errors.into_iter();
    let mut tables = [
        Table::new(
            "Beam: eight sensors of 20 µm noise, 3 N, 50 to 350 mm four times.",
            &LABELS,
            Tally::columns(),
        ),
        Table::new("Beam by the share of its critical speed.", &LABELS, Tally::columns()),
        Table::new(
            "Plate: nine sensors of 20 µm noise, 5 N, four times across; coverage is the mean of both coordinates.",
            &LABELS,
            Tally::columns(),
        ),
    ];
    for bench in &benches {
        let mut tallies: Vec<Tally> = bench.trials().iter().map(|_| Tally::default()).collect();
        for (seed, errors) in seeds().zip(errors.by_ref()) {
            tallies.iter_mut().zip(errors?).for_each(|(tally, errors)| tally.add(seed, errors));
        }
        for ((speed, dynamics), tally) in bench.trials().into_iter().zip(&tallies) {
            let table = match (bench.surface, speed) {
                (Surface::Beam, Speed::MetresPerSecond(_)) => 0,
                (Surface::Beam, Speed::OfCritical(_)) => 1,
                (Surface::Plate, _) => 2,
            };
            let labels = [bench.force(), &speed.label(), dynamics.label()];
            tables[table].rows.push(Row::new(&labels, tally.figures()));
        }
    }
    Ok(tables.into_iter().filter(|table| !table.rows.is_empty()).collect())
}

const LABELS: [&str; 3] = ["force", "speed", "assumption"];

impl Speed {
    fn label(self) -> String {
        match self {
            Self::MetresPerSecond(speed) => format!("{speed} m/s"),
            Self::OfCritical(ratio) => format!("{ratio} of critical"),
        }
    }

    fn contacts(self, moving: MovingContacts) -> Result<MovingContacts> {
        let speed_m_per_s = match self {
            Self::MetresPerSecond(speed) => speed,
            Self::OfCritical(ratio) => {
                let beam = moving.beam.context("the surface has no critical speed")?;
                ratio * beam.critical_speed_m_per_s()
            }
        };
        Ok(moving.at_speed(speed_m_per_s)?)
    }

    /// Assumptions of the trackers.
    const fn dynamics(self, surface: Surface) -> &'static [Dynamics] {
        match (surface, self) {
            (Surface::Beam, Self::MetresPerSecond(_)) => &[Dynamics::Equilibrium, Dynamics::Inertia],
            (Surface::Beam, Self::OfCritical(_)) => &[Dynamics::Inertia],
            (Surface::Plate, _) => &[Dynamics::Equilibrium],
        }
    }
}

impl Dynamics {
    const fn label(self) -> &'static str {
        match self {
            Self::Equilibrium => "equilibrium",
            Self::Inertia => "inertia",
        }
    }

    fn config(self, moving: &MovingContacts) -> Result<TrackerConfig> {
        let swing = match self {
            Self::Equilibrium => None,
            Self::Inertia => {
                let beam = moving.beam.context("the surface has no modes")?;
                Some(Swing { frequency_hz: beam.frequency_hz(1), damping_ratio: beam.damping_ratio() })
            }
        };
        Ok(TrackerConfig { swing, ..TrackerConfig::default() })
    }
}

/// Of filter and smoother; `None` for an untracked contact.
type Errors = Option<(TrackErrors, TrackErrors)>;

impl Bench {
    fn name(&self) -> String {
        format!("{:?}, {} force", self.surface, self.force()).to_lowercase()
    }

    const fn force(&self) -> &'static str {
        if self.is_known { "known" } else { "unknown" }
    }

    fn trials(&self) -> Vec<(Speed, Dynamics)> {
        let at = |speed: &Speed| {
            let speed = *speed;
            speed.dynamics(self.surface).iter().map(move |dynamics| (speed, *dynamics))
        };
        self.speeds.iter().flat_map(at).collect()
    }

    /// Errors of all trials.
    fn errors(&self, seed: u64) -> Result<Vec<Errors>> {
        let rig = match self.surface {
            Surface::Beam => Rig::from_toml(BEAM).context("examples/moving-load.toml")?,
            Surface::Plate => Rig::from_toml(PLATE).context("examples/moving-plate.toml")?,
        };
        let setup = rig.setup.clone().with_force(rig.setup.force_n().filter(|_| self.is_known))?;
        let locator = rig.estimator.fit(&setup, &rig.simulate(seed)?)?;
        let extent = setup.surface().extent();
        let mut errors = Vec::new();
        for speed in &self.speeds {
            let moving = speed.contacts(rig.motion.context("the rig has no motion")?)?;
            let recording = simulate_moving(&rig.setup, &moving, MOVING + seed)?;
            let truths = recording.truths();
            let errors_of = |tracks: &[Track]| TrackErrors::new(tracks, &truths, extent);
            for dynamics in speed.dynamics(self.surface) {
                let tracks = track_recording(&locator, dynamics.config(&moving)?, &recording)?;
                errors.push(errors_of(&tracks.filtered).zip(errors_of(&tracks.smoothed)));
            }
        }
        Ok(errors)
    }
}

/// Each recording is one value: neighbouring readings share their errors.
#[derive(Clone, Debug, Default)]
struct Tally {
    single_mm: Sample,
    single_covered: Sample,
    filter: TrackTally,
    smoother: TrackTally,
}

#[derive(Clone, Debug, Default)]
struct TrackTally {
    error_mm: Sample,
    gain: Ratio,
    covered: Sample,
}

impl Tally {
    fn add(&mut self, calibration: u64, errors: Errors) {
        let Some((filter, smoother)) = errors else { return };
        self.single_mm.add(calibration, 1e3 * filter.single_m);
        self.single_covered.add(calibration, 100.0 * filter.single_covered);
        self.filter.add(calibration, &filter);
        self.smoother.add(calibration, &smoother);
    }

    fn columns() -> Vec<Column> {
        let of_track = |track: &str| {
            [
                Column { decimals: 3, ..Column::mm(&format!("{track} error"), Goal::Smaller) },
                Column { decimals: 1, ..Column::new(&format!("{track} gain"), "×", Goal::Larger) },
                Column::percent(&format!("{track} covered"), Goal::COVERAGE),
            ]
        };
        let single = [
            Column { decimals: 3, ..Column::mm("single error", Goal::Smaller) },
            Column::percent("single covered", Goal::COVERAGE),
        ];
        [single.to_vec(), of_track("filter").to_vec(), of_track("smoother").to_vec()].concat()
    }

    fn figures(&self) -> Vec<Option<Figure>> {
        let single = [self.single_mm.mean(), self.single_covered.mean()];
        [single.to_vec(), self.filter.figures(), self.smoother.figures()].concat()
    }
}

impl TrackTally {
    fn add(&mut self, calibration: u64, errors: &TrackErrors) {
        self.error_mm.add(calibration, 1e3 * errors.track_m);
        self.gain.add(calibration, errors.single_m, errors.track_m);
        self.covered.add(calibration, 100.0 * errors.track_covered);
    }

    fn figures(&self) -> Vec<Option<Figure>> {
        vec![self.error_mm.mean(), self.gain.figure(), self.covered.mean()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filter_is_nearer_than_single_readings_and_the_smoother_than_the_filter() {
        let speed = Speed::MetresPerSecond(SPEEDS_M_PER_S[3]);
        let bench = Bench { surface: Surface::Beam, is_known: true, speeds: vec![speed] };
        assert_eq!(bench.trials(), [(speed, Dynamics::Equilibrium), (speed, Dynamics::Inertia)]);
        let errors: Vec<_> = bench.errors(0).unwrap().into_iter().flatten().collect();
        let [(equilibrium, _), (filter, smoother)] = &errors[..] else { panic!("{errors:?}") };
        assert!(2.0 * filter.track_m < filter.single_m, "{filter:?}");
        assert!(2.0 * smoother.track_m < filter.track_m, "{smoother:?}");
        assert!(filter.track_covered > 0.85 && smoother.track_covered > 0.85, "{errors:?}");
        // The beam swings at 1 m/s.
        assert!(filter.track_m < equilibrium.track_m, "{errors:?}");
    }
}

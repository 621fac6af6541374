//! A simulated hand calibrates and checks a simulated strip in virtual time.

use super::*;
use crate::input::{Arrival, TimedArrival};
use crate::stamp::Stamp;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::{Recording, comment_with_placement};
use palpate_estimators::simulate::SimulatedBench;
use palpate_mechanics::contact::{Contact, Position};
use palpate_rig::Rig;
use std::path::Path;
use std::time::Duration;

const RIG: &str = include_str!("../../../../examples/fsi-like.toml");
const EVERY: Duration = Duration::from_millis(10);

struct Hand<'a> {
    bench: SimulatedBench<'a>,
    at: Duration,
}

impl Hand<'_> {
    /// Follows the requests of the guide until `until` is true, or no step remains.
    fn obey(&mut self, calibration: &mut Calibration, until: impl Fn(&Calibration) -> bool) {
        for _ in 0..20_000 {
            if until(calibration) || calibration.guide().awaited_step() == AwaitedStep::Nothing {
                return;
            }
            let contact = match calibration.guide().awaited_step() {
                AwaitedStep::Press | AwaitedStep::Rest => {
                    let press = calibration.guide().next_press().map(|(_, press)| press);
                    let force_n = |press: Press| press.force_n.unwrap_or(1.0);
                    press.map(|press| Contact { position: press.position, force_n: force_n(press) })
                }
                AwaitedStep::Untouched | AwaitedStep::Release | AwaitedStep::Nothing => None,
            };
            let clean = self.bench.clean(contact.as_slice());
            let reading: Vec<String> = self.bench.measure(&clean).iter().map(f64::to_string).collect();
            self.at += EVERY;
            let arrival = Arrival::Bytes((reading.join(",") + "\n").into_bytes());
            let at = Stamp { elapsed: self.at, unix_ns: 0 };
            calibration.receive(&TimedArrival { at, arrival }, &mut Vec::new()).unwrap();
        }
        panic!("the calibration does not go on from {:?}", calibration.guide().awaited_step());
    }
}

fn begun(rig: &Rig, path: &Path, plan: Vec<Press>) -> Calibration {
    let comment = comment_with_placement("palpate 0.1.0, pressed for rig.toml", Some(2e-3));
    let journal = Journal::new(&rig.setup, path, comment, Vec::new(), DepthKnowledge::Unknown).unwrap();
    Calibration::new(&rig.setup, None, &[], plan, journal).unwrap()
}

fn read(rig: &Rig, path: &Path) -> Recording {
    rig.setup.read_recording("presses.csv", std::fs::read(path).unwrap().as_slice()).unwrap()
}

#[test]
fn repeated_readings_count_once_for_the_noise() {
    let channels = [1.0, 2.5, 0.4];
    let mut state = 7_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let measured: Vec<[f64; 3]> =
        (0..100).map(|_| channels.map(|sd| sd * 12_f64.sqrt() * (uniform() - 0.5))).collect();
    // Means of distinct readings at 20 a second, each repeated up to 10 times.
    let sizes = [1, 2, 5, 10].map(|times| {
        let mut guide =
            Guide::new(vec![Press { position: Position::along(0.1), force_n: None, depth_m: None }]);
        let frames = measured.iter().flat_map(|reading| std::iter::repeat_n(reading, times));
        let mut learnt = None;
        for (i, reading) in frames.enumerate() {
            guide.add(Duration::from_millis((50 / times * i) as u64), reading);
            learnt = learnt.or_else(|| guide.untouched_reading().map(<[f64]>::to_vec));
            if guide.awaited_step() != AwaitedStep::Untouched {
                break;
            }
        }
        assert_eq!(guide.is_sample_and_hold(), times > 1, "{times} times");
        (learnt.unwrap(), guide.noise_sd().unwrap())
    });
    for (baseline, noise_sd) in &sizes[1..] {
        assert_eq!((baseline, noise_sd), (&sizes[0].0, &sizes[0].1));
    }
    for (noise_sd, sd) in sizes[0].1.iter().zip(channels) {
        assert!((0.6..1.5).contains(&(noise_sd / sd)), "{noise_sd} of {sd}");
    }
}

/// An untared load cell stops the machine by its change.
#[test]
fn the_limit_of_a_load_cell_counts_from_its_untouched_reading() {
    let rig = Rig::from_toml(RIG).unwrap();
    let channels = rig.setup.layout().len();
    for learnt_after in [1, 500] {
        let folder = tempfile::tempdir().unwrap();
        let journal = Journal::new(
            &rig.setup,
            &folder.path().join("presses.csv"),
            String::new(),
            Vec::new(),
            DepthKnowledge::Unknown,
        );
        let to_come = plan(&rig, Weights::default(), &[], &[]).unwrap();
        let mut calibration =
            Calibration::new(&rig.setup, rig.stage.as_ref(), &[], to_come, journal.unwrap()).unwrap();
        let mut overload_n = |cells_n: &[f64]| {
            let mut notes = Vec::new();
            for (i, cell_n) in cells_n.iter().enumerate() {
                let line = "0,".repeat(channels) + &format!("{cell_n}\n");
                let at = Stamp { elapsed: EVERY * (i as u32 + 1), unix_ns: 0 };
                let arrival = Arrival::Bytes(line.into_bytes());
                calibration.receive(&TimedArrival { at, arrival }, &mut notes).unwrap();
            }
            let overload = |note| match note {
                Note::Overload(force_n) => Some(force_n),
                _ => None,
            };
            notes.into_iter().find_map(overload)
        };
        assert_eq!(overload_n(&vec![-20.0; learnt_after]), None);
        let over_n = overload_n(&[-23.5]).unwrap();
        assert!((over_n + 3.5).abs() < 1e-9, "{over_n}");
    }
}

#[test]
fn presses_are_struck_out_redone_fitted_and_checked() {
    let rig = Rig::from_toml(&RIG.replace("count = 9\nrepeats = 3", "count = 7\nrepeats = 2")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("presses.csv");
    let to_come = |rows: &[_]| plan(&rig, Weights::default(), &[], rows).unwrap();
    let mut hand = Hand { bench: SimulatedBench::new(&rig.setup, 3).unwrap(), at: Duration::ZERO };
    let mut calibration = begun(&rig, &path, to_come(&[]));
    hand.obey(&mut calibration, |calibration| calibration.journal().presses() == 6);
    let struck = calibration.guide().plan()[2];
    assert!(calibration.strike(2).unwrap() && !calibration.strike(5).unwrap());
    let missing = to_come(calibration.journal().rows());
    assert_eq!((missing.len(), missing[0]), (14 - 5, struck));
    calibration.replan(missing);
    hand.obey(&mut calibration, |_| false);
    let (journal, recording) = (calibration.journal(), read(&rig, &path));
    assert_eq!((journal.presses(), recording.touched().rows.len()), (14, 14));
    assert!(places(journal.rows(), &[]).iter().all(|place| place.recorded == 2));
    let traces = journal.rows().iter().zip(journal.traces()).filter(|(row, _)| row.touches());
    for (row, trace) in traces {
        let points = &trace.as_ref().unwrap_or_else(|| panic!("a trace of {row:?}")).points;
        let (at_s, percent) = points[points.len() - 1];
        assert!(points.len() > 20 && at_s == 0.0 && (percent - 100.0).abs() < 1e-9, "{points:?}");
        assert!(points[0].1 < 20.0, "it begins untouched: {points:?}");
    }
    assert_eq!(recording.provenance.placement_sd_m, Some(2e-3));
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).unwrap();
    assert_eq!(locator.provenance.recording.placement_sd_m, Some(2e-3));
    let checked = check_path(&path);
    let mut check = begun(&rig, &checked, check_presses(&rig, &recording.rows, Weights::default(), &[]));
    hand.obey(&mut check, |_| false);
    let recording = read(&rig, &checked);
    let check = Check::new(&locator, &recording).unwrap().unwrap();
    assert_eq!(check.places.len(), CHECK_PLACES);
    assert!(check.median_m < 1e-3 && check.covered >= Some(4), "{check:?}");
    assert_eq!(read(&rig, &path).touched().rows.len(), 14);
}

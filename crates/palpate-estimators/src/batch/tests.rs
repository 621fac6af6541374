use super::*;
use crate::arrangement::all_over;
use crate::estimator::{Estimator, Locator, contenders};
use crate::fit::{Fit, FitTask};
use crate::fixtures::{digit, paper, plate, raw_setup};
use crate::influence::Influence;
use crate::recording::Recording;
use crate::setup::Setup;
use crate::simulate::simulate_contacts;
use palpate_core::Status;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::sensing::ChannelModel;
use palpate_mechanics::surface::ForceDirection;
use palpate_mechanics::units::{newtons, um};

/// Locators of every suitable method. Networks are trained briefly, to keep the test short.
fn locators(setup: &Setup, presses: &Recording) -> Vec<Locator> {
    let all = contenders(setup, &Estimator::default(), 200 * presses.rows.len());
    all.iter()
        .filter_map(|estimator| estimator.fit_without_interval_check(FitTask::new(setup, presses)).ok())
        .collect()
}

fn readings(recording: &Recording) -> Vec<f64> {
    let rows: Vec<&[f64]> = recording.rows.iter().map(|row| row.reading.as_slice()).collect();
    let mut readings = rows.concat();
    for (k, row) in rows.iter().enumerate() {
        let other = rows[rows.len() - 1 - k];
        readings.extend(match k % 4 {
            0 => vec![0.0; row.len()],
            1 => row.iter().map(|r| 3.0 * r).collect(),
            2 => row.iter().zip(other).map(|(r, s)| r + s).collect(),
            _ => row.iter().map(|r| 1e300 * r).collect::<Vec<_>>(),
        });
    }
    readings
}

fn assert_agree(locator: &Locator, readings: &[f64]) -> Vec<Status> {
    let kind = locator.kind();
    let each = readings.chunks_exact(locator.layout().len());
    let single: Vec<Estimate> = each.map(|reading| locator.locate(reading).unwrap()).collect();
    assert_eq!(locator.locate_batch(readings).unwrap(), single, "{kind}");
    for threads in [1, 3] {
        let options =
            BatchOptions { threads: NonZeroUsize::new(threads).unwrap(), ..BatchOptions::default() };
        let blocks = Mutex::new(vec![None; single.len()]);
        let take = |first: usize, estimates: &[Estimate]| {
            let mut blocks = blocks.lock().unwrap();
            for (i, estimate) in estimates.iter().enumerate() {
                assert_eq!(blocks[first + i].replace(*estimate), None, "reading {} came twice", first + i);
            }
        };
        locator.locate_blocks(readings, options, &take).unwrap();
        let blocks: Vec<_> = blocks.into_inner().unwrap().into_iter().map(Option::unwrap).collect();
        assert_eq!(blocks, single, "{kind}, {threads} threads");
    }
    single.iter().map(|estimate| estimate.status).collect()
}

fn benches() -> Vec<(Setup, Recording)> {
    let measured = raw_setup(paper(0.0, 1).setup.surface().extent(), 8, None);
    let beam = paper(um(5.0), 4);
    let plate = plate(12, ChannelModel { noise_sd: um(20.0), ..ChannelModel::default() });
    let digit = digit(ForceDirection::Normal, 4.0);
    let mut presses = beam.simulate(1);
    presses.rows.iter_mut().for_each(|row| row.force_n = None);
    vec![
        (beam.setup.clone(), beam.simulate(1)),
        (beam.setup.clone().unknown_force(), beam.simulate(1)),
        (measured.clone(), beam.simulate(1)),
        (measured, presses),
        (plate.setup.clone(), plate.simulate(1)),
        (digit.setup.clone(), digit.simulate(1)),
    ]
}

#[test]
fn contacts_have_a_force_where_the_locator_estimates_it() {
    let mut told = Vec::new();
    for (setup, presses) in benches() {
        for locator in locators(&setup, &presses) {
            let touched = presses.touched();
            let estimates = touched.rows.iter().map(|row| locator.locate(&row.reading).unwrap());
            let found = estimates.filter(|estimate| estimate.status == Status::Located);
            let forces: Vec<Option<f64>> = found.map(|estimate| estimate.contact.force_n).collect();
            let is_as_told = |force_n: &Option<f64>| force_n.is_some() == locator.estimates_force();
            assert!(!forces.is_empty() && forces.iter().all(is_as_told), "{}: {forces:?}", locator.kind());
            told.push(locator.estimates_force());
        }
    }
    assert!(told.contains(&true) && told.contains(&false), "{told:?}");
}

#[test]
fn a_batch_of_every_method_answers_as_readings_one_by_one_do() {
    let (mut kinds, mut statuses) = (Vec::new(), Vec::new());
    for (setup, presses) in benches() {
        let readings = readings(&presses);
        for locator in locators(&setup, &presses) {
            statuses.extend(assert_agree(&locator, &readings));
            let absurd: Vec<f64> = [1e308, -1e308, 1e61]
                .into_iter()
                .flat_map(|value| vec![value; setup.layout().len()])
                .collect();
            assert_eq!(assert_agree(&locator, &absurd), [Status::OutsideModel; 3], "{}", locator.kind());
            kinds.push(locator.kind());
        }
    }
    for kind in Estimator::KINDS.iter().filter(|kind| **kind != "auto") {
        assert!(kinds.contains(kind), "no locator of kind {kind}");
    }
    for status in [Status::Located, Status::NoContact, Status::Ambiguous, Status::OutsideModel] {
        assert!(statuses.contains(&status), "{status:?}");
    }
}

fn several_blocks() -> (Locator, Vec<f64>) {
    let example = paper(um(5.0), 4);
    let locator = Influence::default()
        .fit_without_interval_check(FitTask::new(&example.setup, &example.simulate(1)))
        .unwrap()
        .into_locator();
    let contacts = all_over(example.setup.surface().extent()).into_iter();
    let contacts: Vec<_> = contacts.map(|position| Contact { position, force_n: newtons(3.0) }).collect();
    let recording = simulate_contacts(&example.setup, &contacts, 1, 2).unwrap();
    let readings = recording.rows.iter().flat_map(|row| row.reading.clone());
    let readings: Vec<f64> = readings.cycle().take(8 * (5 * BLOCK + 3)).collect();
    (locator, readings)
}

#[test]
fn first_bad_reading_is_named_for_any_number_of_threads() {
    let (locator, mut readings) = several_blocks();
    for (row, channel) in [(BLOCK + 7, 3), (BLOCK + 9, 0), (3 * BLOCK, 1)] {
        readings[8 * row + channel] = f64::NAN;
    }
    let told = "reading 264: channel 4 reads NaN; it must be a finite number";
    assert_eq!(locator.locate_batch(&readings).unwrap_err().to_string(), told);
    for threads in 1..=4 {
        let options =
            BatchOptions { threads: NonZeroUsize::new(threads).unwrap(), ..BatchOptions::default() };
        let error = locator.locate_blocks(&readings, options, &|_, _| {}).unwrap_err();
        assert_eq!(error.to_string(), told, "{threads} threads");
    }
}

#[test]
fn values_that_make_no_whole_readings_are_refused() {
    let (locator, _) = several_blocks();
    let error = locator.locate_batch(&[0.0; 15]).unwrap_err();
    assert_eq!(error.to_string(), "expected a multiple of 8 values, found 15");
    assert_eq!(locator.locate_batch(&[]).unwrap(), []);
    locator.locate_blocks(&[], BatchOptions::default(), &|_, _| panic!("nothing was located")).unwrap();
}

#[test]
fn watch_counts_every_block_and_stops_a_batch() {
    let (locator, readings) = several_blocks();
    let rows = readings.len() / 8;
    let seen = Mutex::new(Vec::new());
    let watch = |progress| {
        seen.lock().unwrap().push(progress);
        seen.lock().unwrap().len() < 3
    };
    let (taken, watch) = (AtomicUsize::new(0), Watch::new(&watch));
    let take = |_: usize, estimates: &[Estimate]| {
        taken.fetch_add(estimates.len(), Ordering::Relaxed);
    };
    let options = BatchOptions { watch, ..BatchOptions::default() };
    assert_eq!(locator.locate_blocks(&readings, options, &take), Err(Cancelled.into()));
    assert_eq!(taken.into_inner(), 3 * BLOCK);
    let counted = |done| palpate_numerics::watch::Progress::Counted {
        name: "locating",
        unit: "readings",
        done,
        of: rows,
    };
    assert_eq!(seen.into_inner().unwrap(), [BLOCK, 2 * BLOCK, 3 * BLOCK].map(counted));
}

//! Tests of the reduction and of chains.

use super::*;
use palpate_estimators::recording::Recording;
use palpate_numerics::watch::{Cancelled, Watch};

/// The rig of the study on a coarse mesh.
fn rig() -> Rig {
    Rig::from_toml(&RIG_TOML.replacen("edges =", "elements = 24\nedges =", 1)).unwrap()
}

fn study(components: &[usize], presentations: u32) -> Elliott {
    Elliott {
        rig: rig(),
        components: components.to_vec(),
        presentations,
        calibrations: 1,
        tolerance_m: 5e-3,
        seed: 0,
    }
}

fn pressed() -> (Rig, Recording, KarhunenLoeve) {
    let rig = rig();
    let recording = rig.simulate(3).unwrap();
    let reduction = KarhunenLoeve::new(&recording, &[20e-6; 25]);
    (rig, recording, reduction)
}

#[test]
fn components_are_uncorrelated_and_keep_all_that_readings_hold() {
    let (_, recording, reduction) = pressed();
    let all = reduction.reduced(&recording, 25);
    let count = all.rows.len() as f64;
    let moment =
        |i: usize, j: usize| all.rows.iter().map(|row| row.reading[i] * row.reading[j]).sum::<f64>() / count;
    for (i, j) in [(0, 1), (0, 5), (2, 3), (7, 20)] {
        assert!(moment(i, j).abs() < 1e-6 * (moment(i, i) * moment(j, j)).sqrt(), "{i}, {j}");
    }
    assert!((1..25).all(|i| moment(i, i) <= moment(i - 1, i - 1) * (1.0 + 1e-9)));
    assert!((reduction.variance_percent().iter().sum::<f64>() - 100.0).abs() < 1e-9);
    // A rotation does not change distances, in standard deviations of the noise.
    let square = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let (one, other) = (&recording.rows[4].reading, &recording.rows[200].reading);
    let whitened = square(one, other) / 20e-6f64.powi(2);
    assert!((square(&all.rows[4].reading, &all.rows[200].reading) / whitened - 1.0).abs() < 1e-9);
}

#[test]
fn all_components_have_the_limit_of_the_readings_and_fewer_have_more() {
    let (rig, _, reduction) = pressed();
    let limit = rig.setup.cramer_rao_bound().unwrap();
    let surface = rig.setup.surface().model().unwrap();
    let contact = Contact { position: Position { x_m: 0.11, y_m: 0.19 }, force_n: 5.0 };
    let functions = rig.setup.layout().sensors().iter();
    let gradients: Vec<ResponseGradient> = functions
        .map(|sensor| surface.response_function(sensor.kind, sensor.position).gradient(contact))
        .collect();
    let whole = limit.bound_at(contact, palpate_mechanics::limit::Force::Known).unwrap().mean_error_m();
    let of = |count: usize| reduction.bound(&gradients, count).unwrap().mean_error_m();
    assert!((of(25) / whole - 1.0).abs() < 1e-6);
    assert!(of(2) > of(4) && of(4) > of(10) && of(10) >= of(25));
}

#[test]
fn the_chain_needs_a_few_components_and_the_influence_locator_beats_it() {
    let found = study(&[2, 8], 150_000).run(Watch::NONE).unwrap();
    let row = |chain: Chain| found.rows.iter().find(|row| row.chain == chain).unwrap();
    let error_m = |chain: Chain| row(chain).error_m.unwrap().median;
    let (two, eight) = (Chain::Components(2), Chain::Components(8));
    assert!(error_m(two) > 1.2 * error_m(eight), "{found:?}");
    assert!(error_m(eight) > 2.0 * error_m(Chain::Influence), "{found:?}");
    assert!(error_m(Chain::Influence) < 1.3 * row(Chain::Influence).limit_m.unwrap(), "{found:?}");
    let moving_m = |chain: Chain| row(chain).moving_error_m.median;
    assert!(2.0 * moving_m(Chain::Filter) < moving_m(Chain::Influence), "{found:?}");
    assert!(moving_m(Chain::Smoother) < moving_m(Chain::Filter), "{found:?}");
}

#[test]
fn stopped_study_has_no_results_and_needs_components() {
    let stopped = study(&[2], 1_000).run(Watch::new(&|_| false)).unwrap_err();
    assert!(Cancelled::caused(&stopped), "{stopped}");
    let told = study(&[26], 1_000).run(Watch::NONE).unwrap_err().to_string();
    assert_eq!(told, "26 components are requested of 25 sensors; expected 1 to the number of sensors");
}

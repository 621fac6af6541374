//! Every example runs, and gives the number that it is about.

#![allow(dead_code, reason = "an example has a main of its own")]

#[path = "../examples/beam.rs"]
mod beam;
#[path = "../examples/limit.rs"]
mod limit;
#[path = "../examples/load_profile.rs"]
mod load_profile;
#[path = "../examples/own_recording.rs"]
mod own_recording;
#[path = "../examples/plate.rs"]
mod plate;
#[path = "../examples/sensor_placement.rs"]
mod sensor_placement;
#[path = "../examples/tracking.rs"]
mod tracking;
#[path = "../examples/training_positions.rs"]
mod training_positions;

#[test]
fn papers_beam_reaches_the_bound_of_an_unknown_force() {
    let error_m = beam::error_m().unwrap();
    assert!((error_m - 1.882e-3).abs() < 1e-5, "{error_m}");
}

#[test]
fn a_recording_of_ones_own_is_located_between_its_positions() {
    let error_m = own_recording::mean_error_m().unwrap();
    assert!(error_m < 2e-3, "{error_m}");
}

#[test]
fn plate_estimates_the_force() {
    let force_n = plate::force_n().unwrap();
    assert!((force_n - 4.174).abs() < 1e-3, "{force_n}");
}

#[test]
fn the_limit_at_mid_span_is_that_of_the_closed_form() {
    let limit_m = limit::mid_span_m().unwrap();
    assert!((limit_m - 0.6946e-3).abs() < 1e-7, "{limit_m}");
}

#[test]
fn a_track_is_within_half_a_millimetre() {
    let error_m = tracking::mean_error_m().unwrap();
    assert!(error_m < 0.5e-3, "{error_m}");
}

#[test]
fn distributed_load_is_estimated_within_a_few_percent() {
    let total_n = load_profile::total_n().unwrap();
    assert!((total_n - 3.0).abs() < 0.1, "{total_n}");
}

#[test]
fn sensors_are_placed_better_than_evenly() {
    let gain = sensor_placement::gain().unwrap();
    assert!((0.18..0.20).contains(&gain), "{gain}");
}

#[test]
fn next_press_is_at_a_new_position() {
    let next_m = training_positions::next_m().unwrap();
    assert!(next_m > 0.22, "{next_m}");
}

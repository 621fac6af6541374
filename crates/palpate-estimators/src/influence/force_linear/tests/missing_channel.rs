//! Channels that are disabled after the fit.

use super::saturating::saturating_strip;
use super::*;
use serde_json::Value;

/// The locator with a channel that has neither influence nor offset variance, under noise beyond any reading.
fn with_silent_channel(locator: &ForceLinearLocator, channel: usize) -> ForceLinearLocator {
    let mut file = serde_json::to_value(locator).unwrap();
    let channels = locator.offsets().len();
    let silence = |list: &mut Value, value: f64| {
        for of_place in list.as_array_mut().unwrap().chunks_mut(channels) {
            of_place[channel] = value.into();
        }
    };
    for name in ["offset_variances", "values", "variances", "covariances"] {
        silence(&mut file["functions"][name], 0.0);
    }
    silence(&mut file["functions"]["noise_sd"], 1e250);
    if let Some(loadings) = file.get_mut("shared_errors") {
        silence(loadings, 0.0);
    }
    serde_json::from_value(file).unwrap()
}

fn assert_ignores_channel(locator: &ForceLinearLocator, touches: &[Row]) {
    const CHANNEL: usize = 2;
    let silent = with_silent_channel(locator, CHANNEL);
    let mut without = locator.clone();
    assert!(without.leave_out(CHANNEL));
    let read: ForceLinearLocator = serde_json::from_str(&serde_json::to_string(&without).unwrap()).unwrap();
    assert_eq!(read, without);
    let mut compared = 0;
    for touch in touches {
        let mut reading = touch.reading.clone();
        reading[CHANNEL] = 1e5;
        let [found, expected] = [without.locate(&reading), silent.locate(&touch.reading)];
        // Bounds of the statuses are those of fewer channels.
        if found.status != expected.status {
            continue;
        }
        compared += 1;
        let numbers = |estimate: &palpate_core::Estimate| {
            let uncertainty = estimate.contact.uncertainty.unwrap();
            let Position { x_m, y_m } = estimate.contact.position;
            let intervals =
                [uncertainty.x_95_m, uncertainty.y_95_m, uncertainty.force_95_n.unwrap_or_default()];
            let intervals = intervals.into_iter().flat_map(|(low, high)| [low, high]);
            intervals.chain([x_m, y_m, estimate.contact.force_n.unwrap()]).collect::<Vec<f64>>()
        };
        for (found, expected) in numbers(&found).into_iter().zip(numbers(&expected)) {
            assert!((found - expected).abs() < 1e-7 * expected.abs().max(1e-3), "{found} {expected}");
        }
    }
    assert!(10 * compared > 9 * touches.len(), "{compared} of {}", touches.len());
}

#[test]
fn a_disabled_channel_is_as_one_without_influence() {
    for presses in [(75, 25), (12, 12)] {
        let mut bench = Bench::strip(3, presses.0, presses.1);
        let touches = bench.touches(40);
        assert_ignores_channel(&bench.fit(Structure::ForceLinear).unwrap(), &touches);
    }
    let mut plate = Bench::plate(1);
    let touches = plate.touches(40);
    assert_ignores_channel(&plate.fit(Structure::ForceLinear).unwrap(), &touches);
    let (bench, touches) = saturating_strip(1, 0.15);
    assert_ignores_channel(&bench.fit(Structure::ForceSaturating).unwrap(), &touches);
}

#[test]
fn the_residual_bound_is_that_of_the_remaining_channels() {
    let mut bench = Bench::strip(5, 75, 25);
    let touches = bench.touches(400);
    let (setup, recording) = (bench.setup(), bench.recording());
    let mut locator = Influence::default().fit(&setup, &recording).unwrap().into_locator();
    locator.leave_out(1).unwrap();
    let outside = touches.iter().filter(|touch| {
        let mut reading = touch.reading.clone();
        reading[1] = 0.0;
        locator.locate(&reading).unwrap().status == Status::OutsideModel
    });
    assert!(outside.count() <= 4);
}

#[test]
fn the_last_channel_in_use_stays() {
    let bench = Bench::strip(5, 75, 25);
    let mut locator = bench.fit(Structure::ForceLinear).unwrap();
    assert_eq!((0..GAUGES).filter(|channel| locator.leave_out(*channel)).count(), GAUGES - 1);
    let before = locator.clone();
    assert!(!locator.leave_out(GAUGES - 1));
    assert!(locator.leave_out(0));
    assert_eq!(locator, before);
}

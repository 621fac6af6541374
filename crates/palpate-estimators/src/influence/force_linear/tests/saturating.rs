//! Channels that saturate: readings of hard presses fall short of proportion to the force.

use super::*;

/// Share by which the largest reading falls short.
const SHARE: f64 = 0.15;

/// A strip whose readings saturate by a share, and touches of it.
pub(super) fn saturating_strip(seed: u64, share: f64) -> (Bench, Vec<Row>) {
    let mut bench = Bench::strip(seed, 75, 25);
    let mut touches = bench.touches(60);
    let offsets = bench.offsets.clone();
    let largest = |c: usize| {
        let sizes = bench.presses.iter().map(|row| (row.reading[c] - offsets[c]).abs());
        sizes.fold(0.0, f64::max)
    };
    let largest: Vec<f64> = (0..offsets.len()).map(largest).collect();
    for row in bench.presses.iter_mut().chain(&mut touches) {
        for (c, value) in row.reading.iter_mut().enumerate() {
            let linear = *value - offsets[c];
            *value = offsets[c] + linear / (1.0 + share / (1.0 - share) * linear.abs() / largest[c]);
        }
    }
    (bench, touches)
}

fn median_error_mm(locator: &ForceLinearLocator, touches: &[Row]) -> f64 {
    median(errors_mm(locator, touches).0).unwrap()
}

#[test]
fn the_share_of_saturation_is_found_and_lowers_the_error() {
    let mut ratios = Vec::new();
    for seed in 0..4 {
        let (bench, touches) = saturating_strip(seed, SHARE);
        let [linear, saturating] =
            [Structure::ForceLinear, Structure::ForceSaturating].map(|s| bench.fit(s).unwrap());
        let share = saturating.saturation_share().unwrap();
        assert!((share - SHARE).abs() < 0.03, "{share}");
        ratios.push(median_error_mm(&saturating, &touches) / median_error_mm(&linear, &touches));
    }
    assert!(mean(ratios.iter().copied()) < 0.9, "{ratios:?}");
}

#[test]
fn readings_in_proportion_to_the_force_have_next_to_no_saturation() {
    for seed in 0..4 {
        let (bench, touches) = saturating_strip(seed, 0.0);
        let [linear, saturating] =
            [Structure::ForceLinear, Structure::ForceSaturating].map(|s| bench.fit(s).unwrap());
        assert!(saturating.saturation_share().unwrap_or(0.0) < 0.02);
        let errors_mm = [&linear, &saturating].map(|locator| median_error_mm(locator, &touches));
        assert!((errors_mm[1] / errors_mm[0] - 1.0).abs() < 0.1, "{errors_mm:?}");
    }
}

#[test]
fn a_file_keeps_the_saturation() {
    let (bench, touches) = saturating_strip(1, SHARE);
    let locator = bench.fit(Structure::ForceSaturating).unwrap();
    let read: ForceLinearLocator = serde_json::from_str(&serde_json::to_string(&locator).unwrap()).unwrap();
    assert_eq!(read, locator);
    assert_eq!(read.locate(&touches[0].reading), locator.locate(&touches[0].reading));
    let mut refused = locator.clone();
    refused.stored.saturation.as_mut().unwrap().share = 1.0;
    let file = serde_json::to_string(&refused).unwrap();
    let error = serde_json::from_str::<ForceLinearLocator>(&file).unwrap_err().to_string();
    assert!(error.contains("saturation"), "{error}");
}

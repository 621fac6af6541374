//! Likelihood for tracking, beside the one that locates single readings.

use super::*;
use crate::influence::ForceLinearLikelihood;
use crate::likelihood::{Geometry, Likelihood};

/// Compares −2·ln of the likelihood of contacts, up to a constant.
fn assert_equals_likelihood_of_single_readings(locator: &ForceLinearLocator, touches: &[Row]) {
    let likelihood = ForceLinearLikelihood::new(locator).unwrap();
    let (mut whitened, mut channels) = (Vec::new(), Vec::new());
    for touch in touches {
        likelihood.whiten(&touch.reading, &mut whitened);
        let relative = locator.relative(&touch.reading);
        let mut single = locator.likelihood(&relative);
        let mut differences = Vec::new();
        for (x, y, force_n) in [(0.1, 0.3, 0.7), (0.35, 0.55, 1.9), (0.5, 0.5, 4.5), (0.93, 0.8, 3.0)] {
            let size_m = [locator.extent().length_m(), locator.extent().width_m().unwrap_or(0.0)];
            let position = Position { x_m: x * size_m[0], y_m: y * size_m[1] };
            let contact = Contact { position, force_n };
            let misfit = match likelihood.geometry() {
                Geometry::Line(line) => line.fit_one(&whitened, contact, None).misfit,
                Geometry::Plane(plane) => plane.fit_on_plane(&whitened, contact).misfit,
            };
            let [along, across] = locator.nodes_at(position);
            let log_determinant = single.whiten([along, across, force_n], &mut channels);
            let square: f64 = channels.iter().map(|[d, f]| (d - force_n * f).powi(2)).sum();
            differences.push(misfit - square - log_determinant);
        }
        let size = 1.0 + differences[0].abs();
        assert!(
            differences.iter().all(|other| (other - differences[0]).abs() < 1e-8 * size),
            "{differences:?}"
        );
    }
}

#[test]
fn likelihood_of_a_contact_is_that_of_a_single_reading() {
    for (presses, places) in [(75, 25), (9, 9)] {
        let mut bench = Bench::strip(4, presses, places);
        let touches = bench.touches(5);
        assert_equals_likelihood_of_single_readings(&bench.fit(Structure::ForceLinear).unwrap(), &touches);
    }
    let mut plate = Bench::plate(1);
    let touches = plate.touches(5);
    assert_equals_likelihood_of_single_readings(&plate.fit(Structure::ForceLinear).unwrap(), &touches);
}

#[test]
fn calibration_variance_is_less_than_that_of_one_reading() {
    let bench = Bench::strip(4, 24, 24);
    let locator = bench.fit(Structure::ForceLinear).unwrap();
    let likelihood = ForceLinearLikelihood::new(&locator).unwrap();
    let contact = Contact { position: Position::along(0.14), force_n: 2.0 };
    let [one, _] = likelihood.calibration_variance(&[contact]);
    let variance_m2 = |likelihood: &ForceLinearLikelihood| {
        let Geometry::Line(line) = likelihood.geometry() else { panic!("a strip is a line") };
        let whitened = likelihood.linearised(&[contact]).reading;
        let [_, [_, xx, xf], [_, _, ff]] = line.fit_one(&whitened, contact, None).information;
        ff / (xx * ff - xf * xf)
    };
    assert!(one.position_m2[0] > 0.0 && one.position_m2[0] < variance_m2(&likelihood), "{one:?}");
    assert_eq!(one.position_m2[1..], [0.0; 2]);
    // Known functions leave the overdispersion, if any.
    for overdispersion in [1.0, 1.5] {
        let mut known = ForceLinearContents::from(bench.with_known_functions(&locator));
        known.channels_as_one = overdispersion;
        let likelihood = ForceLinearLikelihood::new(&known.into_locator()).unwrap();
        let [none, _] = likelihood.calibration_variance(&[contact]);
        let share = 1.0 - overdispersion.recip();
        let all_m2 = variance_m2(&likelihood);
        assert!((none.position_m2[0] - share * all_m2).abs() < 1e-9 * all_m2, "{none:?}");
    }
}

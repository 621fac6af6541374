//! What physics allows an arm, beside what its locators achieve.

use std::f64::consts::FRAC_2_PI;

use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::{Bound, Force};

/// Mean error, in metres, of an estimator at the limit at each of `positions`, for contacts of `force_n` newtons; `None` where the
/// bench has no limit.
///
/// Where readings hardly tell the position, the limit is boundless, but it is still known that the contact lies on the surface. So
/// the bound's standard deviation s is combined with a flat prior of variance l²/12, as a sensor design scores contacts:
/// √(2/π) / √(1/s² + 12/l²), with l the surface's length. Where s is small, that is the mean error of the bound itself.
pub(super) fn expected_errors_m(setup: &Setup, force_n: f64, positions: &[Position]) -> Option<Vec<f64>> {
    let limit = setup.cramer_rao_bound().ok()?;
    let force = if setup.force_n.is_some() { Force::Known } else { Force::Unknown };
    let length_m = setup.surface.extent().length_m();
    let at = |&position: &Position| {
        let bound = limit.at(Contact { position, force_n }, force);
        expected_error_m(bound.as_ref(), length_m)
    };
    Some(positions.iter().map(at).collect())
}

fn expected_error_m(bound: Option<&Bound>, length_m: f64) -> f64 {
    let told = bound.map_or(0.0, |bound| bound.sd_position_m.powi(-2));
    FRAC_2_PI.sqrt() / (told + 12.0 / length_m.powi(2)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_rig::Rig;

    #[test]
    fn known_forces_expect_the_bounds_own_error_and_blind_ends_no_more_than_the_surface() {
        let text = include_str!("../../../examples/paper.toml");
        let setup = Rig::from_toml(text).unwrap().setup;
        let positions = [0.001, 0.2].map(Position::along);
        let known = expected_errors_m(&setup, 3.0, &positions).unwrap();
        let limit = setup.cramer_rao_bound().unwrap();
        for (at, expected_m) in positions.into_iter().zip(known) {
            let bound = limit.at(Contact { position: at, force_n: 3.0 }, Force::Known).unwrap();
            assert!((expected_m / bound.mean_error_m() - 1.0).abs() < 1e-4);
        }
        let mut setup = palpate_estimators::setup::Setup { force_n: None, ..setup.clone() };
        let unknown = expected_errors_m(&setup, 3.0, &positions).unwrap();
        let most_m = 0.4 / 12.0_f64.sqrt() * FRAC_2_PI.sqrt();
        assert!(unknown[0] < most_m && unknown[0] > 0.99 * most_m, "{unknown:?}");
        setup
            .layout
            .edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 0.0))
            .unwrap();
        assert_eq!(expected_errors_m(&setup, 3.0, &positions), None);
    }
}

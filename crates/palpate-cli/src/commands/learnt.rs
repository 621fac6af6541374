//! JSON of the structure, drift, scatter and noise in a locator of a surface without a model.

use crate::json::object;
use palpate_estimators::estimator::Locator;
use palpate_estimators::influence::ForceLinearLocator;
use palpate_mechanics::contact::Position;
use serde::Serialize;

pub fn of_locator(locator: &Locator) -> Option<(&ForceLinearLocator, Vec<String>)> {
    Some((locator.force_linear()?, locator.setup.layout().names()))
}

pub fn json(linear: &ForceLinearLocator, names: &[String]) -> impl Serialize + use<> {
    let size_of = |sizes: &[(usize, f64)], c: usize| sizes.iter().find(|(of, _)| *of == c).map(|(_, sd)| *sd);
    let (drifts, scatter) = (linear.drifts(), linear.scatter());
    let scatters = scatter.as_ref().map_or(&[][..], |scatter| &scatter.sd);
    let channels = linear.channels().map(|(c, offset, noise_sd)| {
        object! {
            "name": names[c].clone(),
            "offset": offset,
            "noise_sd": noise_sd,
            "drift"?: size_of(&drifts, c),
            "scatter_sd"?: size_of(scatters, c),
        }
    });
    object! {
        "structure": linear.structure(),
        "asked_structure": linear.asked_structure(),
        "force_exponent": linear.response(),
        "saturation"?: linear.saturation_share(),
        "presses": linear.presses(),
        "channels": channels.collect::<Vec<_>>(),
        "drift_course"?: linear.drift_course(),
        "noise_by_place"?: linear.noise_by_place().map(|ends| ends.map(|(times, Position { x_m, y_m })| {
            object! { "times": times, "x_mm": 1e3 * x_m, "y_mm": 1e3 * y_m }
        })),
        "scatter_force_n"?: scatter.as_ref().map(|scatter| scatter.force_n),
        "rows_set_aside": linear.set_aside().iter().map(|row| row + 1).collect::<Vec<_>>(),
    }
}

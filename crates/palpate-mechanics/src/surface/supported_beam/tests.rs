use std::sync::LazyLock;

use super::*;
use crate::surface::Beam;
use BeamSupportKind::{Clamped, Free, Guided, Simple};
use SensorKind::{Deflection, Reaction, Slope, Strain};

mod closed_forms;
mod properties;
mod refusals;

static PAPER: LazyLock<Beam> = LazyLock::new(|| Beam::new(0.4, 0.04, 0.0012, 200e9).unwrap());

fn spring(stiffness_n_per_m: f64, rotational_stiffness_nm_per_rad: Option<f64>) -> BeamSupportKind {
    BeamSupportKind::Elastic { stiffness_n_per_m, rotational_stiffness_nm_per_rad }
}

/// The paper's beam on other supports, in metres from its left end.
fn paper_on(supports: &[(f64, BeamSupportKind)]) -> SupportedBeamSpec {
    SupportedBeamSpec {
        length_m: PAPER.length_m(),
        youngs_modulus_pa: PAPER.youngs_modulus_pa(),
        sections: vec![BeamSection { to_m: 0.4, width_m: 0.04, thickness_m: 0.0012 }],
        supports: supports.iter().map(|&(at_m, kind)| BeamSupport { at_m, kind }).collect(),
    }
}

fn beam(spec: &SupportedBeamSpec) -> SupportedBeam {
    SupportedBeam::new(spec.clone()).unwrap()
}

fn at(surface: &dyn Surface, kind: SensorKind, sensor_m: f64, contact_m: f64) -> f64 {
    surface.influence(kind, Position::along(sensor_m), Position::along(contact_m))
}

/// Largest difference of two surfaces' influence functions, as a share of full scale; reactions at
/// `supports_m`.
fn largest_difference(a: &dyn Surface, b: &dyn Surface, supports_m: &[f64]) -> f64 {
    let l = a.length_m();
    let even: Vec<f64> = (0..=30).map(|i| l * f64::from(i) / 30.0).collect();
    let mut largest: f64 = 0.0;
    for kind in [Deflection, Slope, Strain, Reaction] {
        for sensor_m in if kind == Reaction { supports_m } else { &even } {
            let sensor = Position::along(*sensor_m);
            let functions = [a, b].map(|surface| surface.influence_function(kind, sensor));
            for step in 0..=97 {
                let contact = Position::along(l * f64::from(step) / 97.0);
                let [here, there] = [0, 1].map(|i| functions[i].at(contact));
                largest = largest.max((here - there).abs() / a.full_scale(kind));
                let [here, there] = [0, 1].map(|i| functions[i].gradient(contact)[0]);
                // At a kink over the sensor the value of either side is valid.
                if (contact.x_m - sensor_m).abs() > 1e-6 * l {
                    largest = largest.max((here - there).abs() * l / (12.0 * a.full_scale(kind)));
                }
            }
        }
    }
    largest
}

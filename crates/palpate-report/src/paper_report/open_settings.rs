//! What the paper leaves open, and what the study does about it.

use maud::{Markup, html};

use super::Paper;
use crate::numbers::{number, stated};
use crate::page::{Table, text, words};
use palpate_estimators::estimator::Setting;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{Beam, Surface};
use palpate_rig::Rig;

/// Young's modulus as the paper prints it, in pascals.
const PRINTED_MODULUS_PA: f64 = 200e6;

/// What the paper says of an estimator's setting, by its key; the keys in the order of the table.
const OF_THE_NETWORK: [(&str, &str); 13] = [
    ("input_scale", "not stated"),
    ("biases", "not stated"),
    ("initial_weights", "not stated"),
    ("order", "not stated"),
    ("weight_update", "not stated"),
    ("aggregate_error", "stops at an aggregate error of 0.001 %, without saying of what it is the sum"),
    ("max_epochs", "at most a million iterations, without saying what one iteration is"),
    ("hidden", "10"),
    ("hidden_activation", "sigmoid"),
    ("output_activation", "sigmoid"),
    ("output", "both, compared"),
    ("learning_rate", "0.7"),
    ("momentum", "0.9"),
];

impl Paper<'_> {
    pub(super) fn about_open(&self) -> Markup {
        html! {
            p {
                "The paper does not say everything that a replication has to know. Where it is silent, the study's file decides; \
                 the table lists its decisions as they were in this run."
            }
            (self.why_not_the_printed_modulus())
        }
    }

    pub(super) fn open_table(&self) -> Table {
        let mut rows: Vec<Vec<Markup>> = Vec::new();
        if let Some((rig, beam, force_n)) = self.setup() {
            rows.push(modulus_row(beam));
            rows.push(noise_row(rig));
            rows.push(cells("force", "3 N, known", &format!("{} N, known", stated(force_n))));
        }
        rows.extend(OF_THE_NETWORK.iter().filter_map(|(key, paper)| self.network_row(key, paper)));
        rows.push(cells("iteration", "undefined", "one epoch: every training position shown once"));
        rows.push(cells("networks of each kind", "one", &self.report.seeds_in_words()));
        let columns = [words("setting"), words("the paper"), words("this study")];
        Table::new(columns, rows, html! { "Settings of this study, beside what the paper says of them." })
    }

    /// What the beam would do with the modulus as printed, unless the study uses it.
    fn why_not_the_printed_modulus(&self) -> Markup {
        let Some((_, beam, force_n)) = self.setup() else { return Markup::default() };
        if (beam.youngs_modulus_pa() / PRINTED_MODULUS_PA - 1.0).abs() < 1e-6 {
            return Markup::default();
        }
        let sag_m = |youngs_modulus_pa: f64| {
            // The deflection is inversely proportional to the modulus.
            force_n * beam.full_scale(SensorKind::Deflection) * beam.youngs_modulus_pa() / youngs_modulus_pa
        };
        html! {
            p {
                "One value is not followed: the paper prints a Young's modulus of 200 MPa. With it, the load in the middle would \
                 bend this " (stated(beam.length_m() * 1e3)) " mm beam by " (number(sag_m(PRINTED_MODULUS_PA)))
                " m, far outside the small deflections that the beam equation is made for. Steel has 200 GPa, so the print is \
                 taken for a slip. With " (stated(beam.youngs_modulus_pa() / 1e9)) " GPa, as here, it bends by "
                (number(sag_m(beam.youngs_modulus_pa()) * 1e3)) " mm."
            }
        }
    }

    /// The setting with that key, with every value that an arm gives it.
    fn network_row(&self, key: &str, paper: &str) -> Option<Vec<Markup>> {
        let arms = self.report.study.study.arms.iter();
        let found: Vec<Setting> =
            arms.flat_map(|arm| arm.rig.estimator.settings()).filter(|setting| setting.key == key).collect();
        let name = found.first()?.name;
        let mut values: Vec<String> = Vec::new();
        for setting in found {
            if !values.contains(&setting.value) {
                values.push(setting.value);
            }
        }
        let mut value = values.join(", or ");
        if key == "input_scale"
            && let Some((_, beam, force_n)) = self.setup()
        {
            let full_scale_mm = force_n * beam.full_scale(SensorKind::Deflection) * 1e3;
            value += &format!("; the full scale of the deflection is {full_scale_mm:.4} mm");
        }
        Some(cells(name, paper, &value))
    }
}

fn cells(name: &str, paper: &str, study: &str) -> Vec<Markup> {
    vec![text(name), text(paper), text(study)]
}

fn modulus_row(beam: Beam) -> Vec<Markup> {
    let value = format!("{} GPa", stated(beam.youngs_modulus_pa() / 1e9));
    cells("Young's modulus", "200 MPa, taken for a slip", &value)
}

fn noise_row(rig: &Rig) -> Vec<Markup> {
    let noisy = rig.setup.layout.sensors().iter().any(|sensor| sensor.channel != Default::default());
    let study = if noisy {
        "the sensors have faults, as the study's file states"
    } else {
        "none: readings are exact"
    };
    cells("sensor noise", "none: readings are computed", study)
}

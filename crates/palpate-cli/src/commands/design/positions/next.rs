//! The next press of a recording begun.

use super::{Arguments, complaint, findings, what_to_design};
use crate::failure::Failure;
use crate::output;
use crate::progress::Observer;
use crate::table::table;
use palpate_design::positions::{Advice, next_press};
use palpate_estimators::recording::Recording;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Watch;
use palpate_rig::Rig;

/// Presses that a table shows.
const SHOWN: usize = 5;

/// What is printed as JSON.
#[derive(serde::Serialize)]
struct Findings {
    palpate: &'static str,
    rig: String,
    presses: usize,
    positions: usize,
    /// Standard deviations, averaged over the contacts.
    expected_error_mm: f64,
    endless_error_mm: f64,
    to_gain_percent: f64,
    stop_below_percent: f64,
    enough: bool,
    next: Vec<Next>,
    /// Presses to come until it is enough; null where more than are looked ahead.
    presses_to_go: Option<usize>,
}

#[derive(serde::Serialize)]
struct Next {
    #[serde(flatten)]
    place: findings::Place,
    expected_error_mm: f64,
}

pub fn run(arguments: &Arguments, rig: &Rig, recording: &Recording) -> Result<(), Failure> {
    let design = what_to_design(arguments, rig);
    let observer = Observer::of_stages();
    let observe = |progress| observer.observe(progress);
    let advice = next_press(&rig.setup, recording, &design, Watch::new(&observe));
    drop(observer);
    let advice = advice.map_err(|error| complaint(&error, &arguments.rig))?;
    if arguments.json {
        return output::say_json(&told(arguments, &advice));
    }
    print(&advice, rig.setup.surface.extent())
}

fn told(arguments: &Arguments, advice: &Advice) -> Findings {
    Findings {
        palpate: env!("CARGO_PKG_VERSION"),
        rig: arguments.rig.display().to_string(),
        presses: advice.presses,
        positions: advice.positions,
        expected_error_mm: advice.error_m * 1e3,
        endless_error_mm: advice.endless_error_m * 1e3,
        to_gain_percent: advice.to_gain_percent(),
        stop_below_percent: advice.stop_percent,
        enough: advice.is_enough(),
        next: advice
            .next
            .iter()
            .map(|press| Next {
                place: findings::place(&press.position),
                expected_error_mm: press.error_m * 1e3,
            })
            .collect(),
        presses_to_go: advice.gets_there().then_some(advice.next.len()),
    }
}

fn print(advice: &Advice, extent: Extent) -> Result<(), Failure> {
    output::say(format!(
        "{} presses at {} positions: expected error {:.4} mm; with endless presses {:.4} mm, {:.1} % less",
        advice.presses,
        advice.positions,
        advice.error_m * 1e3,
        advice.endless_error_m * 1e3,
        advice.to_gain_percent(),
    ))?;
    if advice.is_enough() {
        return output::say(format!("Enough: less than {} % is left to gain.", advice.stop_percent));
    }
    let mut before_m = advice.error_m;
    let rows = advice.next.iter().take(SHOWN).map(|press| {
        let gain = 100.0 * (1.0 - press.error_m / before_m);
        before_m = press.error_m;
        let (x, y) = (press.position.x_m * 1e3, press.position.y_m * 1e3);
        let place = match extent {
            Extent::Line { .. } => format!("{x:.1}"),
            Extent::Plane { .. } => format!("({x:.1}, {y:.1})"),
        };
        vec![place, format!("{:.4}", press.error_m * 1e3), format!("{gain:.2}")]
    });
    let rows: Vec<_> = rows.collect();
    output::say(format!("\n{}", table(&["press next at, mm", "expected error, mm", "gain, %"], rows)))?;
    if advice.gets_there() {
        let count = advice.next.len();
        let words = if count == 1 { "press leaves" } else { "presses leave" };
        output::say(format!("\n{count} {words} less than {} % to gain.", advice.stop_percent))
    } else {
        output::say(format!(
            "\nMore than {} presses are needed to leave less than {} % to gain.",
            Advice::MOST_AHEAD,
            advice.stop_percent
        ))
    }
}

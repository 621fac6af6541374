//! Descriptions, one line per fact.

mod locator;
mod parameters;

pub use locator::{choice, interval_check, locator};
pub use parameters::{noise_is_hardly_told, parameter_lines, summary_lines};

use crate::arrangement::{Arrangement, Training};
use crate::recording::Recording;
use crate::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::{Extent, SurfaceSpec};
use palpate_mechanics::units::{Dimension, Quantity, format_length_mm};

/// Describes surface, sensors and force.
pub fn setup(setup: &Setup) -> Vec<String> {
    let extent = setup.surface().extent();
    let modulus = |value| Quantity { value, dimension: Dimension::Modulus };
    let surface = match setup.surface() {
        SurfaceSpec::Beam(beam) => format!(
            "simply supported beam, {} × {} × {}, Young's modulus {}",
            format_length_mm(beam.length_m()),
            format_length_mm(beam.width_m()),
            format_length_mm(beam.thickness_m()),
            modulus(beam.youngs_modulus_pa())
        ),
        SurfaceSpec::SupportedBeam(beam) => format!(
            "beam, {} long, {}; section {}; Young's modulus {}",
            format_length_mm(extent.length_m()),
            beam.spec().supports_in_words(),
            beam.spec().sections_in_words(),
            modulus(beam.spec().youngs_modulus_pa)
        ),
        SurfaceSpec::Plate(plate) => format!(
            "plate, {} × {} × {}, Young's modulus {}, Poisson's ratio {}",
            format_length_mm(plate.spec().length_m),
            format_length_mm(plate.spec().width_m),
            format_length_mm(plate.spec().thickness_m),
            modulus(plate.spec().youngs_modulus_pa),
            plate.spec().poissons_ratio
        ),
        SurfaceSpec::Digit(digit) => format!(
            "flexible digit, {} × {} × {}, Young's modulus {}, contact forces {}; E·I/l² is {:.3} N",
            format_length_mm(digit.length_m()),
            format_length_mm(digit.width_m()),
            format_length_mm(digit.thickness_m()),
            modulus(digit.youngs_modulus_pa()),
            digit.direction().name(),
            digit.characteristic_force_n()
        ),
        SurfaceSpec::Measured(_) => match extent.width_m() {
            Some(width_m) => {
                format!("measured, {} × {}", format_length_mm(extent.length_m()), format_length_mm(width_m))
            }
            None => format!("measured, {} long", format_length_mm(extent.length_m())),
        },
    };
    let force = setup.force_n().map_or("unknown".to_owned(), |force_n| format!("{force_n} N, known"));
    vec![
        format!("surface: {surface}"),
        format!("sensors: {}", layout(setup.layout(), extent)),
        format!("contact force: {force}"),
    ]
}

fn layout(layout: &Layout, extent: Extent) -> String {
    let names: Vec<String> = layout
        .sensors()
        .iter()
        .map(|sensor| match sensor.kind {
            SensorKind::Raw => sensor.name.clone(),
            kind => format!("{kind} at {}", extent.place_in_words(sensor.position)),
        })
        .collect();
    let separator = match extent {
        Extent::Line { .. } => ", ",
        Extent::Plane { .. } => "; ",
    };
    format!("{}: {}", layout.len(), names.join(separator))
}

/// Describes the training positions in one line.
pub fn training(training: &Training) -> String {
    let rule = match &training.arrangement {
        Arrangement::Even => "evenly".to_owned(),
        Arrangement::Chebyshev => "at Chebyshev's nodes".to_owned(),
        Arrangement::EvenOver { portion: (start, end) } => {
            format!("evenly from {start:.4} to {end:.4} of the length")
        }
        Arrangement::Grid { columns, rows } => format!("a grid of {columns} × {rows}"),
        Arrangement::EdgeDense { middle, .. } => format!("edge-dense, {middle} in the middle"),
        Arrangement::Explicit(_) => "as listed".to_owned(),
    };
    let placement = training.placement_sd_m.map_or_else(String::new, |sd_m| format!(", {}", placement(sd_m)));
    format!("{}, {rule}, {} × each{placement}", training.count, training.repeats)
}

fn placement(sd_m: f64) -> String {
    format!("placement {} (standard deviation)", format_length_mm(sd_m))
}

/// Describes rows, positions and channel ranges.
pub fn recording(recording: &Recording, setup: &Setup) -> Vec<String> {
    let positions = recording.distinct_positions();
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let ends = |of: fn(&Position) -> f64| {
        let (low, high) = range(&mut positions.iter().map(of));
        format!("{} to {}", format_length_mm(low), format_length_mm(high))
    };
    let positioned = match setup.surface().extent() {
        Extent::Line { .. } => ends(|at| at.x_m),
        Extent::Plane { .. } => format!("{} along, {} across", ends(|at| at.x_m), ends(|at| at.y_m)),
    };
    let mut lines =
        vec![format!("a recording: {} rows at {} positions", recording.rows.len(), positions.len())];
    if !positions.is_empty() {
        lines.push(format!("positions: {positioned}"));
    }
    for (i, (name, kind)) in recording.channels.iter().zip(&recording.kinds).enumerate() {
        let (low, high) = range(&mut recording.rows.iter().map(|row| row.reading[i]));
        let shown = |value| Quantity { value, dimension: kind.dimension() };
        lines.push(format!("channel {name} ({kind}): {} to {}", shown(low), shown(high)));
    }
    lines
}

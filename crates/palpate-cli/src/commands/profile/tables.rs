//! What people read of a profile.

use super::findings::{Findings, Interval, PatchFound, TrueLoad};
use crate::failure::Failure;
use crate::output;
use crate::table::table;
use palpate_mechanics::surface::Extent;

pub fn print(findings: &Findings) -> Result<(), Failure> {
    let interval = |value: &Interval, unit: &str| {
        format!("{:.3} {unit} ({:.3} to {:.3})", value.value, value.low, value.high)
    };
    let heading = match findings.line {
        Some(line) => format!("line {line}: {}", findings.status),
        None => format!("simulated: {}", findings.status),
    };
    output::say(heading)?;
    output::say(format!(
        "misfit {:.1}; noise seldom makes more than {:.1}",
        findings.misfit, findings.worst_misfit
    ))?;
    let Some(centre) = &findings.centre_x_mm else { return Ok(()) };
    output::say(format!("total force         {}", interval(&findings.total_n, "N")))?;
    output::say(format!("centre of pressure  {}", interval(centre, "mm")))?;
    if let Some(across) = &findings.centre_y_mm {
        output::say(format!("            across  {}", interval(across, "mm")))?;
    }
    if let Some(width_mm) = findings.resolution_mm {
        output::say(format!(
            "resolution          {width_mm:.0} mm, the median width of the averaging kernels"
        ))?;
    }
    let extent = findings.extent;
    let rows = findings.patches.iter().enumerate().map(|(i, patch)| patch_row(i + 1, patch));
    output::say(format!("\n{}", table(&columns("patch", extent), rows)))?;
    if findings.loads.is_empty() {
        return Ok(());
    }
    let rows = findings.loads.iter().enumerate().map(|(i, load)| load_row(i + 1, load));
    output::say(format!("\n{}", table(&columns("true load", extent), rows)))
}

fn columns(what: &'static str, extent: Extent) -> Vec<&'static str> {
    let places: &[_] = match extent {
        Extent::Line { .. } => &["stretch, mm", "centre, mm", "limit"],
        Extent::Plane { .. } => &["x, mm", "y, mm", "centre x, mm", "limit", "centre y, mm", "limit"],
    };
    [&[what], places, &["force, N", "limit"]].concat()
}

fn patch_row(number: usize, patch: &PatchFound) -> Vec<String> {
    let cell = |value: &Interval| format!("{:.3} ({:.3} to {:.3})", value.value, value.low, value.high);
    let across = patch.across.as_ref();
    let places = [Some(patch.stretch_mm), across.map(|across| across.stretch_y_mm)];
    let centres = [
        Some((cell(&patch.centre_x_mm), patch.limit_x_mm)),
        across.map(|across| (cell(&across.centre_y_mm), across.limit_y_mm)),
    ];
    row(number, places, centres, (cell(&patch.force_n), patch.limit_force_n))
}

fn load_row(number: usize, load: &TrueLoad) -> Vec<String> {
    let cell = |value: f64| format!("{value:.3}");
    let across = load.across.as_ref();
    let places = [Some(load.stretch_mm), across.map(|across| across.stretch_y_mm)];
    let centres = [
        Some((cell(load.centre_x_mm), load.limit_x_mm)),
        across.map(|across| (cell(across.centre_y_mm), across.limit_y_mm)),
    ];
    row(number, places, centres, (cell(load.force_n), load.limit_force_n))
}

/// A row of [`columns`]: stretches and centres along, and on a plane across.
fn row(
    number: usize,
    stretches_mm: [Option<[f64; 2]>; 2],
    centres: [Option<(String, Option<f64>)>; 2],
    (force, force_limit): (String, Option<f64>),
) -> Vec<String> {
    let limit = |limit: Option<f64>| limit.map_or_else(|| "–".to_owned(), |limit| format!("{limit:.3}"));
    let mut row = vec![number.to_string()];
    row.extend(stretches_mm.into_iter().flatten().map(|[from, to]| format!("{from:.0}–{to:.0}")));
    for (centre, centre_limit) in centres.into_iter().flatten() {
        row.extend([centre, limit(centre_limit)]);
    }
    row.extend([force, limit(force_limit)]);
    row
}

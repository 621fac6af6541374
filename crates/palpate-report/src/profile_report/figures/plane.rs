//! The load on a plane: maps in the place of curves.

use maud::{Markup, html};

use super::residual_figure;
use crate::numbers::mm;
use crate::page::Figure;
use crate::profile_report::ProfileReport;
use crate::{HeatMap, HeatPanel, heat_map_to_svg};
use palpate_estimators::estimator::Resolution;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::UniformLoad;

/// Places whose averaging kernels are drawn, as shares of length and width.
const KERNEL_PLACES: [[f64; 2]; 3] = [[0.5, 0.5], [0.25, 0.25], [0.1, 0.5]];
/// Pascals in a kilopascal, which people read.
const KPA: f64 = 1e3;

pub(super) fn figures(report: &ProfileReport) -> Vec<Figure> {
    let mut figures = vec![pressure_figure(report)];
    if let Some(resolution) = report.resolution {
        figures.push(width_figure(report, resolution));
        figures.push(kernel_figure(report, resolution));
    }
    figures.push(residual_figure(report));
    figures
}

fn pressure_figure(report: &ProfileReport) -> Figure {
    let profile = report.profile;
    let cells = 0..profile.cells.len();
    let sd = |cell: usize| profile.covariance_n2[[cell, cell]].sqrt() / profile.cells.measure() / KPA;
    let mut panels = vec![panel("told", cells.clone().map(|cell| profile.density(cell).0 / KPA).collect())];
    if !report.truth.is_empty() {
        panels.push(panel("simulated", truth(report)));
    }
    panels.push(panel("standard deviation", cells.map(sd).collect()));
    let caption = html! {
        "The pressure that the reading tells, cell by cell"
        @if !report.truth.is_empty() { ", the pressure that was simulated," }
        " and the standard deviation of what is told. Neighbouring cells share their uncertainty: where one is too high, the next is too \
         low, and their sum is told better than either. Dots: the sensors."
    };
    figure(1, map(report, "The pressure on the surface", "kPa", panels), caption)
}

/// The mean pressure of the simulated loads over each cell, in kPa.
fn truth(report: &ProfileReport) -> Vec<f64> {
    let cells = report.profile.cells;
    let force_n = |load: &UniformLoad, (from, to): (Position, Position)| {
        let shared = |a: f64, b: f64, c: f64, d: f64| (b.min(d) - a.max(c)).max(0.0) / (b - a);
        load.force_n
            * shared(load.from.x_m, load.to.x_m, from.x_m, to.x_m)
            * shared(load.from.y_m, load.to.y_m, from.y_m, to.y_m)
    };
    let pressure = |cell| report.truth.iter().map(|load| force_n(load, cells.corners(cell))).sum::<f64>();
    (0..cells.len()).map(|cell| pressure(cell) / cells.measure() / KPA).collect()
}

fn width_figure(report: &ProfileReport, resolution: &Resolution) -> Figure {
    let widths = resolution.widths_m.iter().map(|width_m| width_m * 1e3).collect();
    let caption = html! {
        "Over how much of the surface the pressure map is a mean, at the smoothness of this reading: the side of a square as large as \
         the area where the averaging kernel of a place is above half of its height."
    };
    figure(2, map(report, "Width of the averaging kernels", "width, mm", vec![panel("", widths)]), caption)
}

fn kernel_figure(report: &ProfileReport, resolution: &Resolution) -> Figure {
    let cells = resolution.cells;
    let kernel = |[along, across]: [f64; 2]| {
        let number = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
        let cell = number(across, cells.rows) * cells.columns + number(along, cells.columns);
        let Position { x_m, y_m } = cells.centre(cell);
        let name = format!("of {}, {} mm", mm(x_m), mm(y_m));
        panel(&name, resolution.kernels.row(cell).to_vec())
    };
    let caption = html! {
        "What load elsewhere adds to the map at three places: the ideal is a spike at the place itself. Negative lobes take away."
    };
    figure(
        3,
        map(report, "Averaging kernels", "share", KERNEL_PLACES.into_iter().map(kernel).collect()),
        caption,
    )
}

fn panel(name: &str, values: Vec<f64>) -> HeatPanel {
    HeatPanel { name: name.to_owned(), values }
}

fn map(report: &ProfileReport, title: &str, label: &str, panels: Vec<HeatPanel>) -> HeatMap {
    let cells = report.profile.cells;
    let sensors = report.layout.sensors.iter().map(|sensor| sensor.position);
    HeatMap {
        title: title.to_owned(),
        length_mm: cells.extent.length_m * 1e3,
        width_mm: cells.extent.width_m.unwrap_or(0.0) * 1e3,
        columns: cells.columns,
        rows: cells.rows,
        panels,
        sensors_mm: sensors.map(|at| (at.x_m * 1e3, at.y_m * 1e3)).collect(),
        label: label.to_owned(),
        most: f64::INFINITY,
        width_px: 860,
    }
}

fn figure(number: usize, map: HeatMap, caption: Markup) -> Figure {
    Figure { number, svg: heat_map_to_svg(&map), alternative: map.title, caption }
}

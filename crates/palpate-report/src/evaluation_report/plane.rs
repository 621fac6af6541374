//! Errors over a plane, as a map.

use maud::html;

use super::EvaluationReport;
use crate::numbers::number;
use crate::page::Figure;
use crate::plane_figures::{ErrorGrid, LIMIT_IN_WORDS};
use crate::{HeatPanel, heat_map_to_svg};

pub(super) fn error_map(report: &EvaluationReport, width_m: f64) -> Figure {
    let (bench, evaluation) = (report.bench(), report.evaluation);
    let grid = ErrorGrid::of(std::iter::once(evaluation), evaluation.length_m, width_m);
    let errors = HeatPanel { name: "the locator".to_owned(), values: grid.medians_mm(&evaluation.located) };
    let map = grid.map(bench, "Median location error over the surface", vec![errors]);
    let with_limit = map.panels.len() > 1;
    let caption = html! {
        "Median of the location errors in cells of " (number(grid.cell_m()[0] * 1e3)) " × " (number(grid.cell_m()[1] * 1e3))
        " mm. Dots: the sensors. Grey: no contact was tried."
        @if with_limit { (LIMIT_IN_WORDS) }
    };
    Figure { number: 1, alternative: map.title.clone(), svg: heat_map_to_svg(&map), caption }
}

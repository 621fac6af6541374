//! The limit over a plane, as two maps.

use maud::html;

use super::LimitReport;
use crate::numbers::stated;
use crate::page::Figure;
use crate::plane_figures::sensors_mm;
use crate::{HeatMap, HeatPanel, heat_map_to_svg};
use palpate_estimators::arrangement::cells;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::limit::Force;

/// Cells of a map, about.
const CELLS: f64 = 2000.0;

pub(super) fn limit_map(report: &LimitReport, width_m: f64) -> Figure {
    let extent = report.known.extent;
    let side = |ratio: f64| (CELLS * ratio).sqrt().round().clamp(5.0, 200.0) as usize;
    let (columns, rows) = (side(extent.length_m / width_m), side(width_m / extent.length_m));
    let middles = cells(extent, columns, rows);
    let limit_mm = |force| {
        let at = |&position: &_| {
            let bound = report.limit.at(Contact { position, force_n: report.known.force_n }, force);
            bound.map_or(f64::NAN, |bound| bound.sd_position_m * 1e3)
        };
        middles.iter().map(at).collect::<Vec<f64>>()
    };
    let (known, unknown) = (limit_mm(Force::Known), limit_mm(Force::Unknown));
    let length_mm = extent.length_m * 1e3;
    let cut_off = known.iter().chain(&unknown).any(|value| *value > length_mm);
    let nowhere = known.iter().chain(&unknown).any(|value| value.is_nan());
    let panel = |name: &str, values| HeatPanel { name: name.to_owned(), values };
    let map = HeatMap {
        title: "The least standard deviation of a located contact".to_owned(),
        length_mm,
        width_mm: width_m * 1e3,
        columns,
        rows,
        panels: vec![panel("force known", known), panel("force unknown, estimated along", unknown)],
        sensors_mm: sensors_mm(report.bench),
        label: "limit, mm".to_owned(),
        most: length_mm,
        width_px: 860,
    };
    let caption = html! {
        "The limit at each contact position, for " (stated(report.known.force_n)) " N: the root of the sum of the least variances \
         along and across. No unbiased estimator has a smaller one. Dots: the sensors."
        @if cut_off { " Limits above the length of the surface have its colour: contacts there cannot be located." }
        @if nowhere { " Grey: the readings do not tell the position." }
    };
    Figure { number: 2, alternative: map.title.clone(), svg: heat_map_to_svg(&map), caption }
}

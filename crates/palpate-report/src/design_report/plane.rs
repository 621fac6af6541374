//! The limit over a plane with the even and the best layout, as two maps of one scale.

use maud::html;

use super::SensorDesignReport;
use crate::numbers::stated;
use crate::page::Figure;
use crate::plane_figures::sensors_mm;
use crate::{HeatMap, HeatPanel, heat_map_to_svg};
use palpate_design::sensors::Designed;
use palpate_estimators::arrangement::cells;
use palpate_estimators::setup::Bench;
use palpate_mechanics::contact::Contact;

/// Cells of a map, about.
const CELLS: f64 = 1600.0;

/// Figure `first` for the best layout, and the one after for the even layout.
pub(super) fn limit_maps(report: &SensorDesignReport, width_m: f64, first: usize) -> Vec<Figure> {
    let extent = report.bench.surface.extent();
    let side = |ratio: f64| (CELLS * ratio).sqrt().round().clamp(5.0, 160.0) as usize;
    let (columns, rows) = (side(extent.length_m / width_m), side(width_m / extent.length_m));
    let middles = cells(extent, columns, rows);
    let drawn = |designed: &Designed| {
        let bench = Bench { layout: designed.layout.clone(), ..report.bench.clone() };
        let limit = bench.cramer_rao_bound().ok()?;
        let at = |&position: &_| {
            let contact = Contact { position, force_n: report.problem.force_n() };
            let bound = limit.at(contact, report.problem.force());
            bound.map_or(f64::NAN, |bound| bound.sd_position_m * 1e3)
        };
        let values: Vec<f64> = middles.iter().map(at).collect();
        Some((designed.method.name(), values, sensors_mm(&bench)))
    };
    let shown: Vec<_> = report.best().into_iter().chain(report.even()).filter_map(drawn).collect();
    // Both maps have the colours of the same limits: those of the even layout, but for its largest.
    let mut limits: Vec<f64> =
        shown.iter().flat_map(|(_, values, _)| values).copied().filter(|value| value.is_finite()).collect();
    limits.sort_by(f64::total_cmp);
    let most = limits.get(limits.len() * 95 / 100).copied().unwrap_or(1.0);
    let figure = |i, (name, values, sensors_mm): (&str, Vec<f64>, Vec<(f64, f64)>)| {
        let map = HeatMap {
            title: format!("The least standard deviation of a located contact, {name} layout"),
            length_mm: extent.length_m * 1e3,
            width_mm: width_m * 1e3,
            columns,
            rows,
            panels: vec![HeatPanel { name: String::new(), values }],
            sensors_mm,
            label: "limit, mm".to_owned(),
            most,
            width_px: 640,
        };
        let caption = html! {
            "The limit at each contact position with the " (name) " layout, for " (stated(report.problem.force_n())) " N, force "
            (report.problem.force().name()) ". Dots: the sensors. Limits above " (crate::numbers::number(most))
            " mm have its colour."
        };
        Figure { number: first + i, alternative: map.title.clone(), svg: heat_map_to_svg(&map), caption }
    };
    shown.into_iter().enumerate().map(|(i, layout)| figure(i, layout)).collect()
}

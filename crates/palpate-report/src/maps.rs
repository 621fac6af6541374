use maud::{Markup, html};

use super::numbers::number;
use super::page::Figure;
use super::{HeatMap, HeatPanel};
use palpate_estimators::estimator::Cells;
use palpate_estimators::evaluation::{Evaluation, percentile};
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::{Bound, CramerRaoBound, Force};
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::Extent;

const MOST_SIDE: usize = 60;
/// Cells per position above which most cells would be empty.
const SPARSE: usize = 4;

/// Median errors, and the limit on their scale.
pub(super) fn error_map(
    setup: &Setup,
    title: &str,
    what: &str,
    evaluations: &[(&str, &Evaluation)],
) -> Figure {
    let cells = error_cells(evaluations, setup.surface().extent());
    let in_mm = |errors_m: Vec<f64>| errors_m.into_iter().map(|error_m| error_m * 1e3).collect();
    let errors = evaluations
        .iter()
        .map(|(name, evaluation)| HeatPanel::new(*name, in_mm(evaluation.median_by_cell_m(&cells))));
    let mut panels: Vec<HeatPanel> = errors.collect();
    let finite =
        panels.iter().flat_map(|panel| &panel.values).copied().filter(|error_mm| error_mm.is_finite());
    let most = finite.fold(0.0, f64::max);
    let limit = setup.cramer_rao_bound().ok().zip(setup.force_n()).map(|(limit, force_n)| {
        let values = limits_mm(&limit, &cells, (force_n, Force::Known), Bound::mean_error_m);
        HeatPanel::new("the limit", values)
    });
    let limited = limit.is_some();
    panels.extend(limit);
    let (dots_mm, label) = (sensors_mm(setup.layout()), "error, mm".to_owned());
    let shows_sensors = !dots_mm.is_empty();
    let map = HeatMap { title: title.to_owned(), cells, panels, dots_mm, label, most, width_px: 860 };
    let [along, across] = cells.sides_m().map(|side_m| number(side_m * 1e3));
    let caption = html! {
        (what) ", by cells of " (along) " × " (across) " mm."
        @if shows_sensors { " Dots: the sensors." }
        " Grey: no contact was tried."
        @if limited {
            " The limit is the mean error of the best unbiased estimator for noisy readings and a known force (Cramér–Rao \
             bound); the median of its errors is 0.85 to 0.94 times their mean, the less the longer their ellipse is."
        }
    };
    Figure::map(&map, caption)
}

/// One cell per position for positions on a grid, else larger cells.
fn error_cells(evaluations: &[(&str, &Evaluation)], extent: Extent) -> Cells {
    let located = evaluations.iter().flat_map(|(_, evaluation)| &evaluation.located);
    let mut places: Vec<Position> = located.map(|located| located.truth).collect();
    places.sort_by(|a, b| a.x_m.total_cmp(&b.x_m).then(a.y_m.total_cmp(&b.y_m)));
    places.dedup();
    let distinct = |of: fn(&Position) -> f64, size_m: f64| {
        let mut values: Vec<f64> = places.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * size_m);
        values.len().max(1)
    };
    let columns = distinct(|place| place.x_m, extent.length_m());
    let rows = distinct(|place| place.y_m, extent.width_m().unwrap_or(extent.length_m()));
    let is_grid = columns.saturating_mul(rows) < SPARSE * places.len();
    if is_grid && columns <= MOST_SIDE && rows <= MOST_SIDE {
        return Cells { extent, columns, rows };
    }
    Cells::nearly_square(extent, 0.5 * places.len() as f64, 2..=MOST_SIDE)
}

/// In mm; NaN without a bound.
pub(super) fn limits_mm(
    limit: &CramerRaoBound,
    cells: &Cells,
    (force_n, force): (f64, Force),
    figure: impl Fn(&Bound) -> f64,
) -> Vec<f64> {
    let bound = |position| limit.bound_at(Contact { position, force_n }, force);
    cells.centres().map(|at| bound(at).map_or(f64::NAN, |bound| figure(&bound) * 1e3)).collect()
}

pub(super) fn sensors_mm(layout: &Layout) -> Vec<(f64, f64)> {
    let placed = layout.sensors().iter().filter(|sensor| sensor.kind != SensorKind::Raw);
    placed.map(|sensor| in_mm(sensor.position)).collect()
}

pub(super) fn in_mm(position: Position) -> (f64, f64) {
    (position.x_m * 1e3, position.y_m * 1e3)
}

pub(super) struct DesignMap<'a> {
    pub name: &'a str,
    pub values: Vec<f64>,
    pub dots_mm: Vec<(f64, f64)>,
}

/// One map per design; the colour scale ends at the 95th percentile. `title` gets the design's
/// name, `caption` also the end of the scale.
pub(super) fn compared_maps(
    cells: Cells,
    label: &str,
    designs: Vec<DesignMap>,
    title: impl Fn(&str) -> String,
    caption: impl Fn(&str, &str) -> Markup,
) -> Vec<Figure> {
    let values = designs.iter().flat_map(|design| &design.values).copied();
    let mut finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    finite.sort_by(f64::total_cmp);
    let most = percentile(&finite, 95.0).unwrap_or(1.0);
    let figure = |DesignMap { name, values, dots_mm }: DesignMap| {
        let panels = vec![HeatPanel::new("", values)];
        let (title, label) = (title(name), label.to_owned());
        let map = HeatMap { title, cells, panels, dots_mm, label, most, width_px: 640 };
        Figure::map(&map, caption(name, &number(most)))
    };
    designs.into_iter().map(figure).collect()
}

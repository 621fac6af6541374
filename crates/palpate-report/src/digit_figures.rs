//! Figures of a flexible digit: its shapes, the limit of the force, and what the linear theory would answer.

use maud::html;

use super::limit_line::along;
use super::numbers::{counted, mm, stated};
use super::page::Figure;
use super::{Axis, Chart, Marker, Series, SeriesKind, Stroke, chart_to_svg};
use palpate_estimators::estimator::{EstimatorConfig, Fitting, Locator};
use palpate_estimators::setup::Bench;
use palpate_estimators::simulate::{CleanSensors, simulate_at};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::{Force, Limit, LimitCurve};
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::{Digit, Surface};

/// Where the drawn contacts are, as shares of the length.
const DRAWN_CONTACTS: [f64; 3] = [0.5, 0.75, 1.0];
/// Where the linear theory is judged, as shares of the length: clear of the tip, which an estimate cannot pass.
const JUDGED_CONTACTS: [f64; 3] = [0.45, 0.6, 0.8];
/// Points of a drawn finger.
const SHAPE_STEPS: u32 = 120;
/// Forces of a curve, from a hundredth of the largest load to all of it.
const FORCES: u32 = 60;
/// Above and below what a chart draws.
const MARGIN: f64 = 0.06;

/// The finger as it is, and bent by `force_n` newtons at three places; x and y have the same scale.
pub(super) fn shapes_figure(digit: &Digit, layout: &Layout, force_n: f64) -> Figure {
    let l = digit.length_m;
    let line = |label: String, colour, stroke, contact: Contact| {
        let shape = digit.shape(contact);
        let point = |i| shape.point(f64::from(i) / f64::from(SHAPE_STEPS) * l);
        let points = (0..=SHAPE_STEPS).map(point).map(|[x_m, y_m]| (x_m * 1e3, y_m * 1e3)).collect();
        Series { label, colour, kind: SeriesKind::Line { points, stroke } }
    };
    let at = |share: f64| Contact { position: Position::along(share * l), force_n };
    let mut series =
        vec![line("untouched".to_owned(), 6, Stroke::Dashed, Contact { force_n: 0.0, ..at(1.0) })];
    for (i, share) in DRAWN_CONTACTS.into_iter().enumerate() {
        let label = format!("{} N at {} mm", stated(force_n), mm(share * l));
        series.push(line(label, i, Stroke::Solid, at(share)));
        let [x_m, y_m] = digit.shape(at(share)).point(share * l);
        let kind = SeriesKind::Points { points: vec![(x_m * 1e3, y_m * 1e3)], marker: Marker::Circle };
        series.push(Series { label: String::new(), colour: i, kind });
    }
    let gauges = layout.sensors.iter().map(|sensor| (sensor.position.x_m * 1e3, 0.0)).collect();
    let kind = SeriesKind::Points { points: gauges, marker: Marker::Square };
    series.push(Series { label: "strain gauges".to_owned(), colour: 6, kind });
    // The plot is about as high as it is wide, and both axes span the finger and its margins.
    let (low, high) = (-MARGIN * l * 1e3, (1.0 + MARGIN) * l * 1e3);
    let chart = Chart {
        title: "The finger, exactly bent".to_owned(),
        x: Axis::linear("along the straight finger, mm").from_to(low, high),
        y: Axis::linear("across, mm").from_to(-high, -low),
        series,
        width_px: 640,
        height_px: 720,
        ..Chart::default()
    };
    let caption = html! {
        "The bench: a finger clamped at 0 with " (counted(layout.len(), "strain gauge", "strain gauges")) ", bent by "
        (stated(force_n)) " N that " (match digit.direction {
            palpate_mechanics::surface::ForceDirection::Normal => "push across the bent finger",
            palpate_mechanics::surface::ForceDirection::Vertical => "hang straight down",
        }) ", at three places (discs). Beyond the contact the finger is straight."
    };
    Figure { number: 1, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
}

/// The least standard deviation of the force along the finger.
pub(super) fn force_limit_figure(unknown: &LimitCurve, number: usize) -> Figure {
    let points = along(unknown, |bound| bound.sd_force_n.unwrap_or(f64::NAN) * 1e3);
    let kind = SeriesKind::Line { points, stroke: Stroke::Solid };
    let chart = Chart {
        title: "The least standard deviation of an estimated force".to_owned(),
        x: Axis::linear("contact position, mm").from_to(0.0, unknown.extent.length_m * 1e3),
        y: Axis::log10("limit, mN"),
        series: vec![Series { label: "position unknown, estimated along".to_owned(), colour: 1, kind }],
        ..Chart::default()
    };
    let caption = html! {
        "The limit of the force, " (stated(unknown.force_n)) " N, at each contact position. A contact that fewer than two gauges \
         see has none: one gauge tells force times lever, and no more."
    };
    Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
}

/// What the linear theory makes of clean readings: its errors of position and of force by the force, each against the limit of
/// the exact one. Empty where no estimator suits the bench.
pub(super) fn linear_theory_figures(
    bench: &Bench,
    limit: &Limit,
    digit: &Digit,
    first: usize,
) -> Vec<Figure> {
    let Some(locator) = linear_locator(bench, digit) else { return Vec::new() };
    let sensors = CleanSensors::new(digit, &bench.layout);
    let most_n = Digit::MOST_LOAD * digit.characteristic_force_n();
    let forces = || (1..=FORCES).map(|i| most_n * 10f64.powf(2.0 * f64::from(i) / f64::from(FORCES) - 2.0));
    let contact =
        |share: f64, force_n| Contact { position: Position::along(share * digit.length_m), force_n };
    // Errors of position in mm and of force in %.
    let errors = |contact: Contact| {
        let found = locator.locate(&sensors.reading(contact)).ok().map(|estimate| estimate.contact);
        found.map_or([f64::NAN; 2], |found| {
            let off_n = found.force_n.map_or(f64::NAN, |force_n| force_n - contact.force_n);
            [found.position.distance_m(contact.position) * 1e3, 100.0 * off_n.abs() / contact.force_n]
        })
    };
    let at_limit = |contact: Contact| {
        let bound = limit.at(contact, Force::Unknown);
        let force = bound.and_then(|bound| bound.sd_force_n).unwrap_or(f64::NAN);
        [bound.map_or(f64::NAN, |bound| bound.sd_position_m * 1e3), 100.0 * force / contact.force_n]
    };
    let what = [
        (
            "Where the linear theory would see the contact",
            "error of the position, mm",
            "The error of position",
        ),
        ("How hard the linear theory would find the contact", "error of the force, %", "The error of force"),
    ];
    let figure = |(i, (title, axis, name)): (usize, (&str, &str, &str))| {
        let line = |label: String, colour, stroke, of: &dyn Fn(Contact) -> [f64; 2], share| {
            let points = forces().map(|force_n| (force_n, of(contact(share, force_n))[i])).collect();
            Series { label, colour, kind: SeriesKind::Line { points, stroke } }
        };
        let lines = JUDGED_CONTACTS.into_iter().enumerate().flat_map(|(colour, share)| {
            let place = mm(share * digit.length_m);
            [
                line(format!("touched at {place} mm"), colour, Stroke::Solid, &errors, share),
                line(format!("limit at {place} mm"), colour, Stroke::Dashed, &at_limit, share),
            ]
        });
        let chart = Chart {
            title: title.to_owned(),
            x: Axis::log10("contact force, N"),
            y: Axis::log10(axis),
            series: lines.collect(),
            height_px: 480,
            ..Chart::default()
        };
        let caption = html! {
            (name) " that the linear theory of bending makes on readings without noise, by the force. Dashes: the limit of the exact \
             theory at the gauges' noise, a standard deviation; above it the linear theory is the larger error."
        };
        Figure { number: first + i, alternative: title.to_owned(), svg: chart_to_svg(&chart), caption }
    };
    what.into_iter().enumerate().map(figure).collect()
}

fn linear_locator(bench: &Bench, digit: &Digit) -> Option<Locator> {
    let unknown = Bench { force_n: None, ..bench.clone() };
    let pressed = Bench { force_n: Some(digit.characteristic_force_n()), ..bench.clone() };
    // The estimator learns nothing, but every fit wants a recording.
    let recording = simulate_at(&pressed, &[Position::along(digit.length_m())], 1, 0).ok()?;
    Fitting::prepare(&unknown, &EstimatorConfig::LINEAR_DIGIT, &recording).ok()?.fit(0, &mut || true).ok()?
}

use maud::html;

use super::error_lines::in_milli;
use super::numbers::{counted, mm, rig_number};
use super::page::Figure;
use super::{Axis, Chart, Marker, Series};
use palpate_estimators::digit::LinearTheory;
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::{CramerRaoBound, Force, LimitCurve};
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::{Digit, ForceDirection};

/// Shares of the length.
const DRAWN_CONTACTS: [f64; 3] = [0.5, 0.75, 1.0];
/// Shares of the length, away from the tip, which an estimate cannot pass.
const JUDGED_CONTACTS: [f64; 3] = [0.45, 0.6, 0.8];
const SHAPE_STEPS: u32 = 120;
const FORCES: u32 = 60;
const MARGIN: f64 = 0.06;

/// Straight and under `force_n` at three places, to scale.
pub(super) fn shapes_figure(what: &str, digit: &Digit, layout: &Layout, force_n: f64) -> Figure {
    let l = digit.length_m();
    let points = |contact: Contact| {
        let shape = digit.shape(contact);
        let point = |i| shape.point(f64::from(i) / f64::from(SHAPE_STEPS) * l);
        in_milli((0..=SHAPE_STEPS).map(point).map(|[x_m, y_m]| (x_m, y_m)).collect())
    };
    let at = |share: f64| Contact { position: Position::along(share * l), force_n };
    let mut series = vec![Series::dashes("untouched", 6, points(Contact { force_n: 0.0, ..at(1.0) }))];
    for (colour, share) in DRAWN_CONTACTS.into_iter().enumerate() {
        let label = format!("{} N at {} mm", rig_number(force_n), mm(share * l));
        series.push(Series::line(label, colour, points(at(share))));
        let [x_m, y_m] = digit.shape(at(share)).point(share * l);
        series.push(Series::markers("", colour, in_milli(vec![(x_m, y_m)]), Marker::Circle));
    }
    let gauges = layout.sensors().iter().map(|sensor| (sensor.position.x_m * 1e3, 0.0)).collect();
    series.push(Series::markers("strain gauges", 6, gauges, Marker::Square));
    // The plot is about as high as it is wide; both axes span the finger and its margins.
    let (low, high) = (-MARGIN * l * 1e3, (1.0 + MARGIN) * l * 1e3);
    let x = Axis::linear("along the straight finger, mm").from_to(low, high);
    let y = Axis::linear("across, mm").from_to(-high, -low);
    let chart =
        Chart { width_px: 640, ..Chart::new("The finger, exactly bent", x, y, series).with_height(720) };
    let caption = html! {
        (what) ": a finger clamped at 0 with " (counted(layout.len(), "strain gauge", "strain gauges")) ", bent by "
        (rig_number(force_n)) " N that " (match digit.direction() {
            ForceDirection::Normal => "push across the bent finger",
            ForceDirection::Vertical => "hang straight down",
        }) ", at three places (discs). Beyond the contact the finger is straight."
    };
    Figure::chart(&chart, caption)
}

pub(super) fn force_limit_figure(unknown: &LimitCurve) -> Figure {
    let points = in_milli(unknown.by_x(|bound| bound.sd_force_n.unwrap_or(f64::NAN)));
    let chart = Chart::new(
        "The least standard deviation of an estimated force",
        Axis::linear("contact position, mm").from_to(0.0, unknown.extent.length_m() * 1e3),
        Axis::log10("limit, mN"),
        vec![Series::line("position unknown, estimated along", 1, points)],
    );
    let caption = html! {
        "The limit of the force, " (rig_number(unknown.force_n)) " N, at each contact position. A contact has none with fewer than \
         two sensitive gauges: one gauge determines only force times lever arm."
    };
    Figure::chart(&chart, caption)
}

/// Errors without noise, relative to the exact limit; empty if no estimator suits the bench.
pub(super) fn linear_theory_figures(setup: &Setup, limit: &CramerRaoBound, digit: &Digit) -> Vec<Figure> {
    let Some(theory) = LinearTheory::new(setup, digit) else { return Vec::new() };
    let at_limit = |contact: Contact| {
        let bound = limit.bound_at(contact, Force::Unknown);
        bound.map_or([f64::NAN; 2], |bound| [bound.sd_position_m, bound.sd_force_n.unwrap_or(f64::NAN)])
    };
    let most_n = Digit::MOST_LOAD * digit.characteristic_force_n();
    // Contacts at a share of the length, by force, each with a value.
    let curve = |share: f64, value: &dyn Fn(Contact) -> f64| {
        let contact = |i| {
            let force_n = most_n * 10f64.powf(2.0 * f64::from(i) / f64::from(FORCES) - 2.0);
            Contact { position: Position::along(share * digit.length_m()), force_n }
        };
        (1..=FORCES).map(contact).map(|contact| (contact.force_n, value(contact))).collect()
    };
    let figure = |title: &str, axis: &str, name: &str, shown: &dyn Fn([f64; 2], Contact) -> f64| {
        let lines = JUDGED_CONTACTS.into_iter().enumerate().flat_map(|(colour, share)| {
            let place = mm(share * digit.length_m());
            let errors = curve(share, &|contact| shown(theory.errors(contact), contact));
            let limits = curve(share, &|contact| shown(at_limit(contact), contact));
            [
                Series::line(format!("touched at {place} mm"), colour, errors),
                Series::dashes(format!("limit at {place} mm"), colour, limits),
            ]
        });
        let chart = Chart::new(title, Axis::log10("contact force, N"), Axis::log10(axis), lines.collect());
        let caption = html! {
            (name) " that the linear theory of bending makes on readings without noise, by the force. Dashes: the limit of the exact \
             theory at the gauges' noise, a standard deviation; above it the linear theory is the larger error."
        };
        Figure::chart(&chart.with_height(480), caption)
    };
    let position_mm = |[position_m, _]: [f64; 2], _| position_m * 1e3;
    let force_percent = |[_, force_n]: [f64; 2], contact: Contact| 100.0 * force_n / contact.force_n;
    vec![
        figure(
            "Where the linear theory would see the contact",
            "error of the position, mm",
            "The error of position",
            &position_mm,
        ),
        figure(
            "How hard the linear theory would find the contact",
            "error of the force, %",
            "The error of force",
            &force_percent,
        ),
    ]
}

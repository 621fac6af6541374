use maud::{Markup, html};

use super::bench_figures::bench_figure;
use super::digit_figures::{force_limit_figure, linear_theory_figures};
use super::drawing::chart::Extremes;
use super::error_lines::in_milli;
use super::maps::{limits_mm, sensors_mm};
use super::numbers::{counted, mm, number, place, quantity, rig_number};
use super::page::{Figure, Page, ReportFile, Section, Table};
use super::{Axis, Chart, HeatMap, HeatPanel, Mark, Series};
use palpate_estimators::detectable_force::{DetectableForce, TouchSummary};
use palpate_estimators::estimator::Cells;
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::{CramerRaoBound, Force, LimitCurve, LimitWarning};
use palpate_mechanics::sensing::{Sensor, SensorKind};
use palpate_mechanics::surface::{Extent, SurfaceSpec};

/// Limits are cut off at this many lengths of the surface.
const MOST_LENGTHS: f64 = 10.0;
const CELLS: f64 = 2000.0;
const CELLS_A_SIDE: std::ops::RangeInclusive<usize> = 5..=200;

/// Contents of the report.
#[derive(Clone, Copy)]
pub struct LimitReport<'a> {
    /// Page title.
    pub title: &'a str,
    /// Surface and sensors.
    pub setup: &'a Setup,
    /// Limit.
    pub limit: &'a CramerRaoBound<'a>,
    /// Limit for a known force.
    pub known_force: &'a LimitCurve,
    /// Limit for an unknown force.
    pub unknown_force: &'a LimitCurve,
    /// Knowledge of the force, which the warnings assume.
    pub force: Force,
    /// Warnings.
    pub warnings: &'a [LimitWarning],
    /// Positions for the table.
    pub listed: &'a [Position],
    /// Smallest detectable force.
    pub touch: &'a DetectableForce<'a>,
}

/// `report.html` and SVG figures.
///
/// ```
/// use palpate_estimators::{influence::Influence, setup::Setup};
/// use palpate_mechanics::limit::{Force, LimitCurve};
/// use palpate_mechanics::sensing::SensorKind::Deflection;
/// use palpate_mechanics::surface::Beam;
/// use palpate_mechanics::units::{gpa, mm, um};
/// use palpate_report::{LimitReport, limit_report};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?;
/// let limit = setup.cramer_rao_bound()?;
/// let files = limit_report(&LimitReport {
///     title: "What physics allows on the paper's beam",
///     setup: &setup,
///     limit: &limit,
///     known_force: &LimitCurve::over_surface(&limit, 3.0, Force::Known)?,
///     unknown_force: &LimitCurve::over_surface(&limit, 3.0, Force::Unknown)?,
///     force: Force::Known,
///     warnings: &[],
///     listed: &[],
///     touch: &Influence::default().lightest_touch(&limit),
/// });
/// assert_eq!([&files[0].name, &files[1].name], ["report.html", "figure-1.svg"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn limit_report(report: &LimitReport) -> Vec<ReportFile> {
    let (layout, force_n) = (report.setup.layout(), report.known_force.force_n);
    let (heading, figure) = match report.known_force.extent {
        Extent::Line { .. } => ("The limit along the surface", report.limit_figure()),
        Extent::Plane { .. } => ("The limit over the surface", report.limit_map()),
    };
    let sections = vec![
        Section::new("bench", "The bench")
            .figure(bench_figure("The bench", report.setup.surface(), layout, force_n))
            .table(report.sensor_table()),
        Section::new("limit", heading)
            .figure(figure)
            .table(report.limit_table())
            .figures(report.digit_figures()),
        Section::new("lightest-touch", "The lightest touch")
            .text(report.lightest_touch_in_words())
            .figure(report.touch_figure()),
        Section::new("warnings", "Limitations of this bench").text(report.warnings_in_words()),
        Section::new("meaning", "What the limit means").text(meaning()),
    ];
    Page::new(report.title, report.summary(), sections).files()
}

impl LimitReport<'_> {
    fn curve(&self) -> &LimitCurve {
        match self.force {
            Force::Known => self.known_force,
            Force::Unknown => self.unknown_force,
        }
    }

    fn summary(&self) -> Markup {
        let extent = self.known_force.extent;
        let percent = |limit_m: f64| number(100.0 * limit_m / extent.length_m());
        let at = |(position, limit_m): (Position, f64)| {
            format!("{} mm at {} mm", number(limit_m * 1e3), place(position, extent))
        };
        html! {
            li {
                "What physics allows on this bench: " (counted(self.limit.enabled_count(), "live sensor", "live sensors")) ", "
                (rig_number(self.known_force.force_n)) " N, force " (self.force.name()) "."
            }
            @if let Some(summary) = self.curve().summary() {
                li {
                    "Median limit " b { (number(summary.median_m * 1e3)) " mm" } ", " (percent(summary.median_m))
                    " % of the length; mean " (number(summary.mean_m * 1e3)) " mm, smallest " (at(summary.best))
                    ", largest " (at(summary.worst)) "."
                    @if let Some(words) = self.curve().unidentifiable_text() {
                        " Excluded, because the position is unidentifiable there: " (words) "."
                    }
                }
            } @else {
                li { "With this knowledge of the force the position is unidentifiable everywhere." }
            }
            @if let Some(surely) = self.confident_summary() {
                li {
                    "Smallest force that is detected in " (rig_number(100.0 * surely.found)) " % of its readings (lightest touch): median "
                    b { (number(surely.median_n)) " N" } ", largest " (number(surely.worst.1)) " N at "
                    (place(surely.worst.0, extent)) " mm; an untouched surface gives a contact in " (self.touch.rate().to_string())
                    " of its readings."
                }
            }
            li { a href="#warnings" { (counted(self.warnings.len(), "warning", "warnings")) } "." }
        }
    }

    fn limit_figure(&self) -> Figure {
        let length_mm = self.known_force.extent.length_m() * 1e3;
        let line = |curve: &LimitCurve, label, colour| {
            Series::line(label, colour, in_milli(curve.by_x(|bound| bound.sd_position_m)))
        };
        let series = vec![
            line(self.known_force, "force known", 0),
            line(self.unknown_force, "force unknown, estimated along", 1),
        ];
        let extremes = Extremes::from_lines(&series);
        let chart = Chart::new(
            "The least standard deviation of a located contact",
            Axis::linear("contact position, mm").from_to(0.0, length_mm),
            limit_axis(extremes, length_mm),
            series,
        )
        .with_marks(self.marks(extremes.greatest > length_mm))
        .with_height(480);
        let caption = html! {
            "The limit at each contact position, for " (rig_number(self.known_force.force_n)) " N. No unbiased estimator has a smaller \
             standard deviation; where its errors are Gaussian, its mean error is √(2/π) ≈ 0.8 of it on a line."
            @if !self.warnings.is_empty() { " Shaded: what the warnings are about." }
            @if extremes.greatest > MOST_LENGTHS * length_mm {
                " Limits above " (rig_number(MOST_LENGTHS)) " lengths are not shown: contacts there cannot be located."
            }
        };
        Figure::chart(&chart, caption)
    }

    /// Zones of the warnings; with `beyond`, also the length of the surface.
    fn marks(&self, beyond: bool) -> Vec<Mark> {
        let length_m = self.known_force.extent.length_m();
        let label = format!("length of the surface, {} mm", mm(length_m));
        let length = beyond.then_some(Mark::HorizontalLine { y: length_m * 1e3, label });
        let zones = self.warnings.iter().flat_map(|warning| {
            let (label, twins) = match warning {
                LimitWarning::Blind { .. } => ("blind", None),
                LimitWarning::Mirror { twins, .. } => ("ambiguous", Some(*twins)),
                LimitWarning::Faint { .. } => ("faint", None),
            };
            std::iter::once(warning.zone()).chain(twins).map(move |zone| Mark::Span {
                low: zone.from.x_m * 1e3,
                high: zone.to.x_m * 1e3,
                label: label.to_owned(),
            })
        });
        length.into_iter().chain(zones).collect()
    }

    fn limit_map(&self) -> Figure {
        let extent = self.known_force.extent;
        let cells = Cells::nearly_square(extent, CELLS, CELLS_A_SIDE);
        let panel = |name, force| {
            let limits =
                limits_mm(self.limit, &cells, (self.known_force.force_n, force), |b| b.sd_position_m);
            HeatPanel::new(name, limits)
        };
        let panels =
            vec![panel("force known", Force::Known), panel("force unknown, estimated along", Force::Unknown)];
        let limits = || panels.iter().flat_map(|panel| &panel.values);
        let length_mm = extent.length_m() * 1e3;
        let cut_off = limits().any(|limit_mm| *limit_mm > length_mm);
        let nowhere = limits().any(|limit_mm| limit_mm.is_nan());
        let map = HeatMap {
            title: "The least standard deviation of a located contact".to_owned(),
            cells,
            panels,
            dots_mm: sensors_mm(self.setup.layout()),
            label: "limit, mm".to_owned(),
            most: length_mm,
            width_px: 860,
        };
        let caption = html! {
            "The limit at each contact position, for " (rig_number(self.known_force.force_n)) " N: the root of the sum of the least variances \
             along and across. No unbiased estimator has a smaller one."
            @if !map.dots_mm.is_empty() { " Dots: the sensors." }
            @if cut_off { " Limits above the length of the surface have its colour: contacts there cannot be located." }
            @if nowhere { " Grey: the position is unidentifiable." }
        };
        Figure::map(&map, caption)
    }

    fn digit_figures(&self) -> Vec<Figure> {
        let SurfaceSpec::Digit(digit) = self.setup.surface() else { return Vec::new() };
        let force_limit = force_limit_figure(self.unknown_force);
        std::iter::once(force_limit).chain(linear_theory_figures(self.setup, self.limit, digit)).collect()
    }

    fn limit_table(&self) -> Table {
        let bounds = self.listed.iter().map(|&position| {
            let contact = Contact { position, force_n: self.known_force.force_n };
            (position, [Force::Known, Force::Unknown].map(|force| self.limit.bound_at(contact, force)))
        });
        let caption = html! {
            "The limit at some positions: least standard deviations, and the mean error that goes with the first. A dash: the \
             position is unidentifiable."
        };
        Table::from_rows(bounds)
            .short("position, mm", |(position, _)| place(*position, self.known_force.extent))
            .mm("force known: limit, mm", |(_, [known, _])| known.map(|bound| bound.sd_position_m))
            .mm("mean error, mm", |(_, [known, _])| known.map(|bound| bound.mean_error_m()))
            .mm("force unknown: limit, mm", |(_, [_, unknown])| unknown.map(|bound| bound.sd_position_m))
            .number("of the force, N", |(_, [_, unknown])| unknown.and_then(|bound| bound.sd_force_n))
            .number("lightest touch, N", |(position, _)| self.touch.forces_at(*position)[1])
            .caption(caption)
    }

    /// For the higher detection probability.
    fn confident_summary(&self) -> Option<TouchSummary> {
        let positions: Vec<Position> = self.known_force.points.iter().map(|point| point.position).collect();
        let [_, surely] = self.touch.summaries(&positions);
        surely
    }

    fn lightest_touch_in_words(&self) -> Markup {
        let [half, surely] = DetectableForce::FOUND.map(|found| rig_number(100.0 * found));
        html! {
            p {
                "Below some force a reading is " code { "no_contact" } ": it can come from noise alone, or from the scatter of the untouched \
                 rows of a locator. The bound is such that an untouched surface gives a contact in " (self.touch.rate().to_string())
                " of its readings (" code { "false_alarm_rate" } " in the rig). The smallest detectable force (lightest touch) is detected in "
                (half) " % and in " (surely) " % of its readings, by a locator without a known force."
            }
            @if let Some(TouchSummary { undetected: without @ 1.., .. }) = self.confident_summary() {
                p { "At " (counted(without, "position", "positions")) " no force is detected." }
            }
        }
    }

    fn touch_figure(&self) -> Option<Figure> {
        let length_mm = self.known_force.extent.length_m() * 1e3;
        let Extent::Line { .. } = self.known_force.extent else { return None };
        let line = |i: usize| {
            let points = self.known_force.points.iter().map(|point| point.position);
            let force = |at: Position| (at.x_m * 1e3, self.touch.forces_at(at)[i].unwrap_or(f64::NAN));
            let label = format!("found in {} %", rig_number(100.0 * DetectableForce::FOUND[i]));
            Series::line(&label, i, points.map(force).collect())
        };
        let series = vec![line(0), line(1)];
        let extremes = Extremes::from_lines(&series);
        let axis = extremes.axis("force, N");
        let axis = match extremes.are_far_apart() {
            true => axis.from_to(0.7 * extremes.least, 1.4 * extremes.greatest),
            false if extremes.greatest > 0.0 => axis.from_to(0.0, 1.1 * extremes.greatest),
            false => axis,
        };
        let x = Axis::linear("contact position, mm").from_to(0.0, length_mm);
        let chart = Chart::new("The smallest force that is detected", x, axis, series);
        let caption = html! {
            "The force that a contact at each position must have to be found, at " (self.touch.rate().to_string()) " of false alarms."
        };
        Some(Figure::chart(&chart, caption))
    }

    fn warnings_in_words(&self) -> Markup {
        html! {
            @if self.warnings.is_empty() {
                p {
                    "Nothing to warn of with the force " (self.force.name()) ": no blind zone, no two contacts that read alike, no \
                     contact that drowns in the noise."
                }
            } @else {
                ul {
                    @for warning in self.warnings {
                        li { (sentence(&warning.to_string())) " " b { "What would help:" } " " (warning.help()) "." }
                    }
                }
            }
        }
    }

    fn sensor_table(&self) -> Table {
        Table::from_rows(self.setup.layout().sensors().iter().zip(1..))
            .short("sensor", |(_, number)| number.to_string())
            .words("measures", |(sensor, _)| sensor.kind.name())
            .numeric("position, mm", |(sensor, _)| match sensor.kind {
                // The place of a raw channel is unknown.
                SensorKind::Raw => "–".to_owned(),
                _ => place(sensor.position, self.known_force.extent),
            })
            .wide("noise", |(sensor, _)| noise_in_words(sensor))
            .caption(html! { "The sensors and their noise, from which the limit follows." })
    }
}

fn limit_axis(extremes: Extremes, length_mm: f64) -> Axis {
    let Extremes { least, greatest } = extremes;
    let axis = extremes.axis("limit, mm");
    if extremes.are_far_apart() {
        let top = greatest.min(MOST_LENGTHS * length_mm);
        axis.from_to(0.7 * least, (1.4 * top).max(2.0 * least))
    } else if greatest > 0.0 {
        axis.from_to(0.0, 1.1 * greatest)
    } else {
        axis
    }
}

fn sentence(words: &str) -> String {
    let mut characters = words.chars();
    let first = characters.next().map(|first| first.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", characters.as_str())
}

fn noise_in_words(sensor: &Sensor) -> String {
    let channel = &sensor.channel;
    if channel.disabled {
        return "dead: left out".to_owned();
    }
    let in_unit = |value| match sensor.kind {
        SensorKind::Raw => number(value),
        kind => quantity(value, kind.dimension()),
    };
    let mut parts = Vec::new();
    if channel.noise_sd > 0.0 {
        parts.push(format!("standard deviation {}", in_unit(channel.noise_sd)));
    }
    if channel.resolution > 0.0 {
        parts.push(format!("resolution {}", in_unit(channel.resolution)));
    }
    parts.join(", ")
}

fn meaning() -> Markup {
    html! {
        p {
            "Readings are noisy, so the same contact is never read twice the same, and whatever is computed from a reading \
             scatters. How little it can scatter follows from how fast the readings change with the contact, measured in \
             standard deviations of their noise: this is the Cramér–Rao bound, here called the limit. A clever estimator \
             reaches it; none that is right on average beats it."
        }
        p {
            "With a known force, a change of any reading is informative. With an unknown force, a larger force changes the \
             readings partly as a displacement does, and only the remainder is informative: next to a support, where all \
             deflections vanish together, it is small."
        }
        p {
            "The limit looks at small errors. That two contacts far apart may read alike it does not see; the warnings do. \
             Errors of gain and offset are not in it: calibration removes them."
        }
    }
}

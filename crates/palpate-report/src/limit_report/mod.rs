//! The report of a bench's limit: what physics allows, position by position.

mod figures;
mod plane;

use maud::{Markup, html};

use super::numbers::{counted, mm, number, quantity, stated};
use super::page::{Figure, Figures, Page, Section, Table, numeric, short, text, wide, words};
use super::{ReportError, ReportFile};
use palpate_estimators::setup::Bench;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::{Force, Limit, LimitCurve, LimitWarning};
use palpate_mechanics::sensing::Sensor;

/// What a limit's report is made from.
#[derive(Clone, Copy)]
pub struct LimitReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// The surface and its sensors.
    pub bench: &'a Bench,
    /// Its limit.
    pub limit: &'a Limit<'a>,
    /// The limit all over the surface for a known force.
    pub known: &'a LimitCurve,
    /// The same for an unknown force.
    pub unknown: &'a LimitCurve,
    /// What is known of the force on this bench, which the warnings are about.
    pub force: Force,
    /// What the limit warns of.
    pub warnings: &'a [LimitWarning],
    /// Positions for the table.
    pub listed: &'a [Position],
}

/// Reports a limit: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when the bench cannot be drawn or a figure does not become a picture.
pub fn limit_report(report: &LimitReport) -> Result<Vec<ReportFile>, ReportError> {
    let mut figures: Vec<_> =
        figures::bench_figure(report)?.into_iter().chain([report.limit_figure()]).collect();
    let further = figures::digit_figures(report);
    let numbers: Vec<usize> = further.iter().map(|figure| figure.number).collect();
    figures.extend(further);
    let figures = Figures(figures);
    let section = |id, heading, body| Section { id, heading, body };
    let page = Page {
        title: report.title.to_owned(),
        opening: report.summary(),
        sections: vec![
            section("bench", "The bench", html! { (figures.show(1)) (report.sensor_table(2)) }),
            section(
                "limit",
                if report.is_plane() { "The limit over the surface" } else { "The limit along the surface" },
                html! {
                    (figures.show(2)) (report.limit_table(1))
                    @for number in numbers { (figures.show(number)) }
                },
            ),
            section("warnings", "What this bench cannot tell", report.warnings_in_words()),
            section("meaning", "What the limit means", meaning()),
        ],
        footer: html! { p { "Made by palpate " (env!("CARGO_PKG_VERSION")) "." } },
    };
    page.into_files(figures)
}

impl LimitReport<'_> {
    fn is_plane(&self) -> bool {
        self.known.extent.is_plane()
    }

    fn limit_figure(&self) -> Figure {
        match self.known.extent.width_m {
            Some(width_m) => plane::limit_map(self, width_m),
            None => figures::limit_figure(self),
        }
    }

    /// The curve that holds for this bench.
    fn curve(&self) -> &LimitCurve {
        match self.force {
            Force::Known => self.known,
            Force::Unknown => self.unknown,
        }
    }

    fn summary(&self) -> Markup {
        let length_m = self.known.extent.length_m;
        let percent = |limit_m: f64| number(100.0 * limit_m / length_m);
        let place = |(position, limit_m): (Position, f64)| {
            format!("{} mm at {} mm", number(limit_m * 1e3), place_in_words(position, self.known))
        };
        html! {
            div.summary {
                ul {
                    li {
                        "What physics allows on this bench: " (counted(self.limit.alive(), "live sensor", "live sensors")) ", "
                        (stated(self.known.force_n)) " N, force " (self.force.name()) "."
                    }
                    @if let Some(summary) = self.curve().summary() {
                        li {
                            "Median limit " b { (number(summary.median_m * 1e3)) " mm" } ", " (percent(summary.median_m))
                            " % of the length; mean " (number(summary.mean_m * 1e3)) " mm, smallest " (place(summary.best))
                            ", largest " (place(summary.worst)) "."
                        }
                    } @else {
                        li { "With this knowledge of the force the readings do not tell the position anywhere." }
                    }
                    li { a href="#warnings" { (counted(self.warnings.len(), "warning", "warnings")) } "." }
                }
            }
        }
    }

    fn limit_table(&self, table: usize) -> Markup {
        let contact =
            |position| palpate_mechanics::contact::Contact { position, force_n: self.known.force_n };
        let cell =
            |limit_m: Option<f64>, unit: f64| text(number(limit_m.map_or(f64::NAN, |limit| limit * unit)));
        let rows = self.listed.iter().map(|&position| {
            let bound = |force| self.limit.at(contact(position), force);
            let (known, unknown) = (bound(Force::Known), bound(Force::Unknown));
            vec![
                text(place_in_words(position, self.known)),
                cell(known.map(|bound| bound.sd_position_m), 1e3),
                cell(known.map(|bound| bound.mean_error_m()), 1e3),
                cell(unknown.map(|bound| bound.sd_position_m), 1e3),
                cell(unknown.and_then(|bound| bound.sd_force_n), 1.0),
            ]
        });
        Table {
            number: table,
            caption: html! {
                "The limit at some positions: least standard deviations, and the mean error that goes with the first. A dash: \
                 the readings do not tell."
            },
            columns: vec![
                short("position, mm"),
                numeric("force known: limit, mm"),
                numeric("mean error, mm"),
                numeric("force unknown: limit, mm"),
                numeric("of the force, N"),
            ],
            rows: rows.collect(),
        }
        .markup()
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

    fn sensor_table(&self, table: usize) -> Markup {
        let rows = self.bench.layout.sensors.iter().enumerate().map(|(i, sensor)| {
            vec![
                text((i + 1).to_string()),
                text(sensor.kind.name()),
                text(place_in_words(sensor.position, self.known)),
                text(noise_in_words(sensor)),
            ]
        });
        Table {
            number: table,
            caption: html! { "The sensors and their noise, from which the limit follows." },
            columns: vec![short("sensor"), words("measures"), numeric("position, mm"), wide("noise")],
            rows: rows.collect(),
        }
        .markup()
    }
}

/// With a capital at its beginning and a full stop at its end.
fn sentence(words: &str) -> String {
    let mut characters = words.chars();
    let first = characters.next().map(|first| first.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", characters.as_str())
}

/// "50", or "50, 20" on a plane.
fn place_in_words(position: Position, curve: &LimitCurve) -> String {
    match curve.extent.width_m {
        Some(_) => format!("{}, {}", mm(position.x_m), mm(position.y_m)),
        None => mm(position.x_m),
    }
}

fn noise_in_words(sensor: &Sensor) -> String {
    let channel = &sensor.channel;
    if channel.dead {
        return "dead: left out".to_owned();
    }
    let told = |value| quantity(value, sensor.kind.dimension());
    let mut parts = Vec::new();
    if channel.noise_sd > 0.0 {
        parts.push(format!("standard deviation {}", told(channel.noise_sd)));
    }
    if channel.resolution > 0.0 {
        parts.push(format!("resolution {}", told(channel.resolution)));
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
            "With a known force, a change of any reading tells. With an unknown force, what a harder touch would do to the \
             readings cannot be told from what a move does, and only the rest counts: next to a support, where all \
             deflections vanish together, little is left."
        }
        p {
            "The limit looks at small errors. That two contacts far apart may read alike it does not see; the warnings do. \
             Errors of gain and offset are not in it: calibration removes them."
        }
    }
}

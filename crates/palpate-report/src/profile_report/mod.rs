//! The report of one load profile: how force is spread, how far that can be told, and what is left unexplained.

mod figures;

use maud::{Markup, html};

use super::numbers::{counted, mm, number, stated};
use super::page::{Figures, Page, Section, Table, numeric, short, text, words};
use super::{ReportError, ReportFile};
use palpate_estimators::estimator::{LoadProfile, Patch, PatchLimit, Resolution, Status};
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::UniformLoad;

/// What a profile's report is made from.
#[derive(Clone, Copy)]
pub struct ProfileReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// The sensors.
    pub layout: &'a Layout,
    /// The reading, in SI units.
    pub reading: &'a [f64],
    /// The load that it tells.
    pub profile: &'a LoadProfile,
    /// The limit of each patch, where the readings tell them all.
    pub limits: Option<&'a [PatchLimit]>,
    /// What the layout resolves; `None` without load.
    pub resolution: Option<&'a Resolution>,
    /// The loads that were simulated; none where the truth is not known.
    pub truth: &'a [UniformLoad],
}

/// Reports a load profile: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn profile_report(report: &ProfileReport) -> Result<Vec<ReportFile>, ReportError> {
    let figures = Figures(figures::figures(report));
    let section = |id, heading, body| Section { id, heading, body };
    let page = Page {
        title: report.title.to_owned(),
        opening: report.summary(),
        sections: vec![
            section("profile", "The load", html! { (figures.show(1)) (report.patch_table(1)) }),
            section("resolution", "What this layout resolves", html! { (figures.show(2)) (figures.show(3)) }),
            section(
                "readings",
                "Readings and what is left of them",
                html! { (figures.show(4)) (report.reading_table(2)) },
            ),
            section("meaning", "What the profile means", meaning()),
        ],
        footer: html! { p { "Made by palpate " (env!("CARGO_PKG_VERSION")) "." } },
    };
    page.into_files(figures)
}

impl ProfileReport<'_> {
    fn summary(&self) -> Markup {
        let profile = self.profile;
        let (low, high) = profile.total_95_n();
        html! {
            div.summary {
                ul {
                    li { (status_in_words(profile)) }
                    @if let Some(centre) = &profile.centre {
                        li { "Total force " b { (number(profile.total_n)) " N" } ", 95 % interval " (number(low)) "–" (number(high)) " N." }
                        li {
                            "Centre of pressure at " b { (number(centre.position.x_m * 1e3)) " mm" } ", 95 % interval "
                            (stretch(centre.x_95_m())) " mm"
                            @if self.is_plane() {
                                "; across at " b { (number(centre.position.y_m * 1e3)) " mm" } ", 95 % interval "
                                (stretch(centre.y_95_m())) " mm"
                            }
                            "."
                        }
                        li { a href="#table-1" { (counted(profile.patches.len(), "patch", "patches")) } "." }
                    }
                }
            }
        }
    }

    fn is_plane(&self) -> bool {
        self.profile.cells.extent.is_plane()
    }

    fn patch_table(&self, table: usize) -> Markup {
        let row = |(i, patch): (usize, &Patch)| {
            let limit = self.limits.and_then(|limits| limits.get(i));
            let cell = |value: Option<f64>| text(number(value.unwrap_or(f64::NAN)));
            let centre = &patch.centre;
            let (low_n, high_n) = patch.force_95_n();
            let mut row = vec![
                text((i + 1).to_string()),
                text(format!("{}–{}", mm(patch.from.x_m), mm(patch.to.x_m))),
                text(tenths(centre.position.x_m * 1e3)),
                text(stretch(centre.x_95_m())),
                cell(limit.map(|limit| limit.sd_x_m * 1e3)),
            ];
            if self.is_plane() {
                row.extend([
                    text(format!("{}–{}", mm(patch.from.y_m), mm(patch.to.y_m))),
                    text(tenths(centre.position.y_m * 1e3)),
                    text(stretch(centre.y_95_m())),
                    cell(limit.map(|limit| limit.sd_y_m * 1e3)),
                ]);
            }
            row.extend([
                cell(Some(patch.force_n)),
                text(format!("{}–{}", number(low_n), number(high_n))),
                cell(limit.map(|limit| limit.sd_force_n)),
            ]);
            row
        };
        let along =
            |stretch, centre| [numeric(stretch), numeric(centre), numeric("95 %, mm"), numeric("limit, mm")];
        let mut columns = vec![short("patch")];
        if self.is_plane() {
            columns.extend(along("along, mm", "centre x, mm"));
            columns.extend(along("across, mm", "centre y, mm"));
        } else {
            columns.extend(along("stretch, mm", "centre, mm"));
        }
        columns.extend([numeric("force, N"), numeric("95 %, N"), numeric("limit, N")]);
        Table {
            number: table,
            caption: html! {
                "The patches: connected parts where the load is above a tenth of its highest density, and their limits, the least \
                 standard deviations that an unbiased estimator of evenly loaded patches of this number and these sizes can have."
            },
            columns,
            rows: self.profile.patches.iter().enumerate().map(row).collect(),
        }
        .markup()
    }

    fn reading_table(&self, table: usize) -> Markup {
        let rows = self.layout.sensors.iter().enumerate().map(|(i, sensor)| {
            let unit = sensor.kind.unit();
            let shown = |value: Option<f64>| {
                text(value.map_or_else(|| "–".to_owned(), |value| format!("{:.4}", value / unit.factor())))
            };
            vec![
                text((i + 1).to_string()),
                text(format!("{}, {}", sensor.kind.name(), unit.symbol())),
                text(if self.is_plane() {
                    format!("{}, {}", mm(sensor.position.x_m), mm(sensor.position.y_m))
                } else {
                    mm(sensor.position.x_m)
                }),
                shown(self.reading.get(i).copied()),
                shown(self.profile.fitted.get(i).copied().flatten()),
                text(number(self.profile.residuals.get(i).copied().flatten().unwrap_or(f64::NAN))),
            ]
        });
        Table {
            number: table,
            caption: html! {
                "What each sensor read, what it would read of the profile, and the difference in standard deviations of its noise."
            },
            columns: vec![
                short("sensor"),
                words("measures"),
                numeric("position, mm"),
                numeric("read"),
                numeric("of the profile"),
                numeric("left, sd"),
            ],
            rows: rows.collect(),
        }
        .markup()
    }
}

/// A stretch given in metres, in millimetres to a tenth.
fn stretch((from_m, to_m): (f64, f64)) -> String {
    format!("{}–{}", tenths(from_m * 1e3), tenths(to_m * 1e3))
}

/// A place in millimetres to a tenth.
fn tenths(place_mm: f64) -> String {
    format!("{place_mm:.1}")
}

fn status_in_words(profile: &LoadProfile) -> Markup {
    let (misfit, worst) = (number(profile.misfit), stated(profile.worst_misfit.round()));
    match profile.status {
        Status::NoContact => html! { "No contact: the reading is no more than its noise." },
        Status::OutsideModel => html! {
            b { "Outside the model" } ": no load explains the reading within its noise. The least sum of squared residuals is "
            (misfit) " standard deviations squared; noise alone seldom makes more than " (worst) "."
        },
        _ => html! {
            "A load explains the reading: the least sum of squared residuals is " (misfit) " standard deviations squared, below "
            (worst) "."
        },
    }
}

fn meaning() -> Markup {
    html! {
        p {
            "A few readings do not tell a whole function. Shown is the mixture of all non-negative loads that explain the reading, \
             from very smooth to rough, each smoothness weighed by how probable it makes the reading. Total force, centre of \
             pressure, and the centres and forces of patches are told far better than the shape of the load."
        }
        p {
            "The averaging kernels say over how much of the surface the profile is a mean. They are those of the linear inverse; \
             that a load cannot pull resolves more than they show. What lies next to a support hardly moves any sensor, and the \
             profile puts no load there unless the reading asks for it."
        }
    }
}

use maud::{Markup, html};

use super::bench_figures::{bench_figure, sites_chart};
use super::drawing::chart::Extremes;
use super::error_lines::in_milli;
use super::maps::{self, compared_maps, limits_mm, sensors_mm};
use super::numbers::{NOTHING, counted, mm, number, quantity, rig_number};
use super::page::{Figure, Page, ReportFile, Section, Table};
use super::{Axis, Chart, Mark, Marker, Series};
use palpate_design::sensors::{
    AssessedLayout, Assessment, CountPoint, DesignCriterion, KeepOut, Method, SensorProblem, Symmetry,
    Verification, best_design, enough,
};
use palpate_estimators::estimator::Cells;
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::LimitCurve;
use palpate_mechanics::surface::Extent;

const CELLS: f64 = 1600.0;
const CELLS_A_SIDE: std::ops::RangeInclusive<usize> = 5..=160;

/// Contents of the report.
#[derive(Clone, Copy)]
pub struct SensorDesignReport<'a> {
    /// Page title.
    pub title: &'a str,
    /// Surface, with the rig's own sensors.
    pub setup: &'a Setup,
    /// Design problem.
    pub problem: &'a SensorProblem<'a>,
    /// Designed layouts.
    pub designed: &'a [AssessedLayout],
    /// Errors of simulated calibrations, for some layouts.
    pub verified: &'a [(Method, Verification)],
    /// Layouts with other numbers of sensors.
    pub counts: &'a [CountPoint],
    /// Seed of searches and simulations.
    pub seed: u64,
}

/// `report.html` and SVG figures.
pub fn sensor_design_report(report: &SensorDesignReport) -> Vec<ReportFile> {
    let layouts = Section::new("layouts", "The layouts").table(report.table()).table(report.places());
    let limit = Section::new("limit", "The limit with the best of them");
    let mut sections = match report.problem.extent() {
        Extent::Line { .. } => {
            let setup = report.best().and_then(|best| {
                let what = "The bench with the best layout";
                bench_figure(what, report.setup.surface(), &best.layout, report.problem.force_n())
            });
            vec![layouts.figure(report.sites_figure()), limit.figure(setup).figure(report.limit_figure())]
        }
        Extent::Plane { .. } => vec![layouts, limit.figures(report.limit_maps())],
    };
    sections.extend(report.counts_figure().map(|figure| {
        let section = Section::new("counts", "How many sensors are enough");
        section.text(report.counts_in_words()).figure(figure)
    }));
    sections.push(Section::new("given", "What was given").text(report.given()));
    sections.push(Section::new("meaning", "How layouts are searched and scored").text(meaning()));
    Page::new(report.title, report.summary(), sections).with_source(html! { ", seed " (report.seed) }).files()
}

impl<'a> SensorDesignReport<'a> {
    /// Even layout; the present one if sensors are kept.
    fn even(&self) -> Option<&'a AssessedLayout> {
        self.problem.reference(self.designed)
    }

    fn best(&self) -> Option<&'a AssessedLayout> {
        best_design(self.designed)
    }

    fn verification(&self, method: Method) -> Option<&'a Verification> {
        self.verified.iter().find(|(of, _)| *of == method).map(|(_, verification)| verification)
    }

    fn length_mm(&self) -> f64 {
        self.setup.surface().extent().length_m() * 1e3
    }

    fn summary(&self) -> Markup {
        let Some(best) = self.best() else { return html! {} };
        let limit =
            |designed: &AssessedLayout| designed.assessment.mean_limit_m.map_or(f64::NAN, |m| m * 1e3);
        let error = |designed: &AssessedLayout| {
            self.verification(designed.method).map(|verified| verified.mean_error_m * 1e3)
        };
        let even = self.even();
        let reference = even.map_or("", |even| even.method.reference_in_words());
        let compared = |even: f64, best: f64| {
            let percent = 100.0 * (1.0 - best / even);
            let word = if percent >= 0.0 { "below" } else { "above" };
            if percent.is_finite() {
                format!(", {} % {word} {reference} {} mm", number(percent.abs()), number(even))
            } else {
                String::new()
            }
        };
        html! {
            li {
                "Best of " (counted(self.designed.len(), "layout", "layouts")) " of "
                (counted(best.layout.len(), "sensor", "sensors")) ": " b { (best.method.name()) } ", "
                (self.problem.places_in_words(&best.layout)) "."
            }
            li {
                "The mean limit is " b { (number(limit(best))) " mm" }
                @if let Some(even) = even { (compared(limit(even), limit(best))) }
                "; force " (self.problem.force().name()) "."
            }
            @if let (Some(best), Some(even)) = (error(best), even.and_then(error)) {
                li {
                    "Calibrated and asked in simulation, its locator is off by " b { (number(best)) " mm" } " on average"
                    (compared(even, best)) "."
                }
            }
        }
    }

    fn table(&self) -> Table {
        let scale = self.problem.design().criterion.score_scale();
        let (design, assessed) =
            (self.problem.design(), |designed: &&'a AssessedLayout| &designed.assessment);
        let broken = self.designed.iter().any(|designed| !designed.assessment.keeps_constraints);
        let caption = html! {
            "The layouts. Score: " (score_in_words(design.criterion)) ", the smaller the better. One dead: the worst score when \
             any one sensor dies. Expected: the mean error of an estimator at the limit; simulated: that of a locator, \
             calibrated and evaluated with noise. A dash: some contact is unidentifiable, or the layout was not simulated."
            @if broken { " *: breaks a constraint." }
        };
        let mut table = Table::from_rows(self.designed)
            .short("layout", |designed| {
                format!(
                    "{}{}",
                    designed.method.name(),
                    if assessed(designed).keeps_constraints { "" } else { " *" }
                )
            })
            .number("score", |designed| assessed(designed).score * scale)
            .mm("mean limit, mm", |designed| assessed(designed).mean_limit_m)
            .mm("largest, mm", |designed| assessed(designed).worst_limit_m)
            .number(format!("within {} mm, %", mm(design.tolerance_m)), |designed| {
                assessed(designed).within_tolerance_percent
            })
            .number("one dead: score", |designed| {
                assessed(designed).score_one_dead.map(|score| score * scale)
            })
            .mm("expected error, mm", |designed| assessed(designed).mean_error_m)
            .numeric("simulated error, mm", |designed| match self.verification(designed.method) {
                None => NOTHING.to_owned(),
                Some(verified) => {
                    format!("{:.3} ± {:.3}", verified.mean_error_m * 1e3, verified.standard_error_m * 1e3)
                }
            });
        if design.has_costs() {
            table = table.numeric("cost", |designed| rig_number(assessed(designed).cost));
        }
        table.caption(caption)
    }

    fn places(&self) -> Table {
        Table::from_rows(self.designed)
            .short("layout", |designed| designed.method.name())
            .wide("sensors", |designed| self.problem.places_in_words(&designed.layout))
            .caption(html! { "Where their sensors sit." })
    }

    fn sites_figure(&self) -> Figure {
        let row = |designed: &'a AssessedLayout| (designed.method.name().to_owned(), &designed.layout);
        let rows: Vec<_> = self.designed.iter().map(row).collect();
        let chart = sites_chart(&rows, self.length_mm() * 1e-3, self.keep_out_marks());
        Figure::chart(&chart, html! { "The sensors of every layout, a row each." })
    }

    fn limit_figure(&self) -> Option<Figure> {
        let (even, best) = (self.even(), self.best()?);
        let name = |designed: &AssessedLayout| format!("limit, {} layout", designed.method.name());
        let limits = |designed: &AssessedLayout| {
            let curve = self.limit_of(designed)?;
            Some(in_milli(curve.by_x(|bound| bound.sd_position_m)))
        };
        let of_even = even.and_then(|even| Some(Series::dashes(name(even), 6, limits(even)?)));
        let of_best = limits(best).map(|limits| Series::line(name(best), 0, limits));
        let mut series: Vec<Series> = of_even.into_iter().chain(of_best).collect();
        let extremes = Extremes::from_lines(&series);
        let Extremes { least, greatest } = extremes;
        // Sensors are drawn in two rows beneath the curves.
        let (from, to, rows) = if extremes.are_far_apart() {
            (0.35 * least, 1.4 * greatest, [0.6 * least, 0.45 * least])
        } else {
            (0.0, 1.1 * greatest, [0.1 * greatest, 0.04 * greatest])
        };
        let sites = |designed: &AssessedLayout, colour, y, marker| {
            let points = designed.layout.sensors().iter().map(|sensor| (sensor.position.x_m * 1e3, y));
            let label = format!("sensors, {} layout", designed.method.name());
            Series::markers(label, colour, points.collect(), marker)
        };
        series.extend(even.map(|even| sites(even, 6, rows[0], Marker::Square)));
        series.push(sites(best, 0, rows[1], Marker::Triangle));
        let x = Axis::linear("contact position, mm").from_to(0.0, self.length_mm());
        let y = extremes.axis("limit, mm").from_to(from, to);
        let chart = Chart::new("The least standard deviation of a located contact", x, y, series)
            .with_marks(self.keep_out_marks())
            .with_height(500);
        let caption = html! {
            "The limit at the contacts of the design, for " (rig_number(self.problem.force_n())) " N, force "
            (self.problem.force().name()) ", with the sensors of either layout beneath."
            @if !self.problem.design().keep_out.is_empty() { " Shaded: where no sensor may sit." }
        };
        Some(Figure::chart(&chart, caption))
    }

    fn limit_of(&self, designed: &AssessedLayout) -> Option<LimitCurve> {
        let setup = self.setup.clone().with_layout(designed.layout.clone()).ok()?;
        let positions = &self.problem.contacts().positions;
        let limit = setup.cramer_rao_bound().ok()?;
        LimitCurve::at_positions(&limit, self.problem.force_n(), self.problem.force(), positions).ok()
    }

    fn limit_maps(&self) -> Vec<Figure> {
        let cells = Cells::nearly_square(self.setup.surface().extent(), CELLS, CELLS_A_SIDE);
        let force = (self.problem.force_n(), self.problem.force());
        let limits = |designed: &'a AssessedLayout| {
            let setup = self.setup.clone().with_layout(designed.layout.clone()).ok()?;
            let values =
                limits_mm(&setup.cramer_rao_bound().ok()?, &cells, force, |bound| bound.sd_position_m);
            let dots_mm = sensors_mm(&designed.layout);
            Some(maps::DesignMap { name: designed.method.name(), values, dots_mm })
        };
        let designs = self.best().into_iter().chain(self.even()).filter_map(limits).collect();
        let title = |name: &str| format!("The least standard deviation of a located contact, {name} layout");
        let caption = |name: &str, most: &str| {
            html! {
                "The limit at each contact position with the " (name) " layout, for " (rig_number(force.0)) " N, force "
                (force.1.name()) ". Dots: the sensors. Limits above " (most) " mm have its colour."
            }
        };
        compared_maps(cells, "limit, mm", designs, title, caption)
    }

    fn keep_out_marks(&self) -> Vec<Mark> {
        let mark = |zone: &KeepOut| Mark::Span {
            low: zone.from.x_m * 1e3,
            high: zone.to.x_m * 1e3,
            label: "kept out".to_owned(),
        };
        self.problem.design().keep_out.iter().map(mark).collect()
    }

    fn counts_figure(&self) -> Option<Figure> {
        let (first, last) = (self.counts.first()?, self.counts.last()?);
        let curve = |of: fn(&CountPoint) -> Option<Assessment>| -> Vec<(f64, f64)> {
            let limit_m = |point| of(point).and_then(|assessed| assessed.mean_limit_m).unwrap_or(f64::NAN);
            self.counts.iter().map(|point| (point.count as f64, limit_m(point) * 1e3)).collect()
        };
        let (even, designed) = (curve(|point| point.even), curve(|point| Some(point.designed)));
        let dots =
            |colour, points: &[(f64, f64)]| Series::markers("", colour, points.to_vec(), Marker::Circle);
        let dots = [dots(6, &even), dots(0, &designed)];
        let lines = [Series::dashes("even", 6, even), Series::line("designed", 0, designed)];
        let series: Vec<Series> = lines.into_iter().chain(dots).collect();
        let extremes = Extremes::from_lines(&series);
        let axis = extremes.axis("mean limit, mm");
        let y = if extremes.are_far_apart() { axis } else { axis.from_to(0.0, 1.1 * extremes.greatest) };
        let step = (self.counts.len() / 12 + 1).max(1);
        let ticks: Vec<f64> = self.counts.iter().step_by(step).map(|point| point.count as f64).collect();
        let ends = (first.count as f64 - 0.5, last.count as f64 + 0.5);
        let x = Axis::linear("sensors").from_to(ends.0, ends.1).ticks_at(ticks);
        let caption = html! {
            "The mean limit of the even layout and of the layout by greedy choice and exchange. Where a curve is missing, some \
             contact is unidentifiable with so few sensors."
        };
        Some(Figure::chart(
            &Chart::new("How the limit falls with the number of sensors", x, y, series),
            caption,
        ))
    }

    fn counts_in_words(&self) -> Markup {
        html! {
            @if let (Some(count), Some(last)) = (enough(self.counts), self.counts.last()) {
                p {
                    (counted(count, "sensor comes", "sensors come")) " within 10 % of the score that "
                    (counted(last.count, "sensor has", "sensors have")) "."
                }
            }
        }
    }

    fn given(&self) -> Markup {
        let design = self.problem.design();
        let zone = |from: Position, to: Position| {
            let [from_m, to_m] = [from, to].map(|end| self.problem.extent().coordinates_m(end));
            let sides = from_m.zip(to_m).map(|(from_m, to_m)| format!("{}–{}", mm(from_m), mm(to_m)));
            sides.collect::<Vec<_>>().join(" × ") + " mm"
        };
        let kinds: Vec<String> = design
            .offers
            .iter()
            .map(|offer| {
                let channel = &offer.channel;
                let in_unit = |value| quantity(value, offer.kind.dimension());
                let mut words = format!("{}, noise {}", offer.kind, in_unit(channel.noise_sd));
                if channel.resolution > 0.0 {
                    words += &format!(", resolution {}", in_unit(channel.resolution));
                }
                if design.has_costs() {
                    words += &format!(", cost {}", rig_number(offer.cost));
                }
                words
            })
            .collect();
        html! {
            ul {
                @if !design.fixed.is_empty() {
                    li {
                        (counted(design.fixed.len(), "sensor is", "sensors are")) " kept; "
                        (counted(design.count - design.fixed.len(), "is", "are")) " new."
                    }
                }
                li { (counted(design.count, "sensor", "sensors")) " out of " (counted(self.problem.candidates(), "candidate", "candidates")) ": " (kinds.join("; ")) "." }
                li {
                    (counted(self.problem.contacts().len(), "contact", "contacts")) " over " (zone(design.contacts.from, design.contacts.to))
                    ", " (rig_number(self.problem.force_n())) " N, force " (self.problem.force().name())
                    @let left_out = self.problem.contacts_over_supports().len();
                    @if left_out > 0 {
                        "; those over supports (" (left_out) ") are excluded from scores and limits, because an unknown force \
                         is unidentifiable there"
                    }
                    @if !design.contacts.weights.is_empty() { ", some stretches touched more often than others" }
                    "."
                }
                @if design.spacing_m > 0.0 { li { "Sensors are at least " (mm(design.spacing_m)) " mm apart." } }
                @for kept in &design.keep_out { li { "Nothing sits within " (zone(kept.from, kept.to)) "." } }
                @if design.must_have.len() > design.fixed.len() {
                    li {
                        (counted(design.must_have.len() - design.fixed.len(), "sensor is", "sensors are"))
                        " part of every layout."
                    }
                }
                @if let Some(budget) = design.budget { li { "All together cost at most " (rig_number(budget)) "." } }
                @if design.symmetry == Symmetry::Wanted { li { "Layouts mirror themselves." } }
                @if design.symmetry == Symmetry::Forbidden { li { "No sensor mirrors another." } }
            }
        }
    }
}

fn score_in_words(criterion: DesignCriterion) -> &'static str {
    match criterion {
        DesignCriterion::MeanLimit => {
            "the mean limit in mm, each contact's combined with the size of the surface"
        }
        DesignCriterion::WorstLimit => "the largest limit in mm, combined with the size of the surface",
        DesignCriterion::WithinTolerance => "the share of contacts with a limit above the tolerance, in %",
        DesignCriterion::DOptimality => "the mean of ½·ln det of a contact's least covariance",
    }
}

fn meaning() -> Markup {
    html! {
        p {
            "A layout is scored by the limit over the expected contacts: the smallest standard deviation with which an \
             unbiased estimator can locate a contact. Where a contact is unidentifiable, the limit is infinite; the score \
             combines it with the prior knowledge that the contact is on the surface."
        }
        p {
            b { "greedy-exchange" } " adds the sensor that improves the score most until all are placed, then exchanges one \
             sensor at a time until no exchange improves the score, from several starts. "
            b { "exhaustive" } " tries every layout, where they are few. "
            b { "genetic" } " breeds layouts. " b { "refined" } " moves the best of these off the candidate sites. "
            b { "d-optimal" } " has the most information about position and force together, " b { "principal-components" }
            " reconstructs the readings at all sites best, " b { "qr-pivoting" } " takes the sites that best separate the \
             strongest components of the readings; these three ignore the location error."
        }
    }
}

//! The report of a contact that was followed.

use maud::{Markup, html};

use super::numbers::{counted, number, stated, whole};
use super::page::{Figure, Figures, Page, Section, Table, numeric, short, text};
use super::{
    Axis, BandPoint, Chart, Marker, ReportError, ReportFile, Series, SeriesKind, Stroke, chart_to_svg,
};
use crate::contact::Contact;
use crate::estimator::Track;
use crate::evaluation::{SpeedErrors, TrackErrors};

/// What a track's report is made from.
#[derive(Clone, Copy, Debug)]
pub struct TrackReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// The readings' source.
    pub source: &'a str,
    /// Length of the surface, in metres.
    pub length_m: f64,
    /// What is shown: of the filter or of the smoother.
    pub tracks: &'a [Track],
    /// Which of the two.
    pub how: &'a str,
    /// The true contact of each track, where the source says; a force of 0 where nothing touched.
    pub truths: &'a [Contact],
    /// Errors of the filter and of the smoother, by name, where the truth is known.
    pub errors: &'a [(&'static str, TrackErrors)],
    /// How the errors go with the speed; may be empty.
    pub sweep: &'a [SpeedErrors],
}

/// More points than this hide the track, so that of single estimates only every so many is drawn.
const MOST_POINTS: usize = 60;
/// More points of a line than this cannot be told apart.
const MOST_OF_LINE: usize = 2000;

/// Reports a track: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn track_report(report: &TrackReport) -> Result<Vec<ReportFile>, ReportError> {
    let mut figures = vec![report.track_figure()];
    if !report.truths.is_empty() {
        figures.push(report.errors_figure());
    }
    if !report.sweep.is_empty() {
        figures.push(report.sweep_figure());
    }
    let figures = Figures(figures);
    let section = |id, heading, body| Section { id, heading, body };
    let mut sections = vec![section("track", "The track", figures.show(1))];
    if !report.errors.is_empty() {
        let body = html! { (figures.show(2)) (report.errors_table()) };
        sections.push(section("errors", "Errors", body));
    }
    if !report.sweep.is_empty() {
        let body = html! { (figures.show(3)) (report.sweep_table()) };
        sections.push(section("speed", "Errors against the speed", body));
    }
    let page = Page {
        title: report.title.to_owned(),
        opening: report.summary(),
        sections,
        footer: html! { p { "Made by palpate " (env!("CARGO_PKG_VERSION")) " from " (report.source) "." } },
    };
    page.into_files(figures)
}

impl TrackReport<'_> {
    fn summary(&self) -> Markup {
        html! {
            div.summary {
                ul {
                    li { (counted(self.tracks.len(), "reading", "readings")) " of " b { (self.source) } ", followed by the " (self.how) "." }
                    @for (name, errors) in self.errors {
                        li {
                            "The " (name) ": average error " b { (number(errors.track_m * 1e3)) " mm" } ", "
                            (number(errors.ratio())) " times smaller than that of the readings one by one, "
                            (number(errors.single_m * 1e3)) " mm."
                        }
                    }
                }
            }
        }
    }

    fn track_figure(&self) -> Figure {
        let mut series = Vec::new();
        let stride = self.tracks.len().div_ceil(MOST_POINTS).max(1);
        let alone = |track: &Track| (track.time_s, track.alone.contact.position.x_m * 1e3);
        series.push(Series {
            label: if stride > 1 {
                format!("single readings, every {stride}th")
            } else {
                "single readings".to_owned()
            },
            colour: 4,
            kind: SeriesKind::Points {
                points: self.tracks.iter().step_by(stride).map(alone).collect(),
                marker: Marker::Cross,
            },
        });
        let band = |track: &Track| {
            let ends = track.tracked.map_or((f64::NAN, f64::NAN), |tracked| tracked.x_95_m);
            BandPoint { x: track.time_s, low: ends.0 * 1e3, high: ends.1 * 1e3 }
        };
        let points = self.tracks.iter().map(band).collect();
        series.push(Series {
            label: "95 % of the track".to_owned(),
            colour: 0,
            kind: SeriesKind::Band { points },
        });
        let line =
            |track: &Track| (track.time_s, track.tracked.map_or(f64::NAN, |tracked| tracked.x_m * 1e3));
        let kind = SeriesKind::Line { points: self.tracks.iter().map(line).collect(), stroke: Stroke::Solid };
        series.push(Series { label: format!("track, {}", self.how), colour: 0, kind });
        if !self.truths.is_empty() {
            let truth = |(track, truth): (&Track, &Contact)| {
                let x_m = if truth.force_n > 0.0 { truth.position.x_m } else { f64::NAN };
                (track.time_s, x_m * 1e3)
            };
            let points = self.tracks.iter().zip(self.truths).map(truth).collect();
            let kind = SeriesKind::Line { points, stroke: Stroke::Dashed };
            series.push(Series { label: "true position".to_owned(), colour: 6, kind });
        }
        let chart = Chart {
            title: "The contact over time".to_owned(),
            x: Axis::linear("time, s"),
            y: Axis::linear("position, mm").from_to(0.0, self.length_m * 1e3),
            series,
            height_px: 520,
            ..Chart::default()
        };
        let caption = html! { "Where the contact was, where readings by themselves see it, and the track with its 95 % band." };
        Figure { number: 1, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
    }

    /// What is drawn less the true position, in mm, against the time.
    fn errors_figure(&self) -> Figure {
        let stride = self.tracks.len().div_ceil(MOST_OF_LINE).max(1);
        let touched = || {
            let pairs = self.tracks.iter().zip(self.truths).step_by(stride);
            pairs.filter(|(_, truth)| truth.force_n > 0.0)
        };
        let away =
            |x_m: Option<f64>, truth: &Contact| x_m.map_or(f64::NAN, |x_m| (x_m - truth.position.x_m) * 1e3);
        let line = |label: &str, colour, x_m: fn(&Track) -> Option<f64>| {
            let points = touched().map(|(track, truth)| (track.time_s, away(x_m(track), truth))).collect();
            let kind = SeriesKind::Line { points, stroke: Stroke::Solid };
            Series { label: label.to_owned(), colour, kind }
        };
        let band = touched().map(|(track, truth)| {
            let end = |x_m: f64| away(Some(x_m), truth);
            let ends = track.tracked.map_or((f64::NAN, f64::NAN), |tracked| tracked.x_95_m);
            BandPoint { x: track.time_s, low: end(ends.0), high: end(ends.1) }
        });
        let band = SeriesKind::Band { points: band.collect() };
        let chart = Chart {
            title: "How far readings and track are off".to_owned(),
            x: Axis::linear("time, s"),
            y: Axis::linear("position less the true one, mm"),
            series: vec![
                line("single readings", 4, |track| Some(track.alone.contact.position.x_m)),
                Series { label: "95 % of the track".to_owned(), colour: 1, kind: band },
                line("track", 1, |track| track.tracked.map(|tracked| tracked.x_m)),
            ],
            height_px: 480,
            ..Chart::default()
        };
        let caption = html! { "Errors over time, while something touched." };
        Figure { number: 2, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
    }

    fn sweep_figure(&self) -> Figure {
        let line = |label: &str, colour, error: fn(&SpeedErrors) -> f64| {
            let points = self.sweep.iter().map(|speed| (speed.ratio, error(speed) * 1e3)).collect();
            Series {
                label: label.to_owned(),
                colour,
                kind: SeriesKind::Line { points, stroke: Stroke::Solid },
            }
        };
        let chart = Chart {
            title: "Errors against the contact's speed".to_owned(),
            x: Axis::log10("speed over the critical speed"),
            y: Axis::log10("average error, mm"),
            series: vec![
                line("single readings", 4, |speed| speed.filtered.single_m),
                line("track, filter", 0, |speed| speed.filtered.track_m),
                line("track, smoother", 2, |speed| speed.smoothed.track_m),
            ],
            ..Chart::default()
        };
        let caption = html! {
            "The same motion at other speeds, simulated with the beam's inertia and damping. The influence functions are those of a \
             beam in balance: the faster the contact, the less that holds."
        };
        Figure { number: 3, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
    }

    fn errors_table(&self) -> Markup {
        let row = |(name, errors): &(&'static str, TrackErrors)| {
            let percent = |share: f64| text(number(share * 100.0));
            vec![
                text(name),
                text(whole(errors.tracked as f64)),
                text(number(errors.track_m * 1e3)),
                text(number(errors.single_m * 1e3)),
                text(number(errors.ratio())),
                percent(errors.track_covered),
                percent(errors.single_covered),
            ]
        };
        let columns = [
            "readings",
            "average error, mm",
            "of single readings, mm",
            "ratio",
            "covered, %",
            "of single readings, %",
        ];
        Table {
            number: 1,
            caption: html! { "Errors while something touched; covered: how often the 95 % interval held the contact." },
            columns: std::iter::once(short("track")).chain(columns.map(numeric)).collect(),
            rows: self.errors.iter().map(row).collect(),
        }
        .markup()
    }

    fn sweep_table(&self) -> Markup {
        let row = |speed: &SpeedErrors| {
            let SpeedErrors { ratio, speed_m_per_s, filtered, smoothed } = speed;
            let mm = |error_m: f64| text(number(error_m * 1e3));
            let percent = |share: f64| text(number(share * 100.0));
            vec![
                text(stated(*ratio)),
                text(number(*speed_m_per_s)),
                mm(filtered.single_m),
                mm(filtered.track_m),
                mm(smoothed.track_m),
                percent(filtered.track_covered),
                percent(smoothed.track_covered),
            ]
        };
        let columns = [
            "speed, m/s",
            "single, mm",
            "filter, mm",
            "smoother, mm",
            "filter covers, %",
            "smoother covers, %",
        ];
        Table {
            number: 2,
            caption: html! { "Average errors against the speed over the critical speed." },
            columns: std::iter::once(numeric("ratio")).chain(columns.map(numeric)).collect(),
            rows: self.sweep.iter().map(row).collect(),
        }
        .markup()
    }
}

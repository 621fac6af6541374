//! The report of a contact that was followed.

use maud::{Markup, html};

use super::numbers::{counted, number, stated, whole};
use super::page::{Figure, Figures, Page, Section, Table, numeric, short, text};
use super::{
    Axis, BandPoint, Chart, Marker, ReportError, ReportFile, Series, SeriesKind, Stroke, chart_to_svg,
};
use palpate_estimators::estimator::Track;
use palpate_estimators::track_errors::{SpeedErrors, TrackErrors, tracked_of};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;

/// What a track's report is made from.
#[derive(Clone, Copy, Debug)]
pub struct TrackReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// The readings' source.
    pub source: &'a str,
    /// The surface.
    pub extent: Extent,
    /// What is shown: of the filter or of the smoother.
    pub tracks: &'a [Track],
    /// Which of the two.
    pub how: &'a str,
    /// The true contacts of each track, where the source says; a force of 0 of those that did not touch.
    pub truths: &'a [Vec<Contact>],
    /// Errors of the filter and of the smoother, by name, where the truth is known.
    pub errors: &'a [(&'static str, TrackErrors)],
    /// How the errors go with the speed; may be empty.
    pub sweep: &'a [SpeedErrors],
}

/// More points than this hide the track, so that of single estimates only every so many is drawn.
const MOST_POINTS: usize = 60;
/// More points of a line than this cannot be told apart.
const MOST_OF_LINE: usize = 2000;
/// Width of the plot area of a chart, and what there is above and below it, both about: a plane is drawn to scale.
const PLOT_WIDTH_PX: f64 = 630.0;
const AROUND_PLOT_PX: f64 = 130.0;

/// Reports a track: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn track_report(report: &TrackReport) -> Result<Vec<ReportFile>, ReportError> {
    let track = if report.extent.is_plane() { report.path_figure() } else { report.track_figure() };
    let mut figures = vec![track, report.errors_figure()];
    if !report.sweep.is_empty() {
        figures.push(report.sweep_figure());
    }
    let figures = Figures(figures);
    let section = |id, heading, body| Section { id, heading, body };
    let mut sections = vec![section("track", "The track", figures.show(1))];
    let errors = html! { (figures.show(2)) @if !report.errors.is_empty() { (report.errors_table()) } };
    sections.push(section("errors", "Errors", errors));
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
        let alone = |track: &Track| (track.time_s, track.alone.contact.position.x_m * 1e3);
        let mut series = vec![self.single_readings(alone)];
        for k in 0..self.most_contacts() {
            let place = |track: &Track| {
                (track.time_s, track.contacts.get(k).map_or(f64::NAN, |tracked| tracked.x_m * 1e3))
            };
            let points = self.tracks.iter().map(place).collect();
            series.push(line(format!("track{}, {}", of_two(k, self), self.how), k, Stroke::Solid, points));
        }
        for k in 0..self.truths.iter().map(Vec::len).max().unwrap_or(0) {
            let truth = |(track, truths): (&Track, &Vec<Contact>)| {
                let touching = truths.get(k).filter(|truth| truth.force_n > 0.0);
                (track.time_s, touching.map_or(f64::NAN, |truth| truth.position.x_m * 1e3))
            };
            let points = self.tracks.iter().zip(self.truths).map(truth).collect();
            let label = if k == 0 { "true position" } else { "true position of the second" };
            series.push(line(label.to_owned(), 6 + k, Stroke::Dashed, points));
        }
        let chart = Chart {
            title: "The contact over time".to_owned(),
            x: Axis::linear("time, s"),
            y: Axis::linear("position, mm").from_to(0.0, self.extent.length_m * 1e3),
            series,
            height_px: 520,
            ..Chart::default()
        };
        let caption = html! { "Where the contact was, where readings by themselves see it, and the track." };
        Figure { number: 1, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
    }

    /// The way over a plane, drawn to scale.
    fn path_figure(&self) -> Figure {
        let mm = |position: Position| (position.x_m * 1e3, position.y_m * 1e3);
        let mut series = vec![self.single_readings(|track: &Track| mm(track.alone.contact.position))];
        let place = |track: &Track| {
            let tracked = track.contacts.first();
            tracked.map_or((f64::NAN, f64::NAN), |tracked| mm(tracked.estimate().position))
        };
        let path = self.tracks.iter().map(place).collect();
        series.push(line(format!("track, {}", self.how), 0, Stroke::Solid, path));
        let truth = |truths: &Vec<Contact>| {
            let touching = truths.first().filter(|truth| truth.force_n > 0.0);
            touching.map_or((f64::NAN, f64::NAN), |truth| mm(truth.position))
        };
        if !self.truths.is_empty() {
            let path = self.truths.iter().map(truth).collect();
            series.push(line("true position".to_owned(), 6, Stroke::Dashed, path));
        }
        let [length_mm, width_mm] =
            [self.extent.length_m, self.extent.width_m.unwrap_or_default()].map(|side_m| side_m * 1e3);
        let chart = Chart {
            title: "The contact on the plane".to_owned(),
            x: Axis::linear("x, mm").from_to(0.0, length_mm),
            y: Axis::linear("y, mm").from_to(0.0, width_mm),
            series,
            height_px: (PLOT_WIDTH_PX * width_mm / length_mm + AROUND_PLOT_PX) as u32,
            ..Chart::default()
        };
        let caption =
            html! { "The contact's way over the plane, where readings by themselves see it, and the track." };
        Figure { number: 1, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
    }

    /// Some of the estimates by single readings.
    fn single_readings(&self, alone: impl Fn(&Track) -> (f64, f64)) -> Series {
        let stride = self.tracks.len().div_ceil(MOST_POINTS).max(1);
        Series {
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
        }
    }

    /// The track less the true position, with its 95 % band; where the truth is not known, the band alone, about the track.
    fn errors_figure(&self) -> Figure {
        let stride = self.tracks.len().div_ceil(MOST_OF_LINE).max(1);
        let known = !self.truths.is_empty();
        let mut series = Vec::new();
        for (colour, coordinate) in self.coordinates().into_iter().enumerate() {
            let off = |i: usize| {
                let time_s = self.tracks[i].time_s;
                match self.off_mm(i, &coordinate) {
                    Some([off, low, high]) => (time_s, off, low, high),
                    None => (time_s, f64::NAN, f64::NAN, f64::NAN),
                }
            };
            let points: Vec<_> = (0..self.tracks.len()).step_by(stride).map(off).collect();
            let band = points.iter().map(|(x, _, low, high)| BandPoint { x: *x, low: *low, high: *high });
            let kind = SeriesKind::Band { points: band.collect() };
            series.push(Series { label: format!("its 95 %{}", coordinate.name), colour, kind });
            let off = points.iter().map(|(x, off, ..)| (*x, *off)).collect();
            series.push(line(format!("track{}", coordinate.name), colour, Stroke::Solid, off));
        }
        let (title, y, caption) = if known {
            (
                "How far the track is off",
                "position less the true one, mm",
                "The track's error over time and its 95 % interval, while something touched: the interval should hold 0.",
            )
        } else {
            (
                "How sure the track is",
                "ends of the 95 % interval less the position, mm",
                "The 95 % interval about the track over time.",
            )
        };
        let chart = Chart {
            title: title.to_owned(),
            x: Axis::linear("time, s"),
            y: Axis::linear(y),
            series,
            height_px: 480,
            ..Chart::default()
        };
        let caption = html! { (caption) };
        Figure { number: 2, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
    }

    /// What the figure of errors has a line for: each contact, or both coordinates of a plane.
    fn coordinates(&self) -> Vec<Coordinate> {
        if self.extent.is_plane() {
            let named = |name, across| Coordinate { name, contact: 0, across };
            return vec![named(" in x", false), named(" in y", true)];
        }
        let of = |contact| Coordinate { name: of_two(contact, self), contact, across: false };
        (0..self.most_contacts()).map(of).collect()
    }

    /// The track at reading `i` and both ends of its 95 % interval in mm, less the truth, or less the track where that is not known.
    fn off_mm(&self, i: usize, coordinate: &Coordinate) -> Option<[f64; 3]> {
        let track = &self.tracks[i];
        let (tracked, truth) = match self.truths.get(i) {
            Some(truths) => {
                let tracked = *tracked_of(track, truths).get(coordinate.contact)?;
                (tracked?, Some(truths.get(coordinate.contact)?.position))
            }
            None => (*track.contacts.get(coordinate.contact)?, None),
        };
        let (place_m, (low_m, high_m)) = if coordinate.across {
            tracked.across.map(|across| (across.y_m, across.y_95_m))?
        } else {
            (tracked.x_m, tracked.x_95_m)
        };
        let of_truth = |truth: Position| if coordinate.across { truth.y_m } else { truth.x_m };
        let from_m = truth.map_or(place_m, of_truth);
        Some([place_m, low_m, high_m].map(|end_m| (end_m - from_m) * 1e3))
    }

    /// How many contacts were followed at most.
    fn most_contacts(&self) -> usize {
        self.tracks.iter().map(|track| track.contacts.len()).max().unwrap_or(0)
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
                percent(errors.track_number_right),
            ]
        };
        let columns = [
            "contacts",
            "average error, mm",
            "of single readings, mm",
            "ratio",
            "covered, %",
            "of single readings, %",
            "number right, %",
        ];
        Table {
            number: 1,
            caption: html! { "Errors while something touched; covered: how often the 95 % interval held the contact; number right: how often as many contacts were found as touched." },
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

/// What an error is of.
struct Coordinate {
    /// As it goes on after "track".
    name: &'static str,
    contact: usize,
    across: bool,
}

fn line(label: String, colour: usize, stroke: Stroke, points: Vec<(f64, f64)>) -> Series {
    Series { label, colour, kind: SeriesKind::Line { points, stroke } }
}

/// Which of two contacts is meant; nothing where there is but one.
fn of_two(k: usize, report: &TrackReport) -> &'static str {
    match (report.most_contacts(), k) {
        (2.., 0) => " of the first",
        (2.., _) => " of the second",
        _ => "",
    }
}

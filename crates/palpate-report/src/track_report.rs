use maud::{Markup, html};

use super::maps::in_mm;
use super::numbers::{counted, number, rig_number, whole};
use super::page::{Figure, Page, ReportFile, Section, Table};
use super::{Axis, BandPoint, Chart, Marker, Series};
use palpate_estimators::estimator::Track;
use palpate_estimators::track_errors::{SpeedErrors, TrackErrors, tracked_of};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;

/// More single estimates would cover the track.
const MOST_POINTS: usize = 60;
/// More points cannot be distinguished.
const MOST_OF_LINE: usize = 2000;
/// Approximate width of the plot area, and height of the parts above and below it.
const PLOT_WIDTH_PX: f64 = 630.0;
const AROUND_PLOT_PX: f64 = 130.0;

/// Contents of the report.
#[derive(Clone, Copy, Debug)]
pub struct TrackReport<'a> {
    /// Page title.
    pub title: &'a str,
    /// Source of the readings.
    pub source: &'a str,
    /// Extent of the surface.
    pub extent: Extent,
    /// Tracks of the filter or smoother.
    pub tracks: &'a [Track],
    /// "filter" or "smoother".
    pub how: &'a str,
    /// True contacts of each track, if known; force 0 for no contact.
    pub truths: &'a [Vec<Contact>],
    /// Errors of filter and smoother, by name; empty for an unknown truth.
    pub errors: &'a [(&'static str, TrackErrors)],
    /// Errors by contact speed; may be empty.
    pub sweep: &'a [SpeedErrors],
}

/// `report.html` and SVG figures.
pub fn track_report(report: &TrackReport) -> Vec<ReportFile> {
    let track = match report.extent {
        Extent::Line { .. } => report.track_figure(),
        Extent::Plane { .. } => report.path_figure(),
    };
    let mut sections = vec![
        Section::new("track", "The track").figure(track),
        Section::new("errors", "Errors").figure(report.errors_figure()).table(report.errors_table()),
    ];
    if !report.sweep.is_empty() {
        let section = Section::new("speed", "Errors against the speed").figure(report.sweep_figure());
        sections.push(section.table(report.sweep_table()));
    }
    Page::new(report.title, report.summary(), sections)
        .with_source(html! { " from " (report.source) })
        .files()
}

impl TrackReport<'_> {
    fn summary(&self) -> Markup {
        html! {
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

    fn track_figure(&self) -> Figure {
        let position = |track: &Track| (track.time_s, track.single.contact.position.x_m * 1e3);
        let mut series = vec![self.single_readings(position)];
        for k in 0..self.most_contacts() {
            let place = |track: &Track| {
                (track.time_s, track.contacts.get(k).map_or(f64::NAN, |tracked| tracked.x_m * 1e3))
            };
            let label = format!("track{}, {}", of_two(k, self), self.how);
            series.push(Series::line(label, k, self.tracks.iter().map(place).collect()));
        }
        for k in 0..self.truths.iter().map(Vec::len).max().unwrap_or(0) {
            let truth = |(track, truths): (&Track, &Vec<Contact>)| {
                (track.time_s, touching(truths.get(k)).map_or(f64::NAN, |at| at.x_m * 1e3))
            };
            let points = self.tracks.iter().zip(self.truths).map(truth).collect();
            let label = if k == 0 { "true position" } else { "true position of the second" };
            series.push(Series::dashes(label, 6 + k, points));
        }
        let y = Axis::linear("position, mm").from_to(0.0, self.extent.length_m() * 1e3);
        let chart = Chart::new("The contact over time", Axis::linear("time, s"), y, series).with_height(520);
        let caption = html! { "Where the contact was, where readings by themselves see it, and the track." };
        Figure::chart(&chart, caption)
    }

    fn path_figure(&self) -> Figure {
        let path = |places: &mut dyn Iterator<Item = Option<Position>>| -> Vec<(f64, f64)> {
            places.map(|place| place.map_or((f64::NAN, f64::NAN), in_mm)).collect()
        };
        let mut series = vec![self.single_readings(|track: &Track| in_mm(track.single.contact.position))];
        let mut tracked = self.tracks.iter().map(|track| Some(track.contacts.first()?.estimate().position));
        series.push(Series::line(format!("track, {}", self.how), 0, path(&mut tracked)));
        if !self.truths.is_empty() {
            let mut truths = self.truths.iter().map(|truths| touching(truths.first()));
            series.push(Series::dashes("true position", 6, path(&mut truths)));
        }
        let sides_m = [self.extent.length_m(), self.extent.width_m().unwrap_or_default()];
        let [length_mm, width_mm] = sides_m.map(|side_m| side_m * 1e3);
        let x = Axis::linear("x, mm").from_to(0.0, length_mm);
        let y = Axis::linear("y, mm").from_to(0.0, width_mm);
        let height_px = PLOT_WIDTH_PX * width_mm / length_mm + AROUND_PLOT_PX;
        let chart = Chart::new("The contact on the plane", x, y, series).with_height(height_px as u32);
        let caption =
            html! { "The contact's way over the plane, where readings by themselves see it, and the track." };
        Figure::chart(&chart, caption)
    }

    fn single_readings(&self, position: impl Fn(&Track) -> (f64, f64)) -> Series {
        let stride = self.tracks.len().div_ceil(MOST_POINTS).max(1);
        let every = if stride > 1 { format!(", every {stride}th") } else { String::new() };
        let points = self.tracks.iter().step_by(stride).map(position).collect();
        Series::markers(format!("single readings{every}"), 4, points, Marker::Cross)
    }

    /// Track minus truth with a 95 % band; only the band for an unknown truth.
    fn errors_figure(&self) -> Figure {
        let stride = self.tracks.len().div_ceil(MOST_OF_LINE).max(1);
        let mut series = Vec::new();
        for (colour, coordinate) in self.coordinates().into_iter().enumerate() {
            let point = |i: usize| {
                let [off, low, high] = self.off_mm(i, &coordinate).unwrap_or([f64::NAN; 3]);
                (off, BandPoint { x: self.tracks[i].time_s, low, high })
            };
            let points: Vec<(f64, BandPoint)> = (0..self.tracks.len()).step_by(stride).map(point).collect();
            let band = points.iter().map(|(_, band)| *band).collect();
            series.push(Series::band(format!("its 95 %{}", coordinate.name), colour, band));
            let off = points.iter().map(|(off, band)| (band.x, *off)).collect();
            series.push(Series::line(format!("track{}", coordinate.name), colour, off));
        }
        let (title, y, caption) = if self.truths.is_empty() {
            (
                "How sure the track is",
                "ends of the 95 % interval less the position, mm",
                "The 95 % interval about the track over time.",
            )
        } else {
            (
                "How far the track is off",
                "position less the true one, mm",
                "The track's error over time and its 95 % interval, during contact: the interval should contain 0.",
            )
        };
        let chart = Chart::new(title, Axis::linear("time, s"), Axis::linear(y), series).with_height(480);
        Figure::chart(&chart, html! { (caption) })
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        let named = |name, contact, across| Coordinate { name, contact, across };
        match self.extent {
            Extent::Line { .. } => (0..self.most_contacts())
                .map(|contact| named(of_two(contact, self), contact, false))
                .collect(),
            Extent::Plane { .. } => vec![named(" in x", 0, false), named(" in y", 0, true)],
        }
    }

    /// Track and 95 % interval in mm, minus the truth, or else minus the track.
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
            tracked.transverse.map(|across| (across.y_m, across.y_95_m))?
        } else {
            (tracked.x_m, tracked.x_95_m)
        };
        let of_truth = |truth: Position| if coordinate.across { truth.y_m } else { truth.x_m };
        let from_m = truth.map_or(place_m, of_truth);
        Some([place_m, low_m, high_m].map(|end_m| (end_m - from_m) * 1e3))
    }

    fn most_contacts(&self) -> usize {
        self.tracks.iter().map(|track| track.contacts.len()).max().unwrap_or(0)
    }

    fn sweep_figure(&self) -> Figure {
        let line = |label, colour, error_m: fn(&SpeedErrors) -> f64| {
            let points = self.sweep.iter().map(|speed| (speed.ratio, error_m(speed) * 1e3)).collect();
            Series::line(label, colour, points)
        };
        let series = vec![
            line("single readings", 4, |speed| speed.filtered.single_m),
            line("track, filter", 0, |speed| speed.filtered.track_m),
            line("track, smoother", 2, |speed| speed.smoothed.track_m),
        ];
        let (x, y) = (Axis::log10("speed over the critical speed"), Axis::log10("average error, mm"));
        let caption = html! {
            "This motion at other speeds, simulated with the beam's inertia and damping. The influence functions are those of \
             a beam in balance: the faster the contact, the less accurate they are."
        };
        Figure::chart(&Chart::new("Errors against the contact's speed", x, y, series), caption)
    }

    fn errors_table(&self) -> Table {
        let caption = html! {
            "Errors during contact; covered: the share of 95 % intervals that contain the contact; number right: the share of \
             readings with the right number of contacts."
        };
        Table::from_rows(self.errors)
            .short("track", |(name, _)| *name)
            .numeric("contacts", |(_, errors)| whole(errors.tracked as f64))
            .mm("average error, mm", |(_, errors)| errors.track_m)
            .mm("of single readings, mm", |(_, errors)| errors.single_m)
            .number("ratio", |(_, errors)| errors.ratio())
            .number("covered, %", |(_, errors)| errors.track_covered * 100.0)
            .number("of single readings, %", |(_, errors)| errors.single_covered * 100.0)
            .number("number right, %", |(_, errors)| errors.track_number_right * 100.0)
            .caption(caption)
    }

    fn sweep_table(&self) -> Table {
        Table::from_rows(self.sweep)
            .numeric("ratio", |speed| rig_number(speed.ratio))
            .number("speed, m/s", |speed| speed.speed_m_per_s)
            .mm("single, mm", |speed| speed.filtered.single_m)
            .mm("filter, mm", |speed| speed.filtered.track_m)
            .mm("smoother, mm", |speed| speed.smoothed.track_m)
            .number("filter covers, %", |speed| speed.filtered.track_covered * 100.0)
            .number("smoother covers, %", |speed| speed.smoothed.track_covered * 100.0)
            .caption(html! { "Average errors against the speed over the critical speed." })
    }
}

struct Coordinate {
    /// Name after "track".
    name: &'static str,
    contact: usize,
    across: bool,
}

fn touching(contact: Option<&Contact>) -> Option<Position> {
    contact.filter(|contact| contact.force_n > 0.0).map(|contact| contact.position)
}

fn of_two(k: usize, report: &TrackReport) -> &'static str {
    match (report.most_contacts(), k) {
        (2.., 0) => " of the first",
        (2.., _) => " of the second",
        _ => "",
    }
}

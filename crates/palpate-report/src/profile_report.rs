use maud::{Markup, html};

use super::maps::sensors_mm;
use super::numbers::{NOTHING, counted, decimals, mm, number, place, rig_number};
use super::page::{Columns, Figure, Page, ReportFile, Section, Table};
use super::{Axis, BandPoint, Chart, HeatMap, HeatPanel, Mark, Marker, Series};
use palpate_estimators::estimator::{ForceBounds, LoadProfile, Patch, PatchLimit, Resolution, Status};
use palpate_mechanics::sensing::{Layout, Sensor, SensorKind};
use palpate_mechanics::surface::{Extent, UniformLoad};

/// Shares of the length, and on a plane also of the width.
const KERNEL_PLACES: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
const KERNEL_PLACES_ON_A_PLANE: [[f64; 2]; 3] = [[0.5, 0.5], [0.25, 0.25], [0.1, 0.5]];
/// From N/m to N/mm, and from Pa to kPa.
const PER_THOUSAND: f64 = 1e-3;

/// Contents of the report.
#[derive(Clone, Copy)]
pub struct ProfileReport<'a> {
    /// Page title.
    pub title: &'a str,
    /// Sensors.
    pub layout: &'a Layout,
    /// Reading, in SI units.
    pub reading: &'a [f64],
    /// Estimated load.
    pub profile: &'a LoadProfile,
    /// Limit of each patch; `None` if one is unidentifiable.
    pub limits: Option<&'a [PatchLimit]>,
    /// Resolution of the layout; `None` without load.
    pub resolution: Option<&'a Resolution>,
    /// Simulated loads; empty for an unknown truth.
    pub truth: &'a [UniformLoad],
    /// Origin of the reading: file and line, or rig and seed.
    pub source: &'a str,
}

/// `report.html` and SVG figures.
pub fn profile_report(report: &ProfileReport) -> Vec<ReportFile> {
    let (load, resolved) = match report.extent() {
        Extent::Line { .. } => (
            report.load_figure(),
            report
                .resolution
                .map(|resolution| [report.width_figure(resolution), report.kernel_figure(resolution)]),
        ),
        Extent::Plane { .. } => (
            report.pressure_map(),
            report.resolution.map(|resolution| [report.width_map(resolution), report.kernel_map(resolution)]),
        ),
    };
    let sections = vec![
        Section::new("profile", "The load").figure(load).table(report.patch_table()),
        Section::new("resolution", "What this layout resolves").figures(resolved.into_iter().flatten()),
        Section::new("readings", "Readings and what is left of them")
            .figure(report.residual_figure())
            .table(report.reading_table()),
        Section::new("meaning", "What the profile means").text(meaning()),
    ];
    Page::new(report.title, report.summary(), sections)
        .with_source(html! { " from " (report.source) })
        .files()
}

impl<'a> ProfileReport<'a> {
    fn extent(&self) -> Extent {
        self.profile.cells.extent
    }

    fn summary(&self) -> Markup {
        let profile = self.profile;
        let ForceBounds { total_95_n, margin_m, seen_95_n } = profile.bounds;
        html! {
            li { (status_in_words(profile)) }
            @if let Some(centre) = &profile.centre {
                li {
                    "Total force " b { (number(profile.total_n)) " N" } ", 95 % interval " (interval_n(total_95_n)) " N"
                    " for any shape of the load; " (interval_n(seen_95_n)) " N if no load lies within " (mm(margin_m))
                    " mm of an edge."
                }
                li {
                    "Centre of pressure at " b { (number(centre.position.x_m * 1e3)) " mm" } ", 95 % interval "
                    (interval_mm(centre.x_95_m)) " mm"
                    @if let Extent::Plane { .. } = self.extent() {
                        "; across at " b { (number(centre.position.y_m * 1e3)) " mm" } ", 95 % interval "
                        (interval_mm(centre.y_95_m)) " mm"
                    }
                    "."
                }
                li { a href="#profile" { (counted(profile.patches.len(), "patch", "patches")) } "." }
            }
        }
    }

    fn by_cell(&self, figure: impl Fn(usize) -> f64) -> Vec<(f64, f64)> {
        let centres = self.profile.cells.centres().enumerate();
        centres.map(|(cell, centre)| (centre.x_m * 1e3, figure(cell))).collect()
    }

    fn axis(&self, label: &str) -> Axis {
        Axis::linear(label).from_to(0.0, self.profile.cells.extent.length_m() * 1e3)
    }

    fn load_figure(&self) -> Figure {
        let profile = self.profile;
        let load = self.by_cell(|cell| profile.density(cell).0 * PER_THOUSAND);
        let interval = |(cell, (x, _)): (usize, &(f64, f64))| {
            let (low, high) = profile.density(cell).1;
            BandPoint { x: *x, low: low * PER_THOUSAND, high: high * PER_THOUSAND }
        };
        let band = load.iter().enumerate().map(interval).collect();
        let foot = 0.02 * load.iter().fold(0.0, |most: f64, point| most.max(point.1));
        let centres = profile.patches.iter().map(|patch| (patch.centre.position.x_m * 1e3, foot)).collect();
        let mut series = vec![
            Series::band("95 % interval", 0, band),
            Series::line("load", 0, load),
            Series::markers("centres of the patches", 2, centres, Marker::Triangle),
        ];
        if !self.truth.is_empty() {
            series.push(Series::dashes("true load", 1, self.truth_steps()));
        }
        let centre = profile.centre.map(|centre| Mark::VerticalLine {
            x: centre.position.x_m * 1e3,
            label: "centre of pressure".to_owned(),
        });
        let (x, y) = (self.axis("position, mm"), Axis::linear("load, N/mm"));
        let chart =
            Chart::new("The load along the surface", x, y, series).with_marks(centre.into_iter().collect());
        let caption = html! {
            "The estimated load, with its 95 % interval cell by cell. Beside an edge, where force and position trade off, it \
             is the smallest load; the patches of Table 1 are not."
            @if !self.truth.is_empty() { " Dashes: the load that was simulated." }
            " Neighbouring cells share their uncertainty: where one is too high, the next is too low, and their sum is more \
             certain than either."
        };
        Figure::chart(&chart, caption)
    }

    fn truth_steps(&self) -> Vec<(f64, f64)> {
        let mut loads = self.truth.to_vec();
        loads.sort_by(|a, b| a.from().x_m.total_cmp(&b.from().x_m));
        let steps = loads.iter().flat_map(|load| {
            let (from, to) = (load.from().x_m * 1e3, load.to().x_m * 1e3);
            let density = load.force_n() / (to - from);
            [(from, 0.0), (from, density), (to, density), (to, 0.0)]
        });
        let end = (self.profile.cells.extent.length_m() * 1e3, 0.0);
        std::iter::once((0.0, 0.0)).chain(steps).chain([end]).collect()
    }

    fn width_figure(&self, resolution: &Resolution) -> Figure {
        let points = self.by_cell(|cell| resolution.widths_m[cell] * 1e3);
        let most = points.iter().fold(0.0, |most: f64, point| most.max(point.1));
        let sensors = self.layout.sensors().iter();
        let sensors = sensors.map(|sensor| (sensor.position.x_m * 1e3, 0.02 * most)).collect();
        let series =
            vec![Series::line("width", 0, points), Series::markers("sensors", 2, sensors, Marker::Triangle)];
        let y = Axis::linear("width at half height, mm").from_to(0.0, 1.1 * most);
        let chart = Chart::new("Width of the averaging kernels", self.axis("position, mm"), y, series);
        let caption = html! { "Over how much of the surface the profile is a mean, at the smoothness of this reading." };
        Figure::chart(&chart, caption)
    }

    fn kernel_figure(&self, resolution: &Resolution) -> Figure {
        let cells = resolution.cells;
        let kernel = |(colour, share): (usize, &f64)| {
            let of = ((share * cells.columns as f64) as usize).min(cells.columns - 1);
            let label = format!("of {} mm", mm(cells.centre(of).x_m));
            Series::line(label, colour, self.by_cell(|cell| resolution.kernels[[of, cell]]))
        };
        let series = KERNEL_PLACES.iter().enumerate().map(kernel).collect();
        let (x, y) = (self.axis("position of the load, mm"), Axis::linear("share of a cell's load"));
        let caption = html! {
            "What load elsewhere adds to the profile at five places: the ideal is a spike at the place itself. Negative lobes take away."
        };
        Figure::chart(&Chart::new("Averaging kernels", x, y, series), caption)
    }

    fn map(&self, title: &str, label: &str, panels: Vec<HeatPanel>) -> HeatMap {
        HeatMap {
            title: title.to_owned(),
            cells: self.profile.cells,
            panels,
            dots_mm: sensors_mm(self.layout),
            label: label.to_owned(),
            most: f64::INFINITY,
            width_px: 860,
        }
    }

    fn pressure_map(&self) -> Figure {
        let profile = self.profile;
        let cells = 0..profile.cells.len();
        let kpa =
            |name, pa: Vec<f64>| HeatPanel::new(name, pa.into_iter().map(|pa| pa * PER_THOUSAND).collect());
        let mut panels = vec![kpa("estimated", cells.clone().map(|cell| profile.density(cell).0).collect())];
        if !self.truth.is_empty() {
            panels.push(kpa("simulated", profile.cells.mean_density(self.truth)));
        }
        panels.push(kpa("standard deviation", cells.map(|cell| profile.density_sd(cell)).collect()));
        let caption = html! {
            "The estimated pressure, cell by cell"
            @if !self.truth.is_empty() { ", the pressure that was simulated," }
            " and the standard deviation of the estimate. Neighbouring cells share their uncertainty: where one is too high, \
             the next is too low, and their sum is more certain than either. Dots: the sensors."
        };
        Figure::map(&self.map("The pressure on the surface", "kPa", panels), caption)
    }

    fn width_map(&self, resolution: &Resolution) -> Figure {
        let widths = resolution.widths_m.iter().map(|width_m| width_m * 1e3).collect();
        let caption = html! {
            "Over how much of the surface the pressure map is a mean, at the smoothness of this reading: the side of a square as large as \
             the area where the averaging kernel of a place is above half of its height."
        };
        let panels = vec![HeatPanel::new("", widths)];
        Figure::map(&self.map("Width of the averaging kernels", "width, mm", panels), caption)
    }

    fn kernel_map(&self, resolution: &Resolution) -> Figure {
        let cells = resolution.cells;
        let kernel = |[along, across]: [f64; 2]| {
            let number = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
            let cell = number(across, cells.rows) * cells.columns + number(along, cells.columns);
            let name = format!("of {} mm", place(cells.centre(cell), cells.extent));
            HeatPanel::new(name, resolution.kernels.row(cell).to_vec())
        };
        let panels = KERNEL_PLACES_ON_A_PLANE.into_iter().map(kernel).collect();
        let caption = html! {
            "What load elsewhere adds to the map at three places: the ideal is a spike at the place itself. Negative lobes take away."
        };
        Figure::map(&self.map("Averaging kernels", "share", panels), caption)
    }

    fn residual_figure(&self) -> Figure {
        let mut kinds = self.layout.kinds();
        kinds.dedup();
        let of_kind = |(colour, kind): (usize, &SensorKind)| {
            let sensors = self.layout.sensors().iter().enumerate().filter(|(_, sensor)| sensor.kind == *kind);
            let points = sensors.filter_map(|(i, sensor)| {
                let at = match self.extent() {
                    Extent::Line { .. } => sensor.position.x_m * 1e3,
                    Extent::Plane { .. } => (i + 1) as f64,
                };
                Some((at, self.profile.residuals.get(i).copied().flatten()?))
            });
            let marker = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Cross][colour % 4];
            Series::markers(kind.name(), colour, points.collect(), marker)
        };
        let series = kinds.iter().enumerate().map(of_kind).collect();
        let x = match self.extent() {
            Extent::Line { .. } => self.axis("sensor position, mm"),
            Extent::Plane { .. } => Axis::linear("sensor").from_to(0.0, self.layout.len() as f64 + 1.0),
        };
        let y = Axis::linear("residual, standard deviations of the noise");
        let line_at = |y, label: &str| Mark::HorizontalLine { y, label: label.to_owned() };
        let chart = Chart::new("What the profile leaves of the reading", x, y, series)
            .with_marks(vec![line_at(2.0, "two standard deviations"), line_at(-2.0, "")])
            .with_height(340);
        let caption = html! { "Reading less what the sensor would read of the profile, over the standard deviation of its noise." };
        Figure::chart(&chart, caption)
    }

    fn patch_table(&self) -> Table {
        type Row<'r> = (&'r Patch, Option<&'r PatchLimit>, usize);
        // Stretch, centre, its interval and its limit: along the surface, and on a plane across it.
        let stretch = |from_m: f64, to_m: f64| format!("{}–{}", mm(from_m), mm(to_m));
        let along = |table: Columns<Row<'a>>, [to, centre]: [&str; 2]| {
            table
                .numeric(to, |(patch, ..)| stretch(patch.from.x_m, patch.to.x_m))
                .numeric(centre, |(patch, ..)| tenths_mm(patch.centre.position.x_m))
                .numeric("95 %, mm", move |(patch, ..)| interval_mm(patch.centre.x_95_m))
                .mm("limit, mm", |(_, limit, _)| limit.map(|limit| limit.sd_x_m))
        };
        let across = |table: Columns<Row<'a>>| {
            table
                .numeric("across, mm", |(patch, ..)| stretch(patch.from.y_m, patch.to.y_m))
                .numeric("centre y, mm", |(patch, ..)| tenths_mm(patch.centre.position.y_m))
                .numeric("95 %, mm", |(patch, ..)| interval_mm(patch.centre.y_95_m))
                .mm("limit, mm", |(_, limit, _)| limit.map(|limit| limit.sd_y_m))
        };
        let limit = |i: usize| self.limits.and_then(|limits| limits.get(i));
        let rows = self.profile.patches.iter().enumerate().map(|(i, patch)| (patch, limit(i), i + 1));
        let table = Table::from_rows(rows).short("patch", |(.., number)| number.to_string());
        let table = match self.extent() {
            Extent::Line { .. } => along(table, ["stretch, mm", "centre, mm"]),
            Extent::Plane { .. } => across(along(table, ["along, mm", "centre x, mm"])),
        };
        let caption = html! {
            "The patches: as many evenly loaded parts as the reading needs, and their limits, the least \
             standard deviations that an unbiased estimator of evenly loaded patches of this number and these sizes can have. Intervals are of \
             evenly loaded patches of this number and of any size. Beside an edge force, place and size trade off."
        };
        table
            .number("force, N", |(patch, ..)| patch.force_n)
            .numeric("95 %, N", |(patch, ..)| interval_n(patch.force_95_n))
            .number("limit, N", |(_, limit, _)| limit.map(|limit| limit.sd_force_n))
            .caption(caption)
    }

    fn reading_table(&self) -> Table {
        let shown = |sensor: &Sensor, value: Option<f64>| match value {
            Some(value) => decimals(value / sensor.kind.unit().factor(), 4),
            None => NOTHING.to_owned(),
        };
        let caption = html! {
            "What each sensor read, what it would read of the profile, and the difference in standard deviations of its noise."
        };
        Table::from_rows(self.layout.sensors().iter().enumerate())
            .short("sensor", |(i, _)| (i + 1).to_string())
            .words("measures", |(_, sensor)| {
                format!("{}, {}", sensor.kind.name(), sensor.kind.unit().symbol())
            })
            .numeric("position, mm", |(_, sensor)| place(sensor.position, self.extent()))
            .numeric("read", |(i, sensor)| shown(sensor, self.reading.get(*i).copied()))
            .numeric("of the profile", |(i, sensor)| {
                shown(sensor, self.profile.fitted.get(*i).copied().flatten())
            })
            .number("left, sd", |(i, _)| self.profile.residuals.get(*i).copied().flatten())
            .caption(caption)
    }
}

fn interval_mm((from_m, to_m): (f64, f64)) -> String {
    format!("{}–{}", tenths_mm(from_m), tenths_mm(to_m))
}

/// The upper end may be infinite.
fn interval_n((low_n, high_n): (f64, f64)) -> String {
    if high_n.is_finite() {
        format!("{}–{}", number(low_n), number(high_n))
    } else {
        format!("≥ {}", number(low_n))
    }
}

fn tenths_mm(length_m: f64) -> String {
    format!("{:.1}", length_m * 1e3)
}

fn status_in_words(profile: &LoadProfile) -> Markup {
    let (misfit, worst) = (number(profile.chi_squared), rig_number(profile.worst_misfit.round()));
    match profile.status {
        Status::NoContact => html! { "No contact: the reading does not exceed its noise." },
        Status::OutsideModel => html! {
            b { "Outside the model" } ": no load explains the reading within its noise. The least sum of squared residuals is "
            (misfit) " standard deviations squared; noise alone rarely exceeds " (worst) "."
        },
        Status::Ambiguous => html! {
            b { "Ambiguous" } ": the number of patches is not resolved. More patches than these explain the reading better, with a probability of error \
            between 0.1 % and 5 %. The intervals contain both explanations."
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
            "A few readings do not determine a whole function. The profile is the mixture of all non-negative loads that \
             explain the reading, from very smooth to rough, with each smoothness weighted by its marginal likelihood. Total \
             force, centre of pressure, and the centres and forces of patches are far more certain than the shape of the load."
        }
        p {
            "The averaging kernels show over how much of the surface the profile is a mean. They belong to the linear inverse; \
             the constraint that a load cannot pull resolves more than they show. A load next to a support hardly moves any \
             sensor, and the profile puts no load there unless the reading requires it: patches and total force account for \
             such loads, the sum of the drawn profile does not."
        }
    }
}

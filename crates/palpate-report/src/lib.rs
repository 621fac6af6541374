//! Reports: self-contained HTML pages with figures as SVG, returned as [`ReportFile`]s.
//!
//! ```
//! use palpate_estimators::arrangement::Training;
//! use palpate_estimators::estimator::Estimator;
//! use palpate_estimators::evaluation::Evaluation;
//! use palpate_estimators::fit::Fit;
//! use palpate_estimators::influence::Influence;
//! use palpate_estimators::setup::Setup;
//! use palpate_mechanics::sensing::SensorKind::Deflection;
//! use palpate_mechanics::surface::Beam;
//! use palpate_mechanics::units::{gpa, mm, newtons, um};
//! use palpate_report::{EstimateOrigin, EvaluationReport, evaluation_report};
//!
//! let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
//! let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?;
//! let presses = setup.simulate(&Training::even(10).with_force(newtons(3.0)), 0)?;
//! let locator = Estimator::Influence(Influence::default()).fit(&setup, &presses)?;
//! let files = evaluation_report(&EvaluationReport {
//!     title: "How well the locator remembers",
//!     origin: EstimateOrigin::Locator(&locator),
//!     evaluation: &Evaluation::new(&locator, &presses)?,
//!     recording: &presses.provenance,
//!     portions: &[],
//!     tolerance_m: mm(2.0),
//! });
//! let page = String::from_utf8_lossy(&files[0].bytes);
//! assert!(files[0].name == "report.html" && page.contains("10 readings"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Charts and maps are independent of their subject: a [`Chart`] is plain data from the caller. No
//! function reads a file, the clock or the machine's fonts, so equal data give equal bytes
//! everywhere.
//!
//! ```
//! use palpate_report::{Axis, Chart, Series, chart_to_svg};
//!
//! let errors = vec![(1.0, 12.0), (200.0, 0.4), (399.0, 9.0)];
//! let series = vec![Series::line("10 training positions", 0, errors)];
//! let (x, y) = (Axis::linear("load position, mm"), Axis::log10("error, mm"));
//! let svg = chart_to_svg(&Chart::new("Location error", x, y, series));
//! assert!(svg.starts_with("<svg") && svg.contains("10 training positions"));
//! ```
//!
//! The feature `png` adds PNG copies of figures with a built-in font: `svg_to_png`,
//! `with_png_copies`.
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod beam_drawing;
mod bench_figures;
mod comparison_report;
mod dead_areas_report;
mod design_report;
mod digit_figures;
mod drawing;
mod elliott_report;
mod error_lines;
mod evaluation_report;
mod limit_report;
mod maps;
mod numbers;
mod page;
mod paper_report;
#[cfg(feature = "png")]
mod png;
mod position_report;
mod profile_report;
mod study_report;
mod track_report;

#[cfg(test)]
mod tests;

pub use comparison_report::{ComparisonReport, comparison_report};
pub use dead_areas_report::dead_areas_report;
pub use design_report::{SensorDesignReport, sensor_design_report};
pub use drawing::{
    Axis, BandPoint, Chart, ErrorPoint, HeatMap, HeatPanel, Mark, Marker, Scale, Series, SeriesKind, Stroke,
    chart_to_svg, heat_map_to_svg,
};
pub use elliott_report::elliott_report;
pub use evaluation_report::{EstimateOrigin, EvaluationReport, evaluation_report};
pub use limit_report::{LimitReport, limit_report};
pub use page::ReportFile;
pub use paper_report::paper_report;
#[cfg(feature = "png")]
pub use png::{PngError, svg_to_png, with_png_copies};
pub use position_report::{PositionDesignReport, position_design_report};
pub use profile_report::{ProfileReport, profile_report};
pub use study_report::{StudyReport, study_report};
pub use track_report::{TrackReport, track_report};

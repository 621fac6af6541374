//! Reports: self-contained HTML pages with their figures as SVG and PNG, handed back as [`ReportFile`]s.
//!
//! Beneath them lie charts and drawings of a bench, which know nothing of what is drawn: a [`Chart`] is plain data that
//! the caller fills in. No function touches a file, the clock or the fonts of the machine, so the same data give the
//! same bytes everywhere.
//!
//! ```
//! use palpate::report::{Axis, Chart, Series, SeriesKind, Stroke, chart_to_svg, svg_to_png};
//!
//! let chart = Chart {
//!     title: "Location error".into(),
//!     x: Axis::linear("load position, mm"),
//!     y: Axis::log10("error, mm"),
//!     series: vec![Series {
//!         label: "10 training positions".into(),
//!         colour: 0,
//!         kind: SeriesKind::Line { points: vec![(1.0, 12.0), (200.0, 0.4), (399.0, 9.0)], stroke: Stroke::Solid },
//!     }],
//!     ..Chart::default()
//! };
//! let svg = chart_to_svg(&chart);
//! let png = svg_to_png(&svg, 2.0)?;
//! assert!(png.starts_with(b"\x89PNG"));
//! # Ok::<(), palpate::report::PngError>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod beam_drawing;
mod bench_drawing;
mod canvas;
mod chart;
mod chart_svg;
mod colour_map;
mod comparison_report;
mod dead_areas_report;
mod design_report;
mod digit_figures;
mod elliott_report;
mod evaluation_report;
mod extremes;
mod geometry;
mod heat_map;
mod layout;
mod legend;
mod limit_line;
mod limit_report;
mod numbers;
mod page;
mod paper_report;
mod plane_figures;
mod png;
mod position_report;
mod profile_report;
mod report_file;
mod scale;
mod sites;
mod study_figures;
mod study_parts;
mod study_report;
mod text;
mod ticks;
mod track_report;

#[cfg(test)]
mod tests;

pub use bench_drawing::{
    BenchDrawing, BenchDrawingError, BenchPart, BenchStep, BenchSupport, BenchSupportKind, bench_to_svg,
};
pub use chart::{
    Axis, AxisRange, BandPoint, Chart, ErrorPoint, Mark, Marker, Scale, Series, SeriesKind, Stroke, Ticks,
};
pub use chart_svg::chart_to_svg;
pub use comparison_report::{ComparisonReport, comparison_report};
pub use dead_areas_report::dead_areas_report;
pub use design_report::{SensorDesignReport, sensor_design_report};
pub use elliott_report::{chain_in_words, elliott_report};
pub use evaluation_report::{EvaluationReport, Judged, evaluation_report};
pub use heat_map::{HeatMap, HeatPanel, heat_map_to_svg};
pub use limit_report::{LimitReport, limit_report};
pub use paper_report::paper_report;
pub use png::{PngError, svg_to_png};
pub use position_report::{PositionDesignReport, position_design_report};
pub use profile_report::{ProfileReport, profile_report};
pub use report_file::{ReportError, ReportFile};
pub use study_report::{StudyReport, study_report};
pub use track_report::{TrackReport, track_report};

//! Charts and heat maps as SVG, independent of the subject of the data.
//!
//! A chart is laid out (`layout`, `axis`) before it is drawn (`chart_svg`, `svg`).

pub(crate) mod axis;
pub(crate) mod chart;
mod chart_svg;
pub(crate) mod geometry;
mod heat_map;
pub(crate) mod layout;
pub(crate) mod svg;
pub(crate) mod text;

pub use axis::{Axis, Scale};
pub use chart::{BandPoint, Chart, ErrorPoint, Mark, Marker, Series, SeriesKind, Stroke};
pub use chart_svg::chart_to_svg;
pub use heat_map::{HeatMap, HeatPanel, heat_map_to_svg};

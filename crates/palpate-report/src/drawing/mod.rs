//! Charts and heat maps as SVG: plain data in, text out, and no word of what is drawn.
//!
//! A chart is laid out before it is drawn (`layout`): axes settle their ends (`scale`) and their labels (`ticks`), names find room
//! beneath the plot (`legend`), and only then lines and shapes are written (`chart_svg`, `svg`).

mod chart;
mod chart_svg;
pub(crate) mod extremes;
pub(crate) mod geometry;
mod heat_map;
pub(crate) mod layout;
mod legend;
pub(crate) mod scale;
pub(crate) mod svg;
pub(crate) mod text;
pub(crate) mod ticks;

pub use chart::{Axis, BandPoint, Chart, ErrorPoint, Mark, Marker, Scale, Series, SeriesKind, Stroke};
pub use chart_svg::chart_to_svg;
pub use heat_map::{HeatMap, HeatPanel, heat_map_to_svg};

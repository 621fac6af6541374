//! The chart as data: series, marks and their range, without any drawing.

use super::axis::Axis;

/// A chart of one plot area, its title, axes, series and legend.
///
/// Any data can be drawn. Values that are not finite (or beyond ±1e300) break a line and are otherwise left
/// out, and so are values that are not positive on a logarithmic axis. A chart without data shows empty axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Heading; wrapped onto at most two lines. Empty for none.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis; the label stands above the plot, unrotated.
    pub y: Axis,
    /// Data to draw, later series over earlier ones within each kind: bands lie under lines, lines under points.
    pub series: Vec<Series>,
    /// Reference lines and shaded ranges behind the data.
    pub marks: Vec<Mark>,
    /// Width of the image in pixels at scale 1; drawn within 320 to 4,000.
    pub width_px: u32,
    /// Height of the image in pixels at scale 1, legend included; drawn within 280 to 4,000.
    pub height_px: u32,
}

impl Default for Chart {
    fn default() -> Self {
        Chart::new("", Axis::default(), Axis::default(), Vec::new())
    }
}

impl Chart {
    /// A chart of 720 × 440 pixels without marks.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis, series: Vec<Series>) -> Self {
        Chart { title: title.into(), x, y, series, marks: Vec::new(), width_px: 720, height_px: 440 }
    }

    /// Sets the height of the image.
    pub fn with_height(self, height_px: u32) -> Self {
        Chart { height_px, ..self }
    }

    /// Sets the marks.
    pub fn with_marks(self, marks: Vec<Mark>) -> Self {
        Chart { marks, ..self }
    }
}

/// Data that are drawn in one way, with one entry in the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; empty keeps the series out of it.
    pub label: String,
    /// Index into seven colours that colour-blind readers can distinguish (Okabe and Ito): blue, vermilion,
    /// green, purple, sky blue, orange, black; larger indices start over.
    pub colour: usize,
    /// Shape and data.
    pub kind: SeriesKind,
}

impl Series {
    /// A solid line through `points`.
    pub fn line(label: impl Into<String>, colour: usize, points: Vec<(f64, f64)>) -> Self {
        Series::new(label, colour, SeriesKind::Line { points, stroke: Stroke::Solid })
    }

    /// A broken line through `points`.
    pub fn dashes(label: impl Into<String>, colour: usize, points: Vec<(f64, f64)>) -> Self {
        Series::new(label, colour, SeriesKind::Line { points, stroke: Stroke::Dashed })
    }

    /// A translucent area between two curves.
    pub fn band(label: impl Into<String>, colour: usize, points: Vec<BandPoint>) -> Self {
        Series::new(label, colour, SeriesKind::Band { points })
    }

    /// Unconnected markers.
    pub fn markers(label: impl Into<String>, colour: usize, points: Vec<(f64, f64)>, marker: Marker) -> Self {
        Series::new(label, colour, SeriesKind::Points { points, marker })
    }

    /// Unconnected markers with a vertical bar.
    pub fn error_bars(
        label: impl Into<String>,
        colour: usize,
        points: Vec<ErrorPoint>,
        marker: Marker,
    ) -> Self {
        Series::new(label, colour, SeriesKind::ErrorBars { points, marker })
    }

    /// Whether the series is an area between two curves.
    pub fn is_band(&self) -> bool {
        matches!(self.kind, SeriesKind::Band { .. })
    }

    fn new(label: impl Into<String>, colour: usize, kind: SeriesKind) -> Self {
        Series { label: label.into(), colour, kind }
    }
}

/// Shape and data of a series.
#[derive(Debug, Clone, PartialEq)]
pub enum SeriesKind {
    /// A line through the points in their order.
    Line {
        /// (x, y) in the units of the axes.
        points: Vec<(f64, f64)>,
        /// Solid or dashed.
        stroke: Stroke,
    },
    /// A translucent area between two curves.
    Band {
        /// Lower and upper edge at each x. On a logarithmic axis an edge that is not positive lies on the
        /// end of the axis.
        points: Vec<BandPoint>,
    },
    /// Unconnected markers.
    Points {
        /// (x, y) in the units of the axes.
        points: Vec<(f64, f64)>,
        /// Shape of each marker.
        marker: Marker,
    },
    /// Unconnected markers with a vertical bar.
    ErrorBars {
        /// Each marker and the two ends of its bar.
        points: Vec<ErrorPoint>,
        /// Shape of each marker.
        marker: Marker,
    },
}

/// Stroke of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stroke {
    /// Unbroken.
    #[default]
    Solid,
    /// Broken.
    Dashed,
}

/// Shape of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// A filled disc.
    Circle,
    /// A filled square.
    Square,
    /// A filled triangle, apex up.
    Triangle,
    /// A diagonal cross.
    Cross,
}

/// The edges of a band at one x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandPoint {
    /// Horizontal position.
    pub x: f64,
    /// Lower edge.
    pub low: f64,
    /// Upper edge.
    pub high: f64,
}

/// A value with the ends of its error bar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorPoint {
    /// Horizontal position.
    pub x: f64,
    /// The value itself.
    pub y: f64,
    /// Lower end of the bar. On a logarithmic axis an end that is not positive lies on the end of the axis.
    pub low: f64,
    /// Upper end of the bar.
    pub high: f64,
}

/// A reference behind the data.
///
/// Labels of vertical marks stand above the plot, in at most three rows; a label without room is left out
/// while its mark stays. A horizontal mark is named in the legend.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A dashed vertical line, such as a support.
    VerticalLine {
        /// Position.
        x: f64,
        /// Name; empty for none.
        label: String,
    },
    /// A dashed horizontal line, such as a tolerance.
    HorizontalLine {
        /// Position.
        y: f64,
        /// Name in the legend; empty for none.
        label: String,
    },
    /// A shaded range of x, such as a portion of a beam.
    Span {
        /// One end.
        low: f64,
        /// The other end.
        high: f64,
        /// Name; empty for none.
        label: String,
    },
}

/// Least ratio of the greatest to the least of positive values for a logarithmic axis.
const LOGARITHMIC_FROM: f64 = 10.0;

/// The least and the greatest of some values; zeros without a number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Extremes {
    pub least: f64,
    pub greatest: f64,
}

impl Extremes {
    pub fn from_values(values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        let wider = |extremes: Option<Self>, value: f64| {
            let Self { least, greatest } = extremes.unwrap_or(Self { least: value, greatest: value });
            Some(Self { least: least.min(value), greatest: greatest.max(value) })
        };
        finite.fold(None, wider).unwrap_or_default()
    }

    /// Extremes of the heights of all lines.
    pub fn from_lines(series: &[Series]) -> Self {
        Self::from_values(series.iter().flat_map(|series| match &series.kind {
            SeriesKind::Line { points, .. } => points.iter().map(|point| point.1).collect(),
            _ => Vec::new(),
        }))
    }

    /// Whether only a logarithmic axis shows both ends.
    pub fn are_far_apart(self) -> bool {
        self.least > 0.0 && self.greatest >= LOGARITHMIC_FROM * self.least
    }

    /// An axis that shows both ends: logarithmic if they are far apart.
    pub fn axis(self, label: &str) -> Axis {
        if self.are_far_apart() { Axis::log10(label) } else { Axis::linear(label) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_does_not_count() {
        let extremes = Extremes::from_values([3.0, f64::NAN, 0.3, f64::INFINITY]);
        assert_eq!(extremes, Extremes { least: 0.3, greatest: 3.0 });
        assert!(extremes.are_far_apart());
        assert!(!Extremes::from_values([0.0, 3.0]).are_far_apart());
        assert_eq!(Extremes::from_values([f64::NAN]), Extremes::default());
    }
}

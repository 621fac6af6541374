use super::axis::Axis;

/// Chart with title, axes, series and legend.
///
/// Values that are not finite or beyond ±1e300 break a line, as do non-positive values on a
/// logarithmic axis. Without data the axes are empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Heading of at most two lines; may be empty.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis, with the label above the plot.
    pub y: Axis,
    /// Series; bands lie under lines, lines under points, later series over earlier ones.
    pub series: Vec<Series>,
    /// Reference lines and shaded ranges behind the data.
    pub marks: Vec<Mark>,
    /// Width in pixels, clamped to 320–4,000.
    pub width_px: u32,
    /// Height in pixels with the legend, clamped to 280–4,000.
    pub height_px: u32,
}

impl Default for Chart {
    fn default() -> Self {
        Chart::new("", Axis::default(), Axis::default(), Vec::new())
    }
}

impl Chart {
    /// Chart of 720 × 440 pixels without marks.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis, series: Vec<Series>) -> Self {
        Chart { title: title.into(), x, y, series, marks: Vec::new(), width_px: 720, height_px: 440 }
    }

    /// Sets the height.
    pub fn with_height(self, height_px: u32) -> Self {
        Chart { height_px, ..self }
    }

    /// Sets the marks.
    pub fn with_marks(self, marks: Vec<Mark>) -> Self {
        Chart { marks, ..self }
    }
}

/// Data with one shape, colour and legend entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; without one, no entry.
    pub label: String,
    /// Index into seven colours for colour-blind readers (Okabe and Ito), cyclic: blue, vermilion,
    /// green, purple, sky blue, orange, black.
    pub colour: usize,
    /// Shape and data.
    pub kind: SeriesKind,
}

impl Series {
    /// Solid line.
    pub fn line(label: impl Into<String>, colour: usize, points: Vec<(f64, f64)>) -> Self {
        Series::new(label, colour, SeriesKind::Line { points, stroke: Stroke::Solid })
    }

    /// Dashed line.
    pub fn dashes(label: impl Into<String>, colour: usize, points: Vec<(f64, f64)>) -> Self {
        Series::new(label, colour, SeriesKind::Line { points, stroke: Stroke::Dashed })
    }

    /// Translucent area between two curves.
    pub fn band(label: impl Into<String>, colour: usize, points: Vec<BandPoint>) -> Self {
        Series::new(label, colour, SeriesKind::Band { points })
    }

    /// Unconnected markers.
    pub fn markers(label: impl Into<String>, colour: usize, points: Vec<(f64, f64)>, marker: Marker) -> Self {
        Series::new(label, colour, SeriesKind::Points { points, marker })
    }

    /// Unconnected markers with vertical error bars.
    pub fn error_bars(
        label: impl Into<String>,
        colour: usize,
        points: Vec<ErrorPoint>,
        marker: Marker,
    ) -> Self {
        Series::new(label, colour, SeriesKind::ErrorBars { points, marker })
    }

    /// True for a band.
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
    /// Line through the points in order.
    Line {
        /// (x, y) in units of the axes.
        points: Vec<(f64, f64)>,
        /// Solid or dashed.
        stroke: Stroke,
    },
    /// Translucent area between two curves.
    Band {
        /// Edges; non-positive ones lie on the end of a logarithmic axis.
        points: Vec<BandPoint>,
    },
    /// Unconnected markers.
    Points {
        /// (x, y) in units of the axes.
        points: Vec<(f64, f64)>,
        /// Shape of each marker.
        marker: Marker,
    },
    /// Unconnected markers with vertical error bars.
    ErrorBars {
        /// Markers and ends of their bars.
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
    /// Dashed.
    Dashed,
}

/// Shape of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// Filled disc.
    Circle,
    /// Filled square.
    Square,
    /// Filled triangle, apex up.
    Triangle,
    /// Diagonal cross.
    Cross,
}

/// Edges of a band at one x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandPoint {
    /// Horizontal position.
    pub x: f64,
    /// Lower edge.
    pub low: f64,
    /// Upper edge.
    pub high: f64,
}

/// Value with an error bar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorPoint {
    /// Horizontal position.
    pub x: f64,
    /// Value.
    pub y: f64,
    /// Lower end; a non-positive one lies on the end of a logarithmic axis.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Reference behind the data.
///
/// Labels of vertical marks are above the plot, in at most three rows; labels without room are
/// omitted. The legend names horizontal marks.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// Dashed vertical line, such as a support.
    VerticalLine {
        /// Position.
        x: f64,
        /// Name; may be empty.
        label: String,
    },
    /// Dashed horizontal line, such as a tolerance.
    HorizontalLine {
        /// Position.
        y: f64,
        /// Name in the legend; may be empty.
        label: String,
    },
    /// Shaded range of x, such as a portion of a beam.
    Span {
        /// One end.
        low: f64,
        /// Other end.
        high: f64,
        /// Name; may be empty.
        label: String,
    },
}

/// Least ratio of positive values for a logarithmic axis.
const LOGARITHMIC_FROM: f64 = 10.0;

/// Smallest and largest value; zeros without a number.
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

    pub fn from_lines(series: &[Series]) -> Self {
        Self::from_values(series.iter().flat_map(|series| match &series.kind {
            SeriesKind::Line { points, .. } => points.iter().map(|point| point.1).collect(),
            _ => Vec::new(),
        }))
    }

    pub fn are_far_apart(self) -> bool {
        self.least > 0.0 && self.greatest >= LOGARITHMIC_FROM * self.least
    }

    pub fn axis(self, label: &str) -> Axis {
        if self.are_far_apart() { Axis::log10(label) } else { Axis::linear(label) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_ignore_nan_and_infinity() {
        let extremes = Extremes::from_values([3.0, f64::NAN, 0.3, f64::INFINITY]);
        assert_eq!(extremes, Extremes { least: 0.3, greatest: 3.0 });
        assert!(extremes.are_far_apart());
        assert!(!Extremes::from_values([0.0, 3.0]).are_far_apart());
        assert_eq!(Extremes::from_values([f64::NAN]), Extremes::default());
    }
}

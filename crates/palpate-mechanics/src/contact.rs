//! Contacts, positions, and the extent of a surface.

use serde::{Deserialize, Serialize};

pub use palpate_core::{Contact, Position};

use crate::units::format_length_mm;
use palpate_numerics::OutOfRange;

/// A position off the surface.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "{object} {number} is at {}, off the surface; it must be within {}",
    extent.place_in_words(*position),
    extent.bounds_in_words()
)]
pub struct OffSurface {
    /// Name of the object.
    pub object: &'static str,
    /// Number in its list.
    pub number: usize,
    /// The position.
    pub position: Position,
    /// Extent of the surface.
    pub extent: Extent,
}

impl OffSurface {
    /// Checks that all positions are on a surface.
    ///
    /// # Errors
    /// [`OffSurface`] for the first that is off.
    pub fn check(what: &'static str, positions: &[Position], extent: Extent) -> Result<(), Self> {
        match positions.iter().position(|position| !extent.contains(*position)) {
            Some(i) => Err(Self { object: what, number: i + 1, position: positions[i], extent }),
            None => Ok(()),
        }
    }
}

/// Line or rectangle of contacts.
///
/// ```
/// use palpate_mechanics::contact::{Extent, Position};
///
/// let plate = Extent::plane(0.3, 0.2)?;
/// assert!(plate.contains(Position { x_m: 0.3, y_m: 0.1 }) && !plate.contains(Position { x_m: 0.1, y_m: 0.3 }));
/// assert_eq!(plate.bounds_in_words(), "0 and 300 mm along, 0 and 200 mm across");
/// # Ok::<(), palpate_numerics::OutOfRange>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ExtentFields", into = "ExtentFields")]
pub enum Extent {
    /// Along x, with y = 0.
    Line {
        /// Length along x.
        length: Side,
    },
    /// One corner at the origin.
    Plane {
        /// Length along x.
        length: Side,
        /// Width along y.
        width: Side,
    },
}

/// Side of an [`Extent`], positive and finite, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side(f64);

#[derive(Serialize, Deserialize)]
struct ExtentFields {
    length_m: f64,
    width_m: Option<f64>,
}

impl TryFrom<ExtentFields> for Extent {
    type Error = OutOfRange;

    fn try_from(ExtentFields { length_m, width_m }: ExtentFields) -> Result<Self, OutOfRange> {
        Self::new(length_m, width_m)
    }
}

impl From<Extent> for ExtentFields {
    fn from(extent: Extent) -> Self {
        Self { length_m: extent.length_m(), width_m: extent.width_m() }
    }
}

impl Extent {
    /// Returns a plane when a width is given, otherwise a line.
    ///
    /// # Errors
    /// [`OutOfRange`] for a side that is not positive and finite.
    pub fn new(length_m: f64, width_m: Option<f64>) -> Result<Self, OutOfRange> {
        OutOfRange::check_positive([("the length in metres", length_m)])?;
        OutOfRange::check_positive(width_m.map(|width_m| ("the width in metres", width_m)))?;
        Ok(match width_m {
            None => Self::checked_line(length_m),
            Some(width_m) => Self::checked_plane(length_m, width_m),
        })
    }

    /// Returns a line.
    ///
    /// # Errors
    /// As [`Extent::new`].
    pub fn line(length_m: f64) -> Result<Self, OutOfRange> {
        Self::new(length_m, None)
    }

    /// Returns a plane.
    ///
    /// # Errors
    /// As [`Extent::new`].
    pub fn plane(length_m: f64, width_m: f64) -> Result<Self, OutOfRange> {
        Self::new(length_m, Some(width_m))
    }

    pub(crate) const fn checked_line(length_m: f64) -> Self {
        Self::Line { length: Side(length_m) }
    }

    pub(crate) const fn checked_plane(length_m: f64, width_m: f64) -> Self {
        Self::Plane { length: Side(length_m), width: Side(width_m) }
    }

    /// Line along x.
    #[must_use]
    pub fn along_x(&self) -> Self {
        Self::checked_line(self.length_m())
    }

    /// Length along x.
    pub fn length_m(&self) -> f64 {
        match *self {
            Self::Line { length } | Self::Plane { length, .. } => length.0,
        }
    }

    /// Width along y; `None` for a line.
    pub fn width_m(&self) -> Option<f64> {
        match *self {
            Self::Line { .. } => None,
            Self::Plane { width, .. } => Some(width.0),
        }
    }

    /// Number of coordinates of a position.
    pub fn dimensions(&self) -> usize {
        match self {
            Self::Line { .. } => 1,
            Self::Plane { .. } => 2,
        }
    }

    /// Length and, on a plane, width.
    pub fn sides_m(&self) -> impl Iterator<Item = f64> + use<> {
        std::iter::once(self.length_m()).chain(self.width_m())
    }

    /// `value` on a plane; `None` on a line.
    pub fn if_plane<T>(&self, value: T) -> Option<T> {
        match self {
            Self::Line { .. } => None,
            Self::Plane { .. } => Some(value),
        }
    }

    /// x and, on a plane, y.
    pub fn coordinates_m(&self, position: Position) -> impl Iterator<Item = f64> + use<> {
        std::iter::once(position.x_m).chain(self.if_plane(position.y_m))
    }

    /// Formats a position: "75 mm", or "75 mm, 40 mm" off a line.
    pub fn place_in_words(&self, position: Position) -> String {
        let x = format_length_mm(position.x_m);
        match self {
            Self::Line { .. } if position.y_m == 0.0 => x,
            _ => format!("{x}, {}", format_length_mm(position.y_m)),
        }
    }

    /// Formats positions: "35, 40 mm", "(10, 20), (10, 180) mm", or the columns and rows of a grid.
    pub fn places_in_words(&self, positions: &[Position]) -> String {
        let listed = |place: &dyn Fn(&Position) -> String| {
            format!("{} mm", positions.iter().map(place).collect::<Vec<_>>().join(", "))
        };
        match self {
            Self::Line { .. } => listed(&|at| mm(at.x_m)),
            Self::Plane { .. } => match grid(positions) {
                Some((columns, rows)) => {
                    format!("x {} with y {} mm each", columns.join(", "), rows.join(", "))
                }
                None => listed(&|at| format!("({}, {})", mm(at.x_m), mm(at.y_m))),
            },
        }
    }

    /// Formats the bounds: "0 and 300 mm along, 0 and 200 mm across".
    pub fn bounds_in_words(&self) -> String {
        let along = format!("0 and {}", format_length_mm(self.length_m()));
        match self.width_m() {
            None => along,
            Some(width_m) => format!("{along} along, 0 and {} across", format_length_mm(width_m)),
        }
    }

    /// True for a position on the extent, within 10⁻⁹ of the length.
    pub fn contains(&self, position: Position) -> bool {
        let slack_m = 1e-9 * self.length_m();
        let within = |value: f64, size: f64| value >= -slack_m && value <= size + slack_m;
        within(position.x_m, self.length_m()) && within(position.y_m, self.width_m().unwrap_or(0.0))
    }
}

fn mm(length_m: f64) -> String {
    let text = format!("{:.2}", length_m * 1e3);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn grid(positions: &[Position]) -> Option<(Vec<String>, Vec<String>)> {
    let first = mm(positions.first()?.y_m);
    let columns: Vec<String> =
        positions.iter().take_while(|at| mm(at.y_m) == first).map(|at| mm(at.x_m)).collect();
    let rows: Vec<String> = positions.iter().step_by(columns.len()).map(|at| mm(at.y_m)).collect();
    let at = |i: usize| (&columns[i % columns.len()], &rows[i / columns.len()]);
    let whole = positions.len() == columns.len() * rows.len();
    let is_grid =
        whole && positions.iter().enumerate().all(|(i, place)| at(i) == (&mm(place.x_m), &mm(place.y_m)));
    (is_grid && columns.len().min(rows.len()) >= 2 && positions.len() >= 6).then_some((columns, rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: Extent = Extent::checked_line(0.4);
    const PLANE: Extent = Extent::checked_plane(0.4, 0.2);

    #[test]
    fn positions_read_well() {
        let positions = [Position { x_m: 0.035, y_m: 0.0 }, Position { x_m: 0.1 / 3.0, y_m: 0.2 }];
        assert_eq!(LINE.places_in_words(&positions), "35, 33.33 mm");
        assert_eq!(PLANE.places_in_words(&positions), "(35, 0), (33.33, 200) mm");
    }

    #[test]
    fn grid_is_described_by_columns_and_rows() {
        let at = |i: usize| Position { x_m: 0.01 * (i % 3) as f64, y_m: 0.1 * (i / 3) as f64 };
        let mut positions: Vec<Position> = (0..6).map(at).collect();
        assert_eq!(PLANE.places_in_words(&positions), "x 0, 10, 20 with y 0, 100 mm each");
        assert_eq!(
            PLANE.places_in_words(&positions[..5]),
            "(0, 0), (10, 0), (20, 0), (0, 100), (10, 100) mm"
        );
        positions[4].x_m = 0.011;
        assert!(PLANE.places_in_words(&positions).starts_with("(0, 0), (10, 0), "));
    }

    #[test]
    fn a_file_has_the_width_of_a_line_as_null() {
        let text = serde_json::to_string(&[LINE, PLANE]).unwrap();
        assert_eq!(text, r#"[{"length_m":0.4,"width_m":null},{"length_m":0.4,"width_m":0.2}]"#);
        assert_eq!(serde_json::from_str::<[Extent; 2]>(&text).unwrap(), [LINE, PLANE]);
        assert_eq!(serde_json::from_str::<Extent>(r#"{"length_m":0.4}"#).unwrap(), LINE);
    }

    #[test]
    fn a_side_is_greater_than_0_and_finite() {
        for bad in [0.0, -0.4, f64::NAN, f64::INFINITY] {
            let refused = Extent::line(bad).unwrap_err().to_string();
            assert_eq!(
                refused,
                format!("the length in metres is {bad}; it must be greater than 0 and finite")
            );
            let refused = Extent::plane(0.4, bad).unwrap_err().to_string();
            assert_eq!(
                refused,
                format!("the width in metres is {bad}; it must be greater than 0 and finite")
            );
            assert!(Extent::plane(bad, 0.4).is_err());
        }
        assert!(serde_json::from_str::<Extent>(r#"{"length_m":-0.4,"width_m":null}"#).is_err());
        assert!(serde_json::from_str::<Extent>(r#"{"length_m":0.4,"width_m":0}"#).is_err());
    }
}

//! Training positions: arrangement and presses.

use palpate::estimators::arrangement::{self, Arrangement};
use palpate::mechanics::contact::Position;
use palpate::mechanics::units::format_length_mm;
use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};

use crate::errors::refused;
use crate::quantities::{force_n, length_m};

/// Training positions: the rule that places them, and how each is pressed.
///
/// `even`, `edge_dense`, `chebyshev`, `grid` and `at` make them.
#[pyclass(frozen, eq, from_py_object, module = "palpate")]
#[derive(Clone, PartialEq)]
pub struct Training(pub arrangement::Training);

#[pymethods]
impl Training {
    /// Training positions by a rule; `even` and its like are shorter.
    #[new]
    #[pyo3(signature = (arrangement, count=None, *, middle=None, portion=None, grid=None, positions=None, repeats=1, force=None, placement=None))]
    #[expect(clippy::too_many_arguments, reason = "keys of a section, each by its name")]
    fn new(
        arrangement: &str,
        count: Option<usize>,
        middle: Option<usize>,
        portion: Option<(f64, f64)>,
        grid: Option<(usize, usize)>,
        positions: Option<Bound<'_, PyAny>>,
        repeats: usize,
        force: Option<Bound<'_, PyAny>>,
        placement: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let needed =
            |name: &str| refused(format!("training positions by the rule \"{arrangement}\" need `{name}`"));
        let own_count = count.ok_or_else(|| needed("count"));
        let (rule, count) = match arrangement {
            "even" => {
                (portion.map_or(Arrangement::Even, |portion| Arrangement::EvenOver { portion }), own_count?)
            }
            "edge-dense" => {
                let portion = portion.unwrap_or(Arrangement::PAPER_PORTION);
                (
                    Arrangement::EdgeDense { middle: middle.ok_or_else(|| needed("middle"))?, portion },
                    own_count?,
                )
            }
            "chebyshev" => (Arrangement::Chebyshev, own_count?),
            "grid" => {
                let (columns, rows) = grid.ok_or_else(|| needed("grid"))?;
                (Arrangement::Grid { columns, rows }, columns.saturating_mul(rows))
            }
            "explicit" => {
                let positions = self::positions(&positions.ok_or_else(|| needed("positions"))?)?;
                let count = positions.len();
                (Arrangement::Explicit(positions), count)
            }
            other => {
                return Err(refused(format!(
                    "`arrangement` is \"{other}\"; it must be one of even, edge-dense, chebyshev, grid, explicit"
                )));
            }
        };
        if repeats == 0 {
            return Err(refused("`repeats` is 0; it must be at least 1"));
        }
        let training = arrangement::Training::new(rule, count).repeated(repeats);
        let training = match force {
            Some(force) => training.with_force(checked_force(&force)?),
            None => training,
        };
        Ok(Self(match placement {
            Some(placement) => training.with_placement(checked_placement(&placement)?),
            None => training,
        }))
    }

    /// Number of positions.
    #[getter]
    fn count(&self) -> usize {
        self.0.count
    }

    /// Presses at each position.
    #[getter]
    fn repeats(&self) -> usize {
        self.0.repeats
    }

    /// Force of the presses in newtons; None where it is the setup's.
    #[getter]
    fn force(&self) -> Option<f64> {
        self.0.force_n
    }

    /// Standard deviation in each direction of the pressed place about the asked one, in metres; None where it is unknown.
    #[getter]
    fn placement(&self) -> Option<f64> {
        self.0.placement_sd_m
    }

    fn __repr__(&self) -> String {
        let arrangement::Training { arrangement, count, repeats, force_n, placement_sd_m } = &self.0;
        let rule = match arrangement {
            Arrangement::Even | Arrangement::EvenOver { .. } => "even".to_owned(),
            Arrangement::EdgeDense { middle, .. } => format!("edge-dense, {middle} in the middle"),
            Arrangement::Chebyshev => "Chebyshev's nodes".to_owned(),
            Arrangement::Grid { columns, rows } => format!("grid of {columns} × {rows}"),
            Arrangement::Explicit(positions) => match positions.as_slice() {
                [first, .., last] => {
                    format!("from {} to {}", format_length_mm(first.x_m), format_length_mm(last.x_m))
                }
                _ => "explicit".to_owned(),
            },
        };
        let force = force_n.map_or_else(String::new, |force_n| format!(", {force_n} N"));
        let placement =
            placement_sd_m.map_or_else(String::new, |sd_m| format!(", placement {}", format_length_mm(sd_m)));
        format!("<Training: {count} positions, {rule}, {repeats} × each{force}{placement}>")
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let py = slf.py();
        let rebuild = py.import("palpate._rebuild")?.getattr("training")?;
        let arrangement::Training { arrangement, count, repeats, force_n, placement_sd_m } = &slf.get().0;
        let (name, middle, portion, grid, positions) = match arrangement {
            Arrangement::Even => ("even", None, None, None, None),
            Arrangement::EvenOver { portion } => ("even", None, Some(*portion), None, None),
            Arrangement::EdgeDense { middle, portion } => {
                ("edge-dense", Some(*middle), Some(*portion), None, None)
            }
            Arrangement::Chebyshev => ("chebyshev", None, None, None, None),
            Arrangement::Grid { columns, rows } => ("grid", None, None, Some((*columns, *rows)), None),
            Arrangement::Explicit(positions) => {
                let positions: Vec<(f64, f64)> =
                    positions.iter().map(|place| (place.x_m, place.y_m)).collect();
                ("explicit", None, None, None, Some(positions))
            }
        };
        let arguments = (name, *count, middle, portion, grid, positions, *repeats, *force_n, *placement_sd_m);
        Ok((rebuild, arguments.into_pyobject(py)?))
    }
}

/// In metres, finite and greater than 0.
fn checked_placement(placement: &Bound<'_, PyAny>) -> PyResult<f64> {
    let sd_m = length_m(placement, "placement")?;
    if sd_m.is_finite() && sd_m > 0.0 {
        Ok(sd_m)
    } else {
        Err(refused(format!("`placement` is {sd_m} m; it must be finite and greater than 0")))
    }
}

/// In newtons, greater than 0.
pub fn checked_force(force: &Bound<'_, PyAny>) -> PyResult<f64> {
    let force_n = force_n(force, "force")?;
    if force_n > 0.0 {
        Ok(force_n)
    } else {
        Err(refused(format!("`force` is {force_n} N; it must be greater than 0")))
    }
}

/// A list, or an array of the shape (positions) or (positions, 2).
pub fn positions(value: &Bound<'_, PyAny>) -> PyResult<Vec<Position>> {
    value.try_iter()?.map(|at| position(&at?)).collect()
}

/// A length on a line, two on a plane.
pub fn position(value: &Bound<'_, PyAny>) -> PyResult<Position> {
    if let (false, Ok(coordinates)) = (value.is_instance_of::<PyString>(), value.try_iter()) {
        let coordinates: Vec<_> = coordinates.collect::<PyResult<_>>()?;
        return match coordinates.as_slice() {
            [x] => Ok(Position::along(length_m(x, "x")?)),
            [x, y] => Ok(Position { x_m: length_m(x, "x")?, y_m: length_m(y, "y")? }),
            other => {
                let count = other.len();
                Err(refused(format!("a position has {count} coordinates; it must have 1, or 2 on a plane")))
            }
        };
    }
    Ok(Position::along(length_m(value, "position")?))
}

//! Estimates of one and of many readings.

use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, ToPyArray};
use palpate::estimators::estimate_record::ContactRecord;
use palpate::estimators::estimator::{self, ContactEstimate, Mode, Status, Uncertainty};
use palpate::estimators::force_prior::force_interval_95_n;
use palpate::mechanics::contact::Position;
use palpate::mechanics::surface::Extent;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::refused;

/// In the order of their codes.
const STATUSES: [Status; 5] =
    [Status::Located, Status::NoContact, Status::Ambiguous, Status::OutsideModel, Status::OutsideSurface];

fn code(status: Status) -> u8 {
    STATUSES.iter().position(|known| *known == status).unwrap_or_default() as u8
}

/// Estimate of the contact that made one reading.
#[pyclass(frozen, module = "palpate")]
#[derive(Clone)]
pub struct Estimate {
    inner: estimator::Estimate,
    extent: Extent,
}

impl Estimate {
    pub fn new(inner: estimator::Estimate, extent: Extent) -> Self {
        Self { inner, extent }
    }

    fn contact(&self) -> &ContactEstimate {
        &self.inner.contact
    }
}

#[pymethods]
impl Estimate {
    /// Position along the surface, in metres.
    #[getter]
    fn x(&self) -> f64 {
        self.contact().position.x_m
    }

    /// Position across a plane, in metres; None on a line.
    #[getter]
    fn y(&self) -> Option<f64> {
        self.extent.if_plane(self.contact().position.y_m)
    }

    /// Force in newtons, positive downward; None where it is neither known nor estimated.
    #[getter]
    fn force(&self) -> Option<f64> {
        self.contact().force_n
    }

    /// Ends of the 95 % interval along the surface, in metres; None for a method without it.
    #[getter]
    fn x_95(&self) -> Option<(f64, f64)> {
        self.contact().uncertainty.map(|uncertainty| uncertainty.x_95_m)
    }

    /// Ends of the 95 % interval across a plane, in metres.
    #[getter]
    fn y_95(&self) -> Option<(f64, f64)> {
        self.contact().uncertainty.and_then(|uncertainty| self.extent.if_plane(uncertainty.y_95_m))
    }

    /// Ends of the 95 % interval of the force in newtons; None where the force is known or not estimated.
    #[getter]
    fn force_95(&self) -> Option<(f64, f64)> {
        ContactRecord::new(self.contact(), self.extent).force_interval_95_n().map(<(f64, f64)>::from)
    }

    /// Covariance of (x, y, force), in m², m·N and N²: of the shape (3, 3); None for a method without it. What is not estimated has
    /// zeros.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let Some(uncertainty) = self.contact().uncertainty else { return Ok(None) };
        Ok(Some(square(uncertainty.covariance).to_pyarray(py).reshape([3, 3])?))
    }

    /// Status: "located", "no_contact", "ambiguous", "outside_model" or "outside_surface".
    #[getter]
    fn status(&self) -> &'static str {
        self.inner.status.name()
    }

    /// Other places that explain the same single contact, most probable first, as dicts of "x", "y", "force" and "probability".
    #[getter]
    fn modes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let each = self.inner.modes.as_slice().iter().map(|mode| {
            let dict = contact_dict(py, &mode.contact, self.extent)?;
            dict.set_item("probability", mode.probability)?;
            Ok(dict)
        });
        PyList::new(py, each.collect::<PyResult<Vec<_>>>()?)
    }

    /// Contacts beside the first that touch at the same time, strongest first, as dicts of "x", "y" and "force".
    #[getter]
    fn further<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let each = self.inner.further.as_slice().iter().map(|contact| contact_dict(py, contact, self.extent));
        PyList::new(py, each.collect::<PyResult<Vec<_>>>()?)
    }

    fn __repr__(&self) -> String {
        let mm = |at_m: f64| format!("{:.3}", at_m * 1e3);
        let contact = self.contact();
        let mut text = format!("<Estimate: {}, x = {} mm", self.status(), mm(contact.position.x_m));
        if let Some((low, high)) = self.x_95() {
            text += &format!(" ({}–{})", mm(low), mm(high));
        }
        if let Some(y_m) = self.y() {
            text += &format!(", y = {} mm", mm(y_m));
            if let Some((low, high)) = self.y_95() {
                text += &format!(" ({}–{})", mm(low), mm(high));
            }
        }
        if let Some(force_n) = contact.force_n {
            text += &format!(", {force_n:.3} N");
        }
        text + ">"
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let other = other.get();
            self.inner.contact == other.inner.contact && self.inner.status == other.inner.status
        })
    }

    /// Pickled as the only row of `Estimates`.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (py, own) = (slf.py(), slf.get());
        let alone = Estimates::filled(py, 1, own.extent, |mut rows| {
            rows.set(0, &own.inner);
            Ok(rows)
        })?;
        let row = py.import("operator")?.getattr("getitem")?;
        Ok((row, (Py::new(py, alone)?, 0).into_pyobject(py)?.into_any()))
    }
}

fn contact_dict<'py>(
    py: Python<'py>,
    contact: &ContactEstimate,
    extent: Extent,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("x", contact.position.x_m)?;
    if let Some(y_m) = extent.if_plane(contact.position.y_m) {
        dict.set_item("y", y_m)?;
    }
    dict.set_item("force", contact.force_n)?;
    Ok(dict)
}

/// Rows of estimates in the columns' memory.
pub struct Rows<'a> {
    x_m: &'a mut [f64],
    y_m: &'a mut [f64],
    force_n: &'a mut [f64],
    x_95_m: &'a mut [f64],
    y_95_m: &'a mut [f64],
    covariance: &'a mut [f64],
    status: &'a mut [u8],
    /// Empty until a row has one.
    force_95_n: Vec<[f64; 2]>,
    /// Modes and further contacts, by row.
    several: Vec<(usize, estimator::Estimate)>,
}

/// Entries of a covariance on a line: xx, xf, ff.
const ON_LINE: [usize; 3] = [0, 2, 5];

const UNKNOWN: f64 = f64::NAN;

const NO_UNCERTAINTY: Uncertainty = Uncertainty {
    covariance: [UNKNOWN; 6],
    x_95_m: (UNKNOWN, UNKNOWN),
    y_95_m: (UNKNOWN, UNKNOWN),
    force_95_n: None,
};

impl Rows<'_> {
    pub fn set(&mut self, row: usize, estimate: &estimator::Estimate) {
        let contact = &estimate.contact;
        let uncertainty = contact.uncertainty.as_ref().unwrap_or(&NO_UNCERTAINTY);
        let pair = 2 * row..2 * row + 2;
        self.x_m[row] = contact.position.x_m;
        self.force_n[row] = contact.force_n.unwrap_or(UNKNOWN);
        self.x_95_m[pair.clone()].copy_from_slice(&<[f64; 2]>::from(uncertainty.x_95_m));
        let all = &uncertainty.covariance;
        match self.covariance.as_chunks_mut() {
            (rows, []) if self.y_m.is_empty() => rows[row] = ON_LINE.map(|i| all[i]),
            _ => self.covariance[6 * row..6 * row + 6].copy_from_slice(all),
        }
        self.status[row] = code(estimate.status);
        if let Some(y_m) = self.y_m.get_mut(row) {
            *y_m = contact.position.y_m;
            self.y_95_m[pair].copy_from_slice(&<[f64; 2]>::from(uncertainty.y_95_m));
        }
        if let Some(ends_n) = uncertainty.force_95_n {
            self.force_95_n.resize(self.x_m.len(), [UNKNOWN; 2]);
            self.force_95_n[row] = ends_n.into();
        }
        if !estimate.modes.as_slice().is_empty() || !estimate.further.as_slice().is_empty() {
            self.several.push((row, *estimate));
        }
    }
}

/// Row by row, for (x, y, force).
fn square([xx, xy, xf, yy, yf, ff]: [f64; 6]) -> [f64; 9] {
    [xx, xy, xf, xy, yy, yf, xf, yf, ff]
}

/// Six entries on a plane, those of [`ON_LINE`] on a line.
fn upper_triangle(row: ArrayView1<'_, f64>) -> [f64; 6] {
    match row.len() {
        6 => std::array::from_fn(|i| row[i]),
        _ => whole(std::array::from_fn(|i| row[i])),
    }
}

fn whole(on_line: [f64; 3]) -> [f64; 6] {
    let mut all = [if on_line[0].is_nan() { UNKNOWN } else { 0.0 }; 6];
    ON_LINE.into_iter().zip(on_line).for_each(|(i, entry)| all[i] = entry);
    all
}

/// Estimates of many readings, as columns.
///
/// Attributes
/// ----------
/// x, y : ndarray of float64
///     Positions in metres: of the shape (readings); `y` is None on a line.
/// force : ndarray of float64
///     Forces in newtons, NaN where neither known nor estimated: of the shape (readings).
/// x_95, y_95, force_95 : ndarray of float64
///     Ends of the 95 % intervals: of the shape (readings, 2); NaN for a method without them, and of a force that is known.
/// status : ndarray of str
///     "located", "no_contact", "ambiguous", "outside_model" or "outside_surface": of the shape (readings).
#[pyclass(frozen, module = "palpate")]
pub struct Estimates {
    x: Py<PyArray1<f64>>,
    y: Option<Py<PyArray1<f64>>>,
    force: Py<PyArray1<f64>>,
    x_95: Py<PyArray2<f64>>,
    y_95: Option<Py<PyArray2<f64>>>,
    /// Ends of the forces' intervals where force and place trade off; NaN elsewhere.
    trade_off_95: Py<PyArray2<f64>>,
    /// All six entries on a plane, those of [`ON_LINE`] on a line.
    covariance: Py<PyArray2<f64>>,
    status: Py<PyArray1<u8>>,
    several: Vec<(usize, estimator::Estimate)>,
    extent: Extent,
}

impl Estimates {
    /// Estimates of `rows` readings, which `fill` sets.
    ///
    /// NumPy's memory has large pages, which halves the time of the first write.
    pub fn filled(
        py: Python<'_>,
        rows: usize,
        extent: Extent,
        fill: impl FnOnce(Rows<'_>) -> PyResult<Rows<'_>>,
    ) -> PyResult<Self> {
        let empty = |shape: &[usize]| py.import("numpy")?.call_method1("empty", (shape.to_vec(),));
        let column = || Ok::<_, PyErr>(empty(&[rows])?.cast_into::<PyArray1<f64>>()?);
        let table = |width: usize| Ok::<_, PyErr>(empty(&[rows, width])?.cast_into::<PyArray2<f64>>()?);
        let plane = extent.width_m().is_some();
        let (x, force, x_95, covariance) =
            (column()?, column()?, table(2)?, table(if plane { 6 } else { ON_LINE.len() })?);
        let (y, y_95) = (plane.then(column).transpose()?, plane.then(|| table(2)).transpose()?);
        let status = PyArray1::<u8>::zeros(py, rows, false);
        let (force_95_n, mut several) = {
            let (mut y, mut y_95) = (y.as_ref().map(|y| y.readwrite()), y_95.as_ref().map(|y| y.readwrite()));
            fill(Rows {
                x_m: x.readwrite().as_slice_mut()?,
                y_m: y.as_mut().map_or(Ok(&mut [][..]), |y| y.as_slice_mut())?,
                force_n: force.readwrite().as_slice_mut()?,
                x_95_m: x_95.readwrite().as_slice_mut()?,
                y_95_m: y_95.as_mut().map_or(Ok(&mut [][..]), |y| y.as_slice_mut())?,
                covariance: covariance.readwrite().as_slice_mut()?,
                status: status.readwrite().as_slice_mut()?,
                force_95_n: Vec::new(),
                several: Vec::new(),
            })
            .map(|filled| (filled.force_95_n, filled.several))?
        };
        several.sort_by_key(|(row, _)| *row);
        let force_95 = match force_95_n.is_empty() {
            // One number for all rows, which takes no memory.
            true => py.import("numpy")?.call_method1("broadcast_to", (UNKNOWN, (rows, 2)))?.cast_into()?,
            false => PyArray1::from_vec(py, force_95_n.into_flattened()).reshape([rows, 2])?,
        };
        Ok(Self {
            x: x.unbind(),
            y: y.map(Bound::unbind),
            force: force.unbind(),
            x_95: x_95.unbind(),
            y_95: y_95.map(Bound::unbind),
            trade_off_95: force_95.unbind(),
            covariance: covariance.unbind(),
            status: status.unbind(),
            several,
            extent,
        })
    }
}

#[pymethods]
impl Estimates {
    /// Positions along the surface, in metres: of the shape (readings).
    #[getter]
    fn x(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.x.clone_ref(py)
    }

    /// Positions across a plane, in metres: of the shape (readings); None on a line.
    #[getter]
    fn y(&self, py: Python<'_>) -> Option<Py<PyArray1<f64>>> {
        self.y.as_ref().map(|y| y.clone_ref(py))
    }

    /// Forces in newtons, positive downward, NaN where neither known nor estimated: of the shape (readings).
    #[getter]
    fn force(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.force.clone_ref(py)
    }

    /// Ends of the 95 % intervals along the surface, in metres, NaN for a method without them: of the shape (readings, 2).
    #[getter]
    fn x_95(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        self.x_95.clone_ref(py)
    }

    /// Ends of the 95 % intervals across a plane, in metres: of the shape (readings, 2); None on a line.
    #[getter]
    fn y_95(&self, py: Python<'_>) -> Option<Py<PyArray2<f64>>> {
        self.y_95.as_ref().map(|y_95| y_95.clone_ref(py))
    }

    /// Ends of the 95 % intervals of the forces in newtons, NaN where the force is known or not estimated: of the shape (readings, 2).
    #[getter]
    fn force_95(&self, py: Python<'_>) -> PyResult<Py<PyArray2<f64>>> {
        let (own, force) = (self.trade_off_95.bind(py).readonly(), self.force.bind(py).readonly());
        let covariance = self.covariance.bind(py).readonly();
        let (own, forces, variances) = (own.as_array(), force.as_array(), covariance.as_array());
        let rows = own.outer_iter().zip(forces.iter()).zip(variances.outer_iter());
        let ends: Vec<[f64; 2]> = rows
            .map(|((own, force_n), variances)| {
                // The variance of the force is the last entry, on a line and on a plane.
                let sd_n = variances[variances.len() - 1].sqrt();
                match (own[0].is_nan(), sd_n > 0.0 && sd_n.is_finite() && !force_n.is_nan()) {
                    (false, _) => [own[0], own[1]],
                    (true, true) => force_interval_95_n(*force_n, sd_n).into(),
                    (true, false) => [UNKNOWN; 2],
                }
            })
            .collect();
        Ok(PyArray1::from_vec(py, ends.into_flattened()).reshape([forces.len(), 2])?.unbind())
    }

    /// Covariances of (x, y, force), in m², m·N and N²: of the shape (readings, 3, 3). What is not estimated has zeros; NaN for a method without them.
    #[getter]
    fn covariance(&self, py: Python<'_>) -> PyResult<Py<PyArray3<f64>>> {
        let entries = self.covariance.bind(py).readonly();
        let rows: Vec<[f64; 9]> =
            entries.as_array().outer_iter().map(|row| square(upper_triangle(row))).collect();
        let count = rows.len();
        Ok(PyArray1::from_vec(py, rows.into_flattened()).reshape([count, 3, 3])?.unbind())
    }

    /// Statuses: of the shape (readings).
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let names = py.import("numpy")?.call_method1("array", (STATUSES.map(Status::name).to_vec(),))?;
        names.get_item(self.status.bind(py))
    }

    /// Places beside the first that explain a reading, by the index of the reading: dicts of "x", "y", "force" and "probability".
    #[getter]
    fn modes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.of_few(py, |estimate| estimate.modes(py))
    }

    /// Contacts beside the first that touch at the same time, by the index of the reading: dicts of "x", "y" and "force".
    #[getter]
    fn further<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.of_few(py, |estimate| estimate.further(py))
    }

    /// The estimates as a structured array, a field for each column.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     Of the shape (readings), with the fields "x", "y" (on a plane), "force", "x_95", "y_95" (on a plane), "force_95", "status".
    fn to_numpy<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._frames")?.call_method1("structured", (slf,))
    }

    /// The estimates as a data frame, in mm and N, with units in the names of its columns.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame
    fn to_frame<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._frames")?.call_method1("estimates", (slf,))
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        use numpy::PyUntypedArrayMethods;
        self.x.bind(py).len()
    }

    fn __getitem__(&self, py: Python<'_>, index: isize) -> PyResult<Estimate> {
        let count = self.__len__(py);
        let at = usize::try_from(if index < 0 { index + count as isize } else { index });
        let at = at.ok().filter(|at| *at < count);
        let at = at.ok_or_else(|| PyIndexError::new_err(format!("estimate {index} of {count}")))?;
        self.row(py, at)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let status = self.status.bind(py).readonly();
        let codes = status.as_slice()?;
        let counted = STATUSES.iter().filter_map(|status| {
            let count = codes.iter().filter(|found| **found == code(*status)).count();
            (count > 0).then(|| format!("{count} {}", status.name()))
        });
        Ok(format!("<Estimates: {} readings; {}>", codes.len(), counted.collect::<Vec<_>>().join(", ")))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._html")?.call_method1("estimates", (slf,))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let py = slf.py();
        let own = slf.get();
        let columns = own.columns(py);
        let several: Vec<PackedSeveral> = own.several.iter().map(packed).collect();
        let extent = (own.extent.length_m(), own.extent.width_m());
        let rebuild = py.import("palpate._palpate")?.getattr("Estimates")?.getattr("_from_columns")?;
        Ok((rebuild, (columns, several, extent).into_pyobject(py)?.into_any()))
    }

    #[staticmethod]
    fn _from_columns(
        columns: Columns,
        several: Vec<PackedSeveral>,
        size_m: (f64, Option<f64>),
    ) -> PyResult<Self> {
        let (x, y, force, x_95, y_95, trade_off_95, covariance, status) = columns;
        let extent = Extent::new(size_m.0, size_m.1).map_err(refused)?;
        let several = several.into_iter().map(unpacked).collect::<PyResult<_>>()?;
        Ok(Self { x, y, force, x_95, y_95, trade_off_95, covariance, status, several, extent })
    }
}

/// x, y, force, x_95, y_95, force_95, covariance, codes of the statuses.
type Columns = (
    Py<PyArray1<f64>>,
    Option<Py<PyArray1<f64>>>,
    Py<PyArray1<f64>>,
    Py<PyArray2<f64>>,
    Option<Py<PyArray2<f64>>>,
    Py<PyArray2<f64>>,
    Py<PyArray2<f64>>,
    Py<PyArray1<u8>>,
);

/// x, y, force, covariance and intervals of x, y and force.
type PackedContact = (f64, f64, Option<f64>, Option<([f64; 6], [f64; 2], [f64; 2], Option<[f64; 2]>)>);

/// Row, status code, contact, modes with probabilities, further contacts.
type PackedSeveral = (usize, u8, PackedContact, Vec<(PackedContact, f64)>, Vec<PackedContact>);

fn packed((row, estimate): &(usize, estimator::Estimate)) -> PackedSeveral {
    let contact = |contact: &ContactEstimate| {
        let uncertainty = contact.uncertainty.map(|uncertainty| {
            let force_95 = uncertainty.force_95_n.map(<[f64; 2]>::from);
            (uncertainty.covariance, uncertainty.x_95_m.into(), uncertainty.y_95_m.into(), force_95)
        });
        (contact.position.x_m, contact.position.y_m, contact.force_n, uncertainty)
    };
    let modes = estimate.modes.as_slice().iter().map(|mode| (contact(&mode.contact), mode.probability));
    let further = estimate.further.as_slice().iter().map(contact);
    (*row, code(estimate.status), contact(&estimate.contact), modes.collect(), further.collect())
}

fn unpacked((row, code, first, modes, further): PackedSeveral) -> PyResult<(usize, estimator::Estimate)> {
    let contact = |(x_m, y_m, force_n, uncertainty): PackedContact| ContactEstimate {
        position: Position { x_m, y_m },
        force_n,
        uncertainty: uncertainty.map(|(covariance, x_95, y_95, force_95)| Uncertainty {
            covariance,
            x_95_m: x_95.into(),
            y_95_m: y_95.into(),
            force_95_n: force_95.map(Into::into),
        }),
    };
    let status = STATUSES.get(usize::from(code)).copied();
    let status = status.ok_or_else(|| refused(format!("{code} is the code of no status")))?;
    let mut estimate = estimator::Estimate::of_contact(contact(first), status);
    for (mode, probability) in modes {
        estimate.modes.push(Mode { contact: contact(mode), probability });
    }
    for further in further {
        estimate.further.push(contact(further));
    }
    Ok((row, estimate))
}

impl Estimates {
    fn columns(&self, py: Python<'_>) -> Columns {
        let status = self.status.clone_ref(py);
        (
            self.x(py),
            self.y(py),
            self.force(py),
            self.x_95(py),
            self.y_95(py),
            self.trade_off_95.clone_ref(py),
            self.covariance.clone_ref(py),
            status,
        )
    }

    fn row(&self, py: Python<'_>, at: usize) -> PyResult<Estimate> {
        if let Ok(index) = self.several.binary_search_by_key(&at, |(row, _)| *row) {
            return Ok(Estimate::new(self.several[index].1, self.extent));
        }
        let number = |column: &Py<PyArray1<f64>>| column.bind(py).readonly().as_array()[at];
        let ends = |column: &Py<PyArray2<f64>>| {
            let column = column.bind(py).readonly();
            let row = column.as_array();
            (row[[at, 0]], row[[at, 1]])
        };
        let covariance = self.covariance.bind(py).readonly();
        let covariance = upper_triangle(covariance.as_array().row(at));
        let force_n = Some(number(&self.force)).filter(|force_n| !force_n.is_nan());
        let force_95_n = Some(ends(&self.trade_off_95)).filter(|(low_n, _)| !low_n.is_nan());
        let y_95_m = self.y_95.as_ref().map_or((0.0, 0.0), ends);
        let uncertainty = Uncertainty { covariance, x_95_m: ends(&self.x_95), y_95_m, force_95_n };
        let position = Position { x_m: number(&self.x), y_m: self.y.as_ref().map_or(0.0, number) };
        let uncertainty = Some(uncertainty).filter(|uncertainty| !uncertainty.x_95_m.0.is_nan());
        let contact = ContactEstimate { position, force_n, uncertainty };
        let status = STATUSES[usize::from(self.status.bind(py).readonly().as_array()[at])];
        Ok(Estimate::new(estimator::Estimate::of_contact(contact, status), self.extent))
    }

    fn of_few<'py>(
        &self,
        py: Python<'py>,
        list: impl Fn(&Estimate) -> PyResult<Bound<'py, PyList>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (row, estimate) in &self.several {
            let items = list(&Estimate::new(*estimate, self.extent))?;
            if !items.is_empty() {
                dict.set_item(row, items)?;
            }
        }
        Ok(dict)
    }
}

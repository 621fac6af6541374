//! Setups.

use std::io::Read;

use serde::{Deserialize, Serialize};

use crate::arrangement::inner_grid;
use crate::force_prior::ForceRange;
use crate::imperfections::Imperfections;
use crate::recording::{self, Columns, CsvError, Recording, Schema};
use palpate_mechanics::contact::{OffSurface, Position};
use palpate_mechanics::limit::{CramerRaoBound, Force, LimitError};
use palpate_mechanics::sensing::{
    Layout, LayoutError, Placement, Sensor, SensorGroup, SensorKind, even_positions,
};
use palpate_mechanics::surface::{Extent, InsensitiveSensor, SurfaceSpec};
use palpate_mechanics::units::Quantity;
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::Watch;

/// Surface with sensors, and the known contact force or bound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SetupFields")]
pub struct Setup {
    surface: SurfaceSpec,
    layout: Layout,
    force_n: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    greatest_force_n: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_range: Option<ForceRange>,
    columns: Option<Columns>,
    #[serde(skip_serializing_if = "Option::is_none")]
    imperfections: Option<Imperfections>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename = "Setup")]
struct SetupFields {
    surface: SurfaceSpec,
    layout: Layout,
    force_n: Option<f64>,
    #[serde(default)]
    greatest_force_n: Option<f64>,
    #[serde(default)]
    force_range: Option<ForceRange>,
    columns: Option<Columns>,
    #[serde(default)]
    imperfections: Option<Imperfections>,
}

impl TryFrom<SetupFields> for Setup {
    type Error = SetupError;

    fn try_from(fields: SetupFields) -> Result<Self, SetupError> {
        let SetupFields { surface, layout, force_n, greatest_force_n, force_range, columns, imperfections } =
            fields;
        let setup = Self { columns, force_range, ..Self::new(surface) };
        let setup = setup.with_layout(layout)?.with_force(force_n)?.with_greatest_force(greatest_force_n)?;
        match imperfections {
            Some(imperfections) => setup.with_imperfections(imperfections),
            None => Ok(setup),
        }
    }
}

/// Unsuitable sensor or force.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// Sensor off the surface.
    #[error(transparent)]
    OffSurface(#[from] OffSurface),
    /// Reaction sensor without a support.
    #[error("reaction sensor {number} is at {}, where no support takes up force", extent.place_in_words(*position))]
    NoSupport {
        /// Index in its group, from 1.
        number: usize,
        /// Position.
        position: Position,
        /// Surface.
        extent: Extent,
    },
    /// Sensor that is insensitive to all contacts.
    #[error(
        "{kind} sensor {number} is at {} and would always read 0: {reason}",
        extent.place_in_words(*position)
    )]
    Insensitive {
        /// Index in its group, from 1.
        number: usize,
        /// Quantity.
        kind: SensorKind,
        /// Position.
        position: Position,
        /// Surface.
        extent: Extent,
        /// Reason.
        reason: InsensitiveSensor,
    },
    /// Digit sensor other than a strain gauge.
    #[error("a digit is read by strain gauges, not by {kind} sensors")]
    NotAGauge {
        /// Quantity.
        kind: SensorKind,
    },
    /// Raw channel on a surface with a model.
    #[error("a raw channel has no model; only a measured surface has raw channels")]
    RawOnModel,
    /// Grid of sensors on a line.
    #[error("a grid of sensors needs a plane; this surface is a line")]
    GridOnLine,
    /// Evenly spaced sensors on a plane.
    #[error("{count} sensors along a length do not define positions on a plane; place them by a grid")]
    EvenlyOnPlane {
        /// Number of sensors.
        count: usize,
    },
    /// Group without sensors.
    #[error("a group of 0 sensors; at least 1 is needed")]
    NoSensors,
    /// Noise in a unit of no sensor.
    #[error("noise of {noise}: no sensor measures in this unit")]
    NoSensorOfUnit {
        /// Noise.
        noise: Quantity,
    },
    /// Soft layer on a digit.
    #[error("a soft layer spreads a touch over several points; a digit bends too far for readings to add up")]
    SoftLayerOnDigit,
    /// Invalid layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// Number out of range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
}

fn check_sensor(
    surface: &SurfaceSpec,
    kind: SensorKind,
    number: usize,
    position: Position,
) -> Result<(), SetupError> {
    let extent = surface.extent();
    if kind != SensorKind::Strain && matches!(surface, SurfaceSpec::Digit(_)) {
        return Err(SetupError::NotAGauge { kind });
    }
    if !extent.contains(position) {
        return Err(OffSurface { object: "sensor", number, position, extent }.into());
    }
    let Some(model) = surface.model() else { return Ok(()) };
    if kind == SensorKind::Raw {
        return Err(SetupError::RawOnModel);
    }
    if kind == SensorKind::Reaction && !model.is_supported_at(position) {
        return Err(SetupError::NoSupport { number, position, extent });
    }
    match model.insensitive_sensor(kind, position) {
        Some(reason) => Err(SetupError::Insensitive { number, kind, position, extent, reason }),
        None => Ok(()),
    }
}

impl Setup {
    /// Returns a surface without sensors.
    ///
    /// ```
    /// use palpate_estimators::setup::Setup;
    /// use palpate_mechanics::sensing::SensorKind::Deflection;
    /// use palpate_mechanics::surface::Beam;
    /// use palpate_mechanics::units::{gpa, mm, newtons, um};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    /// assert_eq!(setup.layout().len(), 8);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(surface: impl Into<SurfaceSpec>) -> Self {
        Self {
            surface: surface.into(),
            layout: Layout::default(),
            force_n: None,
            greatest_force_n: None,
            force_range: None,
            columns: None,
            imperfections: None,
        }
    }

    /// Returns a line without a model, with raw channels.
    ///
    /// ```
    /// use palpate_estimators::recording::Columns;
    /// use palpate_estimators::setup::Setup;
    /// use palpate_mechanics::units::mm;
    ///
    /// let columns = Columns::along("X", ["Pl", "Pr"]).force("F");
    /// let setup = Setup::measured(mm(100.0), &["Pl", "Pr"])?.recorded_as(columns);
    /// let file = "X,F,Pl,Pr\n10,1.5,0.9,0.2\n90,1.5,0.1,0.8\n";
    /// let recording = setup.read_recording("presses.csv", file.as_bytes())?;
    /// assert_eq!((recording.rows[1].position.x_m, recording.rows[1].reading[1]), (mm(90.0), 0.8));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SetupError`] without channels or length.
    pub fn measured(length_m: f64, channels: &[&str]) -> Result<Self, SetupError> {
        Self::of_extent(Extent::line(length_m)?, channels)
    }

    /// Returns a plane without a model; see [`Setup::measured`].
    ///
    /// # Errors
    /// [`SetupError`] without channels, length or width.
    pub fn measured_plane(length_m: f64, width_m: f64, channels: &[&str]) -> Result<Self, SetupError> {
        Self::of_extent(Extent::plane(length_m, width_m)?, channels)
    }

    fn of_extent(extent: Extent, channels: &[&str]) -> Result<Self, SetupError> {
        let positions = vec![Position::default(); channels.len()];
        let mut setup = Self::new(extent).sensors(SensorKind::Raw.at_positions(positions))?;
        setup.edit_sensors(|sensors| {
            sensors.iter_mut().zip(channels).for_each(|(sensor, name)| (*name).clone_into(&mut sensor.name));
        })?;
        Ok(setup)
    }

    /// Surface.
    pub fn surface(&self) -> &SurfaceSpec {
        &self.surface
    }

    /// Sensors, one per channel.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Known force of contacts.
    pub fn force_n(&self) -> Option<f64> {
        self.force_n
    }

    /// Stated upper bound of an unknown force.
    pub fn greatest_force_n(&self) -> Option<f64> {
        self.force_range.map(|range| range.ends_n().1).or(self.greatest_force_n)
    }

    /// Stated range of an unknown force.
    pub fn force_range(&self) -> Option<ForceRange> {
        self.force_range
    }

    /// Column roles; `None` for palpate's own columns.
    pub fn columns(&self) -> Option<&Columns> {
        self.columns.as_ref()
    }

    /// Adds sensors, numbered by kind: "deflection_1", "strain_1".
    ///
    /// # Errors
    /// [`SetupError`] for an unsuitable sensor.
    pub fn sensors(mut self, group: SensorGroup) -> Result<Self, SetupError> {
        let SensorGroup { kind, placement, channel } = group;
        channel.check()?;
        let positions = positions_of(placement, self.surface.extent())?;
        let before = self.layout.kinds().into_iter().filter(|of| *of == kind).count();
        let mut sensors = self.layout.into_sensors();
        for (i, position) in positions.into_iter().enumerate() {
            check_sensor(&self.surface, kind, i + 1, position)?;
            let name = format!("{kind}_{}", before + i + 1);
            sensors.push(Sensor { kind, position, name, channel });
        }
        self.layout = Layout::new(sensors)?;
        Ok(self)
    }

    /// Replaces the sensors, including insensitive ones.
    ///
    /// # Errors
    /// [`OffSurface`].
    pub fn with_layout(self, layout: Layout) -> Result<Self, OffSurface> {
        self.check_places(&layout)?;
        Ok(Self { layout, ..self })
    }

    /// Changes the sensors, unless refused.
    ///
    /// # Errors
    /// [`SetupError`] for an unsuitable sensor.
    pub fn edit_sensors(&mut self, edit: impl FnOnce(&mut Vec<Sensor>)) -> Result<(), SetupError> {
        let mut layout = self.layout.clone();
        layout.edit(edit)?;
        self.check_places(&layout)?;
        self.layout = layout;
        Ok(())
    }

    /// Sets the noise of sensors with the unit of `noise`.
    ///
    /// ```
    /// use palpate_estimators::setup::Setup;
    /// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, um}};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?;
    /// let quieter = setup.with_noise("1 um".parse()?)?;
    /// assert_eq!(quieter.layout().sensors()[7].channel.noise_sd, um(1.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SetupError`] without such a sensor, or below 0.
    pub fn with_noise(mut self, noise: Quantity) -> Result<Self, SetupError> {
        let meant = |sensor: &Sensor| sensor.kind.dimension() == noise.dimension;
        if !self.layout.sensors().iter().any(meant) {
            return Err(SetupError::NoSensorOfUnit { noise });
        }
        self.edit_sensors(|sensors| {
            let meant = sensors.iter_mut().filter(|sensor| meant(sensor));
            meant.for_each(|sensor| sensor.channel.noise_sd = noise.value);
        })?;
        Ok(self)
    }

    fn check_places(&self, layout: &Layout) -> Result<(), OffSurface> {
        let positions: Vec<_> = layout.sensors().iter().map(|sensor| sensor.position).collect();
        OffSurface::check("sensor", &positions, self.surface.extent())
    }

    /// Disables or enables a channel; see [`Layout::set_disabled`].
    pub fn set_disabled(&mut self, channel: usize, dead: bool) {
        self.layout.set_disabled(channel, dead);
    }

    /// Sets the known force.
    ///
    /// # Errors
    /// [`SetupError::OutOfRange`] unless positive and finite.
    pub fn known_force(self, force_n: f64) -> Result<Self, SetupError> {
        Ok(self.with_force(Some(force_n))?)
    }

    /// Makes the force unknown.
    #[must_use]
    pub fn unknown_force(self) -> Self {
        Self { force_n: None, ..self }
    }

    /// Sets the force; `None` for unknown.
    ///
    /// # Errors
    /// [`OutOfRange`] unless positive and finite.
    pub fn with_force(self, force_n: Option<f64>) -> Result<Self, OutOfRange> {
        OutOfRange::check_positive(force_n.map(|force_n| ("the force in newtons", force_n)))?;
        Ok(Self { force_n, ..self })
    }

    /// Sets the upper bound of an unknown force; `None` for the calibration's.
    ///
    /// # Errors
    /// [`OutOfRange`] unless positive and finite.
    pub fn with_greatest_force(self, greatest_force_n: Option<f64>) -> Result<Self, OutOfRange> {
        let named = greatest_force_n.map(|force_n| ("the greatest force in newtons", force_n));
        OutOfRange::check_positive(named)?;
        Ok(Self { greatest_force_n, ..self })
    }

    /// Sets the imperfections of simulations.
    ///
    /// # Errors
    /// [`SetupError`] for a number out of range or a digit's soft layer.
    pub fn with_imperfections(self, imperfections: Imperfections) -> Result<Self, SetupError> {
        imperfections.check(self.surface.extent())?;
        if imperfections.touch_width_m > 0.0 && matches!(self.surface, SurfaceSpec::Digit(_)) {
            return Err(SetupError::SoftLayerOnDigit);
        }
        Ok(Self { imperfections: Some(imperfections), ..self })
    }

    /// Removes the imperfections.
    #[must_use]
    pub fn without_imperfections(self) -> Self {
        Self { imperfections: None, ..self }
    }

    /// Imperfections of simulations.
    pub fn imperfections(&self) -> Option<&Imperfections> {
        self.imperfections.as_ref()
    }

    /// Sets the range of an unknown force; `None` for the calibration's.
    #[must_use]
    pub fn with_force_range(self, force_range: Option<ForceRange>) -> Self {
        Self { force_range, ..self }
    }

    /// Force or its bounds.
    pub fn force(&self) -> Force {
        if self.force_n.is_some() { Force::Known } else { Force::Unknown }
    }

    /// Sets the columns of recordings.
    #[must_use]
    pub fn recorded_as(self, columns: Columns) -> Self {
        Self { columns: Some(columns), ..self }
    }

    /// Cramér–Rao bound.
    ///
    /// # Errors
    /// [`LimitError`] without a model, noise or enabled sensors.
    pub fn cramer_rao_bound(&self) -> Result<CramerRaoBound<'_>, LimitError> {
        self.cramer_rao_bound_watched(Watch::NONE)
    }

    /// [`Setup::cramer_rao_bound`], watched.
    ///
    /// # Errors
    /// As there, and [`LimitError::Cancelled`].
    pub fn cramer_rao_bound_watched(&self, watch: Watch) -> Result<CramerRaoBound<'_>, LimitError> {
        let model = self.surface.model().ok_or(LimitError::NoModel)?;
        CramerRaoBound::new_watched(model, &self.layout, watch)
    }

    /// Column roles, by default those of palpate.
    pub fn recording_columns(&self) -> Columns {
        match &self.columns {
            Some(columns) => columns.clone(),
            None => Columns::own(&self.layout.names(), &self.layout.kinds(), self.surface.extent()),
        }
    }

    /// Reads a recording, by default with the setup's force; see [`recording::read`].
    ///
    /// # Errors
    /// [`CsvError`].
    pub fn read_recording(&self, source: &str, bytes: impl Read) -> Result<Recording, CsvError> {
        recording::read(source, bytes, &self.schema(&self.recording_columns()))
    }

    /// Reads a recording from two files; see [`recording::read_pair`].
    ///
    /// # Errors
    /// [`CsvError`].
    pub fn read_recording_pair(
        &self,
        readings: (&str, impl Read),
        contacts: (&str, impl Read),
    ) -> Result<Recording, CsvError> {
        recording::read_pair(readings, contacts, &self.schema(&self.recording_columns()))
    }

    /// Returns the schema of a recording.
    pub fn schema<'a>(&'a self, columns: &'a Columns) -> Schema<'a> {
        let extent = self.surface.extent();
        Schema { columns, layout: &self.layout, extent, known_force_n: self.force_n }
    }
}

fn positions_of(placement: Placement, extent: Extent) -> Result<Vec<Position>, SetupError> {
    let positions = match (placement, extent) {
        (Placement::Evenly(count), Extent::Line { .. }) => even_positions(count, extent.length_m()).collect(),
        (Placement::Evenly(count), Extent::Plane { .. }) => return Err(SetupError::EvenlyOnPlane { count }),
        (Placement::Grid(columns, rows), Extent::Plane { .. }) => inner_grid(extent, columns, rows),
        (Placement::Grid(..), Extent::Line { .. }) => return Err(SetupError::GridOnLine),
        (Placement::At(positions), _) => positions,
    };
    if positions.is_empty() { Err(SetupError::NoSensors) } else { Ok(positions) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures;

    #[test]
    fn bad_sensors_and_forces_are_refused_from_callers_and_from_files() {
        let good = fixtures::paper(5e-6, 1).setup;
        let text = serde_json::to_string(&good).unwrap();
        assert_eq!(serde_json::from_str::<Setup>(&text).unwrap(), good);
        let read = |text: &str| serde_json::from_str::<Setup>(text).unwrap_err().to_string();

        for force_n in [0.0, -3.0, f64::NAN, f64::INFINITY] {
            let refused = good.clone().with_force(Some(force_n)).unwrap_err().to_string();
            let message = format!("the force in newtons is {force_n}; it must be greater than 0 and finite");
            assert_eq!(refused, message);
            let refused = good.clone().with_greatest_force(Some(force_n)).unwrap_err().to_string();
            assert_eq!(refused, message.replace("the force", "the greatest force"));
        }
        let bounded = good.clone().unknown_force().with_greatest_force(Some(20.0)).unwrap();
        let text_of_bounded = serde_json::to_string(&bounded).unwrap();
        assert_eq!(serde_json::from_str::<Setup>(&text_of_bounded).unwrap(), bounded);
        let damaged = text_of_bounded.replace(r#""greatest_force_n":20.0"#, r#""greatest_force_n":0.0"#);
        assert!(read(&damaged).starts_with("the greatest force in newtons is 0;"), "{}", read(&damaged));
        let damaged = text.replace(r#""force_n":3.0"#, r#""force_n":-3.0"#);
        assert!(
            read(&damaged).starts_with("the force in newtons is -3; it must be greater than 0 and finite")
        );

        let message = "sensor 2 is at 500 mm, off the surface; it must be within 0 and 400 mm";
        let mut layout = good.layout().clone();
        layout.edit(|sensors| sensors[1].position.x_m = 0.5).unwrap();
        let mut setup = good.clone();
        let refused = setup.edit_sensors(|sensors| sensors[1].position.x_m = 0.5).unwrap_err();
        assert_eq!((refused.to_string().as_str(), &setup), (message, &good));
        let damaged = text.replace(
            &serde_json::to_string(good.layout()).unwrap(),
            &serde_json::to_string(&layout).unwrap(),
        );
        assert!(read(&damaged).starts_with(message));
        assert_eq!(good.with_layout(layout).unwrap_err().to_string(), message);
    }

    #[test]
    fn a_measured_surface_has_a_length() {
        for length_m in [0.0, -0.1, f64::NAN] {
            let refused = Setup::measured(length_m, &["a", "b"]).unwrap_err();
            assert!(matches!(refused, SetupError::OutOfRange(_)), "{refused}");
        }
    }
}

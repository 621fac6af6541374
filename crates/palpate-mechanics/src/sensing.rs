//! Sensors, their layout and channel errors.

use std::fmt;

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::contact::{Extent, Position};
use crate::units::{Dimension, Unit};
use palpate_numerics::OutOfRange;

/// Quantity that a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorKind {
    /// Displacement normal to the surface, positive upward, in metres.
    Deflection,
    /// Derivative of the deflection along the length, in radians.
    Slope,
    /// Strain along the lower face, positive in tension.
    Strain,
    /// Force of a support on the surface, positive upward, in newtons.
    Reaction,
    /// A channel without a model.
    Raw,
}

impl SensorKind {
    /// All kinds, as declared.
    pub const ALL: [Self; 5] = [Self::Deflection, Self::Slope, Self::Strain, Self::Reaction, Self::Raw];

    /// Name in a rig.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Deflection => "deflection",
            Self::Slope => "slope",
            Self::Strain => "strain",
            Self::Reaction => "reaction",
            Self::Raw => "raw",
        }
    }

    /// Dimension of the readings.
    pub const fn dimension(self) -> Dimension {
        match self {
            Self::Deflection => Dimension::Length,
            Self::Slope => Dimension::Angle,
            Self::Strain => Dimension::Strain,
            Self::Reaction => Dimension::Force,
            Self::Raw => Dimension::None,
        }
    }

    /// Unit in recordings.
    pub fn unit(self) -> Unit {
        let symbol = match self {
            Self::Deflection => "mm",
            Self::Slope => "mrad",
            Self::Strain => "ue",
            Self::Reaction => "N",
            Self::Raw => "",
        };
        Unit::from_symbol(symbol).unwrap_or(Unit::NONE)
    }
}

impl fmt::Display for SensorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A sensor, checked by [`Layout::new`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Measured quantity.
    pub kind: SensorKind,
    /// Position; unused for a raw channel.
    pub position: Position,
    /// Unique name.
    pub name: String,
    /// Errors of the channel.
    pub channel: ChannelModel,
}

/// Sensors of a surface, in the order of a reading.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "LayoutFields")]
pub struct Layout {
    sensors: Vec<Sensor>,
}

#[derive(Deserialize)]
struct LayoutFields {
    sensors: Vec<Sensor>,
}

/// A sensor value out of range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("sensor {number}: {fault}")]
pub struct LayoutError {
    /// Number of the sensor.
    pub number: usize,
    /// Value and bound.
    pub fault: OutOfRange,
}

impl TryFrom<LayoutFields> for Layout {
    type Error = LayoutError;

    fn try_from(unchecked: LayoutFields) -> Result<Self, LayoutError> {
        Self::new(unchecked.sensors)
    }
}

impl Layout {
    /// Creates a layout.
    ///
    /// # Errors
    /// [`LayoutError`] for the first fault.
    ///
    /// ```
    /// use palpate_mechanics::sensing::{Layout, SensorKind};
    ///
    /// let mut sensors = Layout::even(SensorKind::Deflection, 8, 0.4).into_sensors();
    /// sensors[2].channel.noise_sd = -5e-6;
    /// let refused = Layout::new(sensors).unwrap_err();
    /// assert_eq!(refused.to_string(), "sensor 3: the noise is -0.000005; it must be at least 0 and finite");
    /// ```
    pub fn new(sensors: Vec<Sensor>) -> Result<Self, LayoutError> {
        for (number, sensor) in (1..).zip(&sensors) {
            let Position { x_m, y_m } = sensor.position;
            let place = [("the position along x in metres", x_m), ("the position along y in metres", y_m)];
            let checked =
                sensor.channel.check().and_then(|()| OutOfRange::check("finite", place, f64::is_finite));
            checked.map_err(|fault| LayoutError { number, fault })?;
        }
        Ok(Self { sensors })
    }

    /// Returns `count` perfect sensors at the [`even_positions`], named "deflection_1" etc.
    pub fn even(kind: SensorKind, count: usize, length_m: f64) -> Self {
        let sensors = even_positions(count, length_m)
            .enumerate()
            .map(|(i, position)| Sensor {
                kind,
                position,
                name: format!("{kind}_{}", i + 1),
                channel: ChannelModel::default(),
            })
            .collect();
        Self { sensors }
    }

    /// The sensors.
    pub fn sensors(&self) -> &[Sensor] {
        &self.sensors
    }

    /// Returns the sensors.
    pub fn into_sensors(self) -> Vec<Sensor> {
        self.sensors
    }

    /// Changes the sensors.
    ///
    /// # Errors
    /// [`LayoutError`]; the layout is then unchanged.
    pub fn edit(&mut self, edit: impl FnOnce(&mut Vec<Sensor>)) -> Result<(), LayoutError> {
        let mut sensors = self.sensors.clone();
        edit(&mut sensors);
        *self = Self::new(sensors)?;
        Ok(())
    }

    /// Moves every sensor to a finite `position`.
    #[must_use]
    pub fn with_positions(mut self, mut position: impl FnMut(&Sensor) -> Position) -> Self {
        for sensor in &mut self.sensors {
            let at = position(sensor);
            if at.x_m.is_finite() && at.y_m.is_finite() {
                sensor.position = at;
            }
        }
        self
    }

    /// Disables or enables a sensor, by index.
    pub fn set_disabled(&mut self, sensor: usize, disabled: bool) {
        if let Some(sensor) = self.sensors.get_mut(sensor) {
            sensor.channel.disabled = disabled;
        }
    }

    /// Number of sensors.
    pub fn len(&self) -> usize {
        self.sensors.len()
    }

    /// True for a layout without sensors.
    pub fn is_empty(&self) -> bool {
        self.sensors.is_empty()
    }

    /// Formats the positions: "deflection 35, 40 mm; strain 200 mm".
    pub fn places_in_words(&self, extent: Extent) -> String {
        let of = |kind: SensorKind| {
            let sensors = self.sensors.iter().filter(|sensor| sensor.kind == kind);
            let positions: Vec<Position> = sensors.map(|sensor| sensor.position).collect();
            (!positions.is_empty()).then(|| format!("{kind} {}", extent.places_in_words(&positions)))
        };
        SensorKind::ALL.into_iter().filter_map(of).collect::<Vec<_>>().join("; ")
    }

    /// Kind of each sensor.
    pub fn kinds(&self) -> Vec<SensorKind> {
        self.sensors.iter().map(|sensor| sensor.kind).collect()
    }

    /// Name of each sensor.
    pub fn names(&self) -> Vec<String> {
        self.sensors.iter().map(|sensor| sensor.name.clone()).collect()
    }

    /// [`ChannelModel::reading_sd`] of each sensor; `None` if disabled.
    ///
    /// # Errors
    /// [`NoiseError`] for singular noise, or no active sensor.
    pub fn reading_sds(&self) -> Result<Vec<Option<f64>>, NoiseError> {
        let sds = self.sensors.iter().enumerate().map(|(i, sensor)| {
            let ChannelModel { noise_sd, resolution, disabled, .. } = sensor.channel;
            let sd = sensor.channel.reading_sd();
            if disabled {
                Ok(None)
            } else if sd > 0.0 && sd.is_finite() {
                Ok(Some(sd))
            } else {
                Err(NoiseError::Singular { number: i + 1, kind: sensor.kind, noise_sd, resolution })
            }
        });
        let sds = sds.collect::<Result<Vec<_>, _>>()?;
        let lives = sds.iter().any(Option::is_some);
        if lives { Ok(sds) } else { Err(NoiseError::AllDead { count: self.len() }) }
    }
}

/// Positions i·l/(count + 1) for i = 1…count.
pub fn even_positions(count: usize, length_m: f64) -> impl Iterator<Item = Position> {
    (1..=count).map(move |i| Position::along(i as f64 * length_m / (count + 1) as f64))
}

/// Sensors of one kind and channel model.
///
/// ```
/// use palpate_mechanics::sensing::SensorKind;
/// use palpate_mechanics::units::{mm, um};
///
/// let gauges = SensorKind::Strain.at_x([mm(4.0), mm(20.0), mm(40.0)]);
/// let deflections = SensorKind::Deflection.evenly(8).noise(um(5.0));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SensorGroup {
    /// Measured quantity.
    pub kind: SensorKind,
    /// Positions of the sensors.
    pub placement: Placement,
    /// Errors of each channel.
    pub channel: ChannelModel,
}

/// Positions of a group.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// At the [`even_positions`].
    Evenly(usize),
    /// Inner crossings of columns × rows: i·length/(columns + 1), j·width/(rows + 1).
    Grid(usize, usize),
    /// Given positions.
    At(Vec<Position>),
}

impl SensorKind {
    /// Places sensors at the [`even_positions`].
    pub fn evenly(self, count: usize) -> SensorGroup {
        self.placed(Placement::Evenly(count))
    }

    /// Places sensors as [`Placement::Grid`].
    pub fn grid(self, columns: usize, rows: usize) -> SensorGroup {
        self.placed(Placement::Grid(columns, rows))
    }

    /// Places sensors along the length, in metres.
    pub fn at_x(self, x_m: impl IntoIterator<Item = f64>) -> SensorGroup {
        self.placed(Placement::At(x_m.into_iter().map(Position::along).collect()))
    }

    /// Places sensors on a plane.
    pub fn at_positions(self, positions: impl IntoIterator<Item = Position>) -> SensorGroup {
        self.placed(Placement::At(positions.into_iter().collect()))
    }

    fn placed(self, placement: Placement) -> SensorGroup {
        SensorGroup { kind: self, placement, channel: ChannelModel::default() }
    }
}

impl SensorGroup {
    /// Sets the standard deviation of the noise.
    #[must_use]
    pub fn noise(mut self, sd: f64) -> Self {
        self.channel.noise_sd = sd;
        self
    }

    /// Sets the channel model.
    #[must_use]
    pub fn channel(mut self, channel: ChannelModel) -> Self {
        self.channel = channel;
        self
    }
}

/// Error model of one channel, in SI units.
///
/// saturate(quantise((1 + g)·value + o + noise)), or 0 if disabled.
///
/// ```
/// use palpate_mechanics::sensing::ChannelModel;
///
/// let channel = ChannelModel { noise_sd: 3e-6, resolution: 4e-6 * 12f64.sqrt(), ..ChannelModel::default() };
/// assert!((channel.reading_sd() - 5e-6).abs() < 1e-18); // quantisation is noise of variance q²/12
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChannelModel {
    /// Standard deviation of the noise; ≥ 0.
    pub noise_sd: f64,
    /// Quantisation step; 0 for none.
    pub resolution: f64,
    /// Bound of the uniform gain error g, within [0, 1).
    pub gain_error: f64,
    /// Bound of the uniform offset error o; ≥ 0.
    pub offset_error: f64,
    /// Bound of the uniform position error; ≥ 0.
    pub position_error_m: f64,
    /// Saturation limits.
    pub range: Option<(f64, f64)>,
    /// True for a disabled channel.
    #[serde(rename = "dead")]
    pub disabled: bool,
}

/// Errors of one simulated bench.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelErrors {
    /// g of each sensor.
    pub gains: Vec<f64>,
    /// o of each sensor.
    pub offsets: Vec<f64>,
}

impl ChannelErrors {
    /// Draws the errors.
    pub fn draw(layout: &Layout, rng: &mut impl Rng) -> Self {
        let mut errors = Self::none(layout);
        for (i, sensor) in layout.sensors.iter().enumerate() {
            errors.gains[i] = sensor.channel.gain_error * rng.random_range(-1.0..=1.0);
            errors.offsets[i] = sensor.channel.offset_error * rng.random_range(-1.0..=1.0);
        }
        errors
    }

    /// Returns zero errors.
    pub fn none(layout: &Layout) -> Self {
        Self { gains: vec![0.0; layout.len()], offsets: vec![0.0; layout.len()] }
    }
}

/// Returns readings at the true values `clean_reading`.
///
/// One random number per sensor: a fault of one channel leaves the others' noise unchanged.
pub fn measure(
    layout: &Layout,
    clean_reading: &[f64],
    errors: &ChannelErrors,
    rng: &mut impl Rng,
) -> Vec<f64> {
    let noise: Vec<f64> = layout.sensors.iter().map(|_| rng.sample(StandardNormal)).collect();
    measure_with_noise(layout, clean_reading, errors, &noise)
}

/// Returns readings with given noise of variance 1.
pub fn measure_with_noise(
    layout: &Layout,
    clean_reading: &[f64],
    errors: &ChannelErrors,
    noise: &[f64],
) -> Vec<f64> {
    let drawn = errors.gains.iter().zip(&errors.offsets).zip(noise);
    let channels = layout.sensors.iter().map(|sensor| &sensor.channel);
    channels
        .zip(clean_reading)
        .zip(drawn)
        .map(|((channel, value), ((gain, offset), noise))| {
            channel.report((1.0 + gain) * value + offset + channel.noise_sd * noise)
        })
        .collect()
}

impl ChannelModel {
    /// Checks all values.
    ///
    /// # Errors
    /// [`OutOfRange`] for the first fault.
    pub fn check(&self) -> Result<(), OutOfRange> {
        OutOfRange::check_not_negative([
            ("the noise", self.noise_sd),
            ("the resolution", self.resolution),
            ("the offset error", self.offset_error),
            ("the position error in metres", self.position_error_m),
        ])?;
        let gain = [("the gain error", self.gain_error)];
        OutOfRange::check("at least 0 and below 1", gain, |error| (0.0..1.0).contains(&error))?;
        let (low, high) = self.range.unwrap_or((0.0, 1.0));
        OutOfRange::check("finite", [("the upper end of the range", high)], f64::is_finite)?;
        let lower = [("the lower end of the range", low)];
        OutOfRange::check("finite and below the upper one", lower, |low| low.is_finite() && low < high)
    }

    /// √(σ² + q²/12), with noise σ and resolution q.
    pub fn reading_sd(&self) -> f64 {
        self.noise_sd.hypot(self.resolution / 12f64.sqrt())
    }

    fn report(&self, value: f64) -> f64 {
        if self.disabled {
            return 0.0;
        }
        let quantised =
            if self.resolution > 0.0 { (value / self.resolution).round() * self.resolution } else { value };
        match self.range {
            Some((low, high)) => quantised.max(low).min(high),
            None => quantised,
        }
    }
}

/// Error of a layout with singular noise.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoiseError {
    /// A sensor without noise and resolution.
    #[error(
        "sensor {number} ({kind}) has noise {noise_sd} and resolution {resolution}; one of them must be greater than 0, \
         otherwise its precision is unlimited"
    )]
    Singular {
        /// Number of the sensor.
        number: usize,
        /// Measured quantity.
        kind: SensorKind,
        /// Standard deviation of the noise.
        noise_sd: f64,
        /// Quantisation step.
        resolution: f64,
    },
    /// All channels are disabled.
    #[error("all {count} sensors are dead; at least 1 must be alive")]
    AllDead {
        /// Number of sensors.
        count: usize,
    },
}

impl NoiseError {
    /// Suggested remedy.
    pub const fn help(&self) -> &'static str {
        match self {
            Self::Singular { .. } => "add `noise = \"5 um\"` to [sensors], in the unit of the readings",
            Self::AllDead { .. } => "take sensors out of `dead` in [sensors]",
        }
    }
}

#[cfg(test)]
mod tests;

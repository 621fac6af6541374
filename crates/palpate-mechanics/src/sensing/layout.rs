//! Sensor kinds, sensors, and the layout of them all.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::ChannelModel;
use crate::contact::Position;
use crate::surface::Extent;
use crate::units::{Dimension, Unit};

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorKind {
    /// Displacement of the surface across itself, in metres, positive upward.
    Deflection,
    /// The deflection's derivative along the length, in radians.
    Slope,
    /// Strain along the length on the lower face, positive in tension.
    Strain,
    /// Force of a support on the surface, in newtons, positive upward.
    Reaction,
    /// A channel in units of its own, which no model explains.
    Raw,
}

impl SensorKind {
    /// Every kind, in the order that messages list them.
    pub const ALL: [Self; 5] = [Self::Deflection, Self::Slope, Self::Strain, Self::Reaction, Self::Raw];

    /// Its name in a rig.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Deflection => "deflection",
            Self::Slope => "slope",
            Self::Strain => "strain",
            Self::Reaction => "reaction",
            Self::Raw => "raw",
        }
    }

    /// The kind that a rig calls `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// What its readings measure.
    pub const fn dimension(self) -> Dimension {
        match self {
            Self::Deflection => Dimension::Length,
            Self::Slope => Dimension::Angle,
            Self::Strain => Dimension::Strain,
            Self::Reaction => Dimension::Force,
            Self::Raw => Dimension::None,
        }
    }

    /// The unit in which recordings are written: mm, mrad, ue (microstrain), N, or none.
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

/// One sensor: what it measures, where, and how well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// What it measures.
    pub kind: SensorKind,
    /// Where it sits. A raw channel's position means nothing.
    pub position: Position,
    /// Its name, unique in the layout: "deflection_1", or what the recording calls its channel.
    pub name: String,
    /// The faults of its channel.
    pub channel: ChannelModel,
}

/// All the sensors under one surface; a reading has one value for each, in this order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Layout {
    /// The sensors.
    pub sensors: Vec<Sensor>,
}

impl Layout {
    /// `count` sensors of one kind, evenly placed at x_i = i·l/(count + 1) for i = 1…count, with perfect channels.
    ///
    /// `length_m` is the surface's length l in metres. The names are "deflection_1", "deflection_2" and so on.
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

    /// How many sensors there are.
    pub fn len(&self) -> usize {
        self.sensors.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.sensors.is_empty()
    }

    /// Where the sensors of each kind sit, in millimetres with two decimals at most: "deflection 35, 40 mm; strain 200 mm", and
    /// "reaction (10, 20), (10, 180) mm" on a plane.
    pub fn places_in_words(&self, extent: Extent) -> String {
        let of = |kind: SensorKind| {
            let sensors = self.sensors.iter().filter(|sensor| sensor.kind == kind);
            let positions: Vec<Position> = sensors.map(|sensor| sensor.position).collect();
            (!positions.is_empty()).then(|| format!("{kind} {}", extent.places_in_words(&positions)))
        };
        SensorKind::ALL.into_iter().filter_map(of).collect::<Vec<_>>().join("; ")
    }

    /// What each sensor measures.
    pub fn kinds(&self) -> Vec<SensorKind> {
        self.sensors.iter().map(|sensor| sensor.kind).collect()
    }

    /// Each sensor's name.
    pub fn names(&self) -> Vec<String> {
        self.sensors.iter().map(|sensor| sensor.name.clone()).collect()
    }
}

/// x_i = i·l/(count + 1) for i = 1…count.
pub fn even_positions(count: usize, length_m: f64) -> impl Iterator<Item = Position> {
    (1..=count).map(move |i| Position::along(i as f64 * length_m / (count + 1) as f64))
}

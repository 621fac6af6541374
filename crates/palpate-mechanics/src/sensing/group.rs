//! Sensors of one kind that are placed and described together.

use super::{ChannelModel, SensorKind};
use crate::contact::Position;

/// Sensors of one kind with the same channel model, for a surface that is yet to be named.
///
/// ```
/// use palpate_mechanics::sensing::SensorKind;
/// use palpate_mechanics::units::{mm, um};
///
/// let gauges = SensorKind::Strain.at([mm(4.0), mm(20.0), mm(40.0)]);
/// let deflections = SensorKind::Deflection.evenly(8).noise(um(5.0));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SensorGroup {
    /// What they measure.
    pub kind: SensorKind,
    /// Where they sit.
    pub placement: Placement,
    /// The faults that each of them has.
    pub channel: ChannelModel,
}

/// Where the sensors of a group sit.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// So many along the length l, at i·l/(count + 1) for i = 1…count.
    Evenly(usize),
    /// At the inner crossings of a grid of columns × rows: x = i·length/(columns + 1), y = j·width/(rows + 1).
    Grid(usize, usize),
    /// At these positions.
    At(Vec<Position>),
}

impl SensorKind {
    /// `count` sensors of this kind along the length l of a surface, at i·l/(count + 1) for i = 1…count.
    pub fn evenly(self, count: usize) -> SensorGroup {
        self.placed(Placement::Evenly(count))
    }

    /// Sensors of this kind on a plane, at the inner crossings of a grid: `columns` along the length, `rows` across.
    pub fn grid(self, columns: usize, rows: usize) -> SensorGroup {
        self.placed(Placement::Grid(columns, rows))
    }

    /// Sensors of this kind at positions along the length, in metres from its left end.
    pub fn at(self, x_m: impl IntoIterator<Item = f64>) -> SensorGroup {
        self.placed(Placement::At(x_m.into_iter().map(Position::along).collect()))
    }

    /// Sensors of this kind at positions on a plane.
    pub fn at_positions(self, positions: impl IntoIterator<Item = Position>) -> SensorGroup {
        self.placed(Placement::At(positions.into_iter().collect()))
    }

    fn placed(self, placement: Placement) -> SensorGroup {
        SensorGroup { kind: self, placement, channel: ChannelModel::default() }
    }
}

impl SensorGroup {
    /// The same with Gaussian noise of this standard deviation, in the SI unit of the kind; at least 0.
    #[must_use]
    pub fn noise(mut self, sd: f64) -> Self {
        self.channel.noise_sd = sd;
        self
    }

    /// The same with this channel model: noise, resolution, gain and offset errors, range.
    #[must_use]
    pub fn channel(mut self, channel: ChannelModel) -> Self {
        self.channel = channel;
        self
    }
}

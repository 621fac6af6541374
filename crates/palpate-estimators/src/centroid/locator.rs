//! A calibrated centroid.

use serde::{Deserialize, Serialize};

use crate::fit::{Locate, LocatorFault};
use crate::held_out::HeldOutSpread;
use crate::setup::Setup;
use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// A centroid that locates; see [`Centroid`](super::Centroid).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CentroidLocator {
    /// The surface.
    pub extent: Extent,
    /// One over the largest training reading of the channel's kind, in the inverse of its unit; 0 for a dead channel.
    pub channel_scales: Vec<f64>,
    /// What the magnitudes weigh.
    pub weighing: Weighing,
    /// A row for x, and one for y on a two-dimensional surface: with [`Weighing::Positions`] the factor of the
    /// centroid's x (and y), then a constant in metres; with [`Weighing::Channels`] a position in metres a channel.
    pub map: Vec<Vec<f64>>,
    /// The contact's force in newtons, where the bench knows it.
    pub force_n: Option<f64>,
    /// How far maps were off at positions that they were not calibrated on.
    pub spread: Option<HeldOutSpread>,
}

/// What the channels' magnitudes weigh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weighing {
    /// The sensors' known positions, one a channel.
    Positions(Vec<Position>),
    /// Positions that calibration finds, for channels that have none.
    Channels,
}

impl Weighing {
    /// Unknowns of the map for a coordinate.
    pub(super) fn terms(&self, channels: usize, plane: bool) -> usize {
        match self {
            Self::Positions(_) => 2 + usize::from(plane),
            Self::Channels => channels,
        }
    }
}

impl CentroidLocator {
    pub(super) fn terms(&self) -> usize {
        self.weighing.terms(self.channel_scales.len(), self.extent.width_m.is_some())
    }

    /// What the map multiplies; `None` where every reading is 0 and nothing weighs.
    pub(super) fn term_values(&self, reading: &[f64]) -> Option<Vec<f64>> {
        let mut weights: Vec<f64> =
            reading.iter().zip(&self.channel_scales).map(|(r, s)| (r * s).abs()).collect();
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        weights.iter_mut().for_each(|weight| *weight /= total);
        let Weighing::Positions(positions) = &self.weighing else { return Some(weights) };
        let mean = |coordinate: fn(&Position) -> f64| {
            weights.iter().zip(positions).map(|(w, p)| w * coordinate(p)).sum::<f64>()
        };
        let along = mean(|p| p.x_m);
        Some(match self.extent.width_m {
            None => vec![along, 1.0],
            Some(_) => vec![along, mean(|p| p.y_m), 1.0],
        })
    }

    /// The mapped centroid; `None` where every reading is 0.
    pub(super) fn position(&self, reading: &[f64]) -> Option<Position> {
        let terms = self.term_values(reading)?;
        let mapped = |row: &Vec<f64>| row.iter().zip(&terms).map(|(m, t)| m * t).sum::<f64>();
        let mut coordinates = self.map.iter().map(mapped);
        Some(Position { x_m: coordinates.next()?, y_m: coordinates.next().unwrap_or(0.0) })
    }
}

impl Locate for CentroidLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let Some(position) = self.position(reading) else {
            return Estimate::of_position(Position::default(), Status::NoContact);
        };
        let status = if self.extent.contains(position) { Status::Located } else { Status::OutsideSurface };
        let uncertainty = self.spread.map(|spread| spread.uncertainty(position));
        Estimate::of_contact(ContactEstimate { position, force_n: self.force_n, uncertainty }, status)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        let channels = setup.layout.len();
        LocatorFault::check_count("channel scales", channels, self.channel_scales.len())?;
        LocatorFault::check_numbers(
            "channel scale",
            self.channel_scales.iter().copied(),
            |scale| scale >= 0.0,
            "a number of at least 0",
        )?;
        if let Weighing::Positions(positions) = &self.weighing {
            LocatorFault::check_count("sensor positions", channels, positions.len())?;
            let coordinates = positions.iter().flat_map(|p| [p.x_m, p.y_m]);
            LocatorFault::check_numbers("sensor position", coordinates, |_| true, "a finite number")?;
        }
        LocatorFault::check_count(
            "rows of the map",
            1 + usize::from(self.extent.width_m.is_some()),
            self.map.len(),
        )?;
        for row in &self.map {
            LocatorFault::check_count("numbers in a row of the map", self.terms(), row.len())?;
            LocatorFault::check_numbers("map", row.iter().copied(), |_| true, "a finite number")?;
        }
        self.spread.map_or(Ok(()), |spread| spread.check())
    }
}

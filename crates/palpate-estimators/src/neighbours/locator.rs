//! A recording that is asked for what it knows.

use serde::{Deserialize, Serialize};

use super::search::{means, nearest};
use crate::features::Features;
use crate::fit::{Locate, LocatorFault};
use crate::held_out::HeldOutSpread;
use crate::setup::Setup;
use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// Neighbours that locate; see [`Neighbours`](super::Neighbours).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NeighboursLocator {
    /// The surface.
    pub extent: Extent,
    /// By what readings are compared.
    pub features: Features,
    /// k, how many neighbours are asked.
    pub count: usize,
    /// The training rows.
    pub rows: Vec<Neighbour>,
    /// The contact's force in newtons, where the bench knows it.
    pub force_n: Option<f64>,
    /// How far the neighbours at other positions were off.
    pub spread: Option<HeldOutSpread>,
}

/// A training row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Neighbour {
    /// Its reading's features.
    pub features: Vec<f64>,
    /// Its contact.
    pub position: Position,
}

impl Locate for NeighboursLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let found = nearest(self.rows.iter(), &self.features.apply(reading), self.count);
        let Some(position) = means(&found).pop() else {
            return Estimate::of_position(Position::default(), Status::NoContact);
        };
        let status = if self.extent.contains(position) { Status::Located } else { Status::OutsideSurface };
        let uncertainty = self.spread.map(|spread| spread.uncertainty(position));
        Estimate::of_contact(ContactEstimate { position, force_n: self.force_n, uncertainty }, status)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.features.check(setup.layout.len())?;
        LocatorFault::check_numbers("count of neighbours", [self.count as f64], |k| k >= 1.0, "at least 1")?;
        LocatorFault::check_numbers("count of rows", [self.rows.len() as f64], |n| n >= 1.0, "at least 1")?;
        for row in &self.rows {
            let (needed, found) = (self.features.len(), row.features.len());
            LocatorFault::check_count("features of a row", needed, found)?;
            LocatorFault::check_numbers(
                "feature of a row",
                row.features.iter().copied(),
                |_| true,
                "a finite number",
            )?;
            let place = [row.position.x_m, row.position.y_m];
            LocatorFault::check_numbers("position", place, |_| true, "a finite number")?;
        }
        self.spread.map_or(Ok(()), |spread| spread.check())
    }
}

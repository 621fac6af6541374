//! One sensor's fitted influence function, as mechanics would give it.

use super::InfluenceTable;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::InfluenceFunction;

/// The influence function of one sensor of a table.
#[derive(Clone, Copy, Debug)]
pub struct FittedInfluence<'a> {
    table: &'a InfluenceTable,
    sensor: usize,
}

impl InfluenceTable {
    /// The influence function of a sensor, from 0; 0 everywhere for one that the table does not have.
    pub fn function(&self, sensor: usize) -> FittedInfluence<'_> {
        FittedInfluence { table: self, sensor }
    }
}

impl FittedInfluence<'_> {
    fn value_and_slope(&self, x_m: f64) -> (f64, f64) {
        if self.sensor < self.table.sensors {
            self.table.value_and_slope(&self.table.cell(x_m), self.sensor)
        } else {
            (0.0, 0.0)
        }
    }
}

impl InfluenceFunction for FittedInfluence<'_> {
    fn at(&self, contact: Position) -> f64 {
        self.value_and_slope(contact.x_m).0
    }

    fn gradient(&self, contact: Position) -> [f64; 2] {
        [self.value_and_slope(contact.x_m).1, 0.0]
    }
}

//! Readings of the sensors under a contact, and their derivatives.
//!
//! For many sensors on finite elements, three reciprocal solutions per contact are faster than response
//! functions.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use crate::contact::{Contact, Position};
use crate::sensing::{Layout, SensorKind};
use crate::surface::{
    ContactLoad, Influences, ReadingsByContact, ResponseFunction, ResponseGradient, Solving, Surface,
};
use palpate_numerics::small::add_multiple;
use palpate_numerics::watch::{Cancelled, Watch};

/// Largest number of response functions, about the number of solutions for contacts over a plane.
const MOST_FUNCTIONS: usize = 1500;
const MOST_KEPT: usize = 256 << 20;
/// Sensors between two checks of the watch: one sweep of a plate's solver.
const SOLVED_TOGETHER: usize = 24;
const MOST_OF_DEGREES: usize = 192 << 20;

/// Largest number of solutions for twins, relative to those over the surface.
const MOST_SOLUTIONS: f64 = 12.0;

/// Estimated cost of a limit over a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitCost {
    /// Memory.
    pub memory_bytes: f64,
    /// Range of the time on a 3 GHz core, which depends on twins.
    pub seconds: [f64; 2],
}

#[derive(Clone)]
pub(super) enum Responses<'a> {
    BySensor(Vec<Arc<dyn ResponseFunction + 'a>>),
    ByContact(ResponseCache<'a>),
}

#[derive(Clone)]
pub(super) struct ResponseCache<'a> {
    readings: Arc<dyn ReadingsByContact + 'a>,
    sensors: usize,
    /// Influences by [`key`].
    influences: Arc<Mutex<HashMap<[u64; 2], Arc<Influences>>>>,
    /// Readings by degree of freedom.
    degrees: Arc<Mutex<HashMap<usize, Vec<f64>>>>,
}

impl<'a> Responses<'a> {
    pub fn new(surface: &'a dyn Surface, layout: &Layout, watch: Watch) -> Result<Self, Cancelled> {
        Self::with_most_functions(surface, layout, MOST_FUNCTIONS, watch)
    }

    pub(super) fn with_most_functions(
        surface: &'a dyn Surface,
        layout: &Layout,
        most: usize,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let alive = layout.sensors().iter().filter(|sensor| !sensor.channel.disabled);
        let sensors: Vec<(SensorKind, Position)> =
            alive.map(|sensor| (sensor.kind, sensor.position)).collect();
        if sensors.len() > most
            && let Some(readings) = surface.readings_by_contact(&sensors)
        {
            return Ok(Self::ByContact(ResponseCache {
                readings,
                sensors: sensors.len(),
                influences: Arc::default(),
                degrees: Arc::default(),
            }));
        }
        let mut functions = Vec::with_capacity(sensors.len());
        let of_a_kind = sensors.chunk_by(|a, b| a.0 == b.0);
        for together in of_a_kind.flat_map(|sensors| sensors.chunks(SOLVED_TOGETHER)) {
            watch
                .stage("influence functions of the sensors", functions.len() as f64 / sensors.len() as f64)?;
            let positions: Vec<Position> = together.iter().map(|(_, position)| *position).collect();
            functions.extend(surface.response_functions_watched(together[0].0, &positions, watch)?);
        }
        Ok(Self::BySensor(functions))
    }

    pub fn readings(&self, positions: &[Position], force_n: f64) -> Vec<Vec<f64>> {
        match self {
            Self::BySensor(functions) => {
                let at = |&position: &Position| {
                    let contact = Contact { position, force_n };
                    functions.iter().map(|function| function.at(contact)).collect()
                };
                positions.iter().map(at).collect()
            }
            Self::ByContact(by_contact) => by_contact.readings(positions, force_n),
        }
    }

    pub fn gradients(&self, contact: Contact) -> Vec<(f64, ResponseGradient)> {
        match self {
            Self::BySensor(functions) => {
                functions.iter().map(|function| (function.at(contact), function.gradient(contact))).collect()
            }
            Self::ByContact(by_contact) => by_contact.gradients(contact),
        }
    }

    pub fn cost(surface: &dyn Surface, sensors: usize, positions: usize) -> LimitCost {
        let solving = if sensors > MOST_FUNCTIONS { Solving::ByContact } else { Solving::BySensor };
        let reading = (size_of::<f64>() * sensors) as f64;
        // The search for twins stores readings and derivatives of its own.
        let compared = 4.0 * positions as f64 * reading;
        let Some(cost) = surface.solution_cost(sensors, solving) else {
            return LimitCost { memory_bytes: compared, seconds: [0.0; 2] };
        };
        let loads = (ContactLoad::EACH * positions) as f64;
        let (solutions, most, kept) = match solving {
            Solving::BySensor => (sensors as f64, sensors as f64, 0.0),
            Solving::ByContact => (
                loads,
                MOST_SOLUTIONS * loads,
                (loads * reading).min(MOST_KEPT as f64) + MOST_OF_DEGREES as f64,
            ),
        };
        LimitCost {
            memory_bytes: cost.memory_bytes + kept + compared,
            seconds: [solutions, most].map(|solutions| cost.seconds_once + solutions * cost.seconds_each),
        }
    }

    pub fn prepare(&self, positions: &[Position], watch: Watch) -> Result<(), Cancelled> {
        match self {
            Self::BySensor(_) => Ok(()),
            Self::ByContact(by_contact) => by_contact.prepare(positions, watch),
        }
    }
}

impl ResponseCache<'_> {
    fn readings(&self, positions: &[Position], force_n: f64) -> Vec<Vec<f64>> {
        let of = |position: &Position| {
            let mut readings = match self.cached_influences(*position) {
                Some(kept) => kept[0].clone(),
                None => self.interpolated(*position),
            };
            readings.iter_mut().for_each(|reading| *reading *= force_n);
            readings
        };
        positions.iter().map(of).collect()
    }

    fn interpolated(&self, position: Position) -> Vec<f64> {
        let around = self.readings.degrees(position);
        let mut degrees = self.degrees.lock().unwrap_or_else(PoisonError::into_inner);
        if (degrees.len() + around.len()) * size_of::<f64>() * self.sensors > MOST_OF_DEGREES {
            degrees.clear();
        }
        let new = around.iter().map(|(degree, _)| *degree).filter(|degree| !degrees.contains_key(degree));
        let new: Vec<usize> = new.collect();
        let loads: Vec<ContactLoad> = new.iter().copied().map(ContactLoad::Degree).collect();
        degrees.extend(new.into_iter().zip(self.readings.readings_of_loads(&loads)));
        let mut sum = vec![0.0; self.sensors];
        for (degree, weight) in &around {
            if let Some(readings) = degrees.get(degree) {
                add_multiple(&mut sum, *weight, readings);
            }
        }
        sum
    }

    fn gradients(&self, Contact { position, force_n }: Contact) -> Vec<(f64, ResponseGradient)> {
        let influences = self.cached_influences(position).unwrap_or_else(|| self.solved(position));
        let [at, along, across] = &*influences;
        let gradient = |((at, along), across): ((&f64, &f64), &f64)| {
            let position = [force_n * along, force_n * across];
            (force_n * at, ResponseGradient { position, force: *at })
        };
        at.iter().zip(along).zip(across).map(gradient).collect()
    }

    fn prepare(&self, positions: &[Position], watch: Watch) -> Result<(), Cancelled> {
        let stage = "readings under contacts all over the surface";
        self.readings.for_each_contact(positions, stage, watch, |i, influences| {
            if !self.has_room() {
                return ControlFlow::Break(());
            }
            self.keep(positions[i], Arc::new(influences));
            ControlFlow::Continue(())
        })
    }

    fn cached_influences(&self, position: Position) -> Option<Arc<Influences>> {
        self.influences.lock().unwrap_or_else(PoisonError::into_inner).get(&key(position)).cloned()
    }

    fn has_room(&self) -> bool {
        let kept = self.influences.lock().unwrap_or_else(PoisonError::into_inner).len();
        (kept + 1) * 3 * size_of::<f64>() * self.sensors <= MOST_KEPT
    }

    fn keep(&self, position: Position, influences: Arc<Influences>) {
        let mut kept = self.influences.lock().unwrap_or_else(PoisonError::into_inner);
        kept.insert(key(position), influences);
    }

    fn solved(&self, position: Position) -> Arc<Influences> {
        let influences = Arc::new(self.readings.influences(&[position]).pop().unwrap_or_default());
        if self.has_room() {
            self.keep(position, influences.clone());
        }
        influences
    }
}

pub(super) fn key(position: Position) -> [u64; 2] {
    [position.x_m, position.y_m].map(f64::to_bits)
}

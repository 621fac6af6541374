//! Means of the readings of an observation.

use ndarray::Array1;
use palpate_mechanics::contact::{Contact, Position};

/// Duration of an observation.
const DURATION_S: f64 = 0.2;

/// Sums of consecutive readings with the same number of contacts.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub count: f64,
    pub start_s: f64,
    pub times_s: f64,
    pub offsets: Vec<f64>,
    /// x, y and force of each contact.
    pub contacts: Vec<[f64; 3]>,
}

impl Block {
    pub fn add(&mut self, time_s: f64, offsets: impl Iterator<Item = f64>, contacts: &[Contact]) {
        if self.count == 0.0 {
            self.start_s = time_s;
            self.contacts = vec![[0.0; 3]; contacts.len()];
        }
        self.count += 1.0;
        self.times_s += time_s;
        for (i, offset) in offsets.enumerate() {
            match self.offsets.get_mut(i) {
                Some(sum) => *sum += offset,
                None => self.offsets.push(offset),
            }
        }
        for (sum, Contact { position, force_n }) in self.contacts.iter_mut().zip(contacts) {
            sum.iter_mut().zip([position.x_m, position.y_m, *force_n]).for_each(|(sum, own)| *sum += own);
        }
    }

    pub fn time_s(&self) -> f64 {
        self.times_s / self.count
    }

    pub fn offsets(&self) -> Array1<f64> {
        self.offsets.iter().map(|sum| sum / self.count).collect()
    }

    pub fn contacts(&self) -> Vec<Contact> {
        let contact = |sums: &[f64; 3]| {
            let [x_m, y_m, force_n] = sums.map(|sum| sum / self.count);
            Contact { position: Position { x_m, y_m }, force_n }
        };
        self.contacts.iter().map(contact).collect()
    }

    /// Subtracts a change of the baseline from all readings.
    pub fn move_by(&mut self, moved: &[f64]) {
        self.offsets.iter_mut().zip(moved).for_each(|(sum, moved)| *sum -= self.count * moved);
    }

    /// True for other contacts, or after the duration of an observation.
    pub fn ends_before(&self, time_s: f64, contacts: &[Contact]) -> bool {
        self.count > 0.0 && (self.contacts.len() != contacts.len() || time_s - self.start_s >= DURATION_S)
    }
}

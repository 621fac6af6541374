//! Estimates of contacts.

use crate::Position;

/// Estimate of the contacts of one reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The only or strongest contact.
    pub contact: ContactEstimate,
    /// Reliability of the estimate.
    pub status: Status,
    /// Further modes, most probable first, for [`Status::Ambiguous`].
    pub modes: BoundedList<Mode, 3>,
    /// Simultaneous further contacts, strongest first.
    pub further: BoundedList<ContactEstimate, 2>,
}

/// One estimated contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactEstimate {
    /// Estimated position.
    pub position: Position,
    /// Force in newtons, if known or estimated.
    pub force_n: Option<f64>,
    /// Uncertainty, if estimated.
    pub uncertainty: Option<Uncertainty>,
}

impl ContactEstimate {
    fn is_in_numbers(&self) -> bool {
        let Position { x_m, y_m } = self.position;
        let is_certain = |uncertainty: Uncertainty| {
            let ((x_low, x_high), (y_low, y_high)) = (uncertainty.x_95_m, uncertainty.y_95_m);
            let (force_low, force_high) = uncertainty.force_95_n.unwrap_or_default();
            [x_low, x_high, y_low, y_high, force_low, force_high].iter().all(|end| end.is_finite())
                && uncertainty.covariance.iter().all(|entry| !entry.is_nan())
        };
        x_m.is_finite()
            && y_m.is_finite()
            && self.force_n.is_none_or(f64::is_finite)
            && self.uncertainty.is_none_or(is_certain)
    }
}

/// Uncertainty of an estimated contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uncertainty {
    /// Covariance of (x, y, force) in m², m·N and N²: xx, xy, xf, yy, yf, ff; 0 if not estimated.
    pub covariance: [f64; 6],
    /// 95 % interval of x in metres.
    pub x_95_m: (f64, f64),
    /// 95 % interval of y in metres.
    pub y_95_m: (f64, f64),
    /// 95 % interval of the force in newtons, where a standard deviation does not describe it (near an edge).
    pub force_95_n: Option<(f64, f64)>,
}

impl Uncertainty {
    /// Creates an uncertainty on a line from xx, xf, ff.
    pub const fn on_line([xx, xf, ff]: [f64; 3], x_95_m: (f64, f64)) -> Self {
        Self { covariance: [xx, 0.0, xf, 0.0, 0.0, ff], x_95_m, y_95_m: (0.0, 0.0), force_95_n: None }
    }
}

/// A mode of the posterior.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mode {
    /// Contact at the mode.
    pub contact: ContactEstimate,
    /// Posterior probability, 0 to 1.
    pub probability: f64,
}

/// Largest magnitude of a reading; cubes and their products remain finite.
pub const LARGEST_READING: f64 = 1e60;

/// Reliability of an estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// A position on the surface.
    Located,
    /// An untouched surface, without a position.
    NoContact,
    /// Several modes, with the most probable as estimate; without modes, the 95 % interval is the whole
    /// surface.
    Ambiguous,
    /// No contact explains the reading within the noise: more contacts than assumed, a damaged sensor, drift.
    OutsideModel,
    /// A position beyond the edge.
    OutsideSurface,
}

impl Estimate {
    /// Returns an estimate of a position.
    pub const fn of_position(position: Position, status: Status) -> Self {
        Self::of_contact(ContactEstimate { position, force_n: None, uncertainty: None }, status)
    }

    /// Returns an estimate of one contact.
    pub const fn of_contact(contact: ContactEstimate, status: Status) -> Self {
        Self { contact, status, modes: BoundedList::none(NO_MODE), further: BoundedList::none(NO_CONTACT) }
    }

    /// Returns whether all numbers except covariances are finite, and none is NaN.
    pub fn is_in_numbers(&self) -> bool {
        let of_mode = |mode: &Mode| mode.contact.is_in_numbers() && mode.probability.is_finite();
        self.contact.is_in_numbers()
            && self.modes.as_slice().iter().all(of_mode)
            && self.further.as_slice().iter().all(ContactEstimate::is_in_numbers)
    }
}

impl Status {
    /// All statuses.
    pub const ALL: [Self; 5] =
        [Self::Located, Self::NoContact, Self::Ambiguous, Self::OutsideModel, Self::OutsideSurface];

    /// Name in files and on streams.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Located => "located",
            Self::NoContact => "no_contact",
            Self::Ambiguous => "ambiguous",
            Self::OutsideModel => "outside_model",
            Self::OutsideSurface => "outside_surface",
        }
    }
}

const NO_CONTACT: ContactEstimate =
    ContactEstimate { position: Position::along(0.0), force_n: None, uncertainty: None };
const NO_MODE: Mode = Mode { contact: NO_CONTACT, probability: 0.0 };

/// A list of at most N items, without allocation.
///
/// ```
/// use palpate_core::BoundedList;
///
/// let mut list = BoundedList::<u8, 2>::none(0);
/// assert!(list.as_slice().is_empty());
/// assert!(list.push(1) && list.push(2) && !list.push(3));
/// assert_eq!(list.as_slice(), [1, 2]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct BoundedList<T, const N: usize> {
    items: [T; N],
    len: usize,
}

impl<T: Copy, const N: usize> BoundedList<T, N> {
    /// Creates an empty list with unused slots of `filler`.
    pub const fn none(filler: T) -> Self {
        Self { items: [filler; N], len: 0 }
    }

    /// Adds an item; false if full.
    pub fn push(&mut self, item: T) -> bool {
        let Some(slot) = self.items.get_mut(self.len) else { return false };
        *slot = item;
        self.len += 1;
        true
    }

    /// Removes all items.
    pub const fn clear(&mut self) {
        self.len = 0;
    }

    /// Items.
    pub fn as_slice(&self) -> &[T] {
        &self.items[..self.len]
    }
}

impl<T: Copy + PartialEq, const N: usize> PartialEq for BoundedList<T, N> {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cleared_list_equals_an_empty_one() {
        let mut few = BoundedList::<u8, 2>::none(0);
        few.push(7);
        few.clear();
        assert_eq!(few, BoundedList::none(0));
    }
}

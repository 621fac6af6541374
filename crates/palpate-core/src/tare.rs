//! Tare: what a surface reads untouched today, brought to what it read untouched at its calibration.
//!
//! Offsets of raw channels move between calibration and use, with the temperature or when a plug is pulled and put back. With r the
//! reading, b its baseline (what the channel reads untouched today) and o what calibration learnt that it reads untouched, the tared
//! reading is r − b + o.

use crate::{Estimate, Status};

/// Baseline of the channels of a surface, kept in arrays, vectors or slices `B` of the caller's.
///
/// The baseline is the mean of readings that are known to be untouched ([`Tare::add_untouched`]), or it is followed
/// ([`Tare::follow`]).
///
/// ```
/// use palpate_core::Tare;
///
/// let mut tare = Tare::new([100.0, 200.0])?;
/// tare.add_untouched(&[109.0, 195.0])?;
/// tare.add_untouched(&[111.0, 195.0])?;
/// let mut tared = [0.0; 2];
/// tare.apply(&[140.0, 200.0], &mut tared)?;
/// assert_eq!(tared, [130.0, 205.0]);
/// # Ok::<(), palpate_core::TareError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Tare<B> {
    /// Untouched reading of each channel, as calibration learnt it.
    learnt: B,
    baseline: B,
    /// Readings that the baseline is the mean of, at most the time constant; 0 while it is what calibration learnt.
    weight: u32,
    time_constant: u32,
    /// Readings in a row that look let go.
    let_go: u32,
}

/// A reading that does not go with a tare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TareError {
    /// Another number of channels.
    Channels {
        /// Channels of the tare.
        needed: usize,
        /// Channels of the reading.
        found: usize,
    },
    /// A value that is no number.
    NotFinite {
        /// Which channel, from 1.
        channel: usize,
        /// Its value.
        value: f64,
    },
}

impl core::fmt::Display for TareError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Channels { needed, found } => {
                write!(f, "the reading has {found} channels; the tare has {needed}")
            }
            Self::NotFinite { channel, value } => {
                write!(f, "channel {channel} reads {value}; it must be a finite number")
            }
        }
    }
}

impl core::error::Error for TareError {}

impl<B: AsRef<[f64]> + AsMut<[f64]> + Clone> Tare<B> {
    /// Readings from which on a followed baseline is believed: their mean has a fifth of the noise of one.
    pub const SETTLED: u32 = 20;
    /// Readings over which a followed baseline forgets: ten seconds at 100 readings a second.
    pub const TIME_CONSTANT: u32 = 1000;

    /// Readings in a row by which a surface is known to have been let go: three of a thousand readings of noise alone are outside the model.
    pub const LET_GO: u32 = 5;

    /// A tare whose baseline is `learnt`, what calibration learnt that each channel reads untouched.
    ///
    /// # Errors
    /// [`TareError::NotFinite`] for a value that is no number.
    pub fn new(learnt: B) -> Result<Self, TareError> {
        check(learnt.as_ref(), learnt.as_ref().len())?;
        Ok(Self {
            baseline: learnt.clone(),
            learnt,
            weight: 0,
            time_constant: Self::TIME_CONSTANT,
            let_go: 0,
        })
    }

    /// The same, whose followed baseline forgets over so many readings; at least [`Tare::SETTLED`].
    #[must_use]
    pub fn with_time_constant(self, readings: u32) -> Self {
        Self { time_constant: readings.max(Self::SETTLED), ..self }
    }

    /// Untouched reading of each channel today, as far as is known.
    pub fn baseline(&self) -> &[f64] {
        self.baseline.as_ref()
    }

    /// Untouched reading of each channel, as calibration learnt it.
    pub fn learnt(&self) -> &[f64] {
        self.learnt.as_ref()
    }

    /// Adds a reading that is known to be untouched to the mean that is the baseline; the first takes the place of what calibration learnt.
    ///
    /// # Errors
    /// [`TareError`] for another number of channels or a value that is not finite.
    pub fn add_untouched(&mut self, reading: &[f64]) -> Result<(), TareError> {
        check(reading, self.learnt.as_ref().len())?;
        self.weight = self.weight.saturating_add(1);
        self.step(reading, 1.0 / f64::from(self.weight));
        Ok(())
    }

    /// Writes the reading less the baseline, and what calibration learnt added, over `tared`.
    ///
    /// # Errors
    /// [`TareError`] where reading or `tared` have another number of channels, or for a value that is not finite, also of the tared reading.
    pub fn apply(&self, reading: &[f64], tared: &mut [f64]) -> Result<(), TareError> {
        let needed = self.learnt.as_ref().len();
        check(reading, needed)?;
        if tared.len() != needed {
            return Err(TareError::Channels { needed, found: tared.len() });
        }
        let baselines = self.baseline.as_ref().iter().zip(self.learnt.as_ref());
        for ((tared, value), (baseline, learnt)) in tared.iter_mut().zip(reading).zip(baselines) {
            *tared = value - baseline + learnt;
        }
        // Immense readings may be finite, and their difference not.
        check(tared, needed)
    }

    /// Locates a tared reading, and follows the drift of the baseline while nothing touches. `tared` holds the tared reading afterwards.
    ///
    /// The status that `locate` gives says what a reading is to the baseline:
    /// - `no_contact`: the baseline moves towards it, by a mean over the last [`Tare::TIME_CONSTANT`] such readings;
    /// - a contact, whether held for a second or an hour: the baseline stays. It is not tared away, and the drift in the meantime is not
    ///   made up for;
    /// - `outside_model`, which no contact explains: while the baseline is not yet the mean of [`Tare::SETTLED`] readings the surface has
    ///   moved since its calibration, and the reading is the new baseline. Later the baseline stays, as a palm is no contact of
    ///   the model either, unless the opposite of the reading, and of the [`Tare::LET_GO`] − 1 before it, is a contact: then the
    ///   surface was touched when it was tared, has been let go, and the reading is the new baseline.
    ///
    /// So a board that is touched while it starts is right from the moment it is let go. Contacts lighter than those that are told from
    /// noise go into the baseline. A drift of d a reading is d times the time constant ahead of the baseline, which has to be less than
    /// the noise.
    ///
    /// # Errors
    /// [`TareError`] as for [`Tare::apply`].
    pub fn follow(
        &mut self,
        reading: &[f64],
        tared: &mut [f64],
        mut locate: impl FnMut(&[f64]) -> Estimate,
    ) -> Result<Estimate, TareError> {
        self.apply(reading, tared)?;
        let estimate = locate(tared);
        let is_settled = self.weight >= Self::SETTLED;
        let looks_let_go =
            estimate.status == Status::OutsideModel && is_settled && self.is_let_go(tared, &mut locate);
        self.let_go = if looks_let_go { self.let_go + 1 } else { 0 };
        match estimate.status {
            Status::NoContact => {
                if self.weight == 0 {
                    // The surface has not moved: what calibration learnt counts as a settled baseline.
                    self.weight = Self::SETTLED;
                }
                self.weight = (self.weight + 1).min(self.time_constant);
                self.step(reading, 1.0 / f64::from(self.weight));
            }
            Status::OutsideModel if !is_settled || self.let_go >= Self::LET_GO => {
                self.let_go = 0;
                self.weight = 1;
                self.step(reading, 1.0);
            }
            Status::OutsideModel | Status::Located | Status::Ambiguous | Status::OutsideSurface => {}
        }
        Ok(estimate)
    }

    /// Whether the opposite of a tared reading is a contact.
    fn is_let_go(&self, tared: &mut [f64], locate: &mut impl FnMut(&[f64]) -> Estimate) -> bool {
        let mirror = |tared: &mut [f64]| {
            tared
                .iter_mut()
                .zip(self.learnt.as_ref())
                .for_each(|(value, learnt)| *value = 2.0 * learnt - *value);
        };
        mirror(tared);
        let is_finite = tared.iter().all(|value| value.is_finite());
        let opposite = if is_finite { locate(tared).status } else { Status::OutsideModel };
        mirror(tared);
        matches!(opposite, Status::Located | Status::Ambiguous)
    }

    /// Moves the baseline by a share of the way to a reading.
    fn step(&mut self, reading: &[f64], share: f64) {
        for (baseline, value) in self.baseline.as_mut().iter_mut().zip(reading) {
            *baseline += share * (value - *baseline);
        }
    }
}

fn check(reading: &[f64], needed: usize) -> Result<(), TareError> {
    if reading.len() != needed {
        return Err(TareError::Channels { needed, found: reading.len() });
    }
    match reading.iter().position(|value| !value.is_finite()) {
        Some(i) => Err(TareError::NotFinite { channel: i + 1, value: reading[i] }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Position;

    const LEARNT: [f64; 4] = [50.0, -20.0, 0.0, 7.0];

    /// Readings of four channels of a newton at `x`, from 0 to 1.
    fn influence(x: f64) -> [f64; 4] {
        [40.0 * (1.0 - x), 40.0 * x, 60.0 * x * (1.0 - x), 25.0 * (1.0 - x * x)]
    }

    /// Least squares over a grid of places, by noise of 1 count.
    fn locate(reading: &[f64]) -> Estimate {
        let d: [f64; 4] = core::array::from_fn(|c| reading[c] - LEARNT[c]);
        let square: f64 = d.iter().map(|d| d * d).sum();
        let misfit = |x: f64| {
            let f = influence(x);
            let (fd, ff) = f.iter().zip(&d).fold((0.0, 0.0), |(fd, ff), (f, d)| (fd + f * d, ff + f * f));
            square - fd.max(0.0) * fd.max(0.0) / ff
        };
        let places = (0..=200).map(|i| f64::from(i) / 200.0);
        let x = places.min_by(|a, b| misfit(*a).total_cmp(&misfit(*b))).unwrap();
        let status = match misfit(x) {
            _ if square < 20.0 => Status::NoContact,
            misfit if misfit < 15.0 => Status::Located,
            _ => Status::OutsideModel,
        };
        Estimate::of_position(Position::along(x), status)
    }

    /// Noise of about 1 count that repeats after 101 readings.
    fn reading(number: u32, moved: [f64; 4], force: f64, x: f64) -> [f64; 4] {
        let f = influence(x);
        core::array::from_fn(|c| {
            let phase = (number * (3 + 2 * c as u32)) % 101;
            let noise = 1.7 * (f64::from(phase) / 50.0 - 1.0);
            LEARNT[c] + moved[c] + force * f[c] + noise
        })
    }

    const MOVED: [f64; 4] = [-30.0, 12.0, 45.0, 20.0];

    fn follow(tare: &mut Tare<[f64; 4]>, reading: [f64; 4]) -> Estimate {
        let mut tared = [0.0; 4];
        let estimate = tare.follow(&reading, &mut tared, locate).unwrap();
        assert!((tared[0] - reading[0]).abs() < 200.0);
        estimate
    }

    /// So many readings of a force at a place.
    fn follow_many(tare: &mut Tare<[f64; 4]>, numbers: core::ops::Range<u32>, (force, x): (f64, f64)) {
        for number in numbers {
            follow(tare, reading(number, MOVED, force, x));
        }
    }

    fn is_right(tare: &Tare<[f64; 4]>, moved: [f64; 4]) -> bool {
        let expected = LEARNT.iter().zip(moved).map(|(learnt, moved)| learnt + moved);
        tare.baseline().iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1.0)
    }

    #[test]
    fn a_surface_that_moved_is_found_and_a_held_contact_stays() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..60, (0.0, 0.0));
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
        for i in 0..5000 {
            let estimate = follow(&mut tare, reading(i, MOVED, 1.5, 0.3));
            assert_eq!(estimate.status, Status::Located);
            assert!((estimate.contact.position.x_m - 0.3).abs() < 0.05);
        }
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
        assert_eq!(follow(&mut tare, reading(1, MOVED, 0.0, 0.0)).status, Status::NoContact);
    }

    #[test]
    fn a_slow_drift_is_followed_while_nothing_touches() {
        let mut tare = Tare::new(LEARNT).unwrap();
        let moved = |i: u32| MOVED.map(|moved| moved * f64::from(i) / 100_000.0);
        for i in 0..100_000 {
            let touched = i % 500 < 50;
            let estimate = follow(&mut tare, reading(i, moved(i), if touched { 1.0 } else { 0.0 }, 0.7));
            assert_eq!(estimate.status == Status::NoContact, !touched, "{i}");
        }
        assert!(is_right(&tare, moved(100_000)), "{:?}", tare.baseline());
    }

    #[test]
    fn a_board_that_is_touched_while_it_starts_is_right_once_it_is_let_go() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..300, (2.0, 0.4));
        assert!(!is_right(&tare, MOVED));
        follow_many(&mut tare, 0..60, (0.0, 0.0));
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    }

    #[test]
    fn one_loud_reading_is_not_taken_for_a_surface_that_was_let_go() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..2000, (0.0, 0.0));
        // The opposite of a contact.
        for _ in 0..Tare::<[f64; 4]>::LET_GO - 1 {
            assert_eq!(follow(&mut tare, reading(7, MOVED, -0.4, 0.4)).status, Status::OutsideModel);
        }
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
        follow_many(&mut tare, 0..1, (0.0, 0.0));
        follow(&mut tare, reading(7, MOVED, -0.4, 0.4));
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    }

    #[test]
    fn a_palm_is_not_tared_away() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..60, (0.0, 0.0));
        for i in 0..3000 {
            let palm: [f64; 4] =
                core::array::from_fn(|c| reading(i, MOVED, 2.0, 0.0)[c] + 2.0 * influence(1.0)[c]);
            assert_eq!(follow(&mut tare, palm).status, Status::OutsideModel);
        }
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    }

    #[test]
    fn bad_readings_are_refused_and_leave_the_baseline() {
        let mut tare = Tare::new([1.0, 2.0]).unwrap();
        let channels = TareError::Channels { needed: 2, found: 1 };
        assert_eq!(tare.add_untouched(&[1.0]), Err(channels));
        assert_eq!(tare.apply(&[1.0, 2.0], &mut [0.0]), Err(channels));
        assert!(matches!(tare.add_untouched(&[1.0, f64::NAN]), Err(TareError::NotFinite { channel: 2, .. })));
        assert!(matches!(Tare::new([f64::INFINITY]), Err(TareError::NotFinite { channel: 1, .. })));
        assert_eq!(tare, Tare::new([1.0, 2.0]).unwrap());
    }
}

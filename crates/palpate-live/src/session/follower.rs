//! Contacts followed from reading to reading by the tracker, as estimates.

use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_estimators::estimator::{
    Locator, NotTrackable, Track, Tracked, Tracker, TrackerConfig, Tracking,
};
use palpate_estimators::status::PLACE_LEFT_OPEN;
use palpate_mechanics::surface::Extent;

/// A tracker whose state is told as estimates.
pub struct Follower {
    tracking: Tracking,
    config: TrackerConfig,
    tracker: Tracker,
    extent: Extent,
    /// Time of the first reading, from which the tracker's seconds count: those since 1970 leave no digits for microseconds.
    first_ns: Option<u64>,
    /// Difference of the last reading and the tared one.
    baseline: Vec<f64>,
}

impl Follower {
    /// A follower that has seen nothing.
    ///
    /// # Errors
    /// [`NotTrackable`] for a locator by which contacts cannot be followed, or a surface whose modes are not known.
    pub fn new(locator: &Locator, config: TrackerConfig) -> Result<Self, NotTrackable> {
        let tracking = locator.tracking(&config)?;
        Ok(Self {
            tracker: Tracker::new(tracking.likelihood(), config),
            tracking,
            config,
            extent: locator.setup.surface().extent(),
            first_ns: None,
            baseline: Vec::new(),
        })
    }

    /// The estimate after the next reading and what the tare made of it, which was taken at `unix_ns` nanoseconds since 1970; `single` is that of the reading alone.
    ///
    /// A reading that leaves the tracker's state without numbers, as one of 1e300 does, makes it begin anew, and its estimate is `single`; so is that of a
    /// reading that is not later than the one before.
    pub fn follow(&mut self, unix_ns: u64, reading: &[f64], tared: &[f64], single: Estimate) -> Estimate {
        let time_s = unix_ns.saturating_sub(*self.first_ns.get_or_insert(unix_ns)) as f64 * 1e-9;
        self.follow_baseline(reading, tared);
        let Ok(track) = self.tracker.follow(time_s, tared) else { return single };
        let estimate = self.estimate(&track, track.single);
        // Weights of hypotheses that are no numbers leave no probability to anything, for good.
        let has_probability = (track.numbers.iter().sum::<f64>() - 1.0).abs() < 1e-6;
        if has_probability && estimate.is_in_numbers() {
            return estimate;
        }
        self.tracker = Tracker::new(self.tracking.likelihood(), self.config);
        single
    }

    /// Tells the tracker how far the tare's baseline has moved since the last reading.
    fn follow_baseline(&mut self, reading: &[f64], tared: &[f64]) {
        let moved: Vec<f64> = reading.iter().zip(tared).map(|(reading, tared)| reading - tared).collect();
        if self.baseline.len() == moved.len() {
            let by: Vec<f64> = moved.iter().zip(&self.baseline).map(|(now, before)| now - before).collect();
            if by.iter().any(|by| *by != 0.0) {
                self.tracker.move_baseline(&by);
            }
        }
        self.baseline = moved;
    }

    /// The tracker's contacts, as many as are most probable, each in its place while it is followed.
    ///
    /// - `no_contact`: most probably nothing touches.
    /// - `outside_model`: the reading by itself is, unless the surface swings, which no single reading reckons with.
    /// - `ambiguous`: the 95 % interval leaves the place open. Other places that were held possible are within the interval.
    fn estimate(&self, track: &Track, single: Estimate) -> Estimate {
        let is_outside = single.status == Status::OutsideModel && self.config.swing.is_none();
        let mut contacts = track.contacts.iter().map(Tracked::estimate);
        let Some(first) = contacts.next() else {
            let status = if is_outside { Status::OutsideModel } else { Status::NoContact };
            return Estimate::of_contact(single.contact, status);
        };
        let status = if is_outside {
            Status::OutsideModel
        } else if self.leaves_place_open(&first) {
            Status::Ambiguous
        } else {
            Status::Located
        };
        let mut estimate = Estimate::of_contact(first, status);
        for further in contacts {
            // The tracker follows two, and the list has room for both.
            estimate.further.push(further);
        }
        estimate
    }

    /// True where the 95 % intervals have nearly all of every side of the surface.
    fn leaves_place_open(&self, contact: &ContactEstimate) -> bool {
        let Some(uncertainty) = &contact.uncertainty else { return false };
        let is_open = |(low_m, high_m): (f64, f64), side_m: f64| high_m - low_m >= PLACE_LEFT_OPEN * side_m;
        is_open(uncertainty.x_95_m, self.extent.length_m())
            && self.extent.width_m().is_none_or(|width_m| is_open(uncertainty.y_95_m, width_m))
    }
}

//! Estimates of contacts that the tracker follows from reading to reading.

use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_estimators::estimator::{
    Locator, NotTrackable, Track, Tracked, Tracker, TrackerConfig, Tracking,
};
use palpate_estimators::status::PLACE_LEFT_OPEN;
use palpate_mechanics::surface::Extent;

/// A tracker that reports its state as estimates.
pub struct Follower {
    tracking: Tracking,
    config: TrackerConfig,
    tracker: Tracker,
    extent: Extent,
    /// Time of the first reading, from which the tracker's seconds count: seconds since 1970 have too few digits for microseconds.
    first_ns: Option<u64>,
    /// Difference between the last reading and its tared reading.
    baseline: Vec<f64>,
}

impl Follower {
    /// A follower in its initial state.
    ///
    /// # Errors
    /// [`NotTrackable`] for a locator that the tracker cannot use, or a surface with unknown modes.
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

    /// The estimate after the next reading. `tared` is its tared reading, `unix_ns` its time in nanoseconds since 1970, and `single` its estimate
    /// by itself.
    ///
    /// A reading of 1e300, for example, makes the tracker's state non-finite. The tracker then restarts, and the estimate is `single`. A reading
    /// that is not later than the previous one also gives `single`.
    pub fn follow(&mut self, unix_ns: u64, reading: &[f64], tared: &[f64], single: Estimate) -> Estimate {
        let time_s = unix_ns.saturating_sub(*self.first_ns.get_or_insert(unix_ns)) as f64 * 1e-9;
        self.follow_baseline(reading, tared);
        let Ok(track) = self.tracker.follow(time_s, tared) else { return single };
        let estimate = self.estimate(&track, track.single);
        // Weights that are not finite leave no probability to any hypothesis, in all later steps too.
        let has_probability = (track.numbers.iter().sum::<f64>() - 1.0).abs() < 1e-6;
        if has_probability && estimate.is_in_numbers() {
            return estimate;
        }
        self.tracker = Tracker::new(self.tracking.likelihood(), self.config);
        single
    }

    /// Passes the change of the tare's baseline since the last reading to the tracker.
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

    /// The tracker's contacts, in the most probable number. Each keeps its place in the list while it is tracked.
    ///
    /// - `no_contact`: the most probable state is an untouched surface.
    /// - `outside_model`: the reading by itself has this status, and the tracker has no model of swing. A single reading cannot account for swing.
    /// - `ambiguous`: the 95 % interval leaves the place undetermined. Other possible places are within the interval.
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
            // The tracker has at most two contacts, and the list has room for both.
            estimate.further.push(further);
        }
        estimate
    }

    /// True if the 95 % intervals cover nearly the full extent in every direction.
    fn leaves_place_open(&self, contact: &ContactEstimate) -> bool {
        let Some(uncertainty) = &contact.uncertainty else { return false };
        let is_open = |(low_m, high_m): (f64, f64), side_m: f64| high_m - low_m >= PLACE_LEFT_OPEN * side_m;
        is_open(uncertainty.x_95_m, self.extent.length_m())
            && self.extent.width_m().is_none_or(|width_m| is_open(uncertainty.y_95_m, width_m))
    }
}

use palpate_core::{Estimate, Status};
use palpate_estimators::estimator::{
    Locator, NotTrackable, Track, TrackedContact, Tracker, TrackerConfig, Tracking,
};
use palpate_estimators::status::is_undetermined;
use palpate_mechanics::surface::Extent;

/// Tracker that returns estimates.
pub struct EstimateTracker {
    tracking: Tracking,
    config: TrackerConfig,
    tracker: Tracker,
    extent: Extent,
    /// Origin of the times: seconds since 1970 have too few digits for microseconds.
    first_ns: Option<u64>,
    baseline: Vec<f64>,
}

impl EstimateTracker {
    /// Tracker.
    ///
    /// # Errors
    /// [`NotTrackable`].
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

    /// Estimate after a reading at `unix_ns`; `single` for a time that does not increase.
    ///
    /// A state that is not finite, as after a reading of 1e300, restarts the tracker with `single`.
    pub fn update(&mut self, unix_ns: u64, reading: &[f64], tared: &[f64], single: Estimate) -> Estimate {
        let time_s = unix_ns.saturating_sub(*self.first_ns.get_or_insert(unix_ns)) as f64 * 1e-9;
        self.follow_baseline(reading, tared);
        let Ok(track) = self.tracker.update(time_s, tared) else { return single };
        let estimate = self.estimate(&track, track.single);
        // Weights that are not finite remain so in all later steps.
        let has_probability = (track.numbers.iter().sum::<f64>() - 1.0).abs() < 1e-6;
        if has_probability && estimate.is_in_numbers() {
            return estimate;
        }
        self.tracker = Tracker::new(self.tracking.likelihood(), self.config);
        single
    }

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

    /// Most probable contacts in constant order.
    ///
    /// - `outside_model`: status of the reading, unless swing is modelled, which a reading cannot account
    ///   for.
    /// - `ambiguous`: the 95 % interval leaves the position undetermined.
    fn estimate(&self, track: &Track, single: Estimate) -> Estimate {
        let is_outside = single.status == Status::OutsideModel && self.config.swing.is_none();
        let mut contacts = track.contacts.iter().map(TrackedContact::estimate);
        let Some(first) = contacts.next() else {
            let status = if is_outside { Status::OutsideModel } else { Status::NoContact };
            return Estimate::of_contact(single.contact, status);
        };
        let status = if is_outside {
            Status::OutsideModel
        } else if first.uncertainty.is_some_and(|uncertainty| is_undetermined(&uncertainty, self.extent)) {
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
}

use super::repeats::distance;
use std::collections::VecDeque;
use std::time::Duration;

const SHOWN: Duration = Duration::from_secs(4);
const MOST_READINGS: usize = 8192;
const MOST_POINTS: usize = 120;
/// Half the shortest rest before an untouched reading.
const BEFORE_S: f64 = 0.2;

/// Size of a press over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Seconds relative to the recording (≤ 0), and distance from the untouched reading in %.
    pub points: Vec<(f64, f64)>,
}

#[derive(Clone, Debug, Default)]
pub(super) struct RecentReadings {
    readings: VecDeque<(Duration, Vec<f64>)>,
}

impl RecentReadings {
    pub fn add(&mut self, at: Duration, reading: &[f64]) {
        self.readings.push_back((at, reading.to_vec()));
        let is_old = |(then, _): &(Duration, Vec<f64>)| at.saturating_sub(*then) > SHOWN;
        while self.readings.len() > MOST_READINGS || self.readings.front().is_some_and(is_old) {
            self.readings.pop_front();
        }
    }

    /// Trace of the press with the last reading, `ago_s` after its untouched one.
    pub fn trace(&self, untouched: &[f64], ago_s: f64) -> Trace {
        let Some((taken, pressed)) = self.readings.back() else { return Trace::default() };
        let size = distance(pressed, untouched);
        let age_s = |at: Duration| taken.saturating_sub(at).as_secs_f64();
        let shown = self.readings.iter().rev().take_while(|(at, _)| age_s(*at) <= ago_s + BEFORE_S);
        let every = shown.clone().count().div_ceil(MOST_POINTS).max(1);
        // Backwards, so that the recorded reading is a point.
        let points = shown.step_by(every).map(|(at, reading)| {
            let percent = if size > 0.0 { 100.0 * distance(reading, untouched) / size } else { 0.0 };
            (-age_s(*at), percent)
        });
        let mut points: Vec<(f64, f64)> = points.collect();
        points.reverse();
        Trace { points }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_ends_with_the_reading_that_was_taken() {
        let mut recent = RecentReadings::default();
        for i in 0..2000_u32 {
            let value = f64::from(i.saturating_sub(1000));
            recent.add(Duration::from_millis(5) * i, &[7.0 + value]);
        }
        let points = recent.trace(&[7.0], f64::INFINITY).points;
        assert!(points.len() <= MOST_POINTS, "{}", points.len());
        assert_eq!(points.last(), Some(&(0.0, 100.0)));
        assert!(points[0].0 >= -SHOWN.as_secs_f64() && points[0].0 < -3.9, "{:?}", points[0]);
        assert!(points.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 <= pair[1].1));
        // Earlier readings belong to another press.
        let points = recent.trace(&[7.0], 1.0).points;
        assert!(points[0].0 >= -1.0 - BEFORE_S && points.len() > 50, "{points:?}");
    }

    #[test]
    fn a_trace_of_no_size_has_finite_points() {
        let mut recent = RecentReadings::default();
        assert_eq!(recent.trace(&[1.0], 1.0), Trace::default());
        recent.add(Duration::ZERO, &[1.0]);
        assert_eq!(recent.trace(&[1.0], 1.0).points, [(0.0, 0.0)]);
    }
}

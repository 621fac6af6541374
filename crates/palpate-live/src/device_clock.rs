//! Synchronization of a board's clock with the host's.
//!
//! A reading arrives after it was taken: arrival − device time = offset of the clocks + delay, and the delay has a minimum. So the offset, including
//! the least delay, is the lower envelope of arrival − device time over device time. The slope of the envelope is the drift of one clock against the
//! other. The envelope is the line below all points with the least mean distance from them. This line is the edge of their lower convex hull
//! over their mean device time (Zhang, Liu, Xia, "Clock synchronization algorithms for network measurements", INFOCOM 2002). It follows a changing
//! drift, because it is fitted to the last [`WINDOW_S`] only.

use std::collections::VecDeque;
use std::time::Duration;

/// Window of device time for the fit of the envelope, in seconds.
pub const WINDOW_S: f64 = 30.0;
/// Longest bin of device time, in seconds, and as a ratio of the time since the first reading. Only the lowest and the highest point of a bin are kept.
/// The ratio makes the first bins short, so a drift of some percent shows from the first readings on.
const BIN_S: f64 = 0.25;
const BIN_RATIO: f64 = 1.0 / 16.0;
/// Greatest drift of a clock, as a ratio: three times that of an uncalibrated oscillator of a microcontroller.
const GREATEST_DRIFT: f64 = 0.03;
/// Times at which 32-bit clocks wrap around: those in microseconds and those in milliseconds.
const WRAPS: [Duration; 2] = [Duration::from_micros(1 << 32), Duration::from_millis(1 << 32)];
/// Largest difference between a step of the board's clock and one of the host's, in seconds, in addition to [`GREATEST_DRIFT`]. A larger one means
/// that the clock was set.
const STEP_S: f64 = 2.0;

/// Time from one reading to the next by the board's clock alone, which may wrap around; `None` for a clock that was set back.
pub fn step(from: Duration, to: Duration) -> Option<Duration> {
    /// A step back from the last 1/END of the clock's range to the first 1/END is a wrap-around.
    const END: u32 = 16;
    let around = |wrap: &Duration| from < *wrap && *wrap - from < *wrap / END && to < *wrap / END;
    let wrapped = || WRAPS.iter().find(|wrap| around(wrap)).map(|wrap| *wrap - from + to);
    to.checked_sub(from).or_else(wrapped)
}

/// Map from a board's clock to the host's, estimated from the arrivals of readings.
#[derive(Debug, Default)]
pub struct DeviceClock {
    epoch: Option<Epoch>,
}

/// Period in which the board's clock is not set.
#[derive(Debug)]
struct Epoch {
    /// Device and host time of the first reading, the origins of the relative times.
    first_device: Duration,
    first_host: Duration,
    last_device: Duration,
    last_host: Duration,
    /// Sum of the wrap-arounds of the clock.
    wrapped: Duration,
    bins: VecDeque<Bin>,
    line: Line,
    /// Greatest distance of an offset from the line, in seconds.
    spread_s: f64,
}

/// Offset of the host's clock, `offset_s + slope · device_s`, in seconds.
#[derive(Clone, Copy, Debug)]
struct Line {
    offset_s: f64,
    slope: f64,
}

impl Line {
    fn offset_at(self, device_s: f64) -> f64 {
        self.offset_s + self.slope * device_s
    }
}

/// Device time and offset of a reading, in seconds since the first.
#[derive(Clone, Copy, Debug)]
struct Point {
    device_s: f64,
    offset_s: f64,
}

/// Lowest and highest point of an interval of device time.
#[derive(Clone, Copy, Debug)]
struct Bin {
    start_s: f64,
    low: Point,
    high: Point,
}

impl DeviceClock {
    /// Host time at which a reading was taken, which is never after its arrival. Device and host time have independent origins. After the clock was
    /// set, as by a reset of the board, the estimation restarts.
    pub fn host_time(&mut self, device: Duration, arrival: Duration) -> Duration {
        if !self.epoch.as_mut().is_some_and(|epoch| epoch.step(device, arrival)) {
            self.epoch = Some(Epoch::new(device, arrival));
        }
        self.epoch.as_mut().map_or(arrival, |epoch| epoch.host_time(device, arrival))
    }

    /// Seconds by which the host's clock gains on the board's per second of the board's clock; `None` before the second reading.
    pub fn drift(&self) -> Option<f64> {
        self.epoch.as_ref().map(|epoch| epoch.line.slope).filter(|slope| *slope != 0.0)
    }
}

impl Epoch {
    fn new(device: Duration, arrival: Duration) -> Self {
        Self {
            first_device: device,
            first_host: arrival,
            last_device: device,
            last_host: arrival,
            wrapped: Duration::ZERO,
            bins: VecDeque::new(),
            line: Line { offset_s: 0.0, slope: 0.0 },
            spread_s: 0.0,
        }
    }

    /// Advances to the next reading. The host's clock gives the number of wrap-arounds. False for a clock that was set.
    fn step(&mut self, device: Duration, arrival: Duration) -> bool {
        let host_s = arrival.as_secs_f64() - self.last_host.as_secs_f64();
        let device_s = device.as_secs_f64() - self.last_device.as_secs_f64();
        let off_s = |times: f64, wrap: Duration| device_s + times * wrap.as_secs_f64() - host_s;
        let within_s = STEP_S + GREATEST_DRIFT * host_s;
        let around = WRAPS.iter().filter(|wrap| self.last_device < **wrap && device < **wrap).map(|wrap| {
            let times = ((host_s - device_s) / wrap.as_secs_f64()).round().max(0.0);
            (*wrap, times)
        });
        let stay = std::iter::once((Duration::ZERO, 0.0));
        // A clock that goes back has wrapped around, or was set.
        let Some((wrap, times)) = stay
            .chain(around)
            .filter(|(wrap, times)| device_s + times * wrap.as_secs_f64() >= 0.0)
            .find(|(wrap, times)| off_s(*times, *wrap).abs() <= within_s)
        else {
            return false;
        };
        self.wrapped += wrap.saturating_mul(times as u32);
        (self.last_device, self.last_host) = (device, arrival);
        true
    }

    fn host_time(&mut self, device: Duration, arrival: Duration) -> Duration {
        let device = device + self.wrapped;
        let since_first_s = |time: Duration, first: Duration| time.as_secs_f64() - first.as_secs_f64();
        let device_s = since_first_s(device, self.first_device);
        let host_s = since_first_s(arrival, self.first_host);
        let point = Point { device_s, offset_s: host_s - device_s };
        self.add(point);
        // The time is not after the arrival, and not before it by more than the largest delay so far.
        let above_s = (point.offset_s - self.line.offset_at(device_s)).clamp(0.0, self.spread_s);
        arrival.saturating_sub(Duration::from_secs_f64(above_s))
    }

    fn add(&mut self, point: Point) {
        match self.bins.back_mut() {
            Some(bin) if point.device_s < bin.start_s + BIN_S.min(BIN_RATIO * point.device_s) => {
                if point.offset_s < bin.low.offset_s {
                    bin.low = point;
                }
                if point.offset_s > bin.high.offset_s {
                    bin.high = point;
                }
            }
            _ => {
                self.bins.push_back(Bin { start_s: point.device_s, low: point, high: point });
                while self.bins.front().is_some_and(|bin| bin.start_s < point.device_s - WINDOW_S) {
                    self.bins.pop_front();
                }
                self.fit();
            }
        }
        let above_s = point.offset_s - self.line.offset_at(point.device_s);
        if above_s < 0.0 {
            // A point below the envelope lowers it until the next fit.
            self.line.offset_s += above_s;
            self.spread_s -= above_s;
        }
        self.spread_s = self.spread_s.max(above_s);
    }

    fn fit(&mut self) {
        self.line = envelope(&self.bins);
        let line = self.line;
        let above_s = |point: Point| point.offset_s - line.offset_at(point.device_s);
        self.spread_s = self.bins.iter().map(|bin| above_s(bin.high)).fold(0.0, f64::max);
    }
}

/// The line below all points with the least mean distance from them.
fn envelope(bins: &VecDeque<Bin>) -> Line {
    let lowest = |slope: f64| {
        let offsets = bins.iter().map(|bin| bin.low.offset_s - slope * bin.low.device_s);
        Line { offset_s: offsets.fold(f64::INFINITY, f64::min), slope }
    };
    let middle_s = bins.iter().map(|bin| bin.low.device_s).sum::<f64>() / bins.len() as f64;
    let hull = lower_hull(bins.iter().map(|bin| bin.low));
    let edge = hull.array_windows().find(|[_, end]| end.device_s >= middle_s);
    let slope =
        edge.map_or(0.0, |[start, end]| (end.offset_s - start.offset_s) / (end.device_s - start.device_s));
    lowest(slope.clamp(-GREATEST_DRIFT, GREATEST_DRIFT))
}

/// Lower convex hull of points in ascending order of device time.
fn lower_hull(points: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut hull: Vec<Point> = Vec::new();
    for point in points {
        while let [.., a, b] = hull[..] {
            let turns_left = (b.device_s - a.device_s) * (point.offset_s - a.offset_s)
                > (b.offset_s - a.offset_s) * (point.device_s - a.device_s);
            if turns_left {
                break;
            }
            hull.pop();
        }
        hull.push(point);
    }
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// A board with a clock that drifts against the host's, and a line with a jittering delay.
    struct Bench {
        rng: Xoshiro256PlusPlus,
        drift: f64,
        jitter_s: f64,
        start_s: f64,
    }

    impl Bench {
        fn new(seed: u64, drift: f64, jitter_s: f64, start_s: f64) -> Self {
            Self { rng: Xoshiro256PlusPlus::seed_from_u64(seed), drift, jitter_s, start_s }
        }

        /// Device time and arrival of the reading that is taken at a host time; the least delay is 0.
        fn read(&mut self, taken_s: f64) -> (Duration, Duration) {
            let device_us = (self.start_s + taken_s * (1.0 - self.drift)) * 1e6;
            let arrival_s = taken_s + self.rng.random_range(0.0..self.jitter_s);
            let device = Duration::from_micros(u64::from(device_us as u64 as u32));
            (device, Duration::from_secs_f64(arrival_s))
        }
    }

    /// Errors of the mapped time of readings at `rate_hz`, in seconds.
    fn errors_s(
        bench: &mut Bench,
        clock: &mut DeviceClock,
        from_s: f64,
        to_s: f64,
        rate_hz: f64,
    ) -> Vec<f64> {
        let taken = (0..).map(|i| from_s + f64::from(i) / rate_hz).take_while(|taken_s| *taken_s < to_s);
        taken
            .map(|taken_s| {
                let (device, arrival) = bench.read(taken_s);
                let mapped = clock.host_time(device, arrival);
                assert!(mapped <= arrival);
                mapped.as_secs_f64() - taken_s
            })
            .collect()
    }

    /// Resolution of the board's clock, in seconds.
    const TICK_S: f64 = 1e-6;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn mapped_times_are_off_by_less_than_arrivals_scatter(
            seed: u64,
            drift in -0.02..0.02,
            jitter_s in 1e-4..0.02,
            // Some clocks wrap around during the test.
            start_s in prop_oneof![Just(4290.0), 0.0..4200.0],
            rate_hz in 20.0..500.0,
        ) {
            let mut bench = Bench::new(seed, drift, jitter_s, start_s);
            let mut clock = DeviceClock::default();
            let errors = errors_s(&mut bench, &mut clock, 10.0, 40.0, rate_hz);
            let greatest = errors.iter().map(|error| error.abs()).fold(0.0, f64::max);
            prop_assert!(greatest < jitter_s + TICK_S, "{greatest} of {jitter_s}");
            // Once the drift is known, the errors are far below the jitter.
            let mut last = errors[errors.len() / 2..].to_vec();
            last.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
            let median = last[last.len() / 2].abs();
            prop_assert!(median < 0.1 * jitter_s, "{median} of {jitter_s}");
        }
    }

    #[test]
    fn a_drift_that_changes_is_followed() {
        let jitter_s = 2e-3;
        let mut bench = Bench::new(1, 50e-6, jitter_s, 0.0);
        let mut clock = DeviceClock::default();
        let mut start_s = 0.0;
        for drift in [50e-6, 80e-6, 20e-6] {
            // The clock continues at another rate.
            bench.start_s += start_s * (drift - bench.drift);
            bench.drift = drift;
            let errors = errors_s(&mut bench, &mut clock, start_s, start_s + 60.0, 200.0);
            assert!(errors.iter().all(|error| error.abs() < jitter_s + TICK_S));
            let told = clock.drift().unwrap();
            assert!((told - drift).abs() < 10e-6, "{told} of {drift}");
            start_s += 60.0;
        }
    }

    #[test]
    fn a_board_that_resets_is_learnt_anew() {
        let mut bench = Bench::new(2, 100e-6, 1e-3, 500.0);
        let mut clock = DeviceClock::default();
        errors_s(&mut bench, &mut clock, 0.0, 20.0, 100.0);
        bench.start_s = -19.9;
        let errors = errors_s(&mut bench, &mut clock, 20.0, 40.0, 100.0);
        assert!(errors.iter().all(|error| error.abs() < 1e-3 + TICK_S), "{errors:?}");
    }

    #[test]
    fn a_gap_longer_than_once_around_is_mapped() {
        let mut bench = Bench::new(3, 100e-6, 1e-3, 4000.0);
        let mut clock = DeviceClock::default();
        errors_s(&mut bench, &mut clock, 0.0, 20.0, 100.0);
        for gap_s in [100.0, 5000.0, 10_000.0] {
            let errors = errors_s(&mut bench, &mut clock, gap_s, gap_s + 5.0, 100.0);
            assert!(errors.iter().all(|error| error.abs() < 1e-3 + TICK_S), "{gap_s}");
        }
    }

    #[test]
    fn milliseconds_wrap_around_after_49_days() {
        let mut clock = DeviceClock::default();
        let wrap_s = (1_u64 << 32) as f64 * 1e-3;
        for i in 0..1000 {
            let taken_s = 0.01 * f64::from(i);
            let device = Duration::from_secs_f64((wrap_s - 5.0 + taken_s) % wrap_s);
            let mapped = clock.host_time(device, Duration::from_secs_f64(taken_s + 1.0));
            assert!((mapped.as_secs_f64() - taken_s - 1.0).abs() < 1e-6, "{i}");
        }
    }

    #[test]
    fn a_clock_of_another_unit_than_said_leaves_arrivals_as_they_are() {
        let mut clock = DeviceClock::default();
        for i in 0..1000_u64 {
            // Milliseconds are mistaken for seconds: 10 s each.
            let arrival = Duration::from_millis(10 * i);
            assert_eq!(clock.host_time(Duration::from_secs(10 * i), arrival), arrival);
        }
    }
}

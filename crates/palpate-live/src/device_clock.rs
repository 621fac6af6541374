//! Synchronization of the clock of a board with that of the host.
//!
//! Arrival − device time is the offset of the clocks plus a delay with a minimum. The lower envelope of this
//! difference over device time gives the offset with the least delay, and the drift as slope. The envelope is
//! the edge of the lower convex hull over the mean device time (Zhang, Liu, Xia, "Clock synchronization
//! algorithms for network measurements", INFOCOM 2002).

use std::collections::VecDeque;
use std::time::Duration;

/// Window of the fit, in seconds.
pub const WINDOW_S: f64 = 30.0;
/// Longest bin, in seconds and relative to the elapsed time; short first bins show a drift of some percent at
/// once.
const BIN_S: f64 = 0.25;
const BIN_RATIO: f64 = 1.0 / 16.0;
/// Greatest drift as a ratio: three times that of an uncalibrated oscillator of a microcontroller.
const GREATEST_DRIFT: f64 = 0.03;
/// Ranges of 32-bit clocks in µs and ms.
const WRAPS: [Duration; 2] = [Duration::from_micros(1 << 32), Duration::from_millis(1 << 32)];
/// Largest difference between steps in seconds, beyond [`GREATEST_DRIFT`], of clocks that were not set.
const STEP_S: f64 = 2.0;

/// Time between readings, with a wrap-around; `None` for a clock that was set back.
pub fn step(from: Duration, to: Duration) -> Option<Duration> {
    const END: u32 = 16;
    let around = |wrap: &Duration| from < *wrap && *wrap - from < *wrap / END && to < *wrap / END;
    let wrapped = || WRAPS.iter().find(|wrap| around(wrap)).map(|wrap| *wrap - from + to);
    to.checked_sub(from).or_else(wrapped)
}

/// Map from the board's clock to the host's.
#[derive(Debug, Default)]
pub struct DeviceClock {
    epoch: Option<Epoch>,
}

/// Period between two settings of the clock.
#[derive(Debug)]
struct Epoch {
    first_device: Duration,
    first_host: Duration,
    last_device: Duration,
    last_host: Duration,
    wrapped: Duration,
    bins: VecDeque<Bin>,
    line: Line,
    /// Greatest distance of a point above the line.
    spread_s: f64,
}

/// `offset_s + slope · device_s`.
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

#[derive(Clone, Copy, Debug)]
struct Point {
    device_s: f64,
    offset_s: f64,
}

#[derive(Clone, Copy, Debug)]
struct Bin {
    start_s: f64,
    low: Point,
    high: Point,
}

impl DeviceClock {
    /// Host time of a reading, at most its arrival. A clock that was set restarts the estimation.
    pub fn host_time(&mut self, device: Duration, arrival: Duration) -> Duration {
        if !self.epoch.as_mut().is_some_and(|epoch| epoch.step(device, arrival)) {
            self.epoch = Some(Epoch::new(device, arrival));
        }
        self.epoch.as_mut().map_or(arrival, |epoch| epoch.host_time(device, arrival))
    }

    /// Gain of the host's clock per second of the board's.
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

    /// Advances to a reading; false for a clock that was set.
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
        // The delay is at least 0 and at most the largest one so far.
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

        /// Device time and arrival.
        fn read(&mut self, taken_s: f64) -> (Duration, Duration) {
            let device_us = (self.start_s + taken_s * (1.0 - self.drift)) * 1e6;
            let arrival_s = taken_s + self.rng.random_range(0.0..self.jitter_s);
            let device = Duration::from_micros(u64::from(device_us as u64 as u32));
            (device, Duration::from_secs_f64(arrival_s))
        }
    }

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
            // With an estimated drift the errors are far below the jitter.
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
            // Milliseconds are interpreted as seconds: 10 s each.
            let arrival = Duration::from_millis(10 * i);
            assert_eq!(clock.host_time(Duration::from_secs(10 * i), arrival), arrival);
        }
    }
}

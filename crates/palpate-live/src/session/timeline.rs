//! Times of readings, and stretches without any.

use crate::device_clock::DeviceClock;
use crate::frame::Frame;
use crate::stamp::Stamp;
use std::time::Duration;

/// Times of the readings of a session.
#[derive(Debug, Default)]
pub struct Timeline {
    /// Wall clock at the start, less the monotonic one, in ns: later times are reckoned from it, so that they never go back.
    base_ns: Option<i128>,
    /// The same by the last look.
    seen_ns: i128,
    last_ns: u64,
    /// When the last reading was taken, as far as is known.
    last_taken: Option<Duration>,
    last_arrival: Option<Duration>,
    last_sequence: Option<u32>,
    device_clock: DeviceClock,
    /// Start of the second that is counted, and readings in it.
    second: (Duration, u32),
    rate_hz: f64,
}

/// A stretch without readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Its length in seconds.
    pub seconds: f64,
    /// Frames that the board sent in it, where it counts them.
    pub lost_frames: Option<u32>,
    /// Kind of the stretch.
    pub kind: GapKind,
}

/// Kind of a stretch without readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GapKind {
    /// Frames of a stream that went on were lost.
    LostFrames,
    /// Nothing came for longer than [`GAP_S`] and [`GAP_PERIODS`].
    Silence,
}

/// A wall clock that is off by more was set, in ns: it is slewed by less.
const SET_NS: i128 = 500_000_000;
/// Shortest silence that is a gap, in seconds, and its length in periods of the readings.
const GAP_S: f64 = 0.5;
const GAP_PERIODS: f64 = 5.0;

impl Timeline {
    /// Nanoseconds since 1970 of an instant.
    pub fn unix_ns(&self, at: Stamp) -> u64 {
        let base_ns = self.base_ns.unwrap_or_else(|| offset_ns(at));
        u64::try_from(base_ns + at.elapsed.as_nanos() as i128).unwrap_or(0)
    }

    /// Seconds by which the wall clock was set since the last look, where it was.
    pub fn look_at_clock(&mut self, at: Stamp) -> Option<f64> {
        let offset_ns = offset_ns(at);
        if self.base_ns.is_none() {
            self.base_ns = Some(offset_ns);
            self.seen_ns = offset_ns;
        }
        let by_ns = offset_ns - self.seen_ns;
        self.seen_ns = offset_ns;
        (by_ns.abs() > SET_NS).then_some(by_ns as f64 * 1e-9)
    }

    /// Time of the next reading in ns since 1970, later than that of the one before it, and the gap before it; `behind` more frames have arrived with it.
    pub fn next(&mut self, at: Stamp, frame: &Frame, behind: usize) -> (u64, Option<Gap>) {
        let gap = self.gap(at.elapsed, frame.sequence);
        let taken = match frame.device_time {
            Some(device) => self.device_clock.host_time(device, at.elapsed),
            None => at.elapsed.saturating_sub(self.period(at.elapsed, behind).mul_f64(behind as f64)),
        };
        self.count(at.elapsed);
        self.last_arrival = Some(at.elapsed);
        self.last_sequence = frame.sequence;
        self.last_taken = Some(taken);
        self.last_ns = self.unix_ns(Stamp { elapsed: taken, ..at }).max(self.last_ns + 1);
        (self.last_ns, gap)
    }

    /// Time between frames that arrived together and tell no time, this one and `behind` more, as through USB: evenly over the time since the last reading,
    /// but no further apart than is usual.
    fn period(&self, at: Duration, behind: usize) -> Duration {
        let since = self.last_taken.map_or(Duration::ZERO, |last| at.saturating_sub(last));
        let even = since.div_f64(behind as f64 + 1.0);
        if self.rate_hz > 0.0 { even.min(Duration::from_secs_f64(1.0 / self.rate_hz)) } else { even }
    }

    /// Readings a second.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn gap(&self, now: Duration, sequence: Option<u32>) -> Option<Gap> {
        let seconds = now.saturating_sub(self.last_arrival?).as_secs_f64();
        // A number that goes back is that of a board that has begun anew.
        let lost_frames = self
            .last_sequence
            .zip(sequence)
            .map(|(last, next)| next.wrapping_sub(last))
            .filter(|step| *step < 1 << 31)
            .map(|step| step.saturating_sub(1));
        let longest_s =
            if self.rate_hz > 0.0 { GAP_S.max(GAP_PERIODS / self.rate_hz) } else { f64::INFINITY };
        let kind = if seconds > longest_s { GapKind::Silence } else { GapKind::LostFrames };
        (kind == GapKind::Silence || lost_frames.is_some_and(|lost| lost > 0)).then_some(Gap {
            seconds,
            lost_frames,
            kind,
        })
    }

    fn count(&mut self, now: Duration) {
        let (start, count) = &mut self.second;
        *count += 1;
        let span = now.saturating_sub(*start);
        if span >= Duration::from_secs(1) {
            self.rate_hz = f64::from(*count) / span.as_secs_f64();
            self.second = (now, 0);
        }
    }
}

fn offset_ns(at: Stamp) -> i128 {
    i128::from(at.unix_ns) - at.elapsed.as_nanos() as i128
}

#[cfg(test)]
mod tests {
    use super::*;

    fn next(timeline: &mut Timeline, ms: u64, sequence: u32, device_ms: u64) -> (u64, Option<Gap>) {
        let elapsed = Duration::from_millis(ms);
        let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
        timeline.look_at_clock(at);
        let device_time = Some(Duration::from_millis(device_ms));
        timeline.next(at, &Frame { reading: vec![], sequence: Some(sequence), device_time }, 0)
    }

    /// The times, in ms after the start, of frames without a time that arrive in bursts: (ms of the arrival, frames in it).
    fn burst_times_ms(bursts: impl IntoIterator<Item = (u64, usize)>) -> Vec<f64> {
        let mut timeline = Timeline::default();
        let mut times_ms = Vec::new();
        for (ms, frames) in bursts {
            let elapsed = Duration::from_millis(ms);
            let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
            timeline.look_at_clock(at);
            for behind in (0..frames).rev() {
                let frame = Frame { reading: vec![], sequence: None, device_time: None };
                let (unix_ns, _) = timeline.next(at, &frame, behind);
                times_ms.push((unix_ns - 1_800_000_000_000_000_000) as f64 * 1e-6);
            }
        }
        times_ms
    }

    #[test]
    fn frames_that_arrive_together_are_spread_over_the_time_before_and_never_share_one() {
        // Four frames every 8 ms for some seconds, then a silence, then four more.
        let bursts = (1..400).map(|burst| (8 * burst, 4)).chain([(10_000, 4)]);
        let times_ms = burst_times_ms(bursts);
        assert!(times_ms.windows(2).all(|pair| pair[1] > pair[0]));
        for (i, time_ms) in times_ms[4..1596].iter().enumerate() {
            assert!((time_ms - (8.0 + 2.0 * (i + 1) as f64)).abs() < 0.1, "{i}: {time_ms}");
        }
        // After a silence they are as far apart as is usual, not spread over it.
        for (last, expected_ms) in times_ms[1596..].iter().zip([9994.0, 9996.0, 9998.0, 10_000.0]) {
            assert!((last - expected_ms).abs() < 0.1, "{last}");
        }
    }

    #[test]
    fn times_are_those_of_the_board() {
        let mut timeline = Timeline::default();
        let start_ns = next(&mut timeline, 1000, 0, 50).0;
        // Late by 7 ms, then at its time, then late again: of the lateness a tenth is left at most, by the drift that the clock may have.
        for (arrived_ms, number) in [(1017, 1), (1020, 2), (1037, 3)] {
            let device_ms = 50 + 10 * number;
            let at_ns = next(&mut timeline, arrived_ms, number as u32, device_ms).0;
            let off_ns = at_ns.abs_diff(start_ns + 10_000_000 * number);
            assert!(off_ns < 700_000, "{number}: {off_ns}");
        }
    }

    #[test]
    fn frames_that_are_lost_are_counted_around_the_wrap_and_not_over_a_reset() {
        let mut timeline = Timeline::default();
        next(&mut timeline, 0, u32::MAX - 1, 0);
        assert_eq!(next(&mut timeline, 10, 2, 10).1.and_then(|gap| gap.lost_frames), Some(3));
        assert_eq!(next(&mut timeline, 20, 0, 0).1, None);
        assert_eq!(next(&mut timeline, 30, 2, 10).1.and_then(|gap| gap.lost_frames), Some(1));
    }
}

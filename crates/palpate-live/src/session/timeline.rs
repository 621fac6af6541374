use crate::device_clock::{self, DeviceClock};
use crate::frame::Frame;
use crate::stamp::Stamp;
use std::time::Duration;

#[derive(Debug, Default)]
pub struct Timeline {
    /// Wall − monotonic clock at the start; relative times never decrease.
    base_ns: Option<i128>,
    seen_ns: i128,
    last_ns: u64,
    last_taken: Option<Duration>,
    last_arrival: Option<Duration>,
    last_sequence: Option<u32>,
    device_clock: DeviceClock,
    /// Set for streams of any rate.
    board: Option<BoardPace>,
    second: Option<(Duration, u32)>,
    rate_hz: f64,
}

/// Time without readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    pub seconds: f64,
    pub lost_frames: Option<u32>,
    pub kind: GapKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GapKind {
    /// Lost frames of a continuing stream.
    LostFrames,
    /// No reading for longer than [`GAP_S`] and [`GAP_PERIODS`].
    Silence,
}

/// Change in ns that exceeds slewing.
const SET_NS: i128 = 500_000_000;
/// Shortest silence, in seconds and in periods of the readings.
const GAP_S: f64 = 0.5;
const GAP_PERIODS: f64 = 5.0;

impl Timeline {
    pub fn unix_ns(&self, at: Stamp) -> u64 {
        let base_ns = self.base_ns.unwrap_or_else(|| offset_ns(at));
        u64::try_from(base_ns + at.elapsed.as_nanos() as i128).unwrap_or(0)
    }

    /// Seconds by which the wall clock was set.
    pub fn clock_step(&mut self, at: Stamp) -> Option<f64> {
        let offset_ns = offset_ns(at);
        if self.base_ns.is_none() {
            self.base_ns = Some(offset_ns);
            self.seen_ns = offset_ns;
        }
        let by_ns = offset_ns - self.seen_ns;
        self.seen_ns = offset_ns;
        (by_ns.abs() > SET_NS).then_some(by_ns as f64 * 1e-9)
    }

    pub fn follow_board(&mut self) {
        self.board = Some(BoardPace::default());
    }

    /// Time of the board's clock, if followed, else the arrival.
    pub fn board_stamp(&mut self, at: Stamp, device_time: Option<Duration>) -> Stamp {
        match (&mut self.board, device_time) {
            (Some(board), Some(device)) => {
                let elapsed = board.elapsed(device, at.elapsed);
                let by_ns = elapsed.as_nanos() as i128 - at.elapsed.as_nanos() as i128;
                let unix_ns = u64::try_from(i128::from(at.unix_ns) + by_ns).unwrap_or(0);
                Stamp { elapsed, unix_ns }
            }
            _ => at,
        }
    }

    /// Increasing Unix time in ns, and a preceding gap; `behind` more frames arrived.
    pub fn next(&mut self, at: Stamp, frame: &Frame, behind: usize) -> (u64, Option<Gap>) {
        let gap = self.gap(at.elapsed, frame.sequence);
        if gap.is_some_and(|gap| gap.kind == GapKind::Silence) {
            // A silence interrupts the measurement of the rate.
            self.second = None;
        }
        let taken = match frame.device_time {
            Some(_) if self.board.is_some() => at.elapsed,
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

    /// Frames that arrived together, as through USB, are evenly spaced, at most by the usual period.
    fn period(&self, at: Duration, behind: usize) -> Duration {
        let since = self.last_taken.map_or(Duration::ZERO, |last| at.saturating_sub(last));
        let even = since.div_f64(behind as f64 + 1.0);
        if self.rate_hz > 0.0 { even.min(Duration::from_secs_f64(1.0 / self.rate_hz)) } else { even }
    }

    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn gap(&self, now: Duration, sequence: Option<u32>) -> Option<Gap> {
        let seconds = now.saturating_sub(self.last_arrival?).as_secs_f64();
        // A number that decreases comes from a board that has restarted.
        let lost_frames = self
            .last_sequence
            .zip(sequence)
            .map(|(last, next)| next.wrapping_sub(last))
            .filter(|step| *step < 1 << 31)
            .map(|step| step.saturating_sub(1));
        let rate_hz = if self.rate_hz > 0.0 { self.rate_hz } else { self.rate_so_far_hz() };
        let longest_s = if rate_hz > 0.0 { GAP_S.max(GAP_PERIODS / rate_hz) } else { f64::INFINITY };
        let kind = if seconds > longest_s { GapKind::Silence } else { GapKind::LostFrames };
        (kind == GapKind::Silence || lost_frames.is_some_and(|lost| lost > 0)).then_some(Gap {
            seconds,
            lost_frames,
            kind,
        })
    }

    /// Rate in the current second: infinite for several readings at one instant.
    fn rate_so_far_hz(&self) -> f64 {
        let Some(((start, count), last)) = self.second.zip(self.last_arrival) else { return 0.0 };
        if count == 0 { 0.0 } else { f64::from(count) / last.saturating_sub(start).as_secs_f64() }
    }

    fn count(&mut self, now: Duration) {
        // The first reading begins a second, and is not counted in it.
        let Some((start, count)) = &mut self.second else {
            self.second = Some((now, 0));
            return;
        };
        *count += 1;
        let span = now.saturating_sub(*start);
        if span >= Duration::from_secs(1) {
            self.rate_hz = f64::from(*count) / span.as_secs_f64();
            self.second = Some((now, 0));
        }
    }
}

#[derive(Debug, Default)]
struct BoardPace {
    last: Option<(Duration, Duration)>,
}

impl BoardPace {
    fn elapsed(&mut self, device: Duration, arrival: Duration) -> Duration {
        let elapsed = match self.last {
            None => arrival,
            // A clock that goes back was set, for example by a reset, or has wrapped around.
            Some((last_device, last)) => last + device_clock::step(last_device, device).unwrap_or_default(),
        };
        self.last = Some((device, elapsed));
        elapsed
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
        timeline.clock_step(at);
        let device_time = Some(Duration::from_millis(device_ms));
        timeline.next(at, &Frame { reading: vec![], sequence: Some(sequence), device_time }, 0)
    }

    /// Times of bursts: (ms of the arrival, number of frames).
    fn burst_times_ms(bursts: impl IntoIterator<Item = (u64, usize)>) -> Vec<f64> {
        let mut timeline = Timeline::default();
        let mut times_ms = Vec::new();
        for (ms, frames) in bursts {
            let elapsed = Duration::from_millis(ms);
            let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
            timeline.clock_step(at);
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
        // After a silence they have the usual distance, and are not distributed over the silence.
        for (last, expected_ms) in times_ms[1596..].iter().zip([9994.0, 9996.0, 9998.0, 10_000.0]) {
            assert!((last - expected_ms).abs() < 0.1, "{last}");
        }
    }

    #[test]
    fn times_are_those_of_the_board() {
        let mut timeline = Timeline::default();
        let start_ns = next(&mut timeline, 1000, 0, 50).0;
        // Late by 7 ms, on time, then late again: at most a tenth of the delay remains, because the clock may
        // drift.
        for (arrived_ms, number) in [(1017, 1), (1020, 2), (1037, 3)] {
            let device_ms = 50 + 10 * number;
            let at_ns = next(&mut timeline, arrived_ms, number as u32, device_ms).0;
            let off_ns = at_ns.abs_diff(start_ns + 10_000_000 * number);
            assert!(off_ns < 700_000, "{number}: {off_ns}");
        }
    }

    fn gaps_s(arrivals_ms: impl IntoIterator<Item = u64>) -> Vec<f64> {
        let mut timeline = Timeline::default();
        let gaps = arrivals_ms.into_iter().filter_map(|ms| {
            let elapsed = Duration::from_millis(ms);
            let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
            let frame = Frame { reading: vec![], sequence: None, device_time: None };
            timeline.next(at, &frame, 0).1.map(|gap| gap.seconds)
        });
        gaps.collect()
    }

    #[test]
    fn silences_are_gaps_from_the_second_reading_on() {
        // The first reading arrives 7 s after the start, which does not count as a gap.
        assert_eq!(gaps_s([7000, 7010, 7910]), [0.9]);
        assert_eq!(gaps_s((0..59).map(|i| 7000 + 10 * i).chain([9000, 9010, 9020])), [1.42]);
        // A silence does not lower the rate that detects the next silence.
        assert_eq!(gaps_s((0..300).map(|i| 10 * i).chain([12_990, 13_000, 13_600])), [10.0, 0.6]);
        // A board with a reading every 2 s, and one that sends many at once.
        assert!(gaps_s((0..20).map(|i| 2000 * i)).is_empty());
        assert!(gaps_s([100, 100, 100, 500]).is_empty());
    }

    #[test]
    fn a_piped_stream_has_the_times_of_the_board() {
        let mut timeline = Timeline::default();
        timeline.follow_board();
        let at = Stamp { elapsed: Duration::from_secs(5), unix_ns: 1_800_000_000_000_000_000 };
        let mut times_ns = Vec::new();
        // Around the overflow of 32-bit microseconds, and with a reset.
        let wrap_us = 1_u64 << 32;
        for device_us in [wrap_us - 2000, wrap_us - 1000, 0, 1000, 701_000, 0, 1000] {
            let device_time = Some(Duration::from_micros(device_us));
            let stamp = timeline.board_stamp(at, device_time);
            let frame = Frame { reading: vec![], sequence: None, device_time };
            let (unix_ns, gap) = timeline.next(stamp, &frame, 0);
            times_ns.push((unix_ns - at.unix_ns) / 1_000_000);
            assert_eq!(gap.is_some(), device_us == 701_000, "{device_us}");
        }
        assert_eq!(times_ns, [0, 1, 2, 3, 703, 703, 704]);
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

//! Moving contacts.

use std::f64::consts::PI;

use crate::contact::{Contact, Position};
use palpate_numerics::OutOfRange;

/// A contact that moves back and forth along a straight line.
///
/// Over `turn_m` at either end the speed changes as (1 − cos)/2, with acceleration ≤ πv²/(4·turn_m). Between
/// passes the contact is lifted for `lifted_s`, with transitions of `touch_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    from: Position,
    to: Position,
    speed_m_per_s: f64,
    turn_m: f64,
    passes: usize,
    lifted_s: f64,
    touch_s: f64,
}

/// Pieces of a turn: the error is π/(8·200²) = 10⁻⁵ of its length, or 1.6·10⁻⁵ of the force.
const PIECES: usize = 200;

/// Duration of a sudden change of force.
const AT_ONCE_S: f64 = 1e-9;

impl Motion {
    /// Creates one pass.
    ///
    /// # Errors
    /// [`OutOfRange`] unless distance and speed are positive, and the turn is positive and at most half the
    /// distance.
    ///
    /// ```
    /// use palpate_mechanics::contact::Position;
    /// use palpate_mechanics::surface::Motion;
    ///
    /// let motion = Motion::new(Position::along(0.05), Position::along(0.35), 0.5, 0.05)?;
    /// assert!((motion.duration_s() - 0.8).abs() < 1e-12); // turns of 0.2 s, 0.4 s between them
    /// # Ok::<(), palpate_numerics::OutOfRange>(())
    /// ```
    pub fn new(from: Position, to: Position, speed_m_per_s: f64, turn_m: f64) -> Result<Self, OutOfRange> {
        Self { from, to, speed_m_per_s, turn_m, passes: 1, lifted_s: 0.0, touch_s: 0.0 }.checked()
    }

    /// Sets the constant speed.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn with_speed(self, speed_m_per_s: f64) -> Result<Self, OutOfRange> {
        Self { speed_m_per_s, ..self }.checked()
    }

    /// Sets the number of passes.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn with_passes(self, passes: usize) -> Result<Self, OutOfRange> {
        Self { passes, ..self }.checked()
    }

    /// Sets the time without contact between passes, and that of each fall and rise of the force.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn with_lifts(self, lifted_s: f64, touch_s: f64) -> Result<Self, OutOfRange> {
        Self { lifted_s, touch_s, ..self }.checked()
    }

    fn checked(self) -> Result<Self, OutOfRange> {
        let way_m = self.length_m();
        OutOfRange::check_positive([("the way in metres", way_m), ("the speed in m/s", self.speed_m_per_s)])?;
        let turn = [("the turn in metres", self.turn_m)];
        OutOfRange::check("greater than 0 and at most half the way", turn, |m| m > 0.0 && m <= 0.5 * way_m)?;
        OutOfRange::check("at least 1", [("the number of passes", self.passes as f64)], |n| n >= 1.0)?;
        let times = [
            ("the time lifted in seconds", self.lifted_s),
            ("the time of touching in seconds", self.touch_s),
        ];
        OutOfRange::check_not_negative(times)?;
        Ok(self)
    }

    /// Duration.
    pub fn duration_s(&self) -> f64 {
        self.passes as f64 * self.pass_s() + (self.passes - 1) as f64 * self.rest_s()
    }

    /// Returns the contact at `time_s`, clamped to the duration, with the force `force_n` or less.
    pub fn contact_at(&self, time_s: f64, force_n: f64) -> Contact {
        let time_s = time_s.clamp(0.0, self.duration_s());
        let cycle_s = self.pass_s() + self.rest_s();
        let pass = ((time_s / cycle_s).floor() as usize).min(self.passes - 1);
        let since_s = time_s - pass as f64 * cycle_s;
        let way = self.distance_travelled_m(since_s.min(self.pass_s())) / self.length_m();
        let share = if pass.is_multiple_of(2) { way } else { 1.0 - way };
        Contact {
            position: Position {
                x_m: self.from.x_m + share * (self.to.x_m - self.from.x_m),
                y_m: self.from.y_m + share * (self.to.y_m - self.from.y_m),
            },
            force_n: force_n * self.pressed(since_s - self.pass_s()),
        }
    }

    /// Instants between which the motion is linear to 1/200 of each turn and change of force.
    pub fn breaks_s(&self, from_s: f64, to_s: f64) -> Vec<f64> {
        let cycle_s = self.pass_s() + self.rest_s();
        let pass_at = |time_s: f64| ((time_s / cycle_s).max(0.0) as usize).min(self.passes - 1);
        let mut breaks = Vec::new();
        for pass in pass_at(from_s)..=pass_at(to_s) {
            for [begin_s, end_s] in self.curved_s(pass).into_iter().flatten() {
                let pieces = if end_s - begin_s > 3.0 * AT_ONCE_S { PIECES } else { 1 };
                let share = |i: usize| i as f64 / pieces as f64;
                let at = |i: usize| pass as f64 * cycle_s + begin_s + share(i) * (end_s - begin_s);
                breaks.extend((0..=pieces).map(at).filter(|time_s| from_s < *time_s && *time_s < to_s));
            }
        }
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        breaks
    }

    fn curved_s(&self, pass: usize) -> [Option<[f64; 2]>; 4] {
        let (turn_s, pass_s, rest_s) = (self.turn_s(), self.pass_s(), self.rest_s());
        let is_lifted = rest_s > 0.0 && pass + 1 < self.passes;
        let around = |begin_s: f64, end_s: f64| {
            let sudden_s = if self.touch_s > 0.0 { 0.0 } else { AT_ONCE_S };
            is_lifted.then_some([begin_s - sudden_s, end_s + sudden_s])
        };
        [
            Some([0.0, turn_s]),
            Some([pass_s - turn_s, pass_s]),
            around(pass_s, pass_s + self.touch_s),
            around(pass_s + rest_s - self.touch_s, pass_s + rest_s),
        ]
    }

    fn length_m(&self) -> f64 {
        self.from.distance_m(self.to)
    }

    fn turn_s(&self) -> f64 {
        2.0 * self.turn_m / self.speed_m_per_s
    }

    fn pass_s(&self) -> f64 {
        2.0 * self.turn_s() + (self.length_m() - 2.0 * self.turn_m) / self.speed_m_per_s
    }

    fn rest_s(&self) -> f64 {
        if self.lifted_s > 0.0 { self.lifted_s + 2.0 * self.touch_s } else { 0.0 }
    }

    fn distance_travelled_m(&self, since_s: f64) -> f64 {
        let (turn_s, left_s) = (self.turn_s(), self.pass_s() - since_s);
        let turning = |t: f64| 0.5 * self.speed_m_per_s * (t - turn_s / PI * (PI * t / turn_s).sin());
        if since_s < turn_s {
            turning(since_s)
        } else if left_s < turn_s {
            self.length_m() - turning(left_s.max(0.0))
        } else {
            self.turn_m + self.speed_m_per_s * (since_s - turn_s)
        }
    }

    /// Share of the force after a pass; it changes as (1 ± cos)/2.
    fn pressed(&self, rest_s: f64) -> f64 {
        if rest_s <= 0.0 || self.lifted_s <= 0.0 {
            return 1.0;
        }
        let to_edge_s = rest_s.min(self.rest_s() - rest_s);
        if to_edge_s >= self.touch_s { 0.0 } else { 0.5 * (1.0 + (PI * to_edge_s / self.touch_s).cos()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion() -> Motion {
        Motion::new(Position::along(0.35), Position::along(0.05), 0.5, 0.05)
            .and_then(|motion| motion.with_passes(3)?.with_lifts(0.3, 0.1))
            .unwrap()
    }

    #[test]
    fn it_goes_there_and_back_and_is_lifted_between() {
        // A pass takes two turns of 0.2 s and 0.4 s between them; a rest takes 0.5 s.
        assert!((motion().duration_s() - (3.0 * 0.8 + 2.0 * 0.5)).abs() < 1e-12);
        let at = |time_s: f64| {
            let Contact { position, force_n } = motion().contact_at(time_s, 3.0);
            format!("{:.1} mm {force_n:.2} N", position.x_m * 1e3)
        };
        let told = [-1.0, 0.2, 0.4, 0.8, 0.85, 1.05, 1.3, 1.5, 2.1, 9.0].map(at);
        insta::assert_snapshot!(told.join(", "), @"350.0 mm 3.00 N, 300.0 mm 3.00 N, 200.0 mm 3.00 N, 50.0 mm 3.00 N, 50.0 mm 1.50 N, 50.0 mm 0.00 N, 50.0 mm 3.00 N, 100.0 mm 3.00 N, 350.0 mm 3.00 N, 50.0 mm 3.00 N");
    }

    #[test]
    fn on_a_plane_it_goes_straight_at_the_same_speed() {
        // The distance is 300 mm, as along the line.
        let (from, to) = (Position { x_m: 0.3, y_m: 0.25 }, Position { x_m: 0.06, y_m: 0.07 });
        let plane = Motion { from, to, ..motion() };
        for time_s in [0.1, 0.2, 0.35, 0.7, 1.45] {
            let (along, on_plane) = (motion().contact_at(time_s, 3.0), plane.contact_at(time_s, 3.0));
            let way_m = on_plane.position.distance_m(from);
            assert!((way_m - (0.35 - along.position.x_m)).abs() < 1e-12);
            let Position { x_m, y_m } = on_plane.position;
            assert!(((0.3 - x_m) * 0.18 - (0.25 - y_m) * 0.24).abs() < 1e-15);
        }
    }

    #[test]
    fn straight_pieces_between_its_breaks_follow_it() {
        let lifted = |touch_s| motion().with_passes(3).unwrap().with_lifts(0.2, touch_s).unwrap();
        for moved in [motion(), lifted(0.02), lifted(0.0), motion().with_passes(2).unwrap()] {
            let (start_s, end_s) = (0.0123, moved.duration_s());
            let mut ends = vec![start_s];
            ends.extend(moved.breaks_s(start_s, end_s));
            ends.push(end_s);
            for (a, b) in ends.windows(2).map(|pair| (pair[0], pair[1])) {
                assert!(a < b);
                let [from, to] = [a, b].map(|time_s| moved.contact_at(time_s, 3.0));
                let within = moved.contact_at(0.5 * (a + b), 3.0);
                let sag_m = (within.position.x_m - 0.5 * (from.position.x_m + to.position.x_m)).abs();
                assert!(sag_m < 1.01e-5 * 0.05, "{a} {b}: {sag_m}");
                let sag_n = (within.force_n - 0.5 * (from.force_n + to.force_n)).abs();
                assert!(sag_n < 1.6e-5 * 3.0 || b - a < 1.1e-9 && moved.touch_s == 0.0, "{a} {b}: {sag_n}");
            }
        }
        assert_eq!(motion().breaks_s(0.3, 0.31), Vec::<f64>::new());
    }

    #[test]
    fn its_speed_and_acceleration_stay_within_their_bounds() {
        let touching = motion().with_lifts(0.0, 0.1).unwrap();
        let (h, most) = (1e-4, PI * 0.25 / (4.0 * 0.05));
        let x = |time_s: f64| touching.contact_at(time_s, 1.0).position.x_m;
        for i in 1..(touching.duration_s() / h) as i32 {
            let t = h * f64::from(i);
            let (speed, acceleration) =
                ((x(t + h) - x(t - h)) / (2.0 * h), (x(t + h) - 2.0 * x(t) + x(t - h)) / (h * h));
            assert!(
                speed.abs() <= 0.5 + 1e-9 && acceleration.abs() <= most + 0.05,
                "{t}: {speed} {acceleration}"
            );
        }
    }

    #[test]
    fn numbers_out_of_bounds_are_refused_with_their_value() {
        let (from, to) = (Position::along(0.1), Position::along(0.2));
        let told = [
            Motion::new(from, from, 0.5, 0.05),
            Motion::new(from, to, f64::INFINITY, 0.05),
            Motion::new(from, to, 0.5, 0.06),
            motion().with_passes(0),
            motion().with_speed(-1.0),
            motion().with_lifts(-0.1, 0.0),
        ];
        insta::assert_snapshot!(told.map(|motion| motion.unwrap_err().to_string()).join("\n"), @r"
        the way in metres is 0; it must be greater than 0 and finite
        the speed in m/s is inf; it must be greater than 0 and finite
        the turn in metres is 0.06; it must be greater than 0 and at most half the way
        the number of passes is 0; it must be at least 1
        the speed in m/s is -1; it must be greater than 0 and finite
        the time lifted in seconds is -0.1; it must be at least 0 and finite
        ");
    }
}

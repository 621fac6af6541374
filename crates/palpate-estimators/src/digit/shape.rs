//! The shape of a finger at an estimated contact, and how sure it is.

use palpate_core::ContactEstimate;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::{Digit, Elastica};

/// The centre line of a finger, from clamp to tip.
#[derive(Clone, Debug, PartialEq)]
pub struct DigitShape {
    /// Its points, equal steps of the finger's length apart; never empty.
    pub points: Vec<ShapePoint>,
}

/// A point of a centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapePoint {
    /// How far along the finger it is, in metres.
    pub at_m: f64,
    /// Where it is along the straight finger, in metres.
    pub x_m: f64,
    /// Where it is across, positive upward, in metres.
    pub y_m: f64,
    /// Root mean square distance of the true point from this one, in metres; 0 where the contact's uncertainty is not known.
    pub sd_m: f64,
}

impl DigitShape {
    /// The exact shape at the estimated contact; an estimate without a force leaves the finger straight.
    ///
    /// Its uncertainty is the contact's, carried over by the shapes one standard deviation to either side along the
    /// columns of the covariance's Cholesky factor.
    pub(super) fn new(digit: &Digit, contact: &ContactEstimate, steps: usize) -> Self {
        let force_n = contact.force_n.unwrap_or(0.0);
        let at = |off_m: f64, off_n: f64| {
            let position_m = (contact.position.x_m + off_m).max(0.0).min(digit.length_m());
            digit
                .shape(Contact { position: Position::along(position_m), force_n: (force_n + off_n).max(0.0) })
        };
        let shape = at(0.0, 0.0);
        let beside: Vec<[Elastica; 2]> = deviations(contact).map(|[x, f]| [at(x, f), at(-x, -f)]).to_vec();
        let steps = steps.max(1);
        let point = |i: usize| {
            let at_m = digit.length_m() * i as f64 / steps as f64;
            let [x_m, y_m] = shape.point(at_m);
            let off = |[a, b]: &[Elastica; 2]| {
                let ([ax, ay], [bx, by]) = (a.point(at_m), b.point(at_m));
                0.5 * (ax - bx).hypot(ay - by)
            };
            let sd_m = beside.iter().map(off).fold(0.0, f64::hypot);
            ShapePoint { at_m, x_m, y_m, sd_m }
        };
        Self { points: (0..=steps).map(point).collect() }
    }

    /// The tip.
    pub fn tip(&self) -> Option<&ShapePoint> {
        self.points.last()
    }

    /// The largest distance of a point from the same point of the finger's exact shape under `truth`, in metres.
    pub fn distance_m(&self, digit: &Digit, truth: Contact) -> f64 {
        let exact = digit.shape(truth);
        let distance = |point: &ShapePoint| {
            let [x_m, y_m] = exact.point(point.at_m);
            (point.x_m - x_m).hypot(point.y_m - y_m)
        };
        self.points.iter().map(distance).fold(0.0, f64::max)
    }
}

/// The columns of the Cholesky factor of the contact's covariance, each as (position, force).
fn deviations(contact: &ContactEstimate) -> [[f64; 2]; 2] {
    let Some(uncertainty) = contact.uncertainty else { return [[0.0; 2]; 2] };
    let [xx, _, xf, _, _, ff] = uncertainty.covariance;
    if xx <= 0.0 {
        return [[0.0; 2], [0.0, ff.max(0.0).sqrt()]];
    }
    [[xx.sqrt(), xf / xx.sqrt()], [0.0, (ff - xf * xf / xx).max(0.0).sqrt()]]
}

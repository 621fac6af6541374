//! An influence function: a cubic in every stretch.

use super::state::State;
use crate::contact::Position;
use crate::surface::InfluenceFunction;

/// What a sensor reads per newton, as the shape that a disturbance at the sensor bends the beam into (Betti and Maxwell;
/// Müller-Breslau, *Die neueren Methoden der Festigkeitslehre*, 1886).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shape {
    /// In metres.
    pub length_m: f64,
    /// From one end of the beam to the other.
    pub pieces: Vec<Piece>,
}

/// One cubic, known by its states at both ends. Places are shares of the beam's length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub from: f64,
    pub to: f64,
    pub start: State,
    pub end: State,
    pub stiffness: f64,
}

impl Piece {
    /// The state at a place, from the nearer end: beside a support the deflection is then as small as it should be.
    fn at(&self, place: f64) -> State {
        let (behind, ahead) = (place - self.from, self.to - place);
        if behind <= ahead {
            self.start.advanced(behind, self.stiffness)
        } else {
            self.end.advanced(-ahead, self.stiffness)
        }
    }

    /// The largest magnitude of the deflection: at an end, or where the slope, a quadratic, is 0.
    fn peak(&self) -> f64 {
        let State { slope, moment, shear, .. } = self.start;
        let level = roots(shear / 2.0, moment, slope * self.stiffness);
        let within = level.into_iter().filter(|by| (0.0..=self.to - self.from).contains(by));
        within
            .map(|by| self.at(self.from + by).deflection.abs())
            .fold(self.start.deflection.abs().max(self.end.deflection.abs()), f64::max)
    }
}

impl Shape {
    /// The largest magnitude over all contact positions.
    pub fn peak(&self) -> f64 {
        self.pieces.iter().map(Piece::peak).fold(0.0, f64::max)
    }

    fn state(&self, contact: Position) -> State {
        let place = contact.x_m / self.length_m;
        let piece = self.pieces.partition_point(|piece| piece.to < place).min(self.pieces.len() - 1);
        self.pieces[piece].at(place)
    }
}

impl InfluenceFunction for Shape {
    fn at(&self, contact: Position) -> f64 {
        self.state(contact).deflection
    }

    fn gradient(&self, contact: Position) -> [f64; 2] {
        [self.state(contact).slope / self.length_m, 0.0]
    }
}

/// The real roots of a·t² + b·t + c; NaN for those that are not there.
fn roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let root = (b * b - 4.0 * a * c).sqrt();
    let q = -0.5 * (b + if b < 0.0 { -root } else { root });
    [q / a, c / q]
}

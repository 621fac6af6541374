//! Admissible states of a beam, and its shape after a disturbance.
//!
//! Lengths are shares of the length l, stiffnesses shares of the largest bending stiffness D. A sweep carries
//! a basis of the two-dimensional space of states through supports and elements, and orthonormalises it
//! (Godunov, Uspekhi Mat. Nauk 16(3), 1961). Stiffness matrices would lose (l/h)³ digits for an element of
//! length h, and exclude rigid supports.

use std::ops::{Add, Mul};

use super::spec::SAME_PLACE;
use crate::contact::Position;
use crate::surface::InfluenceFunction;
use palpate_numerics::small::solve_general;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Structure {
    length_m: f64,
    pub nodes: Vec<f64>,
    pub holds: Vec<SupportCompliance>,
    pub elements: Vec<Element>,
    forth: Sweep,
    back: Sweep,
}

/// Position in an element; at an end, on the element's side of the node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Site {
    pub element: usize,
    pub offset: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Disturbance {
    Jump(State),
    /// Unit settlement upward of the support.
    Settlement,
}

struct AdjacentStates {
    /// Left states, in the factors of `left_element` of the forward sweep.
    left: Pair,
    left_element: Option<usize>,
    /// Right states, in the factors of `right_element` of the backward sweep.
    right: Pair,
    right_element: Option<usize>,
    hold: SupportCompliance,
    /// True with the support left of the disturbance.
    held_left: bool,
}

impl Structure {
    pub fn new(
        length_m: f64,
        nodes: Vec<f64>,
        holds: Vec<SupportCompliance>,
        elements: Vec<Element>,
    ) -> Self {
        let forth = Sweep::new(holds.iter().copied().zip(elements.iter().copied()));
        let mirrored = holds.iter().rev().copied().zip(elements.iter().rev().copied());
        let back = Sweep::new(mirrored);
        Self { length_m, nodes, holds, elements, forth, back }
    }

    /// Site of a position: right of a node, except for the last one.
    pub fn site(&self, place: f64) -> Site {
        let last = self.elements.len() - 1;
        let element =
            self.nodes.partition_point(|node| node - SAME_PLACE <= place).saturating_sub(1).min(last);
        let (length, offset) = (self.elements[element].length, place - self.nodes[element]);
        let offset = if offset <= SAME_PLACE {
            0.0
        } else if offset >= length - SAME_PLACE {
            length
        } else {
            offset
        };
        Site { element, offset }
    }

    /// Support at a site; `None` between nodes.
    pub fn hold_at(&self, Site { element, offset }: Site) -> Option<SupportCompliance> {
        if offset <= 0.0 {
            Some(self.holds[element])
        } else {
            (offset >= self.elements[element].length).then(|| self.holds[element + 1])
        }
    }

    pub fn rigid_shape(&self) -> Shape {
        let nothing = State::DEFLECTION * 0.0;
        let piece = Piece { from: 0.0, to: 1.0, start: nothing, end: nothing, stiffness: 1.0 };
        Shape { length_m: self.length_m, pieces: vec![piece] }
    }

    pub fn shape(&self, site: Site, disturbance: Disturbance) -> Shape {
        let around = self.surroundings(site);
        let (left, right) = around.fitted(disturbance);
        let mut pieces = self.pieces_left(site, &around, left);
        pieces.extend(self.pieces_right(site, &around, right));
        Shape { length_m: self.length_m, pieces }
    }

    fn surroundings(&self, Site { element, offset }: Site) -> AdjacentStates {
        let last = self.elements.len() - 1;
        let Element { length, stiffness, .. } = self.elements[element];
        // Elements to the right of this one, first in the backward sweep.
        let beyond = last - element;
        let forward = |offset: f64| self.forth.start(element).map(|state| state.advanced(offset, stiffness));
        let backward = |offset: f64| self.back.start(beyond).map(|state| state.advanced(offset, stiffness));
        let (left, left_element) = if offset > 0.0 {
            (forward(offset), Some(element))
        } else {
            (self.forth.end(element), element.checked_sub(1))
        };
        let (right, right_element) = if offset < length {
            (backward(length - offset), Some(beyond))
        } else {
            (self.back.end(beyond), beyond.checked_sub(1))
        };
        let hold = self.hold_at(Site { element, offset }).unwrap_or_default();
        let right = right.map(State::mirrored);
        AdjacentStates { left, left_element, right, right_element, hold, held_left: offset <= 0.0 }
    }

    fn pieces_left(&self, site: Site, around: &AdjacentStates, factors: Factors) -> Vec<Piece> {
        let Some(nearest) = around.left_element else { return Vec::new() };
        let states = self.forth.back_from(nearest, factors);
        let mut pieces = self.pieces((0..=nearest).rev(), states);
        if let Some(cut) = pieces.first_mut().filter(|_| nearest == site.element) {
            cut.to = cut.from + site.offset;
            cut.end = combined(around.left, factors);
        }
        pieces.reverse();
        pieces
    }

    fn pieces(
        &self,
        elements: impl Iterator<Item = usize>,
        states: impl Iterator<Item = (State, State)>,
    ) -> Vec<Piece> {
        let piece = |(element, (start, end)): (usize, (State, State))| {
            let Element { stiffness, .. } = self.elements[element];
            Piece { from: self.nodes[element], to: self.nodes[element + 1], start, end, stiffness }
        };
        elements.zip(states).map(piece).collect()
    }

    fn pieces_right(&self, site: Site, around: &AdjacentStates, factors: Factors) -> Vec<Piece> {
        let Some(nearest) = around.right_element else { return Vec::new() };
        let first = self.elements.len() - 1 - nearest;
        let states = self.back.back_from(nearest, factors);
        let states = states.map(|(end, start)| (start.mirrored(), end.mirrored()));
        let mut pieces = self.pieces(first..self.elements.len(), states);
        if let Some(cut) = pieces.first_mut().filter(|_| first == site.element) {
            cut.from += site.offset;
            cut.start = combined(around.right, factors);
        }
        pieces
    }
}

impl AdjacentStates {
    /// Solves for the factors: jumps by disturbance, force and couple, and two laws of the support.
    fn fitted(&self, disturbance: Disturbance) -> (Factors, Factors) {
        let (jump, settlement) = match disturbance {
            Disturbance::Jump(jump) => (jump, 0.0),
            Disturbance::Settlement => (State::DEFLECTION * 0.0, 1.0),
        };
        let [left, right] = [self.left, self.right].map(|pair| pair.map(State::numbers));
        let (force, couple) = (State::SHEAR.numbers(), State::MOMENT.numbers());
        let (mut system, mut right_side) = ([[0.0; 6]; 6], [0.0; 6]);
        for i in 0..4 {
            system[i] = [-left[0][i], -left[1][i], right[0][i], right[1][i], -force[i], -couple[i]];
            right_side[i] = jump.numbers()[i];
        }
        let on_held_side = |number: usize| {
            let side = if self.held_left { left } else { right };
            let [a, b] = [side[0][number], side[1][number]];
            if self.held_left { [a, b, 0.0, 0.0] } else { [0.0, 0.0, a, b] }
        };
        system[4] = match self.hold.yielding {
            Some(c) => {
                let [a, b, d, e] = on_held_side(0);
                right_side[4] = settlement;
                [a, b, d, e, c, 0.0]
            }
            None => [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        };
        system[5] = match self.hold.turning {
            Some(c) => {
                let [a, b, d, e] = on_held_side(1);
                [a, b, d, e, 0.0, -c]
            }
            None => [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        };
        let [a, b, c, d, ..] = solve_general(&system, &right_side);
        ([a, b], [c, d])
    }
}

/// Influence function (Betti and Maxwell; Müller-Breslau, *Die neueren Methoden der Festigkeitslehre*, 1886).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shape {
    pub length_m: f64,
    pub pieces: Vec<Piece>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub from: f64,
    pub to: f64,
    pub start: State,
    pub end: State,
    pub stiffness: f64,
}

impl Piece {
    /// State from the nearer end, so that the deflection vanishes next to a support.
    fn state_at(&self, place: f64) -> State {
        let (behind, ahead) = (place - self.from, self.to - place);
        if behind <= ahead {
            self.start.advanced(behind, self.stiffness)
        } else {
            self.end.advanced(-ahead, self.stiffness)
        }
    }

    /// Largest deflection, at an end or at a root of the slope.
    fn peak(&self) -> f64 {
        let State { slope, moment, shear, .. } = self.start;
        let level = roots(shear / 2.0, moment, slope * self.stiffness);
        let within = level.into_iter().filter(|by| (0.0..=self.to - self.from).contains(by));
        within
            .map(|by| self.state_at(self.from + by).deflection.abs())
            .fold(self.start.deflection.abs().max(self.end.deflection.abs()), f64::max)
    }
}

impl Shape {
    pub fn peak(&self) -> f64 {
        self.pieces.iter().map(Piece::peak).fold(0.0, f64::max)
    }

    fn state(&self, contact: Position) -> State {
        let place = contact.x_m / self.length_m;
        let piece = self.pieces.partition_point(|piece| piece.to < place).min(self.pieces.len() - 1);
        self.pieces[piece].state_at(place)
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

/// Real roots, or NaN.
fn roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let root = (b * b - 4.0 * a * c).sqrt();
    let q = -0.5 * (b + if b < 0.0 { -root } else { root });
    [q / a, c / q]
}

/// Basis of the admissible states.
type Pair = [State; 2];
type Factors = [f64; 2];

/// Compliances for force and couple; 0 is rigid, `None` free.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SupportCompliance {
    pub yielding: Option<f64>,
    pub turning: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Element {
    pub length: f64,
    pub stiffness: f64,
    pub thickness_m: f64,
}

#[derive(Clone, Debug, PartialEq)]
struct Sweep {
    passages: Vec<Passage>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Passage {
    start: Pair,
    end: Pair,
    before: [Factors; 2],
}

const FREE: Pair = [State::DEFLECTION, State::SLOPE];

impl Sweep {
    pub fn new(elements: impl Iterator<Item = (SupportCompliance, Element)>) -> Self {
        let mut passages = Vec::new();
        let mut pair = FREE;
        for (hold, element) in elements {
            let (start, before) =
                orthonormal(apply_rotation(apply_deflection((pair, UNMIXED), hold.yielding), hold.turning));
            let end = start.map(|state| state.advanced(element.length, element.stiffness));
            passages.push(Passage { start, end, before });
            pair = end;
        }
        Self { passages }
    }

    pub fn start(&self, element: usize) -> Pair {
        self.passages[element].start
    }

    /// Pair after `passed` elements.
    pub fn end(&self, passed: usize) -> Pair {
        passed.checked_sub(1).map_or(FREE, |last| self.passages[last].end)
    }

    /// States at both ends of `element` and of those before it, nearest first.
    pub fn back_from(&self, element: usize, factors: Factors) -> impl Iterator<Item = (State, State)> + '_ {
        self.passages[..=element].iter().rev().scan(factors, |factors, passage| {
            let states = (combined(passage.start, *factors), combined(passage.end, *factors));
            *factors = mixed(passage.before, *factors);
            Some(states)
        })
    }
}

fn combined([first, second]: Pair, [a, b]: Factors) -> State {
    first * a + second * b
}

/// A pair, with the matrix from its factors to the original pair's, by columns.
type Mixture = (Pair, [Factors; 2]);

const UNMIXED: [Factors; 2] = [[1.0, 0.0], [0.0, 1.0]];

fn mixed([first, second]: [Factors; 2], [a, b]: Factors) -> Factors {
    [first[0] * a + second[0] * b, first[1] * a + second[1] * b]
}

/// Pair behind a support of compliance c: the state without deflection is unchanged, the other gets a force
/// of −w/c, times c as c may be 0.
fn apply_deflection(mixture: Mixture, yielding: Option<f64>) -> Mixture {
    let Some(c) = yielding else { return mixture };
    let ((still, still_mix), (moving, moving_mix)) = split_parts(mixture, |state| state.deflection);
    let met = moving * c + State::SHEAR * -moving.deflection;
    ([State { deflection: 0.0, ..still }, met], [still_mix, moving_mix.map(|factor| factor * c)])
}

/// As [`apply_deflection`], for rotation.
fn apply_rotation(mixture: Mixture, turning: Option<f64>) -> Mixture {
    let Some(c) = turning else { return mixture };
    let ((still, still_mix), (moving, moving_mix)) = split_parts(mixture, |state| state.slope);
    let met = moving * c + State::MOMENT * moving.slope;
    ([State { slope: 0.0, ..still }, met], [still_mix, moving_mix.map(|factor| factor * c)])
}

fn split_parts((pair, mix): Mixture, part: fn(State) -> f64) -> ((State, Factors), (State, Factors)) {
    let [a, b] = pair.map(part);
    let size = a.hypot(b);
    let [a, b] = if size > 0.0 { [a / size, b / size] } else { [0.0, 1.0] };
    let combination = |factors: Factors| (combined(pair, factors), mixed(mix, factors));
    (combination([-b, a]), combination([a, b]))
}

/// Gram–Schmidt, twice (Kahan, in Parlett, *The Symmetric Eigenvalue Problem*, 6.9).
fn orthonormal(mixture: Mixture) -> Mixture {
    let (mut pair, mut mix) = mixture;
    scale(&mut pair, &mut mix, 0);
    for _ in 0..2 {
        scale(&mut pair, &mut mix, 1);
        let along = pair[0].dot(pair[1]);
        pair[1] = pair[1] + pair[0] * -along;
        mix[1] = [mix[1][0] - along * mix[0][0], mix[1][1] - along * mix[0][1]];
    }
    scale(&mut pair, &mut mix, 1);
    (pair, mix)
}

fn scale(pair: &mut Pair, mix: &mut [Factors; 2], which: usize) {
    let largest = pair[which].numbers().into_iter().fold(0.0, |most: f64, number| most.max(number.abs()));
    let shrunk = pair[which] * (1.0 / largest);
    let factor = 1.0 / (largest * shrunk.dot(shrunk).sqrt());
    pair[which] = pair[which] * factor;
    mix[which] = mix[which].map(|value| value * factor);
}

/// State: deflection w, slope dw/dξ, moment M = r·d²w/dξ² and V = dM/dξ, with ξ = x/l and stiffness r·D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    pub deflection: f64,
    pub slope: f64,
    pub moment: f64,
    /// D·ΔV = q·l³ for an upward force q.
    pub shear: f64,
}

impl State {
    pub const DEFLECTION: Self = Self { deflection: 1.0, slope: 0.0, moment: 0.0, shear: 0.0 };
    pub const SLOPE: Self = Self { deflection: 0.0, slope: 1.0, moment: 0.0, shear: 0.0 };
    pub const MOMENT: Self = Self { deflection: 0.0, slope: 0.0, moment: 1.0, shear: 0.0 };
    pub const SHEAR: Self = Self { deflection: 0.0, slope: 0.0, moment: 0.0, shear: 1.0 };

    /// State `by` further along an unloaded element.
    pub fn advanced(self, by: f64, stiffness: f64) -> Self {
        let Self { deflection, slope, moment, shear } = self;
        Self {
            deflection: deflection + by * (slope + by * (moment / 2.0 + by * shear / 6.0) / stiffness),
            slope: slope + by * (moment + by * shear / 2.0) / stiffness,
            moment: moment + by * shear,
            shear,
        }
    }

    pub fn mirrored(self) -> Self {
        Self { slope: -self.slope, shear: -self.shear, ..self }
    }

    pub fn dot(self, other: Self) -> f64 {
        self.numbers().iter().zip(other.numbers()).map(|(a, b)| a * b).sum()
    }

    pub const fn numbers(self) -> [f64; 4] {
        [self.deflection, self.slope, self.moment, self.shear]
    }
}

impl Add for State {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            deflection: self.deflection + other.deflection,
            slope: self.slope + other.slope,
            moment: self.moment + other.moment,
            shear: self.shear + other.shear,
        }
    }
}

impl Mul<f64> for State {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self {
            deflection: self.deflection * factor,
            slope: self.slope * factor,
            moment: self.moment * factor,
            shear: self.shear * factor,
        }
    }
}

//! How the beam answers a disturbance at one place.

use super::check::SAME_PLACE;
use super::shape::{Piece, Shape};
use super::state::State;
use super::sweep::{Element, Factors, Hold, Pair, Sweep, combined};
use palpate_numerics::small::solve_general;

/// The beam between its nodes, with the states that it admits from both ends.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Structure {
    length_m: f64,
    /// Where the nodes are, as shares of the length: ends, supports and section steps.
    pub nodes: Vec<f64>,
    pub holds: Vec<Hold>,
    /// One fewer than nodes.
    pub elements: Vec<Element>,
    forth: Sweep,
    back: Sweep,
}

/// A place in an element. At the element's ends it is on this element's side of their supports and steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Site {
    pub element: usize,
    /// From the element's beginning, as a share of the beam's length; from 0 to the element's length.
    pub offset: f64,
}

/// What happens at a site.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Disturbance {
    /// The state jumps by this much.
    Jump(State),
    /// The ground under the support at the site rises by 1.
    Settlement,
}

/// What lies to both sides of a site.
struct Surroundings {
    /// Admitted by the beam to its left, in the factors of this element, if any.
    left: Pair,
    left_element: Option<usize>,
    /// Admitted by the beam to its right, in the factors of this element of the sweep back, if any.
    right: Pair,
    right_element: Option<usize>,
    hold: Hold,
    /// Whether the hold is to the left of what happens.
    held_left: bool,
}

impl Structure {
    pub fn new(length_m: f64, nodes: Vec<f64>, holds: Vec<Hold>, elements: Vec<Element>) -> Self {
        let forth = Sweep::through(holds.iter().copied().zip(elements.iter().copied()));
        let mirrored = holds.iter().rev().copied().zip(elements.iter().rev().copied());
        let back = Sweep::through(mirrored);
        Self { length_m, nodes, holds, elements, forth, back }
    }

    /// The site of a sensor: in the element to the right of a node, but for the last one.
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

    /// What holds the beam at a site; `None` between nodes.
    pub fn hold_at(&self, Site { element, offset }: Site) -> Option<Hold> {
        if offset <= 0.0 {
            Some(self.holds[element])
        } else {
            (offset >= self.elements[element].length).then(|| self.holds[element + 1])
        }
    }

    /// The shape when nothing happens.
    pub fn unbent(&self) -> Shape {
        let nothing = State::DEFLECTION * 0.0;
        let piece = Piece { from: 0.0, to: 1.0, start: nothing, end: nothing, stiffness: 1.0 };
        Shape { length_m: self.length_m, pieces: vec![piece] }
    }

    /// The beam's shape after a disturbance: all it admits to the left and to the right of the site, fitted together.
    pub fn shape(&self, site: Site, disturbance: Disturbance) -> Shape {
        let around = self.surroundings(site);
        let (left, right) = around.fitted(disturbance);
        let mut pieces = self.pieces_left(site, &around, left);
        pieces.extend(self.pieces_right(site, &around, right));
        Shape { length_m: self.length_m, pieces }
    }

    fn surroundings(&self, Site { element, offset }: Site) -> Surroundings {
        let last = self.elements.len() - 1;
        let Element { length, stiffness, .. } = self.elements[element];
        // Elements to the right of this one; the sweep back passes them before it.
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
        Surroundings { left, left_element, right, right_element, hold, held_left: offset <= 0.0 }
    }

    fn pieces_left(&self, site: Site, around: &Surroundings, factors: Factors) -> Vec<Piece> {
        let Some(nearest) = around.left_element else { return Vec::new() };
        let states = self.forth.back_from(nearest, factors);
        let piece = |(element, (start, end)): (usize, (State, State))| {
            let Element { stiffness, .. } = self.elements[element];
            Piece { from: self.nodes[element], to: self.nodes[element + 1], start, end, stiffness }
        };
        let mut pieces: Vec<Piece> = (0..=nearest).rev().zip(states).map(piece).collect();
        if let Some(cut) = pieces.first_mut().filter(|_| nearest == site.element) {
            cut.to = cut.from + site.offset;
            cut.end = combined(around.left, factors);
        }
        pieces.reverse();
        pieces
    }

    fn pieces_right(&self, site: Site, around: &Surroundings, factors: Factors) -> Vec<Piece> {
        let Some(nearest) = around.right_element else { return Vec::new() };
        let first = self.elements.len() - 1 - nearest;
        let states = self.back.back_from(nearest, factors);
        let piece = |(element, (end, start)): (usize, (State, State))| {
            let Element { stiffness, .. } = self.elements[element];
            let [start, end] = [start, end].map(State::mirrored);
            Piece { from: self.nodes[element], to: self.nodes[element + 1], start, end, stiffness }
        };
        let mut pieces: Vec<Piece> = (first..self.elements.len()).zip(states).map(piece).collect();
        if let Some(cut) = pieces.first_mut().filter(|_| first == site.element) {
            cut.from += site.offset;
            cut.start = combined(around.right, factors);
        }
        pieces
    }
}

impl Surroundings {
    /// The factors of both sides: from left to right the state jumps by the disturbance, by the support's force and by its
    /// couple; the support gives way to the one and turns under the other. Six equations.
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

//! Which states a beam admits, from one end of it to the other.
//!
//! Whatever acts further along, the stretches passed so far leave two freedoms: the states of a section are the
//! combinations of two. The sweep carries such a pair from the free air before the beam through its supports and stretches,
//! and makes it orthonormal after every support, so that nothing is lost on the way (Godunov's orthogonal sweep, Uspekhi
//! Mat. Nauk 16(3), 1961). Stiffness matrices are not formed: theirs have entries of 12·E·I/h³, of which a short element
//! takes (l/h)³ digits away, and a rigid support is not a stiff spring's limit in them.

use super::state::State;

/// Two states whose combinations are all that can be; the factors of a combination.
pub(super) type Pair = [State; 2];
pub(super) type Factors = [f64; 2];

/// What holds a node: how far it gives way to a unit force and turns under a unit couple, in the states' unit. 0 is
/// rigid, `None` free.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Hold {
    pub yielding: Option<f64>,
    pub turning: Option<f64>,
}

/// A stretch between neighbouring nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Element {
    /// As a share of the beam's length.
    pub length: f64,
    /// As a share of the beam's largest bending stiffness.
    pub stiffness: f64,
    pub thickness_m: f64,
}

/// The admitted states of every element, in the direction of the sweep.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sweep {
    passages: Vec<Passage>,
}

/// One element's.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Passage {
    /// Just behind the support at its beginning.
    start: Pair,
    /// Just before the support at its end, with the same factors.
    end: Pair,
    /// From this element's factors to those of the one before.
    before: [Factors; 2],
}

/// Nothing holds the air before the beam.
pub(super) const FREE: Pair = [State::DEFLECTION, State::SLOPE];

impl Sweep {
    /// Through `elements`, each with the hold of the node at its beginning.
    pub fn through(elements: impl Iterator<Item = (Hold, Element)>) -> Self {
        let mut passages = Vec::new();
        let mut pair = FREE;
        for (hold, element) in elements {
            let (start, before) = orthonormal(turned(yielded((pair, UNMIXED), hold.yielding), hold.turning));
            let end = start.map(|state| state.advanced(element.length, element.stiffness));
            passages.push(Passage { start, end, before });
            pair = end;
        }
        Self { passages }
    }

    /// The pair just behind the support at the beginning of an element.
    pub fn start(&self, element: usize) -> Pair {
        self.passages[element].start
    }

    /// The pair just before the support at the end of the elements passed so far, counted from 0; that of the free air
    /// where none was.
    pub fn end(&self, passed: usize) -> Pair {
        passed.checked_sub(1).map_or(FREE, |last| self.passages[last].end)
    }

    /// The states at the beginning and the end of `element` and of all before it, nearest first, when the combination in
    /// `element` has these factors.
    pub fn back_from(&self, element: usize, factors: Factors) -> impl Iterator<Item = (State, State)> + '_ {
        self.passages[..=element].iter().rev().scan(factors, |factors, passage| {
            let states = (combined(passage.start, *factors), combined(passage.end, *factors));
            *factors = mixed(passage.before, *factors);
            Some(states)
        })
    }
}

/// The combination of a pair.
pub(super) fn combined([first, second]: Pair, [a, b]: Factors) -> State {
    first * a + second * b
}

/// A pair, and the matrix from its factors to those of the pair that it comes from, by columns.
type Mixture = (Pair, [Factors; 2]);

const UNMIXED: [Factors; 2] = [[1.0, 0.0], [0.0, 1.0]];

fn mixed([first, second]: [Factors; 2], [a, b]: Factors) -> Factors {
    [first[0] * a + second[0] * b, first[1] * a + second[1] * b]
}

/// Behind a support that gives way by c to a unit force: of the combinations, one has no deflection and passes as it is;
/// the other one meets a force of −w/c, here times c so that a rigid support is nothing special.
fn yielded(mixture: Mixture, yielding: Option<f64>) -> Mixture {
    let Some(c) = yielding else { return mixture };
    let ((still, still_mix), (moving, moving_mix)) = parted(mixture, |state| state.deflection);
    let met = moving * c + State::SHEAR * -moving.deflection;
    ([State { deflection: 0.0, ..still }, met], [still_mix, moving_mix.map(|factor| factor * c)])
}

/// Behind a support that turns by c under a unit couple, likewise.
fn turned(mixture: Mixture, turning: Option<f64>) -> Mixture {
    let Some(c) = turning else { return mixture };
    let ((still, still_mix), (moving, moving_mix)) = parted(mixture, |state| state.slope);
    let met = moving * c + State::MOMENT * moving.slope;
    ([State { slope: 0.0, ..still }, met], [still_mix, moving_mix.map(|factor| factor * c)])
}

/// The combination of which `part` is 0, and the one at right angles to it.
fn parted((pair, mix): Mixture, part: fn(State) -> f64) -> ((State, Factors), (State, Factors)) {
    let [a, b] = pair.map(part);
    let size = a.hypot(b);
    let [a, b] = if size > 0.0 { [a / size, b / size] } else { [0.0, 1.0] };
    let combination = |factors: Factors| (combined(pair, factors), mixed(mix, factors));
    (combination([-b, a]), combination([a, b]))
}

/// Gram and Schmidt's, done twice, which is enough (Kahan, in Parlett, *The Symmetric Eigenvalue Problem*, 6.9).
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

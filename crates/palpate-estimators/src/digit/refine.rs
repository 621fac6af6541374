//! The best explanation of a reading on one stretch, by Gauss–Newton steps that stay on it.

use super::gauges::Stretch;
use super::likelihood::{Guess, Likelihood, Sums};

/// Where on a stretch the search starts, as shares of it.
const START_SHARES: [f64; 3] = [0.1, 0.4, 0.8];
/// What the linear theory's force is multiplied by at a start: a finger that bends far has shorter levers.
const START_FORCES: [f64; 6] = [1.0, 1.4, 2.0, 3.0, 5.0, 8.0];
/// Steps that are tried; from a start five to ten reach the last digits.
const MOST_STEPS: usize = 60;
/// A step of this share of its parameter is the last one.
const LAST_STEP: f64 = 1e-10;
/// A step that is halved more often than this gains nothing.
const MOST_HALVINGS: usize = 30;

/// The best contact on a stretch: the lowest of the minima that are reached from the best force at each start.
pub(super) fn search(likelihood: &Likelihood, stretch: Stretch) -> (Guess, Sums) {
    let reached = START_SHARES.map(|share| {
        let position_m = stretch.from_m + share * (stretch.to_m - stretch.from_m);
        refine(likelihood, stretch, start(likelihood, stretch, position_m))
    });
    let [first, rest @ ..] = reached;
    rest.into_iter()
        .fold(first, |best, next| if next.1.chi_squared < best.1.chi_squared { next } else { best })
}

/// The best of a few forces at a position.
fn start(likelihood: &Likelihood, stretch: Stretch, position_m: f64) -> Guess {
    let linear_n = likelihood.linear_force_n(position_m, stretch);
    let guess = |factor: f64| within(likelihood, Guess { position_m, force_n: factor * linear_n }, stretch);
    let chi_squared = |guess: Guess| likelihood.at(guess, stretch).chi_squared;
    let better = |best: Guess, next: Guess| if chi_squared(next) < chi_squared(best) { next } else { best };
    START_FORCES.iter().map(|factor| guess(*factor)).fold(guess(1.0), better)
}

/// Goes from a guess to the nearest minimum of |r|² on the stretch.
fn refine(likelihood: &Likelihood, stretch: Stretch, start: Guess) -> (Guess, Sums) {
    let mut best = (start, likelihood.at(start, stretch));
    for _ in 0..MOST_STEPS {
        let step = step(likelihood, stretch, best);
        let Some(next) = descend(likelihood, stretch, best, step) else { break };
        let moved = (next.0.position_m - best.0.position_m).abs() / stretch.to_m
            + (next.0.force_n - best.0.force_n).abs() / next.0.force_n.max(f64::MIN_POSITIVE);
        best = next;
        if moved < LAST_STEP {
            break;
        }
    }
    best
}

/// The best force at a position that is held.
pub(super) fn refine_force(likelihood: &Likelihood, stretch: Stretch, start: Guess) -> (Guess, Sums) {
    let mut best = (start, likelihood.at(start, stretch));
    for _ in 0..MOST_STEPS {
        let step = [0.0, best.1.force_step()];
        let Some(next) = descend(likelihood, stretch, best, step) else { break };
        let moved = (next.0.force_n - best.0.force_n).abs();
        best = next;
        if moved < LAST_STEP * best.0.force_n {
            break;
        }
    }
    best
}

/// The Gauss–Newton step, up to the end of the stretch; at an end that it would leave, the step of the force alone.
fn step(likelihood: &Likelihood, stretch: Stretch, (guess, sums): (Guess, Sums)) -> [f64; 2] {
    let Some([along_m, harder_n]) = sums.step(likelihood.force_n.is_some()) else {
        return [0.0, sums.force_step()];
    };
    let room_m =
        if along_m > 0.0 { stretch.to_m - guess.position_m } else { stretch.from_m - guess.position_m };
    if room_m.abs() <= 1e-12 * stretch.to_m {
        return [0.0, sums.force_step()];
    }
    let share = (room_m / along_m).min(1.0);
    if along_m == 0.0 { [0.0, harder_n] } else { [share * along_m, share * harder_n] }
}

/// The longest of the step, its half, its quarter and so on that makes |r|² smaller.
fn descend(
    likelihood: &Likelihood,
    stretch: Stretch,
    (guess, sums): (Guess, Sums),
    [along_m, harder_n]: [f64; 2],
) -> Option<(Guess, Sums)> {
    let mut share = 1.0;
    for _ in 0..MOST_HALVINGS {
        let moved = Guess {
            position_m: guess.position_m + share * along_m,
            force_n: guess.force_n + share * harder_n,
        };
        let next = within(likelihood, moved, stretch);
        let there = likelihood.at(next, stretch);
        if there.chi_squared < sums.chi_squared {
            return Some((next, there));
        }
        share *= 0.5;
    }
    None
}

/// The guess, held on the stretch and to forces that push and that the model covers.
fn within(likelihood: &Likelihood, guess: Guess, stretch: Stretch) -> Guess {
    let position_m = guess.position_m.max(stretch.from_m).min(stretch.to_m);
    let force_n = likelihood.force_n.unwrap_or_else(|| {
        let most_n = likelihood.most_force_n(position_m);
        guess.force_n.max(1e-9 * most_n).min(most_n)
    });
    Guess { position_m, force_n }
}

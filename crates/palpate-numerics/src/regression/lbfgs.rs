//! L-BFGS (Nocedal and Wright, *Numerical Optimization*, algorithm 7.5) with a backtracking line search.

use std::collections::VecDeque;

use crate::small::{add_multiple, dot};

const MEMORY: usize = 12;
/// Largest change of a logarithm.
const LONGEST_STEP: f64 = 2.0;
/// Share of the predicted decrease (Armijo).
const SUFFICIENT: f64 = 1e-4;

#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    /// Largest number.
    pub evaluations: usize,
    /// Smallest decrease in two consecutive steps.
    pub decrease: f64,
}

#[derive(Clone, Debug)]
pub(super) struct Minimum {
    pub point: Vec<f64>,
    pub value: f64,
}

struct Pair {
    step: Vec<f64>,
    change: Vec<f64>,
}

/// Minimises `function`, which writes its gradient and returns its value, or infinity.
pub(super) fn minimise<E>(
    start: &[f64],
    stop: Stop,
    mut function: impl FnMut(&[f64], &mut [f64]) -> Result<f64, E>,
) -> Result<Minimum, E> {
    let mut point = start.to_vec();
    let mut gradient = vec![0.0; point.len()];
    let mut value = function(&point, &mut gradient)?;
    let mut pairs: VecDeque<Pair> = VecDeque::new();
    let (mut evaluations, mut small_steps) = (1, 0);
    while value.is_finite() && evaluations < stop.evaluations && small_steps < 2 {
        let direction = direction(&gradient, &pairs);
        let slope = dot(&direction, &gradient);
        // Not a descent direction: the pairs are outdated, or the gradient is rounding error.
        if slope >= 0.0 || !slope.is_finite() {
            if pairs.is_empty() {
                break;
            }
            pairs.clear();
            continue;
        }
        let longest = direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        let mut length = (LONGEST_STEP / longest).min(1.0);
        let mut next_gradient = vec![0.0; point.len()];
        let accepted = loop {
            if evaluations >= stop.evaluations {
                break None;
            }
            let next: Vec<f64> = point.iter().zip(&direction).map(|(x, d)| x + length * d).collect();
            let next_value = function(&next, &mut next_gradient)?;
            evaluations += 1;
            if next_value <= value + SUFFICIENT * length * slope {
                break Some((next, next_value));
            }
            length *= shrink(value, slope * length, next_value);
            if length * longest < 1e-9 {
                break None;
            }
        };
        let Some((next, next_value)) = accepted else { break };
        small_steps = if value - next_value < stop.decrease { small_steps + 1 } else { 0 };
        let step: Vec<f64> = next.iter().zip(&point).map(|(a, b)| a - b).collect();
        let change: Vec<f64> = next_gradient.iter().zip(&gradient).map(|(a, b)| a - b).collect();
        if dot(&step, &change) > 1e-10 * dot(&change, &change) {
            pairs.truncate(MEMORY - 1);
            pairs.push_front(Pair { step, change });
        }
        (point, value, gradient) = (next, next_value, next_gradient);
    }
    Ok(Minimum { point, value })
}

/// −H·g, by the two loops.
fn direction(gradient: &[f64], pairs: &VecDeque<Pair>) -> Vec<f64> {
    let mut q: Vec<f64> = gradient.iter().map(|g| -g).collect();
    let mut shares = Vec::with_capacity(pairs.len());
    for pair in pairs {
        let share = dot(&pair.step, &q) / dot(&pair.step, &pair.change);
        add_multiple(&mut q, -share, &pair.change);
        shares.push(share);
    }
    let first_length = || 1.0 / dot(gradient, gradient).sqrt().max(1.0);
    let scale =
        pairs.front().map_or_else(first_length, |p| dot(&p.step, &p.change) / dot(&p.change, &p.change));
    q.iter_mut().for_each(|q| *q *= scale);
    for (pair, share) in pairs.iter().zip(&shares).rev() {
        let correction = dot(&pair.change, &q) / dot(&pair.step, &pair.change);
        add_multiple(&mut q, share - correction, &pair.step);
    }
    q
}

/// Factor to the minimum of the parabola.
fn shrink(value: f64, slope: f64, next_value: f64) -> f64 {
    let curvature = next_value - value - slope;
    if next_value.is_finite() && curvature > 0.0 { (-0.5 * slope / curvature).clamp(0.1, 0.5) } else { 0.25 }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::watch::Cancelled;

    const STOP: Stop = Stop { evaluations: 300, decrease: 1e-14 };

    #[test]
    fn minimum_of_rosenbrocks_function_is_found() {
        let rosenbrock = |x: &[f64], g: &mut [f64]| {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            (g[0], g[1]) = (-2.0 * a - 400.0 * x[0] * b, 200.0 * b);
            Ok::<f64, Infallible>(a * a + 100.0 * b * b)
        };
        let minimum = minimise(&[-1.2, 1.0], STOP, rosenbrock).unwrap();
        assert!(minimum.point.iter().all(|x| (x - 1.0).abs() < 1e-4), "{minimum:?}");
    }

    #[test]
    fn a_cliff_is_backed_away_from() {
        // Defined for x > 0 only, with the minimum at x = 0.01.
        let cliff = |x: &[f64], g: &mut [f64]| {
            g[0] = 1.0 - 0.01 / x[0];
            Ok::<f64, Infallible>(if x[0] > 0.0 { x[0] - 0.01 * x[0].ln() } else { f64::INFINITY })
        };
        let minimum = minimise(&[1.0], STOP, cliff).unwrap();
        assert!((minimum.point[0] - 0.01).abs() < 1e-6, "{minimum:?}");
    }

    #[test]
    fn minimiser_stops_on_request() {
        let mut left = 3;
        let slope = |_: &[f64], g: &mut [f64]| {
            g[0] = 1.0;
            left -= 1;
            if left > 0 { Ok(f64::from(left)) } else { Err(Cancelled) }
        };
        assert!(minimise(&[0.0], STOP, slope).is_err());
    }
}

//! How far influence functions may deviate from what is believed: found from the presses, by their evidence.

use super::posterior::SensorPresses;
use super::prior::{Mean, Spread};

/// Presses that the search looks at; more would cost time and change little.
pub(super) const MOST_PRESSES: usize = 60;

/// log₁₀ of the five spreads, with the bounds of each. The lower bounds mean "not at all".
const START: [f64; 5] = [-2.0, -3.0, -3.0, -4.0, -4.0];
const LOWEST: [f64; 5] = [-6.0, -8.0, -7.0, -9.0, -9.0];
const HIGHEST: [f64; 5] = [0.0, -1.0, 2.0, 0.0, 0.0];

/// The spread under which the presses of all `sensors`, which are of one kind, are the most probable: steps along one
/// logarithm at a time, ever smaller.
pub(super) fn most_evident(
    sensors: &[SensorPresses],
    mean: Mean,
    length_m: f64,
    noise_is_told: bool,
) -> Spread {
    let spread = |logs: &[f64; 5]| {
        let power = |i: usize| if logs[i] <= LOWEST[i] { 0.0 } else { 10f64.powf(logs[i]) };
        match mean {
            Mean::Model => Spread {
                gain: power(0),
                shift_m: power(1) * length_m,
                remainder: power(2),
                offset: power(3),
                noise: power(4),
            },
            Mean::Zero => {
                Spread { gain: 0.0, shift_m: 0.0, remainder: power(2), offset: power(3), noise: power(4) }
            }
        }
    };
    let evidence = |logs: &[f64; 5]| sensors.iter().map(|s| s.log_evidence(&spread(logs))).sum::<f64>();
    let mut free = vec![2, 3];
    if mean == Mean::Model {
        free.extend([0, 1]);
    }
    if !noise_is_told {
        free.push(4);
    }
    let mut logs = START;
    if mean == Mean::Zero {
        logs[2] = 0.0;
    }
    let mut best = evidence(&logs);
    for step in [1.0, 0.5, 0.25] {
        climb(&mut logs, &mut best, &free, step, &evidence);
    }
    spread(&logs)
}

/// Steps along each free logarithm while the evidence rises.
fn climb(
    logs: &mut [f64; 5],
    best: &mut f64,
    free: &[usize],
    step: f64,
    evidence: &dyn Fn(&[f64; 5]) -> f64,
) {
    const MOST_ROUNDS: usize = 8;
    for _ in 0..MOST_ROUNDS {
        let before = *best;
        for &i in free {
            for direction in [step, -step] {
                loop {
                    let mut candidate = *logs;
                    candidate[i] = (candidate[i] + direction).clamp(LOWEST[i], HIGHEST[i]);
                    let value = evidence(&candidate);
                    if value <= *best {
                        break;
                    }
                    (*logs, *best) = (candidate, value);
                }
            }
        }
        if *best <= before {
            break;
        }
    }
}

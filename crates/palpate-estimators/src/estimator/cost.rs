//! The cost of a fit, before it is begun: memory and time by the sizes of what each method factors and tabulates.
//!
//! Times are for one core of some 3 GHz, to within a factor of a few; memory to within a half.

use super::{CHOICE_FOLDS, Estimator};
use crate::influence::measured::{MeasuredInfluence, most_nodes, most_nuisance_nodes};
use crate::influence::{Influence, Structure, force_linear, learning};
use crate::recording::Recording;
use crate::setup::Setup;
use crate::{neighbours, network};
use palpate_mechanics::surface::Extent;
use palpate_numerics::regression::{INDUCING, MOST_EVALUATIONS, MOST_EXACT};
use std::collections::HashSet;

/// Memory and time that a fit will take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitCost {
    /// Memory at its peak, in bytes, besides the program itself.
    pub memory_bytes: f64,
    /// Time of one core, in seconds; the most where a method may end earlier.
    pub seconds: f64,
}

impl FitCost {
    fn and(self, other: Self) -> Self {
        Self { memory_bytes: self.memory_bytes + other.memory_bytes, seconds: self.seconds + other.seconds }
    }
}

/// Size of an f64.
const NUMBER: f64 = 8.0;
/// Multiply-adds of a matrix product in a second.
const PRODUCTS: f64 = 5e9;
/// Those of loops over what does not fit into the cache.
const LOOPS: f64 = 1e9;

/// Sizes of a task.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    rows: f64,
    channels: f64,
    /// Distinct contacts, each with its force and its nuisance coordinates.
    presses: f64,
    nuisances: usize,
}

impl Estimator {
    /// Memory and time of fitting to a recording of a setup.
    pub fn fit_cost(&self, setup: &Setup, recording: &Recording) -> FitCost {
        let sizes = Sizes::new(setup, recording);
        let own = match self {
            Self::GaussianProcess(process) => {
                sizes.process(sizes.rows, sizes.channels + 1.0, 2.0, process.search_points)
            }
            Self::Influence(influence) => sizes.influence(influence, setup, recording),
            Self::Neighbours(_) => FitCost {
                memory_bytes: sizes.rows * (NUMBER * sizes.channels + 80.0),
                seconds: sizes.rows.min(neighbours::MOST_HELD_OUT as f64) * sizes.rows * sizes.channels
                    / LOOPS,
            },
            Self::Network(network) => {
                let nodes = network.hidden.iter().sum::<usize>() as f64;
                let weights = nodes * (sizes.channels + 3.0);
                FitCost {
                    memory_bytes: 3.0 * NUMBER * sizes.rows * (sizes.channels + 2.0),
                    seconds: f64::from(network.training.most_epochs(recording.rows.len()))
                        * sizes.rows
                        * weights
                        / LOOPS,
                }
            }
            Self::NetworkLm(levenberg) => {
                let weights = levenberg.hidden.iter().sum::<usize>() as f64 * (sizes.channels + 3.0);
                let steps = 2.0 * levenberg.ensemble as f64 * f64::from(levenberg.max_iterations);
                let rows = sizes.rows.min(network::MOST_PRESSES as f64);
                FitCost {
                    memory_bytes: 3.0 * NUMBER * (sizes.rows * sizes.channels + 2.0 * rows * weights),
                    seconds: steps * 2.0 * rows * weights * weights / PRODUCTS,
                }
            }
            Self::ClosedForm(_) | Self::Digit(_) | Self::Centroid(_) => {
                FitCost { memory_bytes: 0.0, seconds: sizes.rows * sizes.channels * 1e-6 }
            }
            Self::Auto => {
                let contenders = Self::contenders(setup);
                let costs = contenders.iter().map(|contender| contender.fit_cost(setup, recording));
                // One after the other, in each fold.
                costs.fold(FitCost { memory_bytes: 0.0, seconds: 0.0 }, |sum, cost| FitCost {
                    memory_bytes: sum.memory_bytes.max(cost.memory_bytes),
                    seconds: sum.seconds + CHOICE_FOLDS as f64 * cost.seconds,
                })
            }
        };
        own.and(FitCost { memory_bytes: 3.0 * sizes.rows * (NUMBER * sizes.channels + 120.0), seconds: 0.0 })
    }
}

impl Sizes {
    fn new(setup: &Setup, recording: &Recording) -> Self {
        let presses: HashSet<Vec<u64>> = recording
            .rows
            .iter()
            .map(|row| {
                let position = [row.position.x_m, row.position.y_m];
                let force_n = row.force_n.filter(|_| row.nuisances.is_empty());
                position.iter().chain(&row.nuisances).chain(&force_n).map(|value| value.to_bits()).collect()
            })
            .collect();
        Self {
            rows: recording.rows.len() as f64,
            channels: setup.layout().len() as f64,
            presses: presses.len() as f64,
            nuisances: recording.rows.iter().map(|row| row.nuisances.len()).max().unwrap_or_default(),
        }
    }

    /// A Gaussian process of so many points, their coordinates and outputs, and points of the search for its hyperparameters.
    fn process(&self, points: f64, coordinates: f64, outputs: f64, search_points: usize) -> FitCost {
        let searched = points.min(search_points as f64);
        // Each a factor and an inverse.
        let search = MOST_EVALUATIONS as f64 * 2.0 * searched.powi(3) / PRODUCTS;
        let rows = 4.0 * NUMBER * points * (coordinates + outputs);
        if points <= MOST_EXACT as f64 {
            return FitCost {
                memory_bytes: rows + NUMBER * (3.0 * points * points + 4.0 * searched * searched),
                seconds: search + points.powi(3) / 3.0 / PRODUCTS + points * points * 4e-9,
            };
        }
        let kept = INDUCING as f64;
        FitCost {
            memory_bytes: rows + NUMBER * (10.0 * kept * kept + 4096.0 * kept),
            seconds: search + points * (1.5 * kept * kept / PRODUCTS + kept * 4e-9) + kept * kept * 4e-6,
        }
    }

    fn influence(&self, influence: &Influence, setup: &Setup, recording: &Recording) -> FitCost {
        let extent = setup.surface().extent();
        let is_free = influence.structure == Structure::Free
            || self.nuisances > 0
            || recording.rows.iter().any(|row| row.force_n.is_none());
        if setup.surface().model().is_some() {
            return self.over_a_model(extent);
        }
        if !is_free {
            return self.force_linear(extent);
        }
        let nodes = most_nodes(extent) as f64;
        let has_depth = self.nuisances > 0 || recording.rows.iter().any(|row| row.force_n.is_some());
        let depth = if has_depth { most_nuisance_nodes(extent) as f64 } else { 1.0 };
        let coordinates = (extent.dimensions() + self.nuisances.max(usize::from(has_depth))) as f64;
        let process = self.process(
            self.presses,
            coordinates,
            self.channels,
            MeasuredInfluence::default().search_points,
        );
        let kept = if self.presses <= MOST_EXACT as f64 { self.presses } else { INDUCING as f64 };
        let table = FitCost {
            memory_bytes: NUMBER * nodes * depth * (5.0 * self.channels + 16.0),
            // Each node twice: some tables are made again, finer.
            seconds: 2.0 * nodes * depth * (kept * (self.channels + 30.0) / LOOPS / 4.0 + 6e-5),
        };
        // A fifth of the presses is held out of a second process.
        process.and(FitCost { memory_bytes: 0.0, ..process }).and(table)
    }

    /// Influence functions that are learnt over those of a model.
    fn over_a_model(&self, extent: Extent) -> FitCost {
        let presses = self.presses.min(learning::MOST_LEARNT as f64);
        let nodes = most_nodes(extent) as f64;
        FitCost {
            memory_bytes: NUMBER * (6.0 * presses * presses + nodes * (presses + 4.0 * self.channels)),
            seconds: self.channels * presses * presses * (presses / 3.0 + nodes / 2.0) / PRODUCTS,
        }
    }

    /// Influence functions of presses with forces: two priors are judged, each by as many factors as there are folds, and each channel
    /// has one of its own; residuals of every press are another.
    fn force_linear(&self, extent: Extent) -> FitCost {
        let presses = self.presses.min(force_linear::MOST_PRESSES as f64);
        let nodes = force_linear::most_nodes(extent) as f64;
        let kept = presses * (1.0 - 1.0 / force_linear::FOLDS as f64);
        let factors = 2.0 * force_linear::FOLDS as f64 * kept.powi(3) / 3.0 + presses.powi(3);
        FitCost {
            memory_bytes: NUMBER * (10.0 * presses * presses + 4.0 * nodes * self.channels)
                + 2.0 * NUMBER * self.presses * (2.0 * self.channels + 10.0),
            seconds: self.channels * (factors + nodes * presses * presses / 2.0) / PRODUCTS
                + self.presses * presses * 2e-8,
        }
    }
}

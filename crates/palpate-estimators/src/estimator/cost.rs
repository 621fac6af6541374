//! Memory and time of a fit.
//!
//! Times are for one busy core; `cargo bench -p palpate --bench cost` measures them
//! (docs/validation/speeds.md).

use super::auto::compared_rows;
use super::{CHOICE_FOLDS, Estimator, is_learnt};
use crate::features::FeatureKind;
use crate::fit::{FitTask, check_folds};
use crate::gaussian_process::folds_taken;
use crate::influence::measured::{MeasuredInfluence, most_nodes, most_nuisance_nodes};
use crate::influence::{Influence, Structure, force_linear, learning, sizes_over_a_model};
use crate::network::LevenbergMarquardt;
use crate::reading_check::ReadingCheck;
use crate::recording::Recording;
use crate::setup::Setup;
use crate::{neighbours, network};
use palpate_mechanics::surface::{Extent, SolutionCost, Solving, Surface, SurfaceSpec};
use palpate_numerics::FEWEST_FOR_95;
use palpate_numerics::regression::{INDUCING, MOST_EXACT};
use std::collections::HashSet;

/// Memory and time of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitCost {
    /// Peak memory, without the program.
    pub memory_bytes: f64,
    /// Time of one core; an upper bound for iterations.
    pub seconds: f64,
}

impl FitCost {
    /// Adds the cost of the interval check.
    #[must_use]
    pub fn with_interval_check(self, recording: &Recording) -> Self {
        let places = recording.distinct_positions().len();
        // Each fold is fitted to all others.
        let fitted = check_folds(places).saturating_sub(1) as f64;
        let checked = if places >= FEWEST_FOR_95 { fitted * self.seconds } else { 0.0 };
        Self { seconds: self.seconds + checked, ..self }
    }

    fn and(self, other: Self) -> Self {
        Self { memory_bytes: self.memory_bytes + other.memory_bytes, seconds: self.seconds + other.seconds }
    }
}

const NUMBER: f64 = 8.0;
/// Multiply-adds per second, large matrices.
const PRODUCTS: f64 = 12e9;
/// Multiply-adds per second, narrow matrices.
const NARROW: f64 = 5e9;
/// Multiply-adds per second, triangular solution.
const SOLVED: f64 = 2e9;
/// Multiply-adds per second, beyond the cache.
const LOOPS: f64 = 1e9;

#[derive(Clone, Copy, Debug)]
struct Sizes {
    rows: f64,
    channels: f64,
    presses: f64,
    nuisances: usize,
}

impl Estimator {
    /// Estimates the cost of a fit.
    pub fn fit_cost(&self, setup: &Setup, recording: &Recording) -> FitCost {
        if let Some(candidates) = self.candidates(FitTask::new(setup, recording)) {
            let compared = compared_rows(&candidates, recording);
            let costs = candidates.iter().map(|candidate| candidate.fit_cost(setup, &compared));
            // One after the other, in each fold.
            return costs.fold(FitCost { memory_bytes: 0.0, seconds: 0.0 }, |sum, cost| FitCost {
                memory_bytes: sum.memory_bytes.max(cost.memory_bytes),
                seconds: sum.seconds + CHOICE_FOLDS as f64 * cost.seconds,
            });
        }
        let sizes = Sizes::new(setup, recording);
        let own = match self {
            Self::GaussianProcess(process) => {
                let coordinates = sizes.channels + 1.0;
                let cost = sizes.process(sizes.rows, coordinates, 2.0, process.search_points);
                let kinds =
                    process.features.map_or_else(|| FeatureKind::contenders(setup, recording).len(), |_| 1);
                // Widths need a search of their own, and the posteriors of the folds' remainders.
                let searched = sizes.rows.min(process.search_points as f64);
                let widths = sizes.process(searched, coordinates, 2.0, process.search_points).seconds
                    + folds_taken(recording.rows.len()) as f64 * conditioning_seconds(sizes.rows);
                FitCost { seconds: kinds as f64 * cost.seconds + widths, ..cost }
            }
            Self::Influence(influence) => sizes.influence(influence, setup, recording),
            Self::Neighbours(_) => FitCost {
                memory_bytes: sizes.rows * (NUMBER * sizes.channels + 80.0),
                seconds: FeatureKind::contenders(setup, recording).len() as f64
                    * sizes.rows.min(neighbours::MOST_HELD_OUT as f64)
                    * sizes.rows
                    * sizes.channels
                    / LOOPS,
            },
            Self::Network(network) => {
                const NODE_SECONDS: f64 = 24e-9;
                const WEIGHT_SECONDS: f64 = 0.7e-9;
                let nodes = network.hidden.iter().sum::<usize>() as f64;
                let weights = nodes * (sizes.channels + 3.0);
                let presentations =
                    f64::from(network.training.most_epochs(recording.rows.len())) * sizes.rows;
                FitCost {
                    memory_bytes: 3.0 * NUMBER * sizes.rows * (sizes.channels + 2.0),
                    seconds: presentations * (nodes * NODE_SECONDS + weights * WEIGHT_SECONDS),
                }
            }
            Self::NetworkLm(levenberg) => sizes.network_lm(levenberg, setup, recording),
            Self::ClosedForm(_) | Self::Digit(_) | Self::Centroid(_) => {
                FitCost { memory_bytes: 0.0, seconds: sizes.rows * sizes.channels * 1e-6 }
            }
            Self::Auto(_) => FitCost { memory_bytes: 0.0, seconds: 0.0 },
        };
        let own = if is_learnt(self.kind()) { own.and(check_cost(setup, recording)) } else { own };
        own.and(FitCost { memory_bytes: sizes.rows * (NUMBER * sizes.channels + 120.0), seconds: 0.0 })
    }
}

fn check_cost(setup: &Setup, recording: &Recording) -> FitCost {
    let recording = ReadingCheck::thinned(recording);
    match setup.surface() {
        SurfaceSpec::Digit(_) => FitCost { memory_bytes: 0.0, seconds: 0.0 },
        _ => Sizes::new(setup, &recording).influence(&Influence::default(), setup, &recording),
    }
}

fn conditioning_seconds(points: f64) -> f64 {
    if points <= MOST_EXACT as f64 {
        return points.powi(3) / 3.0 / PRODUCTS + points * points * 4e-9;
    }
    let kept = INDUCING as f64;
    points * (kept * kept / PRODUCTS + kept * 4e-9) + kept * kept * 2e-6
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

    fn network_lm(&self, levenberg: &LevenbergMarquardt, setup: &Setup, recording: &Recording) -> FitCost {
        let [inputs, outputs] = network::network_size(setup, recording).unwrap_or([0, 0]);
        let widths: Vec<usize> =
            std::iter::once(inputs).chain(levenberg.hidden.iter().copied()).chain([outputs]).collect();
        let weights = widths.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum::<usize>() as f64;
        let steps = 2.0 * levenberg.ensemble as f64 * f64::from(levenberg.max_iterations);
        let rows = self.rows.min(network::MOST_PRESSES as f64);
        // The first output's Jacobian, the others, which share the cache with it, and the curvature.
        let products = 0.5 * (1.0 + outputs as f64) * rows * weights * weights + 1.5 * weights.powi(3);
        FitCost {
            memory_bytes: 3.0 * NUMBER * (self.rows * self.channels + outputs as f64 * rows * weights),
            seconds: steps * products / NARROW,
        }
    }

    fn process(&self, points: f64, coordinates: f64, outputs: f64, search_points: usize) -> FitCost {
        const EVALUATIONS: f64 = 20.0;
        const PAIR_SECONDS: f64 = 1e-7;
        let searched = points.min(search_points as f64);
        let search =
            EVALUATIONS * searched.powi(3) / NARROW + PAIR_SECONDS * searched * searched * coordinates;
        let rows = 4.0 * NUMBER * points * (coordinates + outputs);
        let of_search = 4.0 * searched * searched;
        if points <= MOST_EXACT as f64 {
            return FitCost {
                memory_bytes: rows + NUMBER * of_search.max(1.1 * points * points),
                seconds: search + conditioning_seconds(points),
            };
        }
        let kept = INDUCING as f64;
        FitCost {
            memory_bytes: rows + NUMBER * of_search.max(2.0 * kept * kept + 512.0 * kept),
            seconds: search + conditioning_seconds(points),
        }
    }

    fn influence(&self, influence: &Influence, setup: &Setup, recording: &Recording) -> FitCost {
        let extent = setup.surface().extent();
        let is_free = influence.structure == Structure::Free
            || self.nuisances > 0
            || recording.rows.iter().any(|row| row.force_n.is_none())
            || recording.rows.windows(2).all(|rows| rows[0].force_n == rows[1].force_n);
        if let Some(surface) = setup.surface().model() {
            return self.over_a_model(surface);
        }
        if !is_free {
            let learnt = self.force_linear(extent);
            // Functions of the readings, and of the linearized readings.
            return match influence.structure {
                Structure::ForceSaturating => learnt.and(FitCost { memory_bytes: 0.0, ..learnt }),
                _ => learnt,
            };
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
            // Each node twice: some tables are recomputed on a finer grid.
            seconds: 2.0 * nodes * depth * (kept * (self.channels + 30.0) / LOOPS / 4.0 + 6e-5),
        };
        // A second process is fitted without a fifth of the presses.
        process.and(FitCost { memory_bytes: 0.0, ..process }).and(table)
    }

    /// One triangular solution per node.
    fn over_a_model(&self, surface: &dyn Surface) -> FitCost {
        let presses = self.presses.min(learning::MOST_LEARNT as f64);
        let [nodes, mixed] = sizes_over_a_model(surface.extent());
        let (nodes, functions) = (nodes as f64, mixed + self.channels as usize);
        let solution = surface.solution_cost(functions, Solving::BySensor);
        let learnt = FitCost {
            memory_bytes: NUMBER * (4.0 * presses * presses + nodes * (presses + mixed as f64)),
            seconds: self.channels
                * (presses.powi(3) / 3.0 / NARROW + nodes * presses * presses / 2.0 / SOLVED),
        };
        solution.map_or(learnt, |SolutionCost { memory_bytes, seconds_once, seconds_each }| {
            learnt.and(FitCost { memory_bytes, seconds: seconds_once + functions as f64 * seconds_each })
        })
    }

    /// Hyperparameter search, priors with a factorisation per fold, channels, residuals; refits without
    /// outliers and with noise by position; evidence of the averaged components.
    fn force_linear(&self, extent: Extent) -> FitCost {
        const EVALUATIONS: f64 = 700.0;
        const LEARNT: f64 = 2.2;
        /// Components, with ratios of noise to signal, places of sources, and residues of a place.
        const COMPONENTS: f64 = 60.0;
        const RATIOS: f64 = 12.0;
        const SOURCES: f64 = 900.0;
        const RESIDUES: f64 = 40.0;
        const OF_RESIDUE_S: f64 = 6e-9;
        let presses = self.presses.min(force_linear::MOST_PRESSES as f64);
        let searched = presses.min(force_linear::MOST_SEARCHED as f64);
        let nodes = force_linear::most_nodes(extent) as f64;
        let kept = presses * (1.0 - 1.0 / force_linear::FOLDS as f64);
        let factors = 2.0 * force_linear::FOLDS as f64 * kept.powi(3) / 3.0 + presses.powi(3);
        let learning = EVALUATIONS * searched.powi(3) / 3.0 / NARROW + factors / PRODUCTS;
        let evidence = searched.powi(3) / 3.0 / NARROW
            + SOURCES * searched * searched / PRODUCTS
            + SOURCES * RESIDUES * self.channels * OF_RESIDUE_S;
        FitCost {
            memory_bytes: NUMBER * (7.0 * presses * presses + 4.0 * nodes * self.channels)
                + 2.0 * NUMBER * self.presses * (2.0 * self.channels + 10.0),
            seconds: self.channels * (LEARNT * learning + nodes * presses * presses / 2.0 / PRODUCTS)
                + LEARNT * self.presses * presses * 5e-8
                + COMPONENTS * RATIOS * evidence,
        }
    }
}

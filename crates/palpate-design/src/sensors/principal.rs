//! Principal components of the readings at all sites, and the reconstruction from a layout (Tongpadungrod et
//! al.).
//!
//! X = U·S·Vᵀ are the whitened readings (contacts × candidates, each row times the root of its contact's
//! share). The columns of V are the components about 0, s_j² their variances. The score is the share of
//! variance that the best linear reconstruction does not explain.

use ndarray::Array2;

use super::limit_objective::padded;
use super::objective::{Block, ForceBelief, LANES, Objective, State};
use palpate_numerics::symmetric_eigen;

/// Largest number of components above the noise.
const MOST_COMPONENTS: usize = 24;
/// Least relative variance above rounding errors.
const LEAST_SHARE: f64 = 1e-12;

pub(super) struct PrincipalComponents {
    /// Components at every candidate, in descending order of the variances.
    pub modes: Vec<Vec<f64>>,
    pub variances: Vec<f64>,
}

impl PrincipalComponents {
    pub fn from_readings(readings: &Array2<f64>) -> Self {
        let (squares, contacts) = symmetric_eigen(&readings.dot(&readings.t()));
        let least = LEAST_SHARE * squares.first().copied().unwrap_or(0.0);
        let kept = squares.iter().take_while(|square| **square > least).count().min(MOST_COMPONENTS);
        let mode = |k: usize| {
            let along = readings.t().dot(&contacts.column(k));
            (along / squares[k].sqrt()).to_vec()
        };
        Self { modes: (0..kept).map(mode).collect(), variances: squares.iter().take(kept).copied().collect() }
    }
}

/// Unexplained share of variance.
pub(super) struct Reconstruction {
    /// [candidate][block of components]
    rows: Vec<Block>,
    blocks: usize,
    variances: Vec<f64>,
}

impl Reconstruction {
    pub fn new(components: &PrincipalComponents) -> Self {
        let candidates = components.modes.first().map_or(0, Vec::len);
        let row = |i: usize| components.modes.iter().map(|mode| mode[i]).collect::<Vec<f64>>();
        Self {
            rows: (0..candidates).flat_map(|i| padded(&row(i))).collect(),
            blocks: components.modes.len().div_ceil(LANES),
            variances: components.variances.clone(),
        }
    }

    fn total(&self) -> f64 {
        self.variances.iter().sum()
    }

    fn trace(&self, state: &State) -> f64 {
        (0..self.variances.len()).map(|i| state.values[i * self.blocks + i / LANES][i % LANES]).sum()
    }

    /// C·j, and 1 + jᵀ·C·j.
    fn gain_and_variance(&self, state: &State, row: &[Block]) -> (Vec<f64>, f64) {
        let told: Vec<f64> = state.values.chunks_exact(self.blocks).map(|line| dot(line, row)).collect();
        let signal: f64 = told.iter().zip(row.iter().flatten()).map(|(a, b)| a * b).sum();
        (told, 1.0 + signal)
    }
}

impl Objective for Reconstruction {
    fn row(&self, candidate: usize) -> &[Block] {
        &self.rows[candidate * self.blocks..(candidate + 1) * self.blocks]
    }

    fn state(&self, rows: &[&[Block]], _: ForceBelief) -> State {
        let mut values = vec![[0.0; LANES]; self.variances.len() * self.blocks];
        for (i, variance) in self.variances.iter().enumerate() {
            values[i * self.blocks + i / LANES][i % LANES] = *variance;
        }
        let start = State { values, constant: 0.0 };
        rows.iter().fold(start, |state, row| self.updated(&state, row))
    }

    fn score(&self, state: &State) -> f64 {
        self.trace(state) / self.total()
    }

    fn score_with(&self, state: &State, row: &[Block]) -> f64 {
        let (told, shrink) = self.gain_and_variance(state, row);
        let gain: f64 = told.iter().map(|told| told * told).sum();
        (self.trace(state) - gain / shrink) / self.total()
    }

    fn updated(&self, state: &State, row: &[Block]) -> State {
        let (told, shrink) = self.gain_and_variance(state, row);
        let mut with = state.clone();
        for (line, own) in with.values.chunks_exact_mut(self.blocks).zip(&told) {
            for (value, other) in line.iter_mut().flatten().zip(&told) {
                *value -= own * other / shrink;
            }
        }
        with
    }

    fn value(&self, state: &State) -> f64 {
        self.score(state)
    }
}

fn dot(a: &[Block], b: &[Block]) -> f64 {
    let mut lanes = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    lanes.iter().sum()
}

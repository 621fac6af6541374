//! Criteria of searches.

/// Block width for vector instructions.
pub(super) const LANES: usize = 8;

/// Values of `LANES` contacts, padded with zeros.
pub(super) type Block = [f64; LANES];

/// Bound of the covariances for the chosen sensors.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub values: Vec<Block>,
    /// Part of the score that is independent of an added sensor.
    pub constant: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ForceBelief {
    /// Nearly uninformative; the prior of scores.
    Vague,
    /// Order of magnitude, for the first sensors: one sensor cannot determine position and force.
    Rough,
}

/// Score of layouts, smaller is better. A sensor is a row of sensitivities.
pub(super) trait Objective: Sync {
    fn row(&self, candidate: usize) -> &[Block];

    fn state(&self, rows: &[&[Block]], belief: ForceBelief) -> State;

    /// Score of searches.
    fn score(&self, state: &State) -> f64;

    /// Score of searches with one more sensor.
    fn score_with(&self, state: &State, row: &[Block]) -> f64;

    /// State with one more sensor.
    fn updated(&self, state: &State, row: &[Block]) -> State;

    /// Displayed score, without the term that breaks ties.
    fn value(&self, state: &State) -> f64;
}

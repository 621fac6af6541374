//! Criteria for searches: the score of a layout, and a fast score of a layout with one more sensor.

/// Numbers that are processed together, which compilers translate into vector instructions.
pub(super) const LANES: usize = 8;

/// Values of `LANES` contacts (or of one, padded with zeros).
pub(super) type Block = [f64; LANES];

/// Bound of the covariances of the unknowns for the chosen sensors: all that is needed to evaluate one more sensor.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// The covariance matrices, in the order that the objective defines.
    pub values: Vec<Block>,
    /// Part of the score that is independent of an added sensor.
    pub constant: f64,
}

/// Prior of the force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ForceBelief {
    /// Nearly uninformative, for every layout that is evaluated.
    Vague,
    /// Order of magnitude. It is used to choose the first sensors of a layout: a single sensor gives no information on the position
    /// if the force is wholly unknown.
    Rough,
}

/// A score of layouts, the smaller the better. A sensor is a row of numbers: its information on each unknown.
pub(super) trait Objective: Sync {
    /// The row of a candidate.
    fn row(&self, candidate: usize) -> &[Block];

    /// The state with sensors of these rows.
    fn state(&self, rows: &[&[Block]], belief: ForceBelief) -> State;

    /// The score by which layouts are searched.
    fn score(&self, state: &State) -> f64;

    /// The score by which layouts are searched, with one more sensor.
    fn score_with(&self, state: &State, row: &[Block]) -> f64;

    /// The state with one more sensor.
    fn updated(&self, state: &State, row: &[Block]) -> State;

    /// The displayed score, without the term that only breaks ties in a search.
    fn value(&self, state: &State) -> f64;
}

//! Criteria as searches use them: the score of a layout, and quickly that of the same with one more sensor.

/// Numbers that are worked on side by side, which compilers turn into vector instructions.
pub(super) const LANES: usize = 8;

/// Values of as many contacts (or of one, padded with zeros).
pub(super) type Block = [f64; LANES];

/// Least covariances of what is unknown, for the sensors so far: what it takes to judge one sensor more.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// The covariance matrices, as the objective lays them out.
    pub values: Vec<Block>,
    /// Part of the score that adding a sensor does not change.
    pub constant: f64,
}

/// Prior belief of the force, before any sensor reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ForceBelief {
    /// Next to nothing, as for every layout that is judged.
    Vague,
    /// Order of magnitude. So the first sensors of a layout are chosen: one alone tells nothing while the force is
    /// wholly unknown.
    Rough,
}

/// A score of layouts, the smaller the better. A sensor is a row of numbers: what it tells of each unknown.
pub(super) trait Objective: Sync {
    /// The row of a candidate.
    fn row(&self, candidate: usize) -> &[Block];

    /// State of knowledge with sensors of these rows.
    fn state(&self, rows: &[&[Block]], belief: ForceBelief) -> State;

    /// The score by which layouts are searched.
    fn score(&self, state: &State) -> f64;

    /// The same with one more sensor.
    fn score_with(&self, state: &State, row: &[Block]) -> f64;

    /// The state with one more sensor.
    fn updated(&self, state: &State, row: &[Block]) -> State;

    /// The score that people read: without what only breaks ties in a search.
    fn value(&self, state: &State) -> f64;
}

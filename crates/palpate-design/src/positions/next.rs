//! Next press of a recording, and the stopping rule.

use super::design::{PositionDesign, PositionError};
use super::forward::ForwardModel;
use super::presses::Presses;
use super::variance::{ExpectedError, Posterior};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_numerics::watch::Watch;
use palpate_numerics::{OutOfRange, mean, random_order};

const MOST_AHEAD: usize = 200;
/// Largest number of recorded positions in use; a random subset of more overestimates the gain slightly.
const MOST_PRESSED: usize = 1000;

/// Largest ratio of the limit to the error of a guess; above it readings differ only by noise.
const MOST_OF_A_GUESS: f64 = 0.5;

/// Proposed press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextPress {
    /// Position of the press.
    pub position: Position,
    /// Expected error after this press, m.
    pub error_m: f64,
}

/// Expected error of a recording, and the gain from more presses.
///
/// Errors are standard deviations, m, averaged over the contacts. The posterior variance counts as noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Number of rows with a contact.
    pub presses: usize,
    /// Number of distinct positions.
    pub positions: usize,
    /// Expected error of the present calibration.
    pub error_m: f64,
    /// Error after infinitely many presses: the limit.
    pub endless_error_m: f64,
    /// Best next presses until the stopping rule is met, at most [`Advice::MOST_AHEAD`].
    pub next: Vec<NextPress>,
    /// Stopping rule: least further reduction of the error, %.
    pub stop_percent: f64,
}

impl Advice {
    /// Largest number of proposed presses.
    pub const MOST_AHEAD: usize = MOST_AHEAD;

    /// Returns the reduction of the error by infinitely many presses, %.
    pub fn remaining_gain_percent(&self) -> f64 {
        100.0 * (1.0 - self.endless_error_m / self.error_m)
    }

    /// Returns true if the stopping rule is met.
    pub fn is_enough(&self) -> bool {
        self.remaining_gain_percent() < self.stop_percent
    }

    /// Returns true if the presses in `next` meet the stopping rule.
    pub fn reaches_goal(&self) -> bool {
        let last_m = self.next.last().map_or(self.error_m, |press| press.error_m);
        100.0 * (1.0 - self.endless_error_m / last_m) < self.stop_percent
    }
}

/// Proposes the next presses for the contacts of a design.
///
/// Influence functions are Gaussian processes, estimated from the recording without a model. A stated
/// placement error adds the variance |I′|²·σ² to a press.
///
/// ```
/// use palpate_design::positions::{PositionDesign, next_press};
/// use palpate_estimators::arrangement::Training;
/// use palpate_estimators::setup::Setup;
/// use palpate_mechanics::sensing::SensorKind::Deflection;
/// use palpate_mechanics::surface::Beam;
/// use palpate_mechanics::units::{gpa, mm, newtons, um};
/// use palpate_numerics::watch::Watch;
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let begun = setup.simulate(&Training::even(6).repeated(2), 0)?;
/// let advice = next_press(&setup, &begun, &PositionDesign::default(), Watch::NONE)?;
/// assert!(!advice.is_enough() && advice.next[0].error_m < advice.error_m);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`PositionError`] for a recording that is too short or of another setup, or if cancelled.
pub fn next_press(
    setup: &Setup,
    recording: &Recording,
    design: &PositionDesign,
    watch: Watch,
) -> Result<Advice, PositionError> {
    let (extent, stop_percent) = (setup.surface().extent(), design.stop_percent);
    let stop = [("the gain in % that is worth a press", stop_percent)];
    OutOfRange::check("greater than 0 and less than 100", stop, |percent| percent > 0.0 && percent < 100.0)?;
    let contacts = design.weighted_contacts(extent)?;
    let mut presses = Presses::new(recording, setup)?;
    presses.check_reach(extent)?;
    let mut forward = ForwardModel::from_presses(&presses, setup, watch)?;
    let stated = design.existing.as_ref().and_then(|training| training.placement_sd_m);
    let placement_sd_m = recording.provenance.placement_sd_m.or(stated);
    if let Some(sd_m) = placement_sd_m {
        let placed: Vec<Vec<f64>> =
            presses.positions.iter().map(|at| forward.placement_variances(*at, sd_m)).collect();
        presses.place_with(&placed);
        forward = ForwardModel::from_presses(&presses, setup, watch)?;
    }
    // Variance of a press at a place, relative to that of a reading: of its noise, and of its placement.
    let press_variance = |at: Position| {
        let placed = placement_sd_m.map_or(0.0, |sd_m| mean(forward.placement_variances(at, sd_m)));
        presses.variance + placed
    };
    let mut expected = ExpectedError::new(&forward, &contacts, extent);
    if expected.error_m(|_| 0.0) > MOST_OF_A_GUESS * expected.error_m(|_| f64::INFINITY) {
        return Err(PositionError::NothingTold);
    }
    let pressed = subsample(&presses.places);
    let first = expected.places.len();
    expected.places.extend(pressed.iter().map(|(position, _)| position));
    let mut posterior = Posterior::prior(&forward, &expected.places);
    for (i, (_, repeats)) in pressed.iter().enumerate() {
        watch.round()?;
        posterior.condition(first + i, press_variance(expected.places[first + i]) / *repeats as f64);
    }
    let mut advice = Advice {
        presses: presses.positions.len(),
        positions: presses.places.len(),
        error_m: expected.error_m(|place| posterior.variance(place)),
        endless_error_m: expected.error_m(|_| 0.0),
        next: Vec::new(),
        stop_percent,
    };
    if advice.is_enough() {
        return Ok(advice);
    }
    let variances: Vec<f64> = expected.sites().map(|site| press_variance(expected.places[site])).collect();
    while advice.next.len() < MOST_AHEAD && !advice.reaches_goal() {
        watch.round()?;
        let (site, error_m) = expected.best(&posterior, |site| variances[site]);
        posterior.condition(site, variances[site]);
        advice.next.push(NextPress { position: expected.places[site], error_m });
    }
    Ok(advice)
}

fn subsample(places: &[(Position, usize)]) -> Vec<(Position, usize)> {
    let mut drawn: Vec<usize> = random_order(places.len(), 0).into_iter().take(MOST_PRESSED).collect();
    drawn.sort_unstable();
    drawn.into_iter().map(|i| places[i]).collect()
}

//! The next press of a recording begun, and when to stop.

use super::design::{PositionDesign, PositionError};
use super::forward::ForwardModel;
use super::presses::Presses;
use super::variance::{ExpectedError, Posterior};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_numerics::watch::Watch;
use palpate_numerics::{OutOfRange, mean, random_order};

/// Presses that are looked ahead, at most.
const MOST_AHEAD: usize = 200;
/// Positions of a recording that are looked at, at most: of more, that many drawn at random, which leave a little more to gain than all do.
const MOST_PRESSED: usize = 1000;

/// Share of a guess's error that endlessly many presses must go below; else what differs between positions is noise.
const MOST_OF_A_GUESS: f64 = 0.5;

/// A press to come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextPress {
    /// Position to press.
    pub position: Position,
    /// The error that is expected after it, in metres.
    pub error_m: f64,
}

/// Advice on a recording begun: its expected error, and what more presses would gain.
///
/// Errors are standard deviations, in metres, averaged over the contacts: the limit, where what is left unknown of the
/// influence functions counts as noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Rows of the recording in which something touched.
    pub presses: usize,
    /// Places that were pressed.
    pub positions: usize,
    /// The error that is expected of a locator fitted now.
    pub error_m: f64,
    /// The error after endlessly many presses: the limit.
    pub endless_error_m: f64,
    /// The next presses, each the one that helps most, until the rule says to stop; empty where it says so now, and
    /// not longer than [`Advice::MOST_AHEAD`].
    pub next: Vec<NextPress>,
    /// The rule: stop once endlessly many presses would lower the error by less than this, in %.
    pub stop_percent: f64,
}

impl Advice {
    /// Presses that are looked ahead.
    pub const MOST_AHEAD: usize = MOST_AHEAD;

    /// By how much endlessly many presses would lower the error, in %.
    pub fn remaining_gain_percent(&self) -> f64 {
        100.0 * (1.0 - self.endless_error_m / self.error_m)
    }

    /// Whether the rule says to stop.
    pub fn is_enough(&self) -> bool {
        self.remaining_gain_percent() < self.stop_percent
    }

    /// Whether the presses to come reach what the rule asks for.
    pub fn reaches_goal(&self) -> bool {
        let last_m = self.next.last().map_or(self.error_m, |press| press.error_m);
        100.0 * (1.0 - self.endless_error_m / last_m) < self.stop_percent
    }
}

/// Advice on where to press next, for the contacts of a design and until its rule says to stop.
///
/// Influence functions are Gaussian processes whose smoothness and noise the recording tells; no model of the surface is needed.
/// Where the recording, or else the design's training, says how well places are met, a press has the variance |I′|²·σ² beside its noise.
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
/// [`PositionError`] when the recording is not the setup's, or too short to learn from, or the watch stopped it.
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
    // Variance of a press at a place, in units of a reading's: of its noise, and of the place itself.
    let press_variance = |at: Position| {
        let placed = placement_sd_m.map_or(0.0, |sd_m| mean(forward.placement_variances(at, sd_m)));
        presses.variance + placed
    };
    let mut expected = ExpectedError::new(&forward, &contacts, extent);
    if expected.error_m(|_| 0.0) > MOST_OF_A_GUESS * expected.error_m(|_| f64::INFINITY) {
        return Err(PositionError::NothingTold);
    }
    let pressed = few_of(&presses.places);
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

/// All positions up to [`MOST_PRESSED`], and of more that many.
fn few_of(places: &[(Position, usize)]) -> Vec<(Position, usize)> {
    let mut drawn: Vec<usize> = random_order(places.len(), 0).into_iter().take(MOST_PRESSED).collect();
    drawn.sort_unstable();
    drawn.into_iter().map(|i| places[i]).collect()
}

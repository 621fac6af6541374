//! From sections to a checked rig.

mod columns;
mod contact;
mod design;
mod estimator;
mod load;
mod motion;
mod places;
mod plate;
mod sensors;
mod supported_beam;
mod surface;

use palpate_estimators::setup::Bench;

use super::Rig;
use super::error::{RigError, RigProblem};
use super::sections::RigSections;

/// More values than a recording of the training positions should hold in memory.
const MOST_VALUES: usize = 100_000_000;

/// Checks the sections of a rig, or of a study that embeds them; spans are those of the document they came from.
///
/// # Errors
/// [`RigError`] for the first thing that is wrong.
pub fn validate(sections: &RigSections) -> Result<Rig, RigError> {
    let surface = surface::validate(sections.surface.as_ref())?;
    let layout = sensors::validate(sections.sensors.as_ref(), sections.recording.as_ref(), &surface)?;
    let force_n = contact::validate_force(sections.contact.as_ref())?;
    let training = contact::validate_training(sections.training.as_ref(), surface.extent())?;
    let simulated = surface.model().is_some() && sections.recording.is_none();
    let pressed_n = training.as_ref().and_then(|training| training.force_n).or(force_n);
    if let (Some(training), None, true) = (&sections.training, pressed_n, simulated) {
        return Err(RigProblem::NoForce.at(training.span()));
    }
    contact::check_forces(sections, &surface, force_n, training.as_ref())?;
    if let (Some(section), Some(training)) = (&sections.training, &training) {
        let values = training.count.saturating_mul(training.repeats).saturating_mul(layout.len());
        if values > MOST_VALUES {
            return Err(RigProblem::TooManyValues { values, most: MOST_VALUES }.at(section.span()));
        }
    }
    let estimator = estimator::validate(sections.estimator.as_ref(), &layout, force_n)?;
    let loads = load::validate(sections.load.as_deref(), &surface)?;
    let columns = columns::validate(sections.recording.as_ref(), &layout, surface.extent())?;
    let bench = Bench { surface, layout, force_n, columns };
    let motion =
        motion::validate(sections.motion.as_ref(), sections.surface.as_ref(), &bench.surface, force_n)?;
    let design = design::validate(sections.design.as_ref(), &bench)?;
    Ok(Rig { bench, training, estimator, loads, motion, design })
}

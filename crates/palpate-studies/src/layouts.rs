//! The layouts that arms ask for by method.

use super::{Arm, AskedLayout, Study, StudyRunError};
use palpate_design::sensors::{DesignError, Method, SensorDesign, SensorProblem};
use palpate_estimators::setup::Setup;
use palpate_mechanics::sensing::Layout;
use palpate_numerics::watch::Watch;

/// Seed of the searches, the same whatever the study's seeds are: a layout is part of what an arm is.
const SEED: u64 = 0;

/// Gives every arm that asks for a layout the one that the study's `[design]` leads to; arms that ask alike get the same.
pub(super) fn lay_out(mut study: Study, watch: Watch) -> Result<Study, StudyRunError> {
    let mut found: Vec<(Wish, Layout)> = Vec::new();
    for arm in &mut study.arms {
        let Some((asked, wish)) = wish(arm) else { continue };
        let layout = match found.iter().find(|(other, _)| *other == wish) {
            Some((_, layout)) => layout.clone(),
            None => {
                let layout = wish.layout(watch).map_err(|error| match error {
                    DesignError::Cancelled(cancelled) => StudyRunError::Cancelled(cancelled),
                    error => StudyRunError::Design { arm: arm.name.clone(), place: asked.place, error },
                })?;
                found.push((wish, layout.clone()));
                layout
            }
        };
        arm.rig.setup.layout = layout;
    }
    Ok(study)
}

/// What a layout follows from.
#[derive(PartialEq)]
struct Wish {
    method: Method,
    setup: Setup,
    design: SensorDesign,
}

impl Wish {
    fn layout(&self, watch: Watch) -> Result<Layout, DesignError> {
        let problem = SensorProblem::new(&self.setup, &self.design, watch)?;
        Ok(problem.by_method(self.method, SEED, watch)?.layout)
    }
}

fn wish(arm: &Arm) -> Option<(AskedLayout, Wish)> {
    let asked = arm.layout.clone()?;
    let setup = arm.rig.pressed_setup();
    let design = arm.rig.design.clone().or_else(|| SensorDesign::of(&arm.rig.setup).ok())?;
    let method = asked.method;
    Some((asked, Wish { method, setup, design }))
}

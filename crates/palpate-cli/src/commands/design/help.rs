//! What to do about a design that cannot be made.

use palpate_design::positions::PositionError;
use palpate_design::sensors::DesignError;
use palpate_mechanics::limit::LimitError;

/// What would help to place sensors.
pub fn for_sensors(error: &DesignError) -> &'static str {
    match error {
        DesignError::Limit(LimitError::NoModel) => "give a surface with a model, such as `kind = \"beam\"`",
        DesignError::Limit(LimitError::NoForce | LimitError::Force { .. }) => {
            "the limit depends on the contact force: `force = \"3 N\"` in [contact], or --force \"3 N\""
        }
        DesignError::Limit(LimitError::Noise(error)) => error.help(),
        DesignError::Cancelled(_) => "start it again",
        DesignError::Limit(LimitError::Positions { .. }) => "set the contacts' `every` wider apart",
        DesignError::OutOfRange(_) | DesignError::Layout(_) => "check it in [design]",
        DesignError::SingularNoise { .. } => {
            "add `noise = \"5 um\"` to [sensors], or to the kind in [design] `kinds`"
        }
        DesignError::TooFewSites { .. } => {
            "lower `count`, bring `sites` closer together, or make `keep_out` smaller"
        }
        DesignError::Spacing { .. } => "lower `count` or `spacing`, or make `keep_out` smaller",
        DesignError::NoMirror { .. } => "lower `count`, bring `sites` closer together, or allow symmetry",
        DesignError::Budget { .. } => "raise `budget`, lower `count`, or offer cheaper `kinds`",
        DesignError::TooManyMustHaves { .. } => "raise `count`, or take some from `must_have`",
        DesignError::MustHaveReadsNothing { .. } => "move it, or leave it out",
        DesignError::MustHaveKeptOut { .. } => "move it, or change the zone",
        DesignError::MustHavesExclude { .. } => "move one of them, or relax the constraint",
        DesignError::MustHaveWithoutTwin { .. } => "move it, or leave `symmetry` out",
        DesignError::Symmetry { .. } => {
            "choose `sites` that mirror each other, such as a distance that divides the length, or an even `count`"
        }
        DesignError::NoLayout { .. } => {
            "ask for another method, relax the constraints, or offer sensors other than reactions"
        }
        DesignError::TooLarge { .. } => "set `sites` or the contacts' `every` wider apart",
    }
}

/// What would help to place training positions.
pub fn for_positions(error: &PositionError) -> &'static str {
    match error {
        PositionError::Cancelled(_) => "start it again",
        PositionError::NoModel => {
            "give a surface with a model, such as `kind = \"beam\"`; or --data with a recording begun, for the next press"
        }
        PositionError::NoForce => {
            "add `force = \"3 N\"` to [contact], or to [training] where it is not known afterwards"
        }
        PositionError::Auto => "say which: `kind = \"influence\"` in [estimator]",
        PositionError::TooFew { .. } => "--count takes a larger number",
        PositionError::Arrangement(_) | PositionError::Calibration(_) | PositionError::Regression(_) => {
            "check [training], [sensors] and [estimator] of the rig"
        }
        PositionError::OutOfRange(_) => "check it on the command line, or in [design]",
        PositionError::Channels { .. } => "check `channels` in [recording], or the rig's sensors",
        PositionError::TooFewPresses { .. } => "begin with evenly spaced presses, ends included",
        PositionError::NoNoise { .. } => "press some positions twice, or add `noise = \"5 um\"` to [sensors]",
    }
}

//! Rule files.

use crate::failure::{Failure, UserError};
use crate::input;
use palpate_estimators::estimator::Locator;
use palpate_live::rules::Rules;
use palpate_mechanics::surface::Extent;
use std::path::Path;

/// Reads the rules of a file for a surface of this extent; none without a file.
pub fn read(path: Option<&Path>, extent: Extent) -> Result<Rules, Failure> {
    let Some(path) = path else { return Ok(Rules::default()) };
    let text = input::read_text(path)?;
    Ok(Rules::from_toml(&text, extent).map_err(|error| {
        let span = error.span.clone().unwrap_or(0..0);
        UserError::new(error).at_span(&path.display().to_string(), &text, span)
    })?)
}

/// Rejects rules about a force that the locator does not estimate.
pub fn check_force_rules(rules: &Rules, path: &Path, locator: &Locator) -> Result<(), Failure> {
    if locator.estimates_force() {
        return Ok(());
    }
    let Some(rule) = rules.first_of_force() else { return Ok(()) };
    let problem = format!(
        "rule `{}` requires a `force`, but a locator of kind `{}` estimates none: the rule would never act",
        rule.name,
        locator.kind()
    );
    let user_error = UserError::for_path(path, problem);
    Err(user_error.help("remove `force`, or fit an estimator of the force, such as `influence`").into())
}

pub fn refuse_publishing(publishing: &Rules, path: &Path, help: &str) -> Result<(), Failure> {
    let Some(rule) = publishing.as_slice().first() else { return Ok(()) };
    let user_error = UserError::for_path(
        path,
        format!("rule `{}` publishes a message, but no broker is given", rule.name),
    );
    Err(user_error.help(help).into())
}

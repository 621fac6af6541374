//! Rule files.

use crate::failure::{Complaint, Failure};
use crate::input;
use palpate_live::rules::Rules;
use palpate_mechanics::surface::Extent;
use std::path::Path;

/// The rules of a file for a surface of this extent: those that publish and those that send commands to the board; none without a file.
pub fn read(path: Option<&Path>, extent: Extent) -> Result<(Rules, Rules), Failure> {
    let Some(path) = path else { return Ok((Rules::default(), Rules::default())) };
    let text = input::read_text(path)?;
    let rules = Rules::from_toml(&text, extent).map_err(|error| {
        let span = error.span.clone().unwrap_or(0..0);
        Complaint::new(error).at_span(&path.display().to_string(), &text, span)
    })?;
    Ok(rules.by_action())
}

/// Refuses rules that publish, where there is no broker.
pub fn refuse_publishing(publishing: &Rules, path: &Path, help: &str) -> Result<(), Failure> {
    let Some(rule) = publishing.as_slice().first() else { return Ok(()) };
    let complaint =
        Complaint::about(path, format!("rule `{}` publishes a message, and there is no broker", rule.name));
    Err(complaint.help(help).into())
}

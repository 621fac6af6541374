//! Estimators that suit a setup.

use super::Estimator;
use crate::influence::{Influence, Structure};
use crate::setup::Setup;

/// Returns the suitable estimators, with `own` for its kind. Back-propagation is capped at some seconds.
pub fn contenders(setup: &Setup, own: &Estimator, rows: usize) -> Vec<Estimator> {
    const MOST_PRESENTATIONS: usize = 20_000_000;
    let mut contenders = Estimator::contenders(setup);
    for contender in &mut contenders {
        match (&*contender, own) {
            (Estimator::Influence(Influence { structure, .. }), Estimator::Influence(own))
                if *structure != Structure::Auto =>
            {
                *contender = Estimator::Influence(Influence { structure: *structure, ..*own });
            }
            _ if contender.kind() == own.kind() => *contender = own.clone(),
            _ => {}
        }
        if let Estimator::Network(config) = contender {
            let most = u32::try_from(MOST_PRESENTATIONS / rows.max(1)).unwrap_or(u32::MAX).max(1);
            config.training.max_epochs = config.training.max_epochs.min(most);
        }
    }
    contenders
}

/// Name that suits no estimator.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no estimator `{name}` suits the bench; it can be: {}", known.join(", "))]
pub struct UnknownEstimator {
    /// Unknown name.
    pub name: String,
    /// Valid kinds.
    pub known: Vec<&'static str>,
}

/// Selects estimators by kind or [`Estimator::name`]; all for an empty `only`.
///
/// # Errors
/// [`UnknownEstimator`].
pub fn select(mut contenders: Vec<Estimator>, only: &[String]) -> Result<Vec<Estimator>, UnknownEstimator> {
    let is_named = |contender: &Estimator, name: &str| [contender.kind(), contender.name()].contains(&name);
    if let Some(name) = only.iter().find(|name| !contenders.iter().any(|contender| is_named(contender, name)))
    {
        let mut known: Vec<&'static str> = contenders.iter().map(Estimator::kind).collect();
        known.dedup();
        return Err(UnknownEstimator { name: name.clone(), known });
    }
    contenders.retain(|contender| only.is_empty() || only.iter().any(|name| is_named(contender, name)));
    Ok(contenders)
}

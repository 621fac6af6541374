//! Influence functions, and their inversion: learn what each sensor reads as a function of where the contact is, a
//! smooth curve, and find the contact whose curve values are the most likely cause of a reading.

mod answer;
mod belief;
mod config;
mod fitting;
mod hyperparameters;
mod locator;
mod posterior;
mod presses;
mod prior;
mod search;
mod several;
mod table;

pub use belief::ForceBelief;
pub use config::{InfluenceConfig, InfluenceSource};
pub use fitting::InfluenceFitError;
pub use locator::BeamLocator;
pub use search::Scratch;
pub use table::InfluenceTable;

use crate::method::{Fit, FitTask};

impl Fit for InfluenceConfig {
    type Locator = BeamLocator;
    type Error = InfluenceFitError;

    fn fit(
        &self,
        task: FitTask,
        keep_going: &mut dyn FnMut() -> bool,
    ) -> Result<Option<BeamLocator>, InfluenceFitError> {
        fitting::fit_modelled(*self, task, keep_going)
    }
}

#[cfg(test)]
mod tests;

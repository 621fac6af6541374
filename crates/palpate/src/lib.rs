//! Turns an elastic surface with a few sensors into a calibrated contact locator.

pub use palpate_design as design;
pub use palpate_estimators as estimators;
pub use palpate_mechanics as mechanics;
pub use palpate_numerics as numerics;
pub use palpate_rig as rig;

//! Sections of a rig.

use palpate::design::sensors::SensorDesign;
use palpate::estimators::estimator::Estimator;
use palpate::estimators::setup::Setup;
use palpate::rig::RigSections;
use pyo3::prelude::*;

use crate::errors::{of_rig, refused};

pub fn setup(text: &str) -> PyResult<Setup> {
    let sections = RigSections::from_toml(text);
    let setup = sections.and_then(|sections| sections.setup());
    setup.map_err(|error| of_rig(&error, "setup", text))
}

pub fn with_imperfections(text: &str, setup: &Setup) -> PyResult<Setup> {
    let sections = RigSections::from_toml(text);
    let setup = sections.and_then(|sections| sections.with_imperfections(setup.clone()));
    setup.map_err(|error| of_rig(&error, "imperfections", text))
}

pub fn estimator(text: &str, setup: &Setup) -> PyResult<Estimator> {
    let sections = RigSections::from_toml(text);
    let estimator = sections.and_then(|sections| sections.estimator(setup));
    let estimator = estimator.map_err(|error| of_rig(&error, "estimator", text))?;
    estimator.ok_or_else(|| refused("the text has no section [estimator]"))
}

pub fn design(text: &str, setup: &Setup) -> PyResult<Option<SensorDesign>> {
    let sections = RigSections::from_toml(text);
    let design = sections.and_then(|sections| sections.design(setup));
    design.map_err(|error| of_rig(&error, "design", text))
}

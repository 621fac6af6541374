//! Argument that is a setup, a rig or a locator.

use std::sync::Arc;

use palpate::estimators::estimator::Estimator;
use palpate::estimators::setup;
use palpate::estimators::status::FalseAlarmRate;
use palpate::rig;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::bench::Setup;
use crate::locator::Locator;
use crate::rig::Rig;

pub enum Subject<'a> {
    Setup(&'a Arc<setup::Setup>),
    Rig(&'a rig::Rig),
    Locator(&'a palpate::estimators::estimator::Locator),
}

impl<'a> Subject<'a> {
    /// Converts the argument `name`.
    ///
    /// # Errors
    /// `TypeError` for another type.
    pub fn of(value: &'a Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        if let Ok(setup) = value.cast::<Setup>() {
            return Ok(Self::Setup(&setup.get().0));
        }
        if let Ok(rig) = value.cast::<Rig>() {
            return Ok(Self::Rig(&rig.get().inner));
        }
        if let Ok(locator) = value.cast::<Locator>() {
            return Ok(Self::Locator(&locator.get().inner));
        }
        let found = value.get_type().name()?;
        Err(PyTypeError::new_err(format!(
            "`{name}` is of the type {found}; it must be a Setup, a Rig or a Locator"
        )))
    }

    pub fn setup(&self) -> &'a setup::Setup {
        match self {
            Self::Setup(setup) => setup,
            Self::Rig(rig) => &rig.setup,
            Self::Locator(locator) => &locator.setup,
        }
    }

    pub fn false_alarm_rate(&self) -> FalseAlarmRate {
        let set = match self {
            Self::Setup(_) => None,
            Self::Rig(rig) => Estimator::false_alarm_rate(&rig.estimator),
            Self::Locator(locator) => locator.false_alarm_rate(),
        };
        set.unwrap_or_default()
    }
}

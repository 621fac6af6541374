//! Setups of the tests.

use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::Estimator;
use palpate_estimators::setup::Setup;
use palpate_mechanics::sensing::SensorKind::Deflection;
use palpate_mechanics::surface::{Beam, Plate};
use palpate_mechanics::units::{gpa, mm, newtons, um};

use crate::positions::PositionDesign;
use crate::sensors::{ContactPrior, SensorDesign, Sites};

pub(crate) struct Example {
    pub setup: Setup,
    pub design: PositionDesign,
}

pub(crate) fn beam(noise_m: f64) -> Setup {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap();
    let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(noise_m)).unwrap();
    setup.known_force(newtons(3.0)).unwrap()
}

pub(crate) fn noisy() -> Example {
    Example { setup: beam(um(5.0)), design: PositionDesign::for_training(&Training::even(20).repeated(5)) }
}

pub(crate) fn paper() -> Example {
    let design = PositionDesign::for_training(&Training::even(10)).estimator(Estimator::default());
    Example { setup: beam(0.0), design }
}

pub(crate) fn plate(elements: usize) -> Example {
    let plate = Plate::simply_supported((mm(300.0), mm(300.0)), mm(0.8), gpa(200.0), 0.3);
    let plate = plate.and_then(|plate| plate.with_elements(elements));
    let setup = Setup::new(plate.unwrap()).sensors(Deflection.grid(3, 3).noise(um(5.0))).unwrap();
    let setup = setup.known_force(newtons(5.0)).unwrap();
    Example { setup, design: PositionDesign::for_training(&Training::grid(6, 6).repeated(5)) }
}

pub(crate) fn sensor_design() -> (Setup, SensorDesign) {
    let setup = beam(um(5.0));
    let contacts = ContactPrior::along(mm(20.0), mm(380.0), mm(5.0));
    let design = SensorDesign::for_setup(&setup)
        .unwrap()
        .sites(Sites::Every(mm(5.0)))
        .contacts(contacts)
        .unknown_force();
    (setup, design)
}

//! The founding paper's beam: simulate its calibration, fit, and locate a contact of unknown force.

use palpate::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("located within {:.3} mm", 1e3 * error_m()?);
    Ok(())
}

/// Distance of the estimate from a contact at 150 mm, in metres.
pub fn error_m() -> Result<f64, Box<dyn std::error::Error>> {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?;
    let presses = setup.simulate(&Training::even(10).repeated(10).with_force(newtons(3.0)), 0)?;
    let locator = Influence::default().fit(&setup, &presses)?;

    let touched = setup.known_force(newtons(2.0))?;
    let reading = &simulate_at(&touched, &[Position::along(mm(150.0))], 1, 7)?.rows[0].reading;
    let estimate = locator.locate(reading)?;
    println!("{:.1} mm, {:?} N", 1e3 * estimate.contact.position.x_m, estimate.contact.force_n);
    Ok((estimate.contact.position.x_m - mm(150.0)).abs())
}

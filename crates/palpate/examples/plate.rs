//! A plate over nine deflection sensors: position in two coordinates, and an unknown force.

use palpate::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("{:.2} N", force_n()?);
    Ok(())
}

/// The estimated force of a contact of 4 N, in newtons.
pub fn force_n() -> Result<f64, Box<dyn std::error::Error>> {
    let plate = Plate::simply_supported((mm(300.0), mm(200.0)), mm(0.8), gpa(200.0), 0.3)?;
    let setup = Setup::new(plate).sensors(Deflection.grid(3, 3).noise(um(5.0)))?;
    let presses = setup.simulate(&Training::grid(6, 4).repeated(5).with_force(newtons(5.0)), 1)?;
    let locator = Influence::default().fit(&setup, &presses)?;

    let touched = setup.known_force(newtons(4.0))?;
    let place = Position { x_m: mm(110.0), y_m: mm(60.0) };
    let reading = &simulate_at(&touched, &[place], 1, 2)?.rows[0].reading;
    let ContactEstimate { position, force_n, .. } = locator.locate(reading)?.contact;
    println!("({:.1}, {:.1}) mm", 1e3 * position.x_m, 1e3 * position.y_m);
    Ok(force_n.unwrap_or(f64::NAN))
}

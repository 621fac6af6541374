//! Where to press: training positions for the paper's network, and the next press of a recording begun.

use palpate::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("press next at {:.0} mm", 1e3 * next_m()?);
    Ok(())
}

/// Where a recording of presses in the left half is best continued, in metres.
pub fn next_m() -> Result<f64, Box<dyn std::error::Error>> {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    let pressed = [20.0, 60.0, 100.0, 140.0, 180.0].map(|x| Position::along(mm(x)));
    let begun = simulate_at(&setup, &pressed, 5, 3)?;
    let advice = next_press(&setup, None, &begun, 5.0, Watch::NONE)?;
    let next = advice.next.first().ok_or("enough has been pressed")?;
    println!("the error falls from {:.3} to {:.3} mm", 1e3 * advice.error_m, 1e3 * next.error_m);
    Ok(next.position.x_m)
}

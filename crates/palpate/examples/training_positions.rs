//! Where to press: the best of several arrangements of six training positions, and the next press of a recording begun.

use palpate::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("the leftmost of six presses: {:.0} mm", 1e3 * first_m()?);
    println!("press next at {:.0} mm", 1e3 * next_m()?);
    Ok(())
}

fn setup() -> Result<Setup, Box<dyn std::error::Error>> {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    Ok(Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?)
}

/// Leftmost of the six best training positions, in metres.
pub fn first_m() -> Result<f64, Box<dyn std::error::Error>> {
    let quick = PositionDesign { trials: 0, calibrations: 2, ..PositionDesign::default() };
    let problem = PositionProblem::new(&setup()?, &quick.count(6).repeats(5))?;
    let placed = problem.all(Watch::NONE)?;
    for one in &placed {
        println!("{}: {:.3} mm", one.placement.name(), 1e3 * one.verification.mean_error_m);
    }
    Ok(best_placed(&placed).ok_or("no arrangement")?.positions[0].x_m)
}

/// Best next position for a recording of presses in the left half, in metres.
pub fn next_m() -> Result<f64, Box<dyn std::error::Error>> {
    let pressed = [20.0, 60.0, 100.0, 140.0, 180.0].map(|x| Position::along(mm(x)));
    let begun = simulate_at(&setup()?, &pressed, 5, 3)?;
    let advice = next_press(&setup()?, &begun, &PositionDesign::default(), Watch::NONE)?;
    let next = advice.next.first().ok_or("enough has been pressed")?;
    println!("the error falls from {:.3} to {:.3} mm", 1e3 * advice.error_m, 1e3 * next.error_m);
    Ok(next.position.x_m)
}

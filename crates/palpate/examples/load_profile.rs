//! A load that lies spread out: its profile, its total and its centre from one reading.

use palpate::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("{:.2} N in all", total_n()?);
    Ok(())
}

/// The estimated total of 3 N spread over 150–230 mm, in newtons.
pub fn total_n() -> Result<f64, Box<dyn std::error::Error>> {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    let setup = Setup::new(beam)
        .sensors(Deflection.evenly(8).noise(um(1.0)))?
        .sensors(Strain.evenly(8).noise(microstrain(0.2)))?;
    let load = UniformLoad::along(mm(150.0), mm(230.0), newtons(3.0));
    let reading = &simulate_loads(&setup, &[load], 1, 3)?[0];

    let profile = Profiler::from_setup(&setup)?.profile(reading)?;
    for patch in &profile.patches {
        println!("{:.0}–{:.0} mm: {:.2} N", 1e3 * patch.from.x_m, 1e3 * patch.to.x_m, patch.force_n);
    }
    Ok(profile.total_n)
}

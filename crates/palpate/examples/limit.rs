//! What physics allows a setup, without calibrating anything: the Cramér–Rao bound along the beam.

use palpate::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("at mid-span no unbiased estimator is better than {:.3} mm (1 σ)", 1e3 * mid_span_m()?);
    Ok(())
}

/// The limit at mid-span for a known force, in metres.
pub fn mid_span_m() -> Result<f64, Box<dyn std::error::Error>> {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?;
    let bound = setup.cramer_rao_bound()?;
    for x_m in [mm(20.0), mm(100.0), mm(200.0)] {
        let contact = Contact { position: Position::along(x_m), force_n: newtons(3.0) };
        let unknown =
            bound.bound_at(contact, Force::Unknown).ok_or("the position is unidentifiable there")?;
        println!("{:3.0} mm, unknown force: {:.3} mm", 1e3 * x_m, 1e3 * unknown.sd_position_m);
    }
    let contact = Contact { position: Position::along(mm(200.0)), force_n: newtons(3.0) };
    Ok(bound.bound_at(contact, Force::Known).ok_or("the position is unidentifiable there")?.sd_position_m)
}

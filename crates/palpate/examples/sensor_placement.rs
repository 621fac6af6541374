//! Where to put eight sensors, for contacts of unknown force away from the ends.

use palpate::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("the mean limit falls by {:.1} %", 100.0 * gain()?);
    Ok(())
}

/// Share by which the mean limit of the designed layout is below that of the even one.
pub fn gain() -> Result<f64, Box<dyn std::error::Error>> {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    let contacts = ContactPrior::along(mm(20.0), mm(380.0), mm(5.0));
    let design =
        SensorDesign::for_setup(&setup)?.sites(Sites::Every(mm(5.0))).contacts(contacts).unknown_force();
    let problem = SensorProblem::new(&setup, &design, Watch::NONE)?;
    let (even, best) = (problem.even()?, problem.greedy_exchange(0, Watch::NONE)?);
    for sensor in best.layout.sensors() {
        println!("{}: {:.0} mm", sensor.name, 1e3 * sensor.position.x_m);
    }
    let limit =
        |designed: &AssessedLayout| designed.assessment.mean_limit_m.ok_or("some contact is unidentifiable");
    Ok(1.0 - limit(&best)? / limit(&even)?)
}

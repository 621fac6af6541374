//! A contact that moves: each reading updates a track, which is better than any reading by itself.

use palpate::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("mean error of the track: {:.3} mm", 1e3 * mean_error_m()?);
    Ok(())
}

/// Mean error of a track along the beam, in metres.
pub fn mean_error_m() -> Result<f64, Box<dyn std::error::Error>> {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(20.0)))?.known_force(newtons(3.0))?;
    let presses = setup.simulate(&Training::even(10).repeated(50), 0)?;
    let locator = Influence::default().fit(&setup, &presses)?.into_locator();

    let path: Vec<Position> = (0..500).map(|i| Position::along(mm(100.0 + 0.3 * f64::from(i)))).collect();
    let config = TrackerConfig::default();
    let tracking = locator.tracking(&config)?;
    let mut tracker = Tracker::new(tracking.likelihood(), config);
    let (mut sum_m, mut tracked) = (0.0, 0);
    for (i, row) in simulate_at(&setup, &path, 1, 9)?.rows.iter().enumerate() {
        if let Some(contact) = tracker.update(1e-3 * i as f64, &row.reading)?.contacts.first() {
            sum_m += (contact.x_m - row.position.x_m).abs();
            tracked += 1;
        }
    }
    Ok(sum_m / f64::from(tracked))
}

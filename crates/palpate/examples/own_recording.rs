//! A recording of one's own: a CSV file of presses on a surface that has no model, cross-validated by position.

use palpate::prelude::*;

const PRESSES: &str = "x,left,right
10,0.91,0.12\n20,0.79,0.21\n30,0.70,0.29\n40,0.61,0.40\n50,0.50,0.51\n60,0.41,0.60\n70,0.28,0.69\n80,0.20,0.81
10,0.90,0.11\n20,0.81,0.19\n30,0.69,0.31\n40,0.59,0.41\n50,0.51,0.49\n60,0.39,0.61\n70,0.31,0.71\n80,0.19,0.79";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("mean error at positions held out: {:.2} mm", 1e3 * mean_error_m()?);
    Ok(())
}

/// Mean error at positions that the locator was not fitted to, in metres.
pub fn mean_error_m() -> Result<f64, Box<dyn std::error::Error>> {
    let columns = Columns::along("x", ["left", "right"]);
    let setup = Setup::measured(mm(90.0), &["left", "right"])?.recorded_as(columns);
    let presses = setup.read_recording("presses.csv", PRESSES.as_bytes())?;
    let locator = Influence::default().fit(&setup, &presses)?;
    println!("{:?}", locator.locate(&[0.56, 0.45])?.contact.position);

    let judged = cross_validate(&Influence::default(), FitTask::new(&setup, &presses), 4)?;
    Ok(judged.summary(None).map_or(f64::NAN, |errors| errors.average_m))
}

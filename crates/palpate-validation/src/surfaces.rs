use anyhow::Result;
use palpate::mechanics::sensing::ChannelModel;
use palpate::prelude::{Beam, Deflection, Plate, Setup, gpa, mm};

/// Eight deflection sensors with noise alone; unknown force.
pub fn paper_beam(noise_m: f64) -> Result<Setup> {
    paper_beam_with(ChannelModel { noise_sd: noise_m, ..ChannelModel::default() })
}

/// Eight deflection sensors; unknown force.
pub fn paper_beam_with(channel: ChannelModel) -> Result<Setup> {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    Ok(Setup::new(beam).sensors(Deflection.evenly(8).channel(channel))?)
}

/// Simple edges, and nine deflection sensors with noise alone; unknown force.
pub fn square_plate(noise_m: f64) -> Result<Setup> {
    let plate = Plate::simply_supported((mm(300.0), mm(300.0)), mm(0.8), gpa(200.0), 0.3)?;
    Ok(Setup::new(plate).sensors(Deflection.grid(3, 3).noise(noise_m))?)
}

//! `palpate design`: what to build before it is built, and where to press before it is pressed.

pub mod positions;
pub mod sensors;
pub mod watch;

use crate::failure::Failure;

/// Where to put the sensors, and where to press.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Sensors(sensors::Arguments),
    Positions(positions::Arguments),
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.what {
        What::Sensors(arguments) => sensors::run(arguments),
        What::Positions(arguments) => positions::run(arguments),
    }
}

//! `palpate design`: what to build before it is built.

pub mod sensors;

use crate::failure::Failure;

/// Where to put the sensors.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Sensors(sensors::Arguments),
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.what {
        What::Sensors(arguments) => sensors::run(arguments),
    }
}

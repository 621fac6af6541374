//! The `palpate` command: arguments, files, progress, messages. The library computes the results.
//!
//! ```console
//! $ palpate fit examples/paper.toml -o locator.json
//! $ palpate simulate examples/paper.toml --every "1 mm" -o presses.csv
//! $ palpate evaluate locator.json --data presses.csv --report report
//! ```
// These macros panic if the output is closed; `remark` and `output` have replacements.
#![warn(clippy::print_stderr, clippy::print_stdout)]

mod chunks;
mod commands;
mod contact_lines;
mod cost;
mod estimate_columns;
mod failure;
mod input;
mod json;
mod lines;
mod output;
mod progress;
mod remark;
mod rules;
mod session;
mod stdout;
mod tables;
mod tare;
mod target;

use crate::remark::alert;
use clap::{CommandFactory, Parser, Subcommand};
use palpate_live::login::without_passwords;
use std::io::Write;
use std::process::ExitCode;

/// Examples and exit codes in the long help.
const EXAMPLES: &str = "\
Examples:
  # Write a first rig for a recording of presses
  palpate init presses.csv -o rig.toml

  # Fit a locator, and locate readings
  palpate fit rig.toml --data presses.csv -o locator.json
  palpate locate locator.json touches.csv

Exit codes:
  0    Done
  1    Ran, but a stated goal was missed
  2    Bad input, or an output that cannot be written
  3    Finished with data lost
  129  Ended by SIGHUP
  130  Interrupted by Ctrl-C
  131  Ended by SIGQUIT
  143  Ended by SIGTERM";

/// Turn an elastic surface with a few sensors into a calibrated contact locator
#[derive(Parser)]
#[command(name = "palpate", version, max_term_width = 100, after_long_help = EXAMPLES)]
struct Arguments {
    /// Omit progress, notes and warnings; print errors only on stderr
    #[arg(short, long, global = true, help_heading = "Global options")]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Study(commands::study::Arguments),
    Init(commands::init::Arguments),
    Simulate(commands::simulate::Arguments),
    Fit(commands::fit::Arguments),
    Evaluate(commands::evaluate::Arguments),
    Locate(commands::locate::Arguments),
    Track(commands::track::Arguments),
    Calibrate(commands::calibrate::Arguments),
    Compare(commands::compare::Arguments),
    Design(commands::design::Arguments),
    Limit(commands::limit::Arguments),
    Inspect(commands::inspect::Arguments),
    Profile(commands::profile::Arguments),
    Serve(commands::serve::Arguments),
    Record(commands::record::Arguments),
    Recover(commands::recover::Arguments),
    Replay(commands::replay::Arguments),
    SimulatedBoard(commands::simulated_board::Arguments),
    Completions(commands::completions::Arguments),
    #[command(hide = true)]
    Man(commands::man::Arguments),
}

fn main() -> ExitCode {
    failure::install_handler();
    progress::install_signal_handler();
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return answer(&error),
    };
    if arguments.quiet {
        remark::be_quiet();
    }
    let result = match arguments.command {
        Command::Study(arguments) => commands::study::run(&arguments),
        Command::Init(arguments) => commands::init::run(&arguments),
        Command::Simulate(arguments) => commands::simulate::run(&arguments),
        Command::Fit(arguments) => commands::fit::run(&arguments),
        Command::Evaluate(arguments) => commands::evaluate::run(&arguments),
        Command::Locate(arguments) => commands::locate::run(&arguments),
        Command::Track(arguments) => commands::track::run(&arguments),
        Command::Calibrate(arguments) => commands::calibrate::run(&arguments),
        Command::Compare(arguments) => commands::compare::run(&arguments),
        Command::Design(arguments) => commands::design::run(&arguments),
        Command::Limit(arguments) => commands::limit::run(&arguments),
        Command::Inspect(arguments) => commands::inspect::run(&arguments),
        Command::Profile(arguments) => commands::profile::run(&arguments),
        Command::Serve(arguments) => commands::serve::run(&arguments),
        Command::Record(arguments) => commands::record::run(&arguments),
        Command::Recover(arguments) => commands::recover::run(&arguments),
        Command::Replay(arguments) => commands::replay::run(&arguments),
        Command::SimulatedBoard(arguments) => commands::simulated_board::run(&arguments),
        Command::Completions(arguments) => commands::completions::run(&arguments, Arguments::command()),
        Command::Man(arguments) => commands::man::run(&arguments, Arguments::command()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

/// Prints help, version, or a complaint about the arguments.
fn answer(error: &clap::Error) -> ExitCode {
    let text = error.to_string();
    let shown = without_passwords(&text);
    if !error.use_stderr() && stdout::was_closed() {
        return output::closed().report();
    }
    let printed = match shown == text {
        true => error.print().and_then(|()| std::io::stdout().flush()),
        false => {
            alert!("{}", shown.trim_end());
            Ok(())
        }
    };
    match (error.use_stderr(), printed) {
        (true, _) => ExitCode::from(2),
        (false, Ok(())) => ExitCode::SUCCESS,
        (false, Err(error)) => output::unprinted(&error).report(),
    }
}

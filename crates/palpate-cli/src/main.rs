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
#[cfg(feature = "live")]
mod rules;
#[cfg(feature = "live")]
mod session;
mod stdout;
mod tables;
mod tare;
mod target;

use crate::remark::alert;
use clap::{CommandFactory, Parser, Subcommand};
#[cfg(feature = "live")]
use palpate_live::login::without_passwords;
use std::io::Write;
use std::process::ExitCode;

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
    #[cfg(feature = "live")]
    Calibrate(commands::calibrate::Arguments),
    Compare(commands::compare::Arguments),
    Design(commands::design::Arguments),
    Limit(commands::limit::Arguments),
    Inspect(commands::inspect::Arguments),
    Profile(commands::profile::Arguments),
    #[cfg(feature = "live")]
    Serve(commands::serve::Arguments),
    #[cfg(feature = "live")]
    Record(commands::record::Arguments),
    #[cfg(feature = "live")]
    Recover(commands::recover::Arguments),
    #[cfg(feature = "live")]
    Replay(commands::replay::Arguments),
    #[cfg(feature = "live")]
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
        #[cfg(feature = "live")]
        Command::Calibrate(arguments) => commands::calibrate::run(&arguments),
        Command::Compare(arguments) => commands::compare::run(&arguments),
        Command::Design(arguments) => commands::design::run(&arguments),
        Command::Limit(arguments) => commands::limit::run(&arguments),
        Command::Inspect(arguments) => commands::inspect::run(&arguments),
        Command::Profile(arguments) => commands::profile::run(&arguments),
        #[cfg(feature = "live")]
        Command::Serve(arguments) => commands::serve::run(&arguments),
        #[cfg(feature = "live")]
        Command::Record(arguments) => commands::record::run(&arguments),
        #[cfg(feature = "live")]
        Command::Recover(arguments) => commands::recover::run(&arguments),
        #[cfg(feature = "live")]
        Command::Replay(arguments) => commands::replay::run(&arguments),
        #[cfg(feature = "live")]
        Command::SimulatedBoard(arguments) => commands::simulated_board::run(&arguments),
        Command::Completions(arguments) => commands::completions::run(&arguments, Arguments::command()),
        Command::Man(arguments) => commands::man::run(&arguments, Arguments::command()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

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
        (false, Err(error)) => output::print_failure(&error).report(),
    }
}

/// Returns the text unchanged: a command without sources has no passwords.
#[cfg(not(feature = "live"))]
fn without_passwords(text: &str) -> String {
    text.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn verbs_and_options_are_those_of_the_features() {
        let command = Arguments::command();
        command.clone().debug_assert();
        let of_boards = ["calibrate", "record", "recover", "replay", "serve", "simulated-board"];
        for verb in of_boards {
            assert_eq!(command.find_subcommand(verb).is_some(), cfg!(feature = "live"), "{verb}");
        }
        for verb in of_boards.into_iter().filter_map(|verb| command.find_subcommand(verb)) {
            let takes_machine = verb.get_arguments().any(|argument| argument.get_id() == "stage");
            let may = ["calibrate", "serve", "simulated-board"].contains(&verb.get_name());
            assert_eq!(takes_machine, may && cfg!(feature = "gcode"), "{}", verb.get_name());
        }
        for verb in ["fit", "locate", "track", "study"] {
            assert!(command.find_subcommand(verb).is_some(), "{verb}");
        }
    }
}

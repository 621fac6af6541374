//! The `palpate` command: arguments, files, progress, messages. The library computes the results.
//!
//! ```console
//! $ palpate fit examples/paper.toml -o locator.json
//! $ palpate simulate examples/paper.toml --every "1 mm" -o presses.csv
//! $ palpate evaluate locator.json --data presses.csv --out report
//! ```
#![forbid(unsafe_code)]
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
mod tables;
mod tare;
mod target;

use crate::remark::remark;
use clap::{Parser, Subcommand};
#[cfg(feature = "live")]
use palpate_live::login::without_passwords;
use std::io::Write;
use std::process::ExitCode;

/// Turns an elastic surface with a few sensors into a calibrated contact locator.
///
/// Exit codes: 0 done; 1 ran, but a stated goal was missed; 2 bad input; 3 finished with data lost; 130 interrupted by Ctrl-C; 143 ended by SIGTERM, 129 by SIGHUP, 131 by SIGQUIT.
#[derive(Parser)]
#[command(name = "palpate", version, max_term_width = 100)]
struct Arguments {
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
}

fn main() -> ExitCode {
    failure::install_handler();
    progress::install_signal_handler();
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return answer(&error),
    };
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
    let printed = match shown == text {
        true => error.print().and_then(|()| std::io::stdout().flush()),
        false => {
            remark!("{}", shown.trim_end());
            Ok(())
        }
    };
    match (error.use_stderr(), printed) {
        (true, _) => ExitCode::from(2),
        (false, Ok(())) => ExitCode::SUCCESS,
        (false, Err(error)) => output::unprinted(&error).report(),
    }
}

/// The text, as a command without sources has no passwords.
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

//! `palpate completions`: the completion script of a shell.

use crate::failure::Failure;
use crate::output;
use clap_complete::Shell;

const EXAMPLES: &str = "\
Examples:
  # Complete in the current bash
  source <(palpate completions bash)

  # Install the script for fish
  palpate completions fish > ~/.config/fish/completions/palpate.fish";

/// Print a completion script for a shell
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Shell that reads the script
    shell: Shell,
}

pub fn run(arguments: &Arguments, mut command: clap::Command) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "palpate", &mut script);
    output::print(&mut std::io::stdout().lock(), &script)
}

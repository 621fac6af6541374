//! `palpate man`: the manual pages of all verbs.

use crate::failure::{Failure, UserError};
use crate::output;
use crate::target::{Inputs, TargetFolder};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  # Write the pages for `man`
  palpate man -o man/man1";

/// Write the manual pages of all verbs
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Write the pages into DIR: palpate.1, and palpate-VERB.1 for each verb
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
}

struct ManualPage {
    name: String,
    bytes: Vec<u8>,
}

pub fn run(arguments: &Arguments, mut command: clap::Command) -> Result<(), Failure> {
    // Otherwise each group of verbs has a page for its verb `help`.
    command = command.disable_help_subcommand(true);
    command.build();
    let mut pages = Vec::new();
    add_pages(&command, &mut pages).map_err(UserError::new)?;
    let folder = TargetFolder::for_report(&arguments.out, &Inputs::new([]))?;
    for page in &pages {
        folder.write(&page.name, &page.bytes)?;
    }
    output::print_line(format!("{} manual pages: {}", pages.len(), arguments.out.display()))
}

fn add_pages(command: &clap::Command, pages: &mut Vec<ManualPage>) -> std::io::Result<()> {
    let name = format!("{}.1", command.get_display_name().unwrap_or(command.get_name()));
    let mut bytes = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut bytes)?;
    pages.push(ManualPage { name, bytes });
    let verbs = command.get_subcommands().filter(|verb| !verb.is_hide_set());
    verbs.into_iter().try_for_each(|verb| add_pages(verb, pages))
}

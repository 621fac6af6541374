use super::{Batch, Sink};
use crate::commander::{Commander, SendError};
use crate::input::{Command, Input};
use crate::rules::{Action, RuleWatch, Rules};
use crate::session::Output;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

/// Most commands per [`STRETCH`], which protects the board.
const MOST: u32 = 50;
const STRETCH: Duration = Duration::from_secs(1);

/// Sink that sends the commands of rules.
pub struct CommandSink {
    rules: RuleWatch,
    to: Commander,
    reports: SyncSender<Input>,
    stretch: (Instant, u32),
    trouble: Option<CommandSinkError>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
enum CommandSinkError {
    #[error(transparent)]
    Device(SendError),
    #[error("rules have sent {MOST} commands within {} s, the maximum; increase `hold` so that they act less often", STRETCH.as_secs())]
    TooMany,
}

impl CommandSink {
    /// Sink; `reports` receives new causes of unsent commands.
    pub fn new(rules: Rules, to: Commander, reports: SyncSender<Input>) -> Self {
        Self { rules: RuleWatch::new(rules), to, reports, stretch: (Instant::now(), 0), trouble: None }
    }

    fn add(&mut self, output: &Output) {
        let mut lines = Vec::new();
        self.rules.add(output, |rule| {
            if let Action::Command(line) = &rule.action {
                lines.push((line.clone(), rule.name.clone()));
            }
        });
        for (line, rule) in lines {
            let unsent = self.send(&line).err();
            if let Some(unsent) = unsent.filter(|unsent| self.trouble != Some(*unsent)) {
                let text = format!("command `{line}` of rule `{rule}`: {unsent}");
                // A full queue of the session loses the report.
                let _ = self.reports.try_send(Input::Command(Command::Trouble(text)));
            }
            self.trouble = unsent;
        }
    }

    fn send(&mut self, line: &str) -> Result<(), CommandSinkError> {
        let (start, count) = &mut self.stretch;
        if start.elapsed() >= STRETCH {
            (*start, *count) = (Instant::now(), 0);
        }
        if *count >= MOST {
            return Err(CommandSinkError::TooMany);
        }
        *count += 1;
        self.to.send_line(line).map_err(CommandSinkError::Device)
    }
}

impl Sink for CommandSink {
    fn batch(&mut self, batch: &Arc<Batch>) {
        batch.outputs.iter().for_each(|output| self.add(output));
    }
}

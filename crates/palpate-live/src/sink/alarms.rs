use super::{Batch, Sink};
use crate::event::Event;
use crate::input::{Command, Input};
use crate::rules::{Action, RuleWatch, Rules};
use crate::session::Output;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Alarm rules, shared by sessions.
#[derive(Clone, Debug)]
pub struct Alarms(Arc<Mutex<RuleWatch>>);

impl Default for Alarms {
    fn default() -> Self {
        Self(Arc::new(Mutex::new(RuleWatch::new(Rules::default()))))
    }
}

impl Alarms {
    /// Replaces the rules, and resets their states.
    pub fn set(&self, rules: Rules) {
        *self.lock() = RuleWatch::new(rules);
    }

    fn lock(&self) -> MutexGuard<'_, RuleWatch> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Sink that raises alarms as events.
pub struct AlarmSink {
    alarms: Alarms,
    reports: SyncSender<Input>,
}

impl AlarmSink {
    /// Sink; `reports` receives alarms.
    pub fn new(alarms: Alarms, reports: SyncSender<Input>) -> Self {
        Self { alarms, reports }
    }
}

impl Sink for AlarmSink {
    fn batch(&mut self, batch: &Arc<Batch>) {
        let mut watch = self.alarms.lock();
        if watch.rules().as_slice().is_empty() {
            return;
        }
        // Alarm events must not raise further alarms.
        let is_alarm = |output: &&Output| matches!(output, Output::Event(record) if matches!(record.event, Event::Alarm { .. }));
        for output in batch.outputs.iter().filter(|output| !is_alarm(output)) {
            watch.add(output, |rule| {
                if let Action::Alarm(text) = &rule.action {
                    let alarm = Command::Alarm { name: rule.name.clone(), text: text.clone() };
                    // A full queue means that the session is behind its source, which its counters show.
                    let _ = self.reports.try_send(Input::Command(alarm));
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::EventRecord;
    use palpate_mechanics::surface::Extent;
    use std::sync::mpsc::sync_channel;

    fn rules(event: &str) -> Rules {
        let text = format!("[[rule]]\nname = \"r\"\nevent = \"{event}\"\nalarm = \"look\"\n");
        Rules::from_toml(&text, Extent::line(0.4).unwrap()).unwrap()
    }

    #[test]
    fn raises_alarms_by_the_rules_that_are_set_now() {
        let alarms = Alarms::default();
        let (reports, told) = sync_channel(8);
        let mut sink = AlarmSink::new(alarms.clone(), reports);
        let batch =
            |event| Arc::new(Batch { outputs: vec![Output::Event(EventRecord { time_s: 0.0, event })] });
        sink.batch(&batch(Event::Tared));
        assert!(told.try_recv().is_err(), "no rules are set");
        alarms.set(rules("tared"));
        sink.batch(&batch(Event::Tared));
        let expected = Command::Alarm { name: "r".to_owned(), text: "look".to_owned() };
        assert_eq!(told.try_recv(), Ok(Input::Command(expected)));
        alarms.set(rules("mark"));
        sink.batch(&batch(Event::Tared));
        assert!(told.try_recv().is_err(), "the rule was replaced");
    }
}

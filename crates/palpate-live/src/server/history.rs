//! Past of a session, for later browsers.

use crate::event::{Event, EventRecord};
use std::collections::VecDeque;
use std::sync::Arc;

const KEPT_S: f64 = 600.0;
const PER_S: f64 = 10.0;
const MOST_SAMPLES: usize = (KEPT_S * PER_S) as usize;
/// Limit on events, without moves.
const MOST_EVENTS: usize = 1000;
/// Limit on text, for many channels.
const MOST_BYTES: usize = 16 << 20;

/// Samples of 10 minutes at 10 a second, and last events, as JSON.
#[derive(Clone, Debug, Default)]
pub struct History {
    samples: VecDeque<(f64, Arc<str>)>,
    sample_bytes: usize,
    events: VecDeque<Arc<str>>,
}

impl History {
    /// True for the first sample of a tenth of a second.
    pub fn is_due(&self, time_s: f64) -> bool {
        self.samples.back().is_none_or(|(last_s, _)| (time_s * PER_S).floor() > (last_s * PER_S).floor())
    }

    pub fn push_sample(&mut self, time_s: f64, text: &str) {
        self.sample_bytes += text.len();
        self.samples.push_back((time_s, Arc::from(text)));
        let is_old = |past: &Self| {
            let first_s = past.samples.front().map_or(time_s, |(first_s, _)| *first_s);
            past.samples.len() > MOST_SAMPLES || past.sample_bytes > MOST_BYTES || time_s - first_s > KEPT_S
        };
        while is_old(self) {
            let Some((_, text)) = self.samples.pop_front() else { return };
            self.sample_bytes -= text.len();
        }
    }

    pub fn push_event(&mut self, event: &EventRecord) {
        if matches!(event.event, Event::Move { .. }) {
            return;
        }
        let Ok(text) = serde_json::to_string(event) else { return };
        self.events.push_back(Arc::from(text));
        if self.events.len() > MOST_EVENTS {
            self.events.pop_front();
        }
    }

    /// JSON of `samples` and `events`, the oldest first.
    pub fn to_json(&self) -> String {
        let mut json = String::with_capacity(self.sample_bytes + 64);
        json.push_str("{\"samples\":[");
        push_list(&mut json, self.samples.iter().map(|(_, text)| text));
        json.push_str("],\"events\":[");
        push_list(&mut json, self.events.iter());
        json.push_str("]}");
        json
    }
}

fn push_list<'a>(json: &mut String, texts: impl Iterator<Item = &'a Arc<str>>) {
    for (i, text) in texts.enumerate() {
        if i > 0 {
            json.push(',');
        }
        json.push_str(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(rate_hz: f64, seconds: f64) -> History {
        let mut past = History::default();
        for i in 0..(rate_hz * seconds) as u64 {
            let time_s = i as f64 / rate_hz;
            if past.is_due(time_s) {
                past.push_sample(time_s, &format!("{{\"number\":{i}}}"));
            }
        }
        past
    }

    #[test]
    fn keeps_ten_samples_a_second_of_the_last_ten_minutes() {
        let past = filled(100.0, 700.0);
        let (first_s, last_s) = (past.samples[0].0, past.samples[past.samples.len() - 1].0);
        assert!(
            last_s >= 699.8 && first_s >= last_s - KEPT_S && first_s < last_s - KEPT_S + 1.0,
            "{first_s} to {last_s}"
        );
        assert!((5400..=MOST_SAMPLES).contains(&past.samples.len()), "{}", past.samples.len());
        // A slower board loses no samples.
        assert_eq!(filled(4.0, 100.0).samples.len(), 400);
    }

    #[test]
    fn bounds_bytes_and_events() {
        let mut past = History::default();
        for i in 0..200 {
            past.push_sample(f64::from(i), &"x".repeat(1 << 18));
        }
        assert!(past.sample_bytes <= MOST_BYTES && past.samples.len() == 64);
        for i in 0..1500 {
            past.push_event(&EventRecord { time_s: f64::from(i), event: Event::Tared });
        }
        assert_eq!((past.events.len(), past.events[0].contains("500")), (MOST_EVENTS, true));
    }

    #[test]
    fn is_one_record_of_json() {
        let mut past = filled(10.0, 0.5);
        past.push_event(&EventRecord { time_s: 1.0, event: Event::Mark { text: "a \"nut\"".to_owned() } });
        let record: serde_json::Value = serde_json::from_str(&past.to_json()).unwrap();
        assert_eq!(record["samples"].as_array().unwrap().len(), 5);
        assert_eq!(record["events"][0]["text"], "a \"nut\"");
        assert_eq!(History::default().to_json(), "{\"samples\":[],\"events\":[]}");
    }
}

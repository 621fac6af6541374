//! Sinks of sessions beside browsers.

use crate::client::{follow, get, next, post};
use crate::routes::served_with;
use palpate_live::server::LiveError;
use palpate_live::sink::{Batch, OpenSink, Sink};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

struct Nowhere;

impl Sink for Nowhere {
    fn batch(&mut self, _: &Arc<Batch>) {}
}

#[test]
fn a_session_goes_on_where_a_sink_of_the_next_one_cannot_be_opened() {
    let opened = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&opened);
    let once: OpenSink = Box::new(move |_, _, _| match counted.fetch_add(1, Ordering::Relaxed) {
        0 => Ok(Box::new(Nowhere)),
        _ => Err(std::io::Error::other("there is one only")),
    });
    let (live, server) = served_with(None, vec![once]);
    let mut socket = follow(&server, "", None).unwrap();
    live.begin_simulated().unwrap();
    assert!(matches!(live.begin_simulated(), Err(LiveError::Thread(_))));
    let (status, answer) = post(&server, "/api/source", r#"{"url":"simulated"}"#);
    assert_eq!(status, 500, "{answer}");
    assert!(answer["error"].as_str().unwrap().contains("there is one only"), "{answer}");
    assert_eq!(opened.load(Ordering::Relaxed), 3);
    // The first one still counts its readings.
    assert_eq!(get(&server, "/api/session").1["source"], "simulated");
    let mut last = -1;
    while last < 100 {
        for sample in next(&mut socket)["samples"].as_array().unwrap() {
            let number = sample["number"].as_i64().unwrap();
            assert!(number > last, "the session began anew");
            last = number;
        }
    }
    live.end();
}

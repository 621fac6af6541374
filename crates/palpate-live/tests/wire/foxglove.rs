//! Foxglove's WebSocket, with a client that acts as the app.

use crate::bench::{Bench, PATIENCE, fitted};
use foxglove::Decode;
use foxglove::messages::SceneUpdate;
use palpate_core::Status;
use palpate_live::session::Output;
use palpate_live::sink::Sink;
use palpate_live::sink::foxglove::{FoxgloveServer, FoxgloveSink};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

const PROTOCOL: &str = "foxglove.sdk.v1";

fn loopback() -> SocketAddr {
    "127.0.0.1:0".parse().unwrap()
}

/// The app: a socket, and the topics by number of subscription.
struct App {
    socket: WebSocket<TcpStream>,
    topics: BTreeMap<u32, Value>,
}

fn connect(address: SocketAddr, protocol: &str) -> Result<WebSocket<TcpStream>, String> {
    let mut request = format!("ws://{address}/").into_client_request().unwrap();
    request.headers_mut().insert("Sec-WebSocket-Protocol", protocol.parse().unwrap());
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    tungstenite::client(request, stream).map(|(socket, _)| socket).map_err(|error| error.to_string())
}

impl App {
    /// Connects, and subscribes to `count` topics as soon as they are announced.
    fn follow(address: SocketAddr, count: usize) -> Self {
        let mut app = Self { socket: connect(address, PROTOCOL).unwrap(), topics: BTreeMap::new() };
        assert_eq!(app.text()["name"], "palpate");
        while app.topics.len() < count {
            let told = app.text();
            if told["op"] != "advertise" {
                continue;
            }
            for topic in told["channels"].as_array().unwrap() {
                app.topics.insert(app.topics.len() as u32 + 1, topic.clone());
            }
        }
        let wanted: Vec<Value> =
            app.topics.iter().map(|(id, topic)| json!({ "id": id, "channelId": topic["id"] })).collect();
        let subscribe = json!({ "op": "subscribe", "subscriptions": wanted });
        app.socket.send(Message::text(subscribe.to_string())).unwrap();
        app
    }

    fn text(&mut self) -> Value {
        loop {
            if let Message::Text(text) = self.socket.read().unwrap() {
                return serde_json::from_str(&text).unwrap();
            }
        }
    }

    /// Topic, time and bytes of the next message of a topic; `None` if no message comes within `time`.
    fn next_within(&mut self, time: Duration) -> Option<(String, u64, Vec<u8>)> {
        self.socket.get_ref().set_read_timeout(Some(time)).unwrap();
        loop {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => {
                    assert_eq!(bytes[0], 1, "a message of data");
                    let subscription = u32::from_le_bytes(bytes[1..5].try_into().unwrap());
                    let topic = self.topics[&subscription]["topic"].as_str().unwrap().to_owned();
                    let at_ns = u64::from_le_bytes(bytes[5..13].try_into().unwrap());
                    return Some((topic, at_ns, bytes[13..].to_vec()));
                }
                Ok(_) => {}
                Err(tungstenite::Error::Io(error)) if is_timeout(&error) => return None,
                Err(error) => panic!("{error}"),
            }
        }
    }

    fn next(&mut self) -> (String, u64, Vec<u8>) {
        self.next_within(PATIENCE).expect("a message")
    }

    /// Waits until messages arrive: the server processes a subscription with a delay.
    fn until_heard(&mut self, bench: &mut Bench<'_>, sink: &mut FoxgloveSink) {
        let start = Instant::now();
        while self.next_within(Duration::from_millis(50)).is_none() {
            assert!(start.elapsed() < PATIENCE, "nothing arrives");
            bench.send(1, sink);
        }
        while self.next_within(Duration::from_millis(300)).is_some() {}
    }

    fn topic(&self, name: &str) -> &Value {
        self.topics.values().find(|topic| topic["topic"] == name).unwrap()
    }
}

fn is_timeout(error: &std::io::Error) -> bool {
    matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut)
}

#[test]
fn topics_have_schemas_that_name_the_channels() {
    let server = FoxgloveServer::start(loopback()).unwrap();
    let (rig, locator) = fitted();
    let bench = Bench::new(&rig, &locator);
    let _sink = server.sink(bench.session.channels(), bench.session.extent()).unwrap();
    let app = App::follow(server.address(), 4);
    for (topic, encoding, name) in [
        ("/reading", "json", "palpate.Reading"),
        ("/estimate", "json", "palpate.Estimate"),
        ("/event", "json", "palpate.Event"),
        ("/contact", "protobuf", "foxglove.SceneUpdate"),
    ] {
        let told = app.topic(topic);
        assert_eq!((&told["encoding"], &told["schemaName"]), (&encoding.into(), &name.into()));
        if encoding == "json" {
            let schema: Value = serde_json::from_str(told["schema"].as_str().unwrap()).unwrap();
            assert_eq!((&schema["title"], &schema["type"]), (&name.into(), &"object".into()));
            if topic == "/reading" {
                let values = &schema["properties"]["values"]["properties"];
                for channel in bench.session.channels() {
                    assert_eq!(values[&channel.name], json!({ "type": "number" }));
                }
            }
        }
    }
}

#[test]
fn the_app_gets_every_reading_estimate_event_and_scene() {
    let server = FoxgloveServer::start(loopback()).unwrap();
    let (rig, locator) = fitted();
    let mut bench = Bench::new(&rig, &locator);
    let mut sink = server.sink(bench.session.channels(), bench.session.extent()).unwrap();
    let mut app = App::follow(server.address(), 4);
    app.until_heard(&mut bench, &mut sink);
    let (mut located, mut untouched, mut told_events) = (0, 0, 0);
    for _ in 0..15 {
        let batches = bench.send(100, &mut sink);
        for output in batches.iter().flat_map(|batch| &batch.outputs) {
            let Output::Sample(sample) = output else { continue };
            let (topic, at_ns, bytes) = next_of_sample(&mut app, &mut told_events);
            let reading: Value = serde_json::from_slice(&bytes).unwrap();
            assert_eq!((topic.as_str(), at_ns), ("/reading", sample.unix_ns));
            assert_eq!(reading["number"], sample.number);
            for (channel, value) in bench.session.channels().iter().zip(&sample.reading) {
                let sent = reading["values"][&channel.name].as_f64().unwrap();
                assert!((sent * channel.unit.factor() - value).abs() <= 1e-15 * value.abs(), "{reading}");
            }
            let (topic, at_ns, bytes) = next_of_sample(&mut app, &mut told_events);
            let estimate: Value = serde_json::from_slice(&bytes).unwrap();
            assert_eq!((topic.as_str(), at_ns), ("/estimate", sample.unix_ns));
            assert_eq!(estimate["status"], sample.estimate.status.name());
            let x_m = sample.estimate.contact.position.x_m;
            assert!((estimate["x_mm"].as_f64().unwrap() - 1e3 * x_m).abs() < 1e-9, "{estimate}");
            let (topic, at_ns, bytes) = next_of_sample(&mut app, &mut told_events);
            assert_eq!((topic.as_str(), at_ns), ("/contact", sample.unix_ns));
            let scene = SceneUpdate::decode(&bytes[..]).unwrap();
            if sample.estimate.status == Status::NoContact {
                assert_eq!((scene.entities.len(), scene.deletions[0].id.as_str()), (1, "contact"));
                untouched += 1;
            } else {
                // The tip of the arrow, which points down, is at the contact.
                let arrow = &scene.entities[1].arrows[0];
                let tail = arrow.pose.as_ref().unwrap().position.as_ref().unwrap();
                assert_eq!((tail.x, tail.y), (x_m, 0.0));
                assert!((tail.z - arrow.shaft_length - arrow.head_length).abs() < 1e-15);
                located += 1;
            }
        }
        let events: usize = batches.iter().map(|batch| batch.events().count()).sum();
        while told_events < events {
            let (topic, _, bytes) = app.next();
            let event: Value = serde_json::from_slice(&bytes).unwrap();
            assert!(topic == "/event" && event["event"].is_string(), "{topic} {event}");
            told_events += 1;
        }
        assert_eq!(told_events, events);
        told_events = 0;
    }
    assert!(located > 300 && untouched > 300, "{located} {untouched}");
}

/// The next message other than an event; events are counted.
fn next_of_sample(app: &mut App, told_events: &mut usize) -> (String, u64, Vec<u8>) {
    loop {
        let next = app.next();
        if next.0 != "/event" {
            return next;
        }
        *told_events += 1;
    }
}

#[test]
fn a_session_that_begins_anew_keeps_the_topics() {
    let server = FoxgloveServer::start(loopback()).unwrap();
    let (rig, locator) = fitted();
    let mut bench = Bench::new(&rig, &locator);
    let mut sink = server.sink(bench.session.channels(), bench.session.extent()).unwrap();
    let mut app = App::follow(server.address(), 4);
    app.until_heard(&mut bench, &mut sink);
    drop(sink);
    let mut bench = Bench::new(&rig, &locator);
    let mut sink = server.sink(bench.session.channels(), bench.session.extent()).unwrap();
    let samples: usize = bench.send(50, &mut sink).iter().map(|batch| batch.samples().count()).sum();
    let readings = (0..samples).filter(|_| {
        loop {
            let (topic, _, _) = app.next();
            if topic == "/reading" {
                break true;
            }
        }
    });
    assert_eq!(readings.count(), samples);
    drop(server);
    // The app is informed of the end: it does not wait for a timeout.
    let start = Instant::now();
    while app.socket.read().is_ok() {}
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
}

#[test]
fn app_that_never_reads_does_not_delay_others() {
    let server = FoxgloveServer::start(loopback()).unwrap();
    let (rig, locator) = fitted();
    let mut bench = Bench::new(&rig, &locator);
    let mut sink = server.sink(bench.session.channels(), bench.session.extent()).unwrap();
    let mut lazy = App::follow(server.address(), 4);
    lazy.until_heard(&mut bench, &mut sink);
    let batches = bench.send(50, &mut sink);
    let worst = (0..20_000)
        .map(|number| {
            let start = Instant::now();
            sink.batch(&batches[number % batches.len()]);
            start.elapsed()
        })
        .max();
    assert!(worst.unwrap() < Duration::from_secs(1), "{worst:?}");
    let mut app = App::follow(server.address(), 4);
    app.until_heard(&mut bench, &mut sink);
}

#[test]
fn unusable_address_is_refused() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let error = FoxgloveServer::start(address).err().unwrap().to_string();
    assert!(error.contains(&address.to_string()) && error.contains("in use"), "{error}");
    let error = FoxgloveServer::start("192.0.2.1:8765".parse().unwrap()).err().unwrap().to_string();
    assert!(error.contains("192.0.2.1:8765"), "{error}");
    let server = FoxgloveServer::start(loopback()).unwrap();
    assert!(connect(server.address(), "graphql-ws").is_err());
    // Messages of a client have no effect.
    let mut app = App { socket: connect(server.address(), PROTOCOL).unwrap(), topics: BTreeMap::new() };
    app.text();
    for text in ["", "{", "[]", r#"{"op":"subscribe"}"#, r#"{"op":"setParameters","parameters":[]}"#] {
        app.socket.send(Message::text(text)).unwrap();
    }
    app.socket.send(Message::binary(vec![1, 0, 0, 0, 0, 7])).unwrap();
    let told = app.text();
    assert_eq!(told["op"], "status", "{told}");
    assert!(
        FoxgloveServer::start("[::1]:0".parse().unwrap()).is_ok_and(|server| server.address().port() > 0)
    );
}

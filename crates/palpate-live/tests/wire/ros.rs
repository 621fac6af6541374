//! ROS 2 through Zenoh: a router and a subscriber over TCP, as for nodes of `rmw_zenoh_cpp`.

use crate::bench::{Bench, PATIENCE, fitted, next_problem};
use palpate_live::sink::Batch;
use palpate_live::sink::ros::{RosMessage, RosSink, RosUrl, TOPICS, Topic, messages};
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Config, Session, Wait};

fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// A Zenoh session that finds others by these settings alone; tried until the port is free.
fn zenoh(mode: &str, settings: &str, port: u16) -> Session {
    let start = Instant::now();
    loop {
        let mut config = Config::default();
        config.insert_json5("mode", &format!("\"{mode}\"")).unwrap();
        config.insert_json5("scouting/multicast/enabled", "false").unwrap();
        config.insert_json5(settings, &format!("[\"tcp/127.0.0.1:{port}\"]")).unwrap();
        match zenoh::open(config).wait() {
            Ok(session) => return session,
            Err(error) => assert!(start.elapsed() < PATIENCE, "{error}"),
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A client of the router, with the messages and the tokens that it receives.
struct Subscriber {
    _session: Session,
    messages: Receiver<Sample>,
    tokens: Receiver<Sample>,
}

impl Subscriber {
    fn connect(port: u16, data: &str, tokens: &str) -> Self {
        let session = zenoh("client", "connect/endpoints", port);
        let (to, messages) = sync_channel(1 << 16);
        let subscriber = session.declare_subscriber(data).callback(move |sample| {
            let _ = to.send(sample);
        });
        subscriber.background().wait().unwrap();
        let (to, told) = sync_channel(64);
        let subscriber = session.liveliness().declare_subscriber(tokens).history(true);
        let subscriber = subscriber.callback(move |sample| {
            let _ = to.send(sample);
        });
        subscriber.background().wait().unwrap();
        Self { _session: session, messages, tokens: told }
    }

    fn next(&self) -> Sample {
        self.messages.recv_timeout(PATIENCE).unwrap()
    }

    /// The next tokens that appear or disappear.
    fn next_tokens(&self, count: usize, kind: SampleKind) -> Vec<String> {
        let mut tokens: Vec<String> = (0..count)
            .map(|_| {
                let token = self.tokens.recv_timeout(PATIENCE).unwrap();
                assert_eq!(token.kind(), kind, "{}", token.key_expr());
                token.key_expr().to_string()
            })
            .collect();
        tokens.sort();
        tokens
    }
}

/// Number, time and publisher of an attachment.
fn attachment(sample: &Sample) -> (i64, i64, [u8; 16]) {
    let bytes = sample.attachment().unwrap().to_bytes();
    assert_eq!((bytes.len(), bytes[16]), (33, 16));
    let number = |range: std::ops::Range<usize>| i64::from_le_bytes(bytes[range].try_into().unwrap());
    (number(0..8), number(8..16), bytes[17..].try_into().unwrap())
}

/// Messages of batches from [`messages`]; `rosbags` reads their bytes in another test.
fn expected(batches: &[Arc<Batch>], url: &RosUrl, bench: &Bench<'_>) -> Vec<RosMessage> {
    let outputs = batches.iter().flat_map(|batch| &batch.outputs);
    let (channels, extent) = (bench.session.channels(), bench.session.extent());
    outputs.flat_map(|output| messages(output, &url.frame, channels, extent)).collect()
}

/// Waits until messages arrive: a publisher detects a new subscriber with a delay.
fn until_heard(bench: &mut Bench<'_>, sink: &mut RosSink, subscriber: &Subscriber) {
    let start = Instant::now();
    while subscriber.messages.try_recv().is_err() {
        assert!(start.elapsed() < PATIENCE, "nothing arrives");
        bench.send(10, sink);
    }
    std::thread::sleep(Duration::from_millis(500));
    while subscriber.messages.try_recv().is_ok() {}
}

#[test]
fn nodes_get_every_message_and_a_router_that_begins_anew_is_found_again() {
    let port = free_port();
    let url: RosUrl = format!("tcp/127.0.0.1:{port}?domain=5&name=bench/left&frame=top").parse().unwrap();
    let (rig, locator) = fitted();
    let mut bench = Bench::new(&rig, &locator);
    let (reports, told) = sync_channel(64);
    let mut sink = RosSink::new(&url, bench.session.channels(), bench.session.extent(), reports).unwrap();

    // Without a router all messages are lost, and this is reported once.
    let text = next_problem(&told);
    assert!(text.contains(&format!("tcp/127.0.0.1:{port} cannot be reached")), "{text}");
    let early: usize = bench.send(50, &mut sink).iter().map(|batch| batch.outputs.len()).sum();
    let router = zenoh("router", "listen/endpoints", port);
    let text = next_problem(&told);
    assert!(text.contains("is there again"), "{text}");
    assert_eq!(sink.lost(), early as u64);

    let subscriber = Subscriber::connect(port, "5/bench/left/**", "@ros2_lv/5/**");
    let tokens = subscriber.next_tokens(1 + TOPICS.len(), SampleKind::Put);
    assert!(tokens[0].ends_with("0/0/NN/%/%bench/left"), "{tokens:?}");
    for topic in TOPICS {
        let end = format!(
            "{}_/{}/::,10:,:,:,,",
            topic.message_type().rsplit('/').next().unwrap(),
            topic.type_hash()
        );
        let place = format!("/MP/%/%bench/left/%bench%left%{}/", topic.name());
        assert!(tokens.iter().any(|token| token.contains(&place) && token.ends_with(&end)), "{tokens:?}");
    }

    until_heard(&mut bench, &mut sink, &subscriber);
    let batches = bench.send(1500, &mut sink);
    let expected = expected(&batches, &url, &bench);
    let count = |topic| expected.iter().filter(|message| message.topic == topic).count();
    assert!(TOPICS.into_iter().all(|topic| count(topic) > 0) && count(Topic::Estimate) > 1000);
    let mut numbers = [0; TOPICS.len()];
    let mut publishers = Vec::new();
    for message in &expected {
        let sample = subscriber.next();
        let key = format!("5/bench/left/{}/", message.topic.name());
        assert!(sample.key_expr().as_str().starts_with(&key), "{} {key}", sample.key_expr());
        assert!(sample.key_expr().as_str().ends_with(message.topic.type_hash()));
        assert_eq!(sample.payload().to_bytes(), &message.cdr[..], "{message:?}");
        let (number, unix_ns, publisher) = attachment(&sample);
        assert_eq!(unix_ns as u64, message.unix_ns);
        let last = std::mem::replace(&mut numbers[message.topic as usize], number);
        assert!(last == 0 || number == last + 1, "{last} {number}");
        if !publishers.contains(&publisher) {
            publishers.push(publisher);
        }
    }
    assert_eq!((publishers.len(), sink.lost()), (TOPICS.len(), early as u64));

    // The router ends, and another begins at its address.
    drop(subscriber);
    router.close().wait().unwrap();
    let text = next_problem(&told);
    assert!(text.contains("cannot be reached; it is tried again"), "{text}");
    let away: usize = bench.send(200, &mut sink).iter().map(|batch| batch.outputs.len()).sum();
    let _router = zenoh("router", "listen/endpoints", port);
    let text = next_problem(&told);
    assert!(text.contains("is there again"), "{text}");
    assert_eq!(sink.lost(), (early + away) as u64);
    let subscriber = Subscriber::connect(port, "5/bench/left/**", "@ros2_lv/5/**");
    assert_eq!(subscriber.next_tokens(1 + TOPICS.len(), SampleKind::Put), tokens);
    until_heard(&mut bench, &mut sink, &subscriber);

    // Nodes are informed of the end at once.
    let start = Instant::now();
    drop(sink);
    let took = start.elapsed();
    assert_eq!(subscriber.next_tokens(1 + TOPICS.len(), SampleKind::Delete), tokens);
    println!("the sink ended in {took:?}");
}

#[test]
fn a_peer_without_a_router_will_do() {
    let port = free_port();
    let peer = zenoh("peer", "listen/endpoints", port);
    let subscriber = peer.declare_subscriber("0/palpate/wrench/**").wait().unwrap();
    let (rig, locator) = fitted();
    let mut bench = Bench::new(&rig, &locator);
    let (reports, _told) = sync_channel(64);
    let url = format!("tcp/127.0.0.1:{port}").parse().unwrap();
    let mut sink = RosSink::new(&url, bench.session.channels(), bench.session.extent(), reports).unwrap();
    let start = Instant::now();
    let sample = loop {
        bench.send(10, &mut sink);
        if let Ok(Some(sample)) = subscriber.try_recv() {
            break sample;
        }
        assert!(start.elapsed() < PATIENCE, "nothing arrives");
    };
    assert!(sample.key_expr().as_str().contains("WrenchStamped_"), "{}", sample.key_expr());
}

#[test]
fn sink_ends_soon_without_answers() {
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let (rig, locator) = fitted();
    let mut bench = Bench::new(&rig, &locator);
    for router in [
        // No host answers at an address for documentation (RFC 5737); the listener never reads.
        "tcp/192.0.2.1".to_owned(),
        format!("tcp/{}", silent.local_addr().unwrap()),
        "tcp/no-such-host.invalid".to_owned(),
    ] {
        let (reports, _told) = sync_channel(64);
        let url = router.parse().unwrap();
        let mut sink = RosSink::new(&url, bench.session.channels(), bench.session.extent(), reports).unwrap();
        let start = Instant::now();
        bench.send(100, &mut sink);
        drop(sink);
        assert!(start.elapsed() < Duration::from_secs(3), "{router}: {:?}", start.elapsed());
    }
}

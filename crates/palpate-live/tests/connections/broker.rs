//! A broker between board, session and machine: mosquitto, started and ended by the tests.

use crate::bench::{Bench, PATIENCE, lines};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_live::input::{Arrival, Command as SessionCommand, Input, TimedArrival};
use palpate_live::rules::Rules;
use palpate_live::session::{Session, SessionConfig};
use palpate_live::simulated_board::{BoardConfig, Finger, SimulatedBoard};
use palpate_live::sink::{Batch, MqttSink, Sink};
use palpate_live::stamp::HostClock;
use palpate_rig::Rig;
use palpate_testing::skip::skip;
use rumqttc::{Client, Event, MqttOptions, Packet, QoS};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

const RIG: &str = include_str!("../../../../examples/noisy-beam.toml");

/// A broker for one test.
struct Broker(Child);

impl Drop for Broker {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Broker {
    fn start(folder: &Path, port: u16) -> Self {
        let config = folder.join("mosquitto.conf");
        let text = format!("listener {port} 127.0.0.1\nallow_anonymous true\npersistence false\n");
        std::fs::write(&config, text).unwrap();
        let mut command = Command::new(mosquitto().unwrap());
        command.arg("-c").arg(config).stdout(Stdio::null()).stderr(Stdio::null());
        let broker = Self(command.spawn().unwrap());
        let start = Instant::now();
        while TcpStream::connect(("127.0.0.1", port)).is_err() {
            assert!(start.elapsed() < PATIENCE, "mosquitto does not listen");
            std::thread::sleep(Duration::from_millis(20));
        }
        broker
    }
}

/// Path of the broker's program; `None` if it is not installed.
fn mosquitto() -> Option<std::path::PathBuf> {
    let named = std::env::var_os("PALPATE_MOSQUITTO").map(Into::into);
    Some(named.unwrap_or_else(|| "/usr/sbin/mosquitto".into()))
        .filter(|path: &std::path::PathBuf| path.is_file())
}

/// True without an installed broker; the test is then skipped.
fn is_missing() -> bool {
    let missing = mosquitto().is_none();
    if missing {
        skip("mosquitto", "install Debian's mosquitto, or name the program in PALPATE_MOSQUITTO");
    }
    missing
}

fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// Forwards data from one port to another and back, as long as the test runs.
fn forward(from: u16, to: u16) {
    let listener = TcpListener::bind(("127.0.0.1", from)).unwrap();
    std::thread::spawn(move || {
        for near in listener.incoming().map_while(Result::ok) {
            let far = TcpStream::connect(("127.0.0.1", to)).unwrap();
            for (mut here, mut there) in [(near.try_clone().unwrap(), far.try_clone().unwrap()), (far, near)]
            {
                std::thread::spawn(move || {
                    let _ = std::io::copy(&mut here, &mut there);
                    let _ = there.shutdown(Shutdown::Write);
                });
            }
        }
    });
}

/// Another client of the broker, and its received messages.
struct Subscriber {
    client: Client,
    messages: Receiver<(String, Vec<u8>)>,
}

impl Subscriber {
    fn connect(port: u16, filter: &str) -> Self {
        let options = MqttOptions::new(format!("subscriber to {filter}"), "127.0.0.1", port);
        let (client, mut connection) = Client::new(options, 1024);
        client.subscribe(filter, QoS::AtLeastOnce).unwrap();
        let (to, messages) = sync_channel(1 << 16);
        let (ready, is_ready) = sync_channel(1);
        std::thread::spawn(move || {
            for event in connection.iter() {
                match event {
                    Ok(Event::Incoming(Packet::SubAck(_))) => ready.send(()).unwrap(),
                    Ok(Event::Incoming(Packet::Publish(message))) => {
                        let _ = to.send((message.topic, message.payload.to_vec()));
                    }
                    Ok(_) => {}
                    Err(_) => return,
                }
            }
        });
        is_ready.recv_timeout(PATIENCE).unwrap();
        Self { client, messages }
    }

    fn next(&self) -> (String, Vec<u8>) {
        self.messages.recv_timeout(PATIENCE).unwrap()
    }

    /// Messages before the first one of a topic with this text.
    fn until(&self, topic: &str, text: &str) -> Vec<(String, Vec<u8>)> {
        let end = (topic.to_owned(), text.as_bytes().to_vec());
        std::iter::from_fn(|| Some(self.next()).filter(|message| *message != end)).collect()
    }
}

#[test]
fn a_broker_that_begins_anew_is_subscribed_to_again() {
    if is_missing() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let port = free_port();
    let bench = Bench::open(&format!("mqtt://127.0.0.1:{port}/bench/values"));
    let why = bench.lost();
    assert!(why.contains("the broker 127.0.0.1") && why.contains("cannot be reached"), "{why}");
    for _ in 0..2 {
        let broker = Broker::start(folder.path(), port);
        bench.opened();
        let board = Subscriber::connect(port, "bench/values/command");
        for n in 0..500 {
            board.client.publish("bench/values", QoS::AtMostOnce, false, lines(n..n + 1)).unwrap();
        }
        for n in 0..500 {
            assert_eq!(bench.next(), Arrival::Message(lines(n..n + 1)));
        }
        bench.source.send(b"zero").unwrap();
        assert_eq!(board.next(), ("bench/values/command".to_owned(), b"zero".to_vec()));
        // A message is a line, and needs no line end.
        bench.source.commander().unwrap().send_line("brake on").unwrap();
        assert_eq!(board.next(), ("bench/values/command".to_owned(), b"brake on".to_vec()));
        drop(broker);
        bench.lost();
    }
}

/// A session of a simulated board that sends its outputs to a sink.
struct Bridge<'a> {
    board: SimulatedBoard<'a>,
    session: Session<'a>,
    clock: HostClock,
    sink: MqttSink,
}

impl Bridge<'_> {
    /// Sends frames of the board through the session. Returns the number of samples.
    fn send(&mut self, frames: usize) -> usize {
        let mut samples = 0;
        for _ in 0..frames {
            let arrival = Arrival::Bytes(self.board.send_until(self.board.next_at()));
            let mut outputs = Vec::new();
            self.session.receive(&TimedArrival { at: self.clock.now(), arrival }, &mut outputs);
            let batch = Arc::new(Batch { outputs });
            samples += batch.samples().count();
            self.sink.batch(&batch);
            std::thread::sleep(Duration::from_micros(200));
        }
        samples
    }
}

#[test]
fn estimates_events_status_and_rules_reach_a_broker_that_begins_anew() {
    if is_missing() {
        return;
    }
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let broker = Broker::start(folder.path(), port);
    let listener = Subscriber::connect(port, "bench/#");
    let rig = Rig::from_toml(RIG).unwrap();
    let presses = rig.simulate(0).unwrap();
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &presses)).unwrap();
    let session = Session::new(&locator, &SessionConfig::default()).unwrap();
    let rules =
        "[[rule]]\nname = \"far\"\nx = [\"0 mm\", \"400 mm\"]\ntopic = \"bench/stop\"\nmessage = \"1\"\n";
    let (reports, told) = sync_channel(64);
    let url = format!("mqtt://127.0.0.1:{port}/bench/left").parse().unwrap();
    let rules = Rules::from_toml(rules, session.extent()).unwrap();
    let sink = MqttSink::new(&url, session.channels(), session.extent(), rules, reports).unwrap();
    let config = BoardConfig { rate_hz: 200.0, seed: 3, ..BoardConfig::default() };
    let board = SimulatedBoard::new(&rig.setup, &config, Finger::random(&rig, 3)).unwrap();
    let mut bridge = Bridge { board, session, clock: HostClock::new(), sink };

    assert!(listener.until("bench/left/status", "online").is_empty());
    let samples = bridge.send(1500);
    // The message is retained: later subscribers receive it, too.
    let later = Subscriber::connect(port, "bench/left/status");
    assert_eq!(later.next(), ("bench/left/status".to_owned(), b"online".to_vec()));

    drop(broker);
    let Input::Command(SessionCommand::Trouble(text)) = told.recv_timeout(PATIENCE).unwrap() else {
        panic!()
    };
    assert!(text.contains("the broker mqtt://") && text.contains("it is tried again"), "{text}");
    let all: Vec<_> = listener.messages.try_iter().collect();
    let count = |topic: &str| all.iter().filter(|(of, _)| of == topic).count();
    assert_eq!(count("bench/left/estimate"), samples);
    assert_eq!(bridge.sink.lost().load(Ordering::Relaxed), 0);
    assert!(count("bench/stop") >= 1 && count("bench/left/event") >= 2, "{}", count("bench/left/event"));
    let first = all.iter().find(|(topic, _)| topic == "bench/left/estimate").unwrap();
    let estimate: Value = serde_json::from_slice(&first.1).unwrap();
    assert_eq!((&estimate["number"], &estimate["status"]), (&0.into(), &"no_contact".into()));

    // While the broker is away, estimates are counted as lost, and the message of a rule waits.
    let away = bridge.send(3000);
    let lost = bridge.sink.lost().load(Ordering::Relaxed);
    assert!(lost as usize >= away, "{lost} of {away}");
    // The subscriber connects before the sink finds the broker, because a broker does not keep messages for later subscribers.
    let again = free_port();
    let _broker = Broker::start(folder.path(), again);
    let listener = Subscriber::connect(again, "bench/#");
    forward(port, again);
    let before = listener.until("bench/left/status", "online");
    let stop = ("bench/stop".to_owned(), b"1".to_vec());
    let waited = before.contains(&stop) || (0..100).any(|_| listener.next() == stop);
    assert!(waited, "{before:?}");
    drop(bridge.sink);
    listener.until("bench/left/status", "offline");
}

/// A minimal broker: it answers one client, then calls `after` with the connection.
fn fake_broker(code: u8, after: impl FnOnce(&mut TcpStream) + Send + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        // A packet consists of its kind, its length (below 128 here), and its content.
        let packet = |stream: &mut TcpStream| {
            let mut head = [0; 2];
            stream.read_exact(&mut head).unwrap();
            let mut content = vec![0; usize::from(head[1])];
            stream.read_exact(&mut content).unwrap();
            content
        };
        packet(&mut stream);
        stream.write_all(&[0x20, 2, 0, code]).unwrap();
        if code == 0 {
            let content = packet(&mut stream);
            stream.write_all(&[0x90, 3, content[0], content[1], 0]).unwrap();
            after(&mut stream);
        }
    });
    port
}

/// A message of QoS 0 as a packet.
fn publish(topic: &str, payload: &[u8]) -> Vec<u8> {
    let mut length = 2 + topic.len() + payload.len();
    let mut packet = vec![0x30];
    loop {
        let more = if length >= 128 { 0x80 } else { 0 };
        packet.push((length % 128) as u8 | more);
        length /= 128;
        if length == 0 {
            break;
        }
    }
    packet.extend((topic.len() as u16).to_be_bytes());
    packet.extend(topic.bytes());
    packet.extend(payload);
    packet
}

#[test]
fn a_broker_that_refuses_is_quoted_with_the_remedy() {
    let port = fake_broker(5, |_| {});
    let why = Bench::open(&format!("mqtt://127.0.0.1:{port}/a")).lost();
    assert!(why.contains("refuses: NotAuthorized") && why.contains("PALPATE_MQTT_PASSWORD"), "{why}");
}

#[test]
fn a_message_of_3_mb_does_not_end_the_source() {
    let port = fake_broker(0, |stream| {
        stream.write_all(&publish("a", &vec![b'7'; 3_000_000])).unwrap();
        stream.write_all(&publish("a", b"1,2")).unwrap();
        std::thread::sleep(PATIENCE);
    });
    let bench = Bench::open(&format!("mqtt://127.0.0.1:{port}/a"));
    bench.opened();
    let Arrival::Message(start) = bench.next() else { panic!("no message") };
    assert_eq!(start.len(), palpate_live::frame::LONGEST_MESSAGE + 1);
    assert_eq!(bench.next(), Arrival::Message(b"1,2".to_vec()));
}

//! Sources over real parts: a pseudo-terminal, sockets and a broker; devices that go away and come back.

use palpate_live::input::{Arrival, Input};
use palpate_live::source::{SendError, Source};
use palpate_live::stamp::HostClock;
use palpate_testing::skip::skip;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

/// Longest time that anything may take on a machine that has other things to do.
const PATIENCE: Duration = Duration::from_secs(30);

struct Bench {
    source: Source,
    arrivals: Receiver<Input>,
}

impl Bench {
    fn open(url: &str) -> Self {
        let (to, arrivals) = sync_channel(1024);
        let source = Source::open(&url.parse().unwrap(), Path::new("."), HostClock::new(), to).unwrap();
        Self { source, arrivals }
    }

    fn next(&self) -> Arrival {
        match self.arrivals.recv_timeout(PATIENCE) {
            Ok(Input::Arrived(arrived)) => arrived.arrival,
            other => panic!("{other:?}"),
        }
    }

    fn opened(&self) {
        loop {
            match self.next() {
                Arrival::Opened(_) | Arrival::Joined(_) => return,
                Arrival::Lost(_) => {}
                other => panic!("{other:?}"),
            }
        }
    }

    /// The reason why the device went away, once it has.
    fn lost(&self) -> String {
        match self.next() {
            Arrival::Lost(why) => why,
            other => panic!("{other:?}"),
        }
    }

    /// Bytes up to so many.
    fn bytes(&self, count: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        while bytes.len() < count {
            match self.next() {
                Arrival::Bytes(more) | Arrival::Message(more) => bytes.extend(more),
                other => panic!("{other:?} after {} bytes", bytes.len()),
            }
        }
        bytes
    }

    /// Time from the source's end to that of its thread.
    fn end(self) -> Duration {
        let start = Instant::now();
        drop(self.source);
        loop {
            match self.arrivals.recv_timeout(PATIENCE) {
                Ok(_) => {}
                Err(RecvTimeoutError::Disconnected) => return start.elapsed(),
                Err(RecvTimeoutError::Timeout) => panic!("the source's thread goes on"),
            }
        }
    }
}

/// Lines of numbered frames.
fn lines(numbers: std::ops::Range<u32>) -> Vec<u8> {
    numbers.flat_map(|n| format!("n:{n},a:1.25,b:-3\n").into_bytes()).collect()
}

/// The least of several, which other work on the machine has delayed least.
fn least(times: usize, measure: impl Fn() -> Duration) -> Duration {
    (0..times).map(|_| measure()).min().unwrap()
}

#[cfg(unix)]
#[test]
fn a_serial_port_is_read_unplugged_and_read_again() {
    use serialport::{SerialPort, TTYPort};
    let folder = tempfile::tempdir().unwrap();
    let device = folder.path().join("board");
    let plug = || {
        let (board, host) = TTYPort::pair().unwrap();
        let _ = std::fs::remove_file(&device);
        std::os::unix::fs::symlink(host.name().unwrap(), &device).unwrap();
        board
    };
    let bench = Bench::open(&format!("serial://{}?baud=115200", device.display()));
    let why = bench.lost();
    assert!(why.contains("board") && why.contains("as soon as it is plugged in"), "{why}");
    assert_eq!(bench.source.send(b"x"), Err(SendError::Away));
    for _ in 0..2 {
        let mut board = plug();
        board.set_timeout(PATIENCE).unwrap();
        bench.opened();
        let sent = lines(0..2000);
        let mut taken = Vec::new();
        for part in sent.chunks(1000) {
            board.write_all(part).unwrap();
            taken.extend(bench.bytes(part.len()));
        }
        assert_eq!(taken, sent);
        bench.source.send(b"zero\n").unwrap();
        let mut command = [0; 5];
        board.read_exact(&mut command).unwrap();
        assert_eq!(&command, b"zero\n");
        drop(board);
        bench.lost();
    }
}

#[test]
fn a_server_that_goes_away_is_connected_to_again() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = server.local_addr().unwrap();
    let bench = Bench::open(&format!("tcp://{at}"));
    let serve = |server: &TcpListener| -> TcpStream {
        let (mut board, _) = server.accept().unwrap();
        bench.opened();
        let sent = lines(0..20_000);
        std::thread::scope(|scope| {
            scope.spawn(|| board.write_all(&sent).unwrap());
            assert_eq!(bench.bytes(sent.len()), sent);
        });
        bench.source.send(b"zero\n").unwrap();
        let mut command = [0; 5];
        board.read_exact(&mut command).unwrap();
        assert_eq!(&command, b"zero\n");
        board
    };
    drop(serve(&server));
    let why = bench.lost();
    assert!(why.contains("closed the connection"), "{why}");
    drop(serve(&server));
    // Now nobody listens for a while.
    drop(server);
    bench.lost();
    let why = bench.lost();
    assert!(why.contains("cannot connect to 127.0.0.1"), "{why}");
    let server = loop {
        if let Ok(server) = TcpListener::bind(at) {
            break server;
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    serve(&server);
}

#[test]
fn datagrams_are_messages() {
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let bench = Bench::open(&format!("udp://127.0.0.1:{port}"));
    bench.opened();
    assert_eq!(bench.source.send(b"x"), Err(SendError::OneWay));
    let board = UdpSocket::bind("127.0.0.1:0").unwrap();
    for n in 0..1000 {
        let message = lines(n..n + 1);
        board.send_to(&message, ("127.0.0.1", port)).unwrap();
        assert_eq!(bench.next(), Arrival::Message(message));
    }
}

/// A broker of its own.
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

/// The program of the broker, where there is one.
fn mosquitto() -> Option<std::path::PathBuf> {
    let named = std::env::var_os("PALPATE_MOSQUITTO").map(Into::into);
    Some(named.unwrap_or_else(|| "/usr/sbin/mosquitto".into()))
        .filter(|path: &std::path::PathBuf| path.is_file())
}

#[test]
fn a_broker_that_begins_anew_is_subscribed_to_again() {
    if mosquitto().is_none() {
        return skip("mosquitto", "install Debian's mosquitto, or name the program in PALPATE_MOSQUITTO");
    }
    let folder = tempfile::tempdir().unwrap();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let bench = Bench::open(&format!("mqtt://127.0.0.1:{port}/bench/values"));
    let why = bench.lost();
    assert!(why.contains("the broker 127.0.0.1") && why.contains("is not there"), "{why}");
    for _ in 0..2 {
        let broker = Broker::start(folder.path(), port);
        bench.opened();
        let board = Board::connect(port);
        for n in 0..500 {
            board.publish(&lines(n..n + 1));
        }
        for n in 0..500 {
            assert_eq!(bench.next(), Arrival::Message(lines(n..n + 1)));
        }
        bench.source.send(b"zero").unwrap();
        assert_eq!(board.command(), b"zero");
        drop(broker);
        bench.lost();
    }
}

/// A board that speaks MQTT.
struct Board {
    client: rumqttc::Client,
    commands: Receiver<Vec<u8>>,
}

impl Board {
    fn connect(port: u16) -> Self {
        use rumqttc::{Client, Event, MqttOptions, Packet, QoS};
        let (client, mut connection) = Client::new(MqttOptions::new("board", "127.0.0.1", port), 1024);
        client.subscribe("bench/values/command", QoS::AtMostOnce).unwrap();
        let (to, commands) = sync_channel(16);
        let (ready, is_ready) = sync_channel(1);
        std::thread::spawn(move || {
            for event in connection.iter() {
                match event {
                    Ok(Event::Incoming(Packet::SubAck(_))) => ready.send(()).unwrap(),
                    Ok(Event::Incoming(Packet::Publish(message))) => {
                        to.send(message.payload.to_vec()).unwrap();
                    }
                    Ok(_) => {}
                    Err(_) => return,
                }
            }
        });
        is_ready.recv_timeout(PATIENCE).unwrap();
        Self { client, commands }
    }

    fn publish(&self, message: &[u8]) {
        self.client.publish("bench/values", rumqttc::QoS::AtMostOnce, false, message).unwrap();
    }

    fn command(&self) -> Vec<u8> {
        self.commands.recv_timeout(PATIENCE).unwrap()
    }
}

#[test]
fn every_source_ends_within_100_ms() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = server.local_addr().unwrap();
    let udp = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let urls = [
        format!("tcp://{at}"),
        // Nobody answers at an address for documentation (RFC 5737).
        "tcp://192.0.2.1:5000".to_owned(),
        "mqtt://192.0.2.1/values".to_owned(),
        format!("udp://127.0.0.1:{udp}"),
        "serial:///dev/no-such-port".to_owned(),
    ];
    for url in urls {
        let took = least(5, || {
            let bench = Bench::open(&url);
            std::thread::sleep(Duration::from_millis(150));
            bench.end()
        });
        assert!(took < Duration::from_millis(100), "{url}: {took:?}");
    }
}

#[test]
fn a_source_ends_while_the_session_is_behind() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let (to, _arrivals) = sync_channel(1);
    let url = format!("tcp://{}", server.local_addr().unwrap()).parse().unwrap();
    let source = Source::open(&url, Path::new("."), HostClock::new(), to).unwrap();
    let (mut board, _) = server.accept().unwrap();
    board.set_write_timeout(Some(Duration::from_millis(300))).unwrap();
    // Nobody takes arrivals, so that at some time the board cannot send any more: nothing grows without bound.
    let mut sent = 0;
    while board.write_all(&[b'1'; 1 << 16]).is_ok() {
        sent += 1 << 16;
        assert!(sent < 1 << 30, "{sent} bytes went somewhere");
    }
    drop(source);
    let start = Instant::now();
    board.set_write_timeout(Some(PATIENCE)).unwrap();
    // The source closes the connection as it ends.
    while board.write_all(&[b'1'; 1 << 16]).is_ok() {
        assert!(start.elapsed() < PATIENCE);
    }
}

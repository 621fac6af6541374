//! Sources over real parts: a pseudo-terminal and sockets; devices that go away and come back.

use crate::bench::{Bench, PATIENCE, lines};
use palpate_live::event::{Event, EventRecord};
use palpate_live::input::{Arrival, Command, Input};
use palpate_live::rules::Rules;
use palpate_live::session::Output;
use palpate_live::sink::{Batch, CommandSink, Sink};
use palpate_live::source::{SendError, Source};
use palpate_live::stamp::HostClock;
use palpate_mechanics::surface::Extent;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

/// The least of several measurements, which other work on the machine has delayed least.
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

#[cfg(unix)]
#[test]
fn a_serial_port_that_is_held_is_named_and_bytes_that_waited_are_a_backlog() {
    use serialport::{SerialPort, TTYPort};
    let (_board, host) = TTYPort::pair().unwrap();
    let device = host.name().unwrap();
    drop(host);
    let held = serialport::new(&device, 115_200).open().unwrap();
    let bench = Bench::open(&format!("serial://{device}"));
    let why = bench.lost();
    assert!(why.contains("another program has it open"), "{why}");
    drop(held);
    bench.end();
    let (mut board, host) = TTYPort::pair().unwrap();
    let device = host.name().unwrap();
    // The port stays open, as with a connected board, but no program has locked it.
    let _open = std::fs::File::open(&device).unwrap();
    drop(host);
    board.write_all(b"1,2\n3,").unwrap();
    // The kernel transfers bytes from one end to the other in the background.
    std::thread::sleep(Duration::from_millis(100));
    let bench = Bench::open(&format!("serial://{device}"));
    bench.opened();
    assert_eq!(bench.next(), Arrival::Backlog(b"1,2\n3,".to_vec()));
    board.write_all(b"4\n").unwrap();
    assert_eq!(bench.bytes(2), b"4\n");
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
    // For a while the server does not listen.
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

/// Rules that act too often: the number of commands is bounded, and unsent ones are reported once per cause.
#[test]
fn commands_of_rules_are_bounded_and_unsent_ones_reported() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let bench = Bench::open(&format!("tcp://{}", server.local_addr().unwrap()));
    let (board, _) = server.accept().unwrap();
    bench.opened();
    let on_marks = |command: &str| {
        let text = format!("[[rule]]\nevent = \"mark\"\ncommand = \"{command}\"\n");
        Rules::from_toml(&text, Extent::line(1.0).unwrap()).unwrap()
    };
    let (reports, told) = sync_channel(64);
    let mut sink = CommandSink::new(on_marks("brake on"), bench.source.commander().unwrap(), reports);
    let event = Event::Mark { text: String::new() };
    let mark = Arc::new(Batch { outputs: vec![Output::Event(EventRecord { time_s: 0.0, event })] });
    for _ in 0..2000 {
        sink.batch(&mark);
    }
    board.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
    let lines: Vec<String> = BufReader::new(&board).lines().map_while(Result::ok).collect();
    assert!((16..=50).contains(&lines.len()), "{} lines", lines.len());
    assert!(lines.iter().all(|line| line == "brake on"), "{lines:?}");
    let told: Vec<Input> = told.try_iter().collect();
    assert!((1..=50).contains(&told.len()), "{told:?}");
    let Some(Input::Command(Command::Trouble(last))) = told.last() else { panic!("{told:?}") };
    assert!(last.contains("`brake on`") && last.contains("50 commands within 1 s"), "{last}");
    // The lost board is reported once.
    drop(board);
    drop(server);
    bench.lost();
    let (reports, told) = sync_channel(64);
    let mut sink = CommandSink::new(on_marks("off"), bench.source.commander().unwrap(), reports);
    (0..10).for_each(|_| sink.batch(&mark));
    let told: Vec<Input> = told.try_iter().collect();
    let [Input::Command(Command::Trouble(text))] = told.as_slice() else { panic!("{told:?}") };
    assert!(text.contains("the device is not there"), "{text}");
}

#[test]
fn datagrams_are_messages() {
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let bench = Bench::open(&format!("udp://127.0.0.1:{port}"));
    bench.opened();
    assert_eq!(bench.source.send(b"x"), Err(SendError::OneWay));
    assert_eq!(bench.source.commander().err(), Some(SendError::OneWay));
    let board = UdpSocket::bind("127.0.0.1:0").unwrap();
    for n in 0..1000 {
        let message = lines(n..n + 1);
        board.send_to(&message, ("127.0.0.1", port)).unwrap();
        assert_eq!(bench.next(), Arrival::Message(message));
    }
}

#[test]
fn every_source_ends_within_100_ms() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = server.local_addr().unwrap();
    let udp = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let urls = [
        format!("tcp://{at}"),
        // No host answers at an address for documentation (RFC 5737).
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
    // The test takes no arrivals, so the board finally cannot send any more: no buffer grows without bound.
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

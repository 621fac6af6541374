//! Each route with valid and with invalid requests.

use crate::client::{ask, follow, get, next, post};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_live::server::{Access, Live, Server};
use palpate_live::simulated_board::BoardConfig;
use palpate_live::sink::OpenSink;
use palpate_rig::Rig;
use serde_json::{Value, json};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tungstenite::Message;

const RIG: &str = include_str!("../../../../examples/noisy-beam.toml");
const TOKEN: &str = "0123456789abcdef";

/// A server with a simulated board of 1,000 readings per second, before the session has begun.
fn served(token: Option<&str>) -> (Arc<Live>, Server) {
    served_with(token, Vec::new())
}

/// A server as from [`served`], with these sinks beside browsers.
pub fn served_with(token: Option<&str>, sinks: Vec<OpenSink>) -> (Arc<Live>, Server) {
    let rig = Rig::from_toml(RIG).unwrap();
    let recording = rig.simulate(0).unwrap();
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).unwrap();
    let config = BoardConfig { rate_hz: 1000.0, seed: 1, ..BoardConfig::default() };
    let live = Live::new(locator, "noisy-beam.toml", Some((rig, config)), PathBuf::new());
    let live = Arc::new(live.with_sinks(sinks));
    let address: SocketAddr = "127.0.0.1:0".parse().unwrap();
    let access = Access::new(address, token.map(str::to_owned), Vec::new()).unwrap();
    let server = Server::start(address, access, Arc::clone(&live)).unwrap();
    (live, server)
}

#[test]
fn a_browser_begins_the_simulated_board_and_follows_it() {
    let (live, server) = served(None);
    let (status, session) = get(&server, "/api/session");
    assert_eq!((status, &session["source"], &session["has_simulated"]), (200, &Value::Null, &json!(true)));
    assert_eq!(session["surface"]["supports"][1], json!({ "at_mm": 400.0, "kind": "simple" }));
    assert_eq!(session["channels"].as_array().unwrap().len(), 8);
    assert_eq!(session["limit"]["sd_mm"].as_array().unwrap().len(), 399);
    // A tare without a session is refused.
    assert_eq!(post(&server, "/api/tare", "{}").0, 409);

    let mut socket = follow(&server, "", None).unwrap();
    assert_eq!(post(&server, "/api/source", r#"{"url":"simulated"}"#).0, 200);
    assert_eq!(get(&server, "/api/session").1["source"], "simulated");
    assert_eq!(post(&server, "/api/mark", r#"{"text":"here"}"#).0, 200);
    assert_eq!(post(&server, "/api/tare", "{}").0, 200);
    let (mut events, mut last) = (Vec::<String>::new(), -1);
    // A tare takes a second of readings.
    while last < 500 || (last < 20_000 && events.iter().all(|event| event != "tared")) {
        let message = next(&mut socket);
        let samples = message["samples"].as_array().unwrap();
        assert!(samples.len() <= 64);
        for sample in samples {
            let number = sample["number"].as_i64().unwrap();
            assert!(number > last && sample["reading"].as_array().unwrap().len() == 8);
            last = number;
        }
        let told = message["events"].as_array().unwrap();
        events.extend(told.iter().map(|event| event["event"].as_str().unwrap().to_owned()));
    }
    for expected in ["source_opened", "mark", "tared"] {
        assert!(events.iter().any(|event| event == expected), "{expected}: {events:?}");
    }
    // A new session counts from 0 for the same browser.
    assert_eq!(post(&server, "/api/source", r#"{"url":"simulated"}"#).0, 200);
    let begins = Instant::now();
    while next(&mut socket)["samples"].as_array().unwrap().iter().all(|sample| sample["number"] != 0) {
        assert!(begins.elapsed() < Duration::from_secs(10));
    }
    live.end();
    assert_eq!(get(&server, "/api/session").1["source"], Value::Null);
    assert_eq!(post(&server, "/api/mark", r#"{"text":"late"}"#).0, 409);
}

#[test]
fn every_sample_comes_as_json_and_as_packets() {
    let (live, server) = served(None);
    let mut text = follow(&server, "?rate=all", None).unwrap();
    let mut binary = follow(&server, "?form=binary&rate=all", None).unwrap();
    live.begin_simulated().unwrap();
    let mut expected = 0;
    let mut first = Value::Null;
    while expected < 300 {
        for sample in next(&mut text)["samples"].as_array().unwrap() {
            assert_eq!(sample["number"], expected);
            if expected == 0 {
                first = sample.clone();
            }
            expected += 1;
        }
    }
    let mut expected = 0_u64;
    while expected < 300 {
        let Message::Binary(packet) = binary.read().unwrap() else { panic!("no packet") };
        let u32_at = |at: usize| u32::from_le_bytes(packet[at..at + 4].try_into().unwrap());
        assert_eq!(&packet[..4], [b'p', 2, 8, 0]);
        let each = 48 + 4 * 8;
        assert_eq!(packet.len(), 8 + each * u32_at(4) as usize);
        for sample in packet[8..].chunks(each) {
            assert_eq!(u64::from_le_bytes(sample[..8].try_into().unwrap()), expected);
            if expected == 0 {
                let f32_at =
                    |at: usize| f64::from(f32::from_le_bytes(sample[at..at + 4].try_into().unwrap()));
                assert!((f32_at(20) - first["x_mm"].as_f64().unwrap()).abs() < 1e-3);
                assert!((f32_at(48) / first["reading"][0].as_f64().unwrap() - 1.0).abs() < 1e-6);
            }
            expected += 1;
        }
    }
    live.end();
}

#[test]
fn other_pages_and_other_names_are_refused() {
    let (_live, server) = served(None);
    let own = format!("http://{}", server.address());
    let ask_from = |origin: &str| ask(&server, "POST", "/api/tare", &[("Origin", origin)], "{}").0;
    assert_eq!(ask_from("http://example.org"), 403);
    assert_eq!(ask_from("null"), 403);
    assert_eq!(ask_from(&own), 409);
    assert_eq!(ask(&server, "GET", "/api/session", &[("Host", "example.org")], "").0, 403);
    let address = server.address().to_string();
    let host = address.as_str();
    for (hosts, status) in [([host, host], 400), ([host, "example.org"], 400), (["example.org", host], 400)] {
        let headers = hosts.map(|host| ("Host", host));
        assert_eq!(ask(&server, "GET", "/api/session", &headers, "").0, status, "{hosts:?}");
    }
    assert_eq!(ask(&server, "GET", "http://example.org/api/session", &[], "").0, 403);
    assert_eq!(ask(&server, "GET", &format!("{own}/api/session"), &[], "").0, 200);
    let refused = follow(&server, "", Some("http://example.org")).unwrap_err();
    assert!(matches!(refused, tungstenite::Error::Http(answer) if answer.status() == 403));
    follow(&server, "", Some(&own)).unwrap();
}

#[test]
fn a_token_is_asked_for() {
    let (_live, server) = served(Some(TOKEN));
    assert_eq!(get(&server, "/api/session").0, 401);
    assert_eq!(get(&server, "/api/session?token=0123456789abcdeg").0, 401);
    assert_eq!(get(&server, &format!("/api/session?token={TOKEN}")).0, 200);
    let bearer = format!("Bearer {TOKEN}");
    assert_eq!(ask(&server, "POST", "/api/tare", &[("Authorization", &bearer)], "{}").0, 409);
    assert!(follow(&server, "", None).is_err());
    follow(&server, &format!("?token={TOKEN}"), None).unwrap();
    // The page itself contains no data of the session.
    assert_eq!(ask(&server, "GET", "/", &[], "").0, 200);
}

#[test]
fn bad_requests_are_answered_in_words() {
    let (_live, server) = served(None);
    let long = json!({ "text": "m".repeat(201) }).to_string();
    let large = json!({ "text": "m".repeat(70_000) }).to_string();
    let cases = [
        ("/api/mark", long.as_str(), 400),
        ("/api/mark", r#"{"text":"two\nlines"}"#, 400),
        ("/api/mark", r#"{"text":1}"#, 400),
        ("/api/mark", "{", 400),
        ("/api/mark", r#"["text"]"#, 400),
        ("/api/mark", &large, 413),
        ("/api/source", r#"{"url":"serial:///dev/ttyACM0"}"#, 403),
        ("/api/source", r#"{"url":"simulated:/etc/passwd"}"#, 403),
        ("/api/nothing", "{}", 404),
    ];
    for (path, body, expected) in cases {
        let (status, answer) = post(&server, path, body);
        assert_eq!(status, expected, "{path} {}", &body[..body.len().min(80)]);
        assert!(answer["error"].is_string() && answer["help"].is_string(), "{path}: {answer}");
    }
    for (method, path, expected) in [
        ("GET", "/api/tare", 405),
        ("PUT", "/api/session", 405),
        ("DELETE", "/api/recordings/a.mcap", 405),
        ("GET", "/api/recordings/%FF", 400),
        ("GET", "/api/recordings/%FF/file", 400),
        ("PUT", "/api/nothing", 404),
        ("OPTIONS", "/api/nothing/at/all", 404),
        ("GET", "/api", 404),
        ("GET", "/api/", 404),
    ] {
        let (status, head, body) = ask(&server, method, path, &[], "");
        assert_eq!(status, expected, "{method} {path}");
        let answer: Value = serde_json::from_str(&body).unwrap_or_else(|_| panic!("{method} {path}: {body}"));
        assert!(answer["error"].is_string() && answer["help"].is_string(), "{method} {path}: {answer}");
        assert_eq!(head.contains("\r\nallow: "), expected == 405, "{method} {path}: {head}");
    }
    assert_eq!(ask(&server, "PUT", "/no-such-page", &[], "").0, 404);
    assert_eq!(ask(&server, "PUT", "/", &[], "").0, 405);
    assert_eq!(get(&server, "/api/stream").0, 400);
    assert!(follow(&server, "?form=xml", None).is_err());
    for path in ["/../Cargo.toml", "/%2e%2e/Cargo.toml", "/no-such-file.js"] {
        assert_eq!(get(&server, path).0, 404, "{path}");
    }
    let (status, head, _) = ask(&server, "GET", "/", &[], "");
    assert_eq!(status, 200);
    for header in [
        "content-security-policy: default-src 'self'",
        "x-content-type-options: nosniff",
        "referrer-policy: no-referrer",
    ] {
        assert!(head.contains(header), "{head}");
    }
}

#[test]
fn too_many_commands_in_a_second_are_refused() {
    let (_live, server) = served(None);
    let refused = (0..60).map(|_| post(&server, "/api/tare", "{}").0).filter(|status| *status == 429).count();
    assert!(refused > 0);
}

#[test]
fn a_browser_that_sends_too_much_is_let_go() {
    let (live, server) = served(None);
    let mut socket = follow(&server, "", None).unwrap();
    live.begin_simulated().unwrap();
    socket.send(Message::Text("m".repeat(5000).into())).unwrap();
    let start = Instant::now();
    while socket.read().is_ok() {
        assert!(start.elapsed() < Duration::from_secs(10));
    }
    live.end();
}

#[test]
fn close_frame_of_a_browser_is_answered() {
    let (live, server) = served(None);
    for query in ["", "?form=binary"] {
        let mut socket = follow(&server, query, None).unwrap();
        live.begin_simulated().unwrap();
        socket.read().unwrap();
        socket.close(None).unwrap();
        let end = std::iter::repeat_with(|| socket.read()).find_map(Result::err).unwrap();
        assert!(matches!(end, tungstenite::Error::ConnectionClosed), "{end}");
    }
    live.end();
}

#[test]
fn browser_that_never_reads_does_not_delay_others() {
    let (live, server) = served(None);
    let _slow: Vec<_> = (0..3).map(|_| follow(&server, "?rate=all", None).unwrap()).collect();
    let mut quick = follow(&server, "?rate=all", None).unwrap();
    live.begin_simulated().unwrap();
    let mut expected = 0;
    while expected < 3000 {
        for sample in next(&mut quick)["samples"].as_array().unwrap() {
            assert_eq!(sample["number"], expected);
            expected += 1;
        }
    }
    live.end();
}

#[test]
fn servers_end_at_once_with_browsers_on() {
    let (live, server) = served(None);
    live.begin_simulated().unwrap();
    let _browsers: Vec<_> = (0..10).map(|_| follow(&server, "", None).unwrap()).collect();
    let start = Instant::now();
    live.end();
    drop(server);
    assert!(start.elapsed() < Duration::from_millis(200), "{:?}", start.elapsed());
}

#[cfg(unix)]
#[test]
fn only_regular_files_are_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = folder.path().join("recordings");
    std::fs::create_dir_all(recordings.join("folder.mcap")).unwrap();
    std::fs::write(folder.path().join("secret"), "secret").unwrap();
    std::os::unix::fs::symlink("../secret", recordings.join("link.mcap")).unwrap();
    nix::unistd::mkfifo(&recordings.join("pipe.mcap"), nix::sys::stat::Mode::S_IRWXU).unwrap();
    let rig = Rig::from_toml(RIG).unwrap();
    let recording = rig.simulate(0).unwrap();
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).unwrap();
    let live = Live::new(locator, "rig", None, PathBuf::new()).with_recordings(recordings);
    let address: SocketAddr = "127.0.0.1:0".parse().unwrap();
    let server =
        Server::start(address, Access::new(address, None, Vec::new()).unwrap(), Arc::new(live)).unwrap();
    assert_eq!(get(&server, "/api/recordings"), (200, serde_json::json!([])));
    for name in ["link", "pipe", "folder"] {
        for path in [format!("/api/recordings/{name}.mcap"), format!("/api/recordings/{name}.mcap/file")] {
            let (status, _, body) = ask(&server, "GET", &path, &[], "");
            assert_eq!(status, 400, "{path}: {body}");
            assert!(body.contains("not a regular file") && !body.contains("secret"), "{path}: {body}");
        }
    }
}

#[test]
fn a_page_that_is_loaded_again_gets_the_past_of_the_session() {
    let (_live, server) = served(None);
    assert_eq!(get(&server, "/api/history").1, json!({ "samples": [], "events": [] }));
    assert_eq!(post(&server, "/api/source", r#"{"url":"simulated"}"#).0, 200);
    assert_eq!(post(&server, "/api/mark", r#"{"text":"here"}"#).0, 200);
    let end = Instant::now() + Duration::from_secs(20);
    let past = loop {
        let (_, past) = get(&server, "/api/history");
        if past["samples"].as_array().unwrap().len() >= 5 {
            break past;
        }
        assert!(Instant::now() < end, "{past}");
        std::thread::sleep(Duration::from_millis(50));
    };
    let samples = past["samples"].as_array().unwrap();
    let times: Vec<f64> = samples.iter().map(|sample| sample["time_s"].as_f64().unwrap()).collect();
    assert!(times.windows(2).all(|pair| (pair[1] * 10.0).floor() > (pair[0] * 10.0).floor()), "{times:?}");
    assert_eq!(samples[0]["reading"].as_array().unwrap().len(), 8);
    assert!(past["events"].as_array().unwrap().iter().any(|event| event["text"] == "here"), "{past}");
    // Another session has a separate history.
    assert_eq!(post(&server, "/api/source", r#"{"url":"simulated"}"#).0, 200);
    let (_, past) = get(&server, "/api/history");
    assert!(!past["events"].as_array().unwrap().iter().any(|event| event["text"] == "here"), "{past}");
}

#[test]
fn alarms_are_checked_set_and_raised() {
    let (_live, server) = served(None);
    let set = |text: &str| post(&server, "/api/alarms", &json!({ "text": text }).to_string());
    for (text, words) in [
        ("[[rule]]\nevent = \"mark\"\nalarm = \"\"\n", "line 3: `alarm` has 0 characters"),
        ("[[rule]]\nx = [\"1 m\", \"2 m\"]\nalarm = \"a\"\n", "line 2: `x` is from 1 m to 2 m"),
        ("[[rule]]\nevent = \"mark\"\ncommand = \"brake\"\n", "does not raise an alarm"),
        ("rules", "line 1"),
    ] {
        let (status, refusal) = set(text);
        assert!(status == 400 && refusal["error"].as_str().unwrap().contains(words), "{refusal}");
    }
    let file = "# mine\n[[rule]]\nname = \"marked\"\nevent = \"mark\"\nalarm = \"look\"\n";
    assert_eq!(set(file), (200, json!({ "text": file, "file": null })));
    assert_eq!(get(&server, "/api/alarms").1, json!({ "text": file, "file": null }));
    assert_eq!(post(&server, "/api/source", r#"{"url":"simulated"}"#).0, 200);
    let mut socket = follow(&server, "", None).unwrap();
    assert_eq!(post(&server, "/api/mark", r#"{"text":"here"}"#).0, 200);
    let alarm = loop {
        let events = next(&mut socket)["events"].as_array().unwrap().clone();
        if let Some(alarm) = events.into_iter().find(|event| event["event"] == "alarm") {
            break alarm;
        }
    };
    assert_eq!((&alarm["name"], &alarm["text"]), (&json!("marked"), &json!("look")));
    assert_eq!(set(""), (200, json!({ "text": "", "file": null })));
}

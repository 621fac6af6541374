//! Bring-up of a board without a rig, from its first line to the calibration of the new rig.

use crate::client::{get, post};
use palpate_live::server::{Access, Live, Server};
use serde_json::{Value, json};
use std::io::Write;
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A board that sends lines of three values to each client until the client disconnects.
fn board() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(mut stream) = stream else { return };
            std::thread::spawn(move || {
                while stream.write_all(b"10,-20,30\n").is_ok() {
                    std::thread::sleep(Duration::from_millis(5));
                }
            });
        }
    });
    format!("tcp://{address}")
}

fn served(folder: &Path) -> Server {
    let live = Live::bringing_up(board().parse().unwrap(), folder.to_owned()).unwrap();
    let address: SocketAddr = "127.0.0.1:0".parse().unwrap();
    let access = Access::new(address, None, Vec::new()).unwrap();
    Server::start(address, access, Arc::new(live)).unwrap()
}

fn seen(server: &Server, until: impl Fn(&Value) -> bool) -> Value {
    let end = Instant::now() + Duration::from_secs(20);
    loop {
        let (status, seen) = get(server, "/api/bring-up");
        assert_eq!(status, 200, "{seen}");
        if until(&seen) {
            return seen;
        }
        assert!(Instant::now() < end, "{seen}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn form(changes: &Value) -> String {
    let mut form = json!({
        "file": "strip.toml", "channels": ["left", "", "right"], "length_mm": 300, "width_mm": null, "places": [6], "repeats": 2,
        "force_n": 2, "force_is_known": false, "overwrite": false, "write": true,
    });
    for (key, value) in changes.as_object().unwrap() {
        form[key] = value.clone();
    }
    form.to_string()
}

#[test]
fn a_board_without_a_rig_is_seen_and_gets_one() {
    let folder = tempfile::tempdir().unwrap();
    let server = served(folder.path());
    let (_, session) = get(&server, "/api/session");
    assert_eq!(
        (&session["brings_up"], &session["surface"], &session["calibrates"]),
        (&json!(true), &Value::Null, &json!(false))
    );
    let board = seen(&server, |seen| seen["readings"].as_u64() > Some(20));
    assert_eq!(board["channels"][1], json!({ "name": "s2", "now": -20.0, "range": [-20.0, -20.0] }));
    assert_eq!(
        (&board["lines"][0]["text"], &board["problem"], &board["port"]),
        (&json!("10,-20,30"), &Value::Null, &Value::Null)
    );
    // A TCP source offers no choice of ports. Before the locator exists, only the steps of the bring-up are allowed.
    assert_eq!(post(&server, "/api/bring-up", r#"{"port":"/etc/passwd","baud":9600}"#).0, 400);
    assert_eq!(post(&server, "/api/tare", "{}").0, 409);
    assert_eq!(post(&server, "/api/alarms", r#"{"text":""}"#).0, 409);
    assert_eq!(get(&server, "/api/calibration").0, 404);

    for (change, words, field) in [
        (json!({ "file": "../strip.toml" }), "cannot name a rig", "file"),
        (json!({ "length_mm": 0 }), "the length is 0 mm", "length_mm"),
        (json!({ "channels": ["left"] }), "the board sends 3 values", "channels"),
        (
            json!({ "placement_mm": 400 }),
            "the placement is 400 mm; it must be less than 300 mm",
            "placement_mm",
        ),
        (json!({ "sensor_places_mm": [[1], [], [400]] }), "`right` is at 400 mm", "sensor_places_mm"),
        (
            json!({ "force_n": null, "second_force_n": 1 }),
            "a second force needs a first one",
            "second_force_n",
        ),
    ] {
        let (status, refusal) = post(&server, "/api/rig", &form(&change));
        assert!(status == 400 && refusal["error"].as_str().unwrap().contains(words), "{refusal}");
        assert_eq!(refusal["field"], json!(field), "{refusal}");
    }
    let (status, made) = post(&server, "/api/rig", &form(&json!({ "write": false })));
    assert_eq!((status, &made["written"], &made["exists"]), (200, &json!(false), &json!([])));
    assert!(!folder.path().join("strip.toml").exists());

    std::fs::write(folder.path().join("strip.toml"), "mine").unwrap();
    let (status, refusal) = post(&server, "/api/rig", &form(&json!({})));
    assert!(status == 409 && refusal["error"].as_str().unwrap().contains("exists already"), "{refusal}");
    assert_eq!(std::fs::read_to_string(folder.path().join("strip.toml")).unwrap(), "mine");
    let whole = json!({
        "overwrite": true, "second_force_n": 4, "placement_mm": 2, "sensor_places_mm": [[50], [], [250]],
    });
    let (status, made) = post(&server, "/api/rig", &form(&whole));
    assert_eq!((status, &made["written"]), (200, &json!(true)), "{made}");
    assert!(made["text"].as_str().unwrap().contains("positions = [\"50 mm\", \"250 mm\"]"), "{made}");
    assert_eq!(
        std::fs::read_to_string(folder.path().join("strip.toml")).unwrap(),
        made["text"].as_str().unwrap()
    );

    let (_, session) = get(&server, "/api/session");
    assert_eq!((&session["brings_up"], &session["calibrates"]), (&json!(false), &json!(true)));
    assert_eq!(session["channels"].as_array().unwrap().len(), 2);
    assert_eq!(get(&server, "/api/bring-up").0, 409);
    assert_eq!(post(&server, "/api/rig", &form(&json!({ "overwrite": true }))).0, 409);
    // The calibration reads the two channels, though the board sends three values.
    let (status, begun) = post(&server, "/api/calibration", r#"{"step":"begin"}"#);
    // Two presses of 6 places with the first weight, and of 3 with the second.
    assert_eq!((status, &begun["left"]), (200, &json!(12 + 6)), "{begun}");
    assert_eq!((&begun["placement_mm"], &begun["single_weight_n"]), (&json!(2.0), &Value::Null));
    let end = Instant::now() + Duration::from_secs(20);
    loop {
        let (_, state) = get(&server, "/api/calibration");
        if state["readings"].as_u64() > Some(3) {
            assert_eq!(
                (&state["bad_frames"], &state["reading"]),
                (&json!(0), &json!([10.0, 30.0])),
                "{state}"
            );
            return;
        }
        assert!(Instant::now() < end, "{state}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

//! ROS 2 messages of a session, compared byte by byte with a file that `rosbags` reads in python/tests/test_ros_messages.py.
//!
//! `PALPATE_WRITE_GOLDEN=1 cargo test -p palpate-live --test ros_messages` rewrites the file.

use palpate_core::{ContactEstimate, Estimate, Position, Status};
use palpate_live::event::{Event, EventRecord};
use palpate_live::frame::Channel;
use palpate_live::sample::Sample;
use palpate_live::session::Output;
use palpate_live::sink::ros::{RosMessage, Topic, messages};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

/// 2027-01-15 08:00:00 UTC and a nanosecond.
const UNIX_NS: u64 = 1_800_000_000_000_000_001;

fn contact(x_m: f64, y_m: f64, force_n: Option<f64>) -> ContactEstimate {
    ContactEstimate { position: Position { x_m, y_m }, force_n, uncertainty: None }
}

fn sample(unix_ns: u64, estimate: Estimate) -> Output {
    let arrived = Duration::from_millis(5);
    let reading = vec![1.5, -2.0];
    Output::Sample(Box::new(Sample {
        number: 7,
        unix_ns,
        arrived,
        tared: reading.clone(),
        reading,
        estimate,
    }))
}

/// Messages of a session on a plane with two channels.
fn published(output: &Output, frame: &str) -> Vec<RosMessage> {
    let channel = |name: &str| Channel { name: name.to_owned(), label: name.to_owned(), unit: Unit::NONE };
    let channels = [channel("left"), channel("right")];
    messages(output, frame, &channels, Extent::plane(0.3, 0.2).unwrap())
}

fn located(contact: ContactEstimate, further: &[ContactEstimate]) -> Estimate {
    let mut estimate = Estimate::of_contact(contact, Status::Located);
    for further in further {
        assert!(estimate.further.push(*further), "there is no room");
    }
    estimate
}

fn header(sec: i64, nanosec: u32, frame: &str) -> Value {
    json!({ "stamp": { "sec": sec, "nanosec": nanosec }, "frame_id": frame })
}

fn vector(x: f64, y: f64, z: f64) -> Value {
    json!({ "x": x, "y": y, "z": z })
}

/// An output of a session, the frame, and the expected topics and fields.
type Case = (Output, &'static str, Vec<(Topic, Value)>);

fn cases() -> Vec<Case> {
    let point =
        |header: &Value, x, y| (Topic::Contact, json!({ "header": header, "point": vector(x, y, 0.0) }));
    let wrench = |header: &Value, force: Value, torque: Value| {
        (Topic::Wrench, json!({ "header": header, "wrench": { "force": force, "torque": torque } }))
    };
    let estimate = |data: &str| (Topic::Estimate, json!({ "data": data }));
    let none = vector(0.0, 0.0, 0.0);
    let mut cases = Vec::new();
    // Frames of all lengths up to 9, because the following field is aligned to 8.
    for frame in ["s", "su", "sur", "surf", "surfa", "surfac", "surface", "surface1", "surface/1"] {
        let head = header(1_800_000_000, 1, frame);
        cases.push((
            sample(UNIX_NS, located(contact(0.125, 0.0625, Some(2.0)), &[])),
            frame,
            vec![
                point(&head, 0.125, 0.0625),
                wrench(&head, vector(0.0, 0.0, -2.0), vector(-0.125, 0.25, 0.0)),
                estimate(
                    r#"{"number":7,"time_s":1800000000.0,"reading":[1.5,-2.0],"x_mm":125.0,"y_mm":62.5,"force_n":2.0,"status":"located"}"#,
                ),
            ],
        ));
    }
    // The forces and torques of two contacts add up; the point is that of the stronger contact.
    let head = header(1_800_000_000, 1, "surface");
    cases.push((
        sample(UNIX_NS, located(contact(0.25, 0.125, Some(4.0)), &[contact(0.0625, 0.5, Some(1.0))])),
        "surface",
        vec![
            point(&head, 0.25, 0.125),
            wrench(&head, vector(0.0, 0.0, -5.0), vector(-1.0, 1.0625, 0.0)),
            estimate(
                r#"{"number":7,"time_s":1800000000.0,"reading":[1.5,-2.0],"x_mm":250.0,"y_mm":125.0,"force_n":4.0,"status":"located","further":[{"x_mm":62.5,"y_mm":500.0,"force_n":1.0}]}"#,
            ),
        ],
    ));
    // An unknown force: no wrench.
    cases.push((
        sample(UNIX_NS, located(contact(0.25, 0.125, None), &[])),
        "surface",
        vec![
            point(&head, 0.25, 0.125),
            estimate(
                r#"{"number":7,"time_s":1800000000.0,"reading":[1.5,-2.0],"x_mm":250.0,"y_mm":125.0,"status":"located"}"#,
            ),
        ],
    ));
    // An untouched surface: a wrench of zero, and no point.
    cases.push((
        sample(UNIX_NS, Estimate::of_contact(contact(0.25, 0.125, Some(0.5)), Status::NoContact)),
        "surface",
        vec![
            wrench(&head, none.clone(), none),
            estimate(
                r#"{"number":7,"time_s":1800000000.0,"reading":[1.5,-2.0],"x_mm":250.0,"y_mm":125.0,"force_n":0.5,"status":"no_contact"}"#,
            ),
        ],
    ));
    // Unreliable estimates are in the topic `estimate` alone.
    for status in [Status::Ambiguous, Status::OutsideModel, Status::OutsideSurface] {
        let data = format!(
            r#"{{"number":7,"time_s":1800000000.0,"reading":[1.5,-2.0],"x_mm":250.0,"y_mm":125.0,"force_n":0.5,"status":"{}"}}"#,
            status.name()
        );
        let output = sample(UNIX_NS, Estimate::of_contact(contact(0.25, 0.125, Some(0.5)), status));
        cases.push((output, "surface", vec![estimate(&data)]));
    }
    // The last second of ROS, and one beyond it.
    for (unix_s, sec) in [(2_147_483_647, 2_147_483_647), (9_000_000_000_u64, 2_147_483_647)] {
        let unix_ns = unix_s * 1_000_000_000 + 5;
        let time_s = unix_ns as f64 * 1e-9;
        let head = header(sec, 5, "surface");
        let data = format!(
            r#"{{"number":7,"time_s":{time_s:?},"reading":[1.5,-2.0],"x_mm":250.0,"y_mm":125.0,"status":"located"}}"#
        );
        cases.push((
            sample(unix_ns, located(contact(0.25, 0.125, None), &[])),
            "surface",
            vec![point(&head, 0.25, 0.125), estimate(&data)],
        ));
    }
    let mark = EventRecord { time_s: 1.8e9, event: Event::Mark { text: "Kübel \"A\"\0".to_owned() } };
    let data = "{\"time_s\":1800000000.0,\"event\":\"mark\",\"text\":\"Kübel \\\"A\\\"\\u0000\"}";
    cases.push((Output::Event(mark), "surface", vec![(Topic::Event, json!({ "data": data }))]));
    cases
}

#[test]
fn messages_are_those_of_the_golden_file() {
    let mut all = Vec::new();
    for (output, frame, expected) in cases() {
        let published = published(&output, frame);
        let topics: Vec<Topic> = published.iter().map(|message| message.topic).collect();
        assert_eq!(topics, expected.iter().map(|(topic, _)| *topic).collect::<Vec<_>>(), "{output:?}");
        for (message, (topic, fields)) in published.iter().zip(expected) {
            let cdr: String = message.cdr.iter().map(|byte| format!("{byte:02x}")).collect();
            all.push(json!({
                "type": topic.message_type(),
                "hash": topic.type_hash(),
                "fields": fields,
                "cdr": cdr,
            }));
        }
    }
    let text = serde_json::to_string_pretty(&all).unwrap() + "\n";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/ros-messages.json");
    if std::env::var_os("PALPATE_WRITE_GOLDEN").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &text).unwrap();
    }
    let golden: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    assert_eq!(Value::Array(all), golden);
}

#[test]
fn messages_have_the_time_of_their_reading_or_event() {
    for (output, frame, _) in cases() {
        let unix_ns = match &output {
            Output::Sample(sample) => sample.unix_ns,
            Output::Event(_) => 1_800_000_000_000_000_000,
        };
        assert!(published(&output, frame).iter().all(|message| message.unix_ns == unix_ns));
    }
}

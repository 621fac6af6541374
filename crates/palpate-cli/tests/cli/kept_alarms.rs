//! Alarms that were set on the page are kept beside the locator, or in the folder of recordings, until the next start.
#![cfg(unix)]

use crate::support::attempt::{Attempt, get, post};
use crate::support::command::{complained, folder, run, said};
use crate::support::examples::NOISY_BEAM;
use serde_json::json;
use std::fs;

const ALARM: &str = "# mine\n[[rule]]\nname = \"marked\"\nevent = \"mark\"\nalarm = \"look\"\n";
const OTHER: &str = "[[rule]]\nname = \"other\"\nevent = \"gap\"\nalarm = \"a gap\"\n";
const COMMAND: &str = "[[rule]]\nname = \"brake\"\nevent = \"mark\"\ncommand = \"brake\"\n";

#[test]
fn alarms_of_the_page_are_there_after_a_restart() {
    let bench = folder(NOISY_BEAM);
    let folder = bench.path();
    said(&run(folder, &["fit", "rig.toml", "-o", "strip.json"]));
    fs::write(folder.join("rules.toml"), OTHER).unwrap();
    fs::write(folder.join("commands.toml"), COMMAND).unwrap();
    let serve = |arguments: &[&str]| {
        let mut server =
            Attempt::begin(folder, &[&["serve", "--listen", "127.0.0.1:0"][..], arguments].concat());
        let address = server.address();
        (server, address)
    };
    let kept = |text: &str, file: &str| json!({ "text": text, "file": file });

    let (server, address) = serve(&["strip.json"]);
    assert_eq!(get(&address, "/api/alarms"), kept("", "strip.alarms.toml"));
    assert_eq!(post(&address, "/api/alarms", &json!({ "text": ALARM })), kept(ALARM, "strip.alarms.toml"));
    assert_eq!(server.interrupt().0, Some(130));
    assert_eq!(fs::read_to_string(folder.join("strip.alarms.toml")).unwrap(), ALARM);

    // They are said at the start; rules of the command line take their place, commands to the board do not.
    let (mut server, address) = serve(&["strip.json", "--rules", "commands.toml"]);
    server.wait_for(&["alarms of strip.alarms.toml"]);
    assert_eq!(get(&address, "/api/alarms"), kept(ALARM, "strip.alarms.toml"));
    server.interrupt();
    let (server, address) = serve(&["strip.json", "--rules", "rules.toml"]);
    let of_rules = get(&address, "/api/alarms");
    assert!(of_rules["file"].is_null() && of_rules["text"].as_str().unwrap().contains("a gap"), "{of_rules}");
    post(&address, "/api/alarms", &json!({ "text": "" }));
    server.interrupt();
    assert_eq!(fs::read_to_string(folder.join("strip.alarms.toml")).unwrap(), ALARM);

    // The last rule takes the file with it.
    let (server, address) = serve(&["strip.json"]);
    assert_eq!(post(&address, "/api/alarms", &json!({ "text": "" })), kept("", "strip.alarms.toml"));
    server.interrupt();
    assert!(!folder.join("strip.alarms.toml").exists());

    // The demonstration has no locator: its alarms are in the folder of recordings, where there is one.
    let (server, address) = serve(&["--record", "takes"]);
    post(&address, "/api/alarms", &json!({ "text": ALARM }));
    server.interrupt();
    assert_eq!(fs::read_to_string(folder.join("takes/alarms.toml")).unwrap(), ALARM);
    let (server, address) = serve(&[]);
    assert!(get(&address, "/api/alarms")["file"].is_null());
    server.interrupt();
}

#[test]
fn damaged_alarms_are_refused_with_their_place() {
    let bench = folder(NOISY_BEAM);
    let folder = bench.path();
    for (text, words) in
        [("[[rule]]\nevent = \"mark\"\nalarm = 5\n", "3"), (COMMAND, "does not raise an alarm")]
    {
        fs::write(folder.join("rig.alarms.toml"), text).unwrap();
        let refused = complained(&run(folder, &["serve", "rig.toml", "--listen", "127.0.0.1:0"]), 2);
        assert!(refused.contains("rig.alarms.toml") && refused.contains(words), "{refused}");
    }
}

//! Keys of planes.

use super::*;
use palpate_estimators::arrangement::Arrangement;
use palpate_mechanics::contact::Position;

const PLANE: &str = r#"[surface]
kind = "measured"
length = "300 mm"
width = "200 mm"
[sensors]
measure = "deflection"
grid = [3, 3]
[contact]
force = "5 N"
[training]
grid = [6, 4]
repeats = 5
[estimator]
kind = "influence"
"#;

fn millimetres(positions: impl IntoIterator<Item = Position>) -> Vec<[f64; 2]> {
    positions.into_iter().map(|p| [p.x_m, p.y_m].map(|m| (m * 1e6).round() / 1e3)).collect()
}

#[test]
fn grids_and_pairs_are_at_their_positions() {
    let rig = Rig::from_toml(PLANE).unwrap();
    let sensors = millimetres(rig.setup.layout().sensors().iter().map(|sensor| sensor.position));
    assert_eq!(sensors[..4], [[75.0, 50.0], [150.0, 50.0], [225.0, 50.0], [75.0, 100.0]]);
    let training = rig.training.unwrap();
    assert_eq!((&training.arrangement, training.count), (&Arrangement::Grid { columns: 6, rows: 4 }, 24));
    let pressed = millimetres(training.positions(rig.setup.surface().extent()).unwrap());
    assert_eq!([pressed[0], pressed[1], pressed[23]], [[25.0, 25.0], [75.0, 25.0], [275.0, 175.0]]);

    let pairs = PLANE
        .replace("grid = [3, 3]", "positions = [[\"75 mm\", \"50 mm\"], [\"10 cm\", \"0 mm\"]]")
        .replace("grid = [6, 4]", "positions = [[\"1 mm\", \"2 mm\"]]");
    let rig = Rig::from_toml(&pairs).unwrap();
    let sensors = millimetres(rig.setup.layout().sensors().iter().map(|sensor| sensor.position));
    assert_eq!(sensors, [[75.0, 50.0], [100.0, 0.0]]);
    let pressed = rig.training.unwrap().positions(rig.setup.surface().extent()).unwrap();
    assert_eq!(millimetres(pressed), [[1.0, 2.0]]);
}

#[test]
fn lines_and_planes_that_are_mixed_up_are_refused_with_a_caret() {
    let pairs = |pair: &str| format!("positions = [[\"75 mm\", \"50 mm\"], {pair}]");
    let [single, one, three, off, unit] = [
        "\"75 mm\"",
        "[\"75 mm\"]",
        "[\"75 mm\", \"1 mm\", \"2 mm\"]",
        "[\"75 mm\", \"201 mm\"]",
        "[\"75 mm\", 50]",
    ]
    .map(pairs);
    let on_a_plane = refused(
        PLANE,
        &[
            ("grid = [3, 3]", "count = 9"),
            ("grid = [3, 3]", "grid = [3, 3]\ncount = 9"),
            ("grid = [3, 3]", ""),
            ("grid = [3, 3]", "grid = [3]"),
            ("grid = [3, 3]", "grid = [0, 3]"),
            ("grid = [3, 3]", "grid = [300, 300]"),
            ("grid = [3, 3]", "grid = 9"),
            ("grid = [3, 3]", &single),
            ("grid = [3, 3]", &one),
            ("grid = [3, 3]", &three),
            ("grid = [3, 3]", &off),
            ("grid = [3, 3]", &unit),
            ("grid = [6, 4]", "count = 24"),
            ("grid = [6, 4]", "count = 25\ngrid = [6, 4]"),
            ("grid = [6, 4]", ""),
            ("grid = [6, 4]", "grid = [6, 4]\nmiddle = 4"),
            ("grid = [6, 4]", "arrangement = \"even\"\ngrid = [6, 4]"),
            ("grid = [6, 4]", "arrangement = \"edge-dense\"\ncount = 10\nmiddle = 4"),
            ("grid = [6, 4]", &single),
            ("grid = [6, 4]", &off),
        ],
    );
    let on_a_line = refused(
        BENCH,
        &[
            ("count = 8", "grid = [3, 3]"),
            ("count = 8", &one),
            ("count = 10", "grid = [5, 2]"),
            ("count = 10", "positions = [\"75 mm\", [\"75 mm\", \"0 mm\"]]"),
        ],
    );
    insta::assert_snapshot!(format!("{on_a_plane}\n\n{on_a_line}"));
}

#[test]
fn a_load_on_a_plane_is_a_rectangle() {
    let load = "[[load]]\nfrom = [\"70 mm\", \"80 mm\"]\nto = [\"110 mm\", \"120 mm\"]\nforce = \"4 N\"\n";
    let loaded = format!("{PLANE}{load}");
    let loads = Rig::from_toml(&loaded).unwrap().loads;
    assert_eq!(millimetres([loads[0].from(), loads[0].to()]), [[70.0, 80.0], [110.0, 120.0]]);
    assert_eq!((loads.len(), loads[0].force_n()), (1, 4.0));
    insta::assert_snapshot!(refused(
        &loaded,
        &[
            ("from = [\"70 mm\", \"80 mm\"]", "from = \"70 mm\""),
            ("to = [\"110 mm\", \"120 mm\"]", "to = [\"110 mm\"]"),
            ("to = [\"110 mm\", \"120 mm\"]", "to = [\"110 mm\", \"70 mm\"]"),
            ("to = [\"110 mm\", \"120 mm\"]", "to = [\"110 mm\", \"220 mm\"]"),
        ],
    ));
    let on_a_line =
        "[surface]\nkind = \"measured\"\nlength = \"300 mm\"\n[sensors]\nmeasure = \"raw\"\ncount = 3\n";
    insta::assert_snapshot!(refused(&format!("{on_a_line}{load}"), &[("", "")]));
}

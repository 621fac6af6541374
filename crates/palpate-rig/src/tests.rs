mod digits;
mod imperfections;
mod loads;
mod planes;
mod plates;
mod sections;

use super::*;
use palpate_estimators::arrangement::Arrangement;
use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::{Auto, Estimator};
use palpate_estimators::network::{InputScale, Network, OutputCoding};
use palpate_estimators::recording::{Column, Decimal, PositionColumns, Separator, ValueColumn};
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{Beam, Extent, SurfaceSpec};
use palpate_testing::data::recording;

mod supports;

const PAPER: &str = include_str!("../../../examples/paper.toml");
const FSI_WATER: &str = include_str!("../../../examples/fsi-water.toml");

#[test]
fn papers_bench_has_the_published_values() {
    let rig = Rig::from_toml(PAPER).unwrap();
    let beam = Beam::new(0.4, 0.04, 0.0012, 200e9).unwrap();
    assert_eq!(rig.setup.surface(), &SurfaceSpec::Beam(beam));
    let mut layout = Layout::even(SensorKind::Deflection, 8, 0.4);
    layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 5e-6)).unwrap();
    assert_eq!(rig.setup.layout(), &layout);
    assert_eq!(rig.setup.force_n(), Some(3.0));
    assert_eq!(rig.training, Some(Training::new(Arrangement::Even, 10)));
    assert_eq!(rig.estimator, Estimator::Network(Network::default()));
    assert_eq!(rig.setup.columns(), None);
}

#[test]
fn the_water_strip_maps_foreign_columns() {
    let rig = Rig::from_toml(FSI_WATER).unwrap();
    assert_eq!(rig.setup.surface(), &SurfaceSpec::Measured(Extent::line(0.1).unwrap()));
    assert_eq!(rig.setup.layout().names(), ["Pl", "Pr"]);
    let Estimator::Network(network) = &rig.estimator else { panic!("{:?}", rig.estimator) };
    assert_eq!((network.output, network.input_scale), (OutputCoding::Normalized, InputScale::Standardized));
    let columns = rig.setup.columns().unwrap();
    assert_eq!(columns.position, PositionColumns::Along(Column::Name("X".to_owned())));
    assert_eq!(columns.position_unit.symbol(), "mm");
}

#[test]
fn the_time_of_rows_and_the_dialect_are_mapped() {
    let with = |keys: &str| FSI_WATER.replace("[recording]", &format!("[recording]\n{keys}"));
    let time = |keys: &str| Rig::from_toml(&with(keys)).unwrap().setup.columns().unwrap().time.clone();
    let column = Column::Name("Zeit".to_owned());
    let unit = |symbol: &str| palpate_mechanics::units::Unit::from_symbol(symbol).unwrap();
    assert_eq!(time(""), None);
    assert_eq!(time("time = \"Zeit\""), Some(ValueColumn { column: column.clone(), unit: unit("s") }));
    let milliseconds = time("time = \"Zeit\"\ntime_unit = \"ms\"");
    assert_eq!(milliseconds, Some(ValueColumn { column, unit: unit("ms") }));
    let refused = |keys: &str| Rig::from_toml(&with(keys)).unwrap_err().to_string();
    assert_eq!(
        refused("time = \"Zeit\"\ntime_unit = \"mm\""),
        "`time_unit`: wrong unit `mm`; a time is one of us, ms, s, min, h"
    );
    assert_eq!(refused("time_unit = \"ms\""), "[recording] has no `time`");

    let said = Rig::from_toml(&with("separator = \"semicolon\"\ndecimal = \"comma\"")).unwrap();
    let columns = said.setup.columns().unwrap();
    assert_eq!((columns.separator, columns.decimal), (Some(Separator::Semicolon), Some(Decimal::Comma)));
    assert_eq!(refused("decimal = \"dot\""), "`decimal` is `dot`; known are point, comma");
}

#[test]
fn several_nuisance_columns_are_mapped_in_their_order() {
    let said = r#"nuisance = "depth"
nuisance_unit = "mm""#;
    assert!(FSI_WATER.contains("nuisance = "), "the example has a nuisance coordinate");
    let lines = FSI_WATER.lines().filter(|line| !line.starts_with("nuisance"));
    let rest = lines.collect::<Vec<_>>().join("\n");
    let with = |keys: &str| Rig::from_toml(&rest.replace("[recording]", &format!("[recording]\n{keys}")));
    let columns = |keys: &str| -> Vec<(String, String)> {
        let rig = with(keys).unwrap();
        let columns = rig.setup.columns().unwrap();
        columns
            .nuisances()
            .map(|values| (values.column.to_string(), values.unit.symbol().to_owned()))
            .collect()
    };
    let pair = |name: &str, unit: &str| (format!("`{name}`"), unit.to_owned());
    assert_eq!(columns(""), []);
    assert_eq!(columns(said), [pair("depth", "mm")]);
    assert_eq!(columns("nuisance = [\"depth\"]\nnuisance_unit = [\"mm\"]"), [pair("depth", "mm")]);
    let two = "nuisance = [\"depth\", \"temperature\"]";
    assert_eq!(columns(two), [pair("depth", ""), pair("temperature", "")]);
    let units = columns(&format!("{two}\nnuisance_unit = [\"mm\", \"\"]"));
    assert_eq!(units, [pair("depth", "mm"), pair("temperature", "")]);
}

#[test]
fn the_water_strips_recording_is_read() {
    let Some(path) = recording("tactile-fsi/1d-water-1.5mm.csv") else { return };
    let rig = Rig::from_toml(FSI_WATER).unwrap();
    let recording = rig.setup.read_recording("water", std::fs::File::open(path).unwrap()).unwrap();
    assert_eq!(recording.rows.len(), 779);
    assert_eq!(recording.distinct_positions().len(), 41);
    assert_eq!(recording.rows[0].reading, [2.04354199724436, 1.42585650614297]);
    assert_eq!(recording.rows[0].force_n, Some(2.21296444140415));
    let folds = recording.folds(5).unwrap();
    assert_eq!(recording.warnings(), []);
    let held_out: Vec<usize> = folds.iter().map(|fold| fold.held_out.len()).collect();
    assert_eq!(held_out, [9 * 19, 8 * 19, 8 * 19, 8 * 19, 8 * 19]);
}

/// Formats message, marked line and help.
fn pointed(text: &str) -> String {
    let error = Rig::from_toml(text).unwrap_err();
    let mut shown = error.to_string();
    if let Some(span) = error.span.clone() {
        let start = text[..span.start].rfind('\n').map_or(0, |at| at + 1);
        let line = text[start..].lines().next().unwrap_or("");
        let end = span.end.min(start + line.len()).max(span.start);
        let before = text[start..span.start].chars().count();
        let marked = text[span.start..end].chars().count().max(1);
        shown += &format!("\n  | {line}\n  | {}{}", " ".repeat(before), "^".repeat(marked));
    }
    if let Some(help) = error.help() {
        shown += &format!("\n  help: {help}");
    }
    shown
}

const BENCH: &str = r#"[surface]
kind = "beam"
length = "400 mm"
width = "40 mm"
thickness = "1.2 mm"
youngs_modulus = "200 GPa"
[sensors]
measure = "deflection"
count = 8
[contact]
force = "3 N"
[training]
count = 10
[estimator]
kind = "network"
"#;

/// Reads the base with replaced pieces.
fn refused(base: &str, changes: &[(&str, &str)]) -> String {
    let shown = changes.iter().map(|(from, to)| {
        assert!(base.contains(from), "{from}");
        pointed(&base.replace(from, to))
    });
    shown.collect::<Vec<_>>().join("\n\n")
}

#[test]
fn a_bad_surface_is_refused_with_a_caret() {
    let shown = refused(
        BENCH,
        &[
            ("length", "lenght"),
            ("length =", "colour ="),
            ("[surface]", "[surfaces]"),
            ("\"400 mm\"", "\"400 m m\""),
            ("\"400 mm\"", "\"400 N\""),
            ("\"400 mm\"", "400"),
            ("\"400 mm\"", "\"-400 mm\""),
            ("\"400 mm\"", "[400]"),
            ("\"400 mm\"", "\"400 mm"),
            ("\"1.2 mm\"", "\"0 mm\""),
            ("\"1.2 mm\"", "\"1e-300 nm\""),
            ("\"beam\"", "\"baem\""),
            ("\"beam\"", "\"measured\""),
            ("kind = \"beam\"\n", ""),
            ("width = \"40 mm\"\n", ""),
            ("thickness", "supports = \"clamped\"\nthickness"),
        ],
    );
    insta::assert_snapshot!(shown);
    insta::assert_snapshot!(pointed(""));
}

#[test]
fn bad_sensors_are_refused_with_a_caret() {
    let shown = refused(
        BENCH,
        &[
            ("count = 8", "count = 0"),
            ("count = 8", "count = -1"),
            ("count = 8", ""),
            ("count = 8", "positions = []"),
            ("count = 8", "positions = [\"44 mm\", \"401 mm\"]"),
            ("count = 8", "positions = [\"44 mm\"]\ncount = 1"),
            ("count = 8", "count = 8\nnoise = \"5 N\""),
            ("count = 8", "count = 8\nnoise = \"-5 um\""),
            ("count = 8", "count = 8\ngain_error = \"100 %\""),
            ("count = 8", "count = 8\nposition_error = \"5 N\""),
            ("\"deflection\"\ncount = 8", "\"reaction\"\npositions = [\"0 mm\"]\nposition_error = \"1 mm\""),
            ("count = 8", "count = 8\nrange = [\"5 mm\", \"-5 mm\"]"),
            ("count = 8", "count = 8\nrange = [\"5 mm\"]"),
            ("count = 8", "count = 8\ndead = [3, 9]"),
            ("\"deflection\"", "\"deflexion\""),
            ("\"deflection\"", "\"raw\""),
            ("\"deflection\"", "\"reaction\""),
            ("\"deflection\"\ncount = 8", "\"reaction\"\npositions = [\"0 mm\", \"200 mm\"]"),
            ("measure = \"deflection\"\n", ""),
        ],
    );
    insta::assert_snapshot!(shown);
}

#[test]
fn bad_contacts_and_training_positions_are_refused_with_a_caret() {
    let shown = refused(
        BENCH,
        &[
            ("\"3 N\"", "\"0 N\""),
            ("\"3 N\"", "\"3 mm\""),
            ("force = \"3 N\"\n", ""),
            ("force = \"3 N\"", "greatest_force = \"0 N\""),
            ("force = \"3 N\"", "greatest_force = \"-20 N\""),
            ("force = \"3 N\"", "greatest_force = \"20 mm\""),
            ("force = \"3 N\"", "force = \"3 N\"\ngreatest_force = \"20 N\""),
            ("count = 10", "count = 0"),
            ("count = 10", "count = 10\nrepeats = 0"),
            ("count = 10", "count = 100000\nrepeats = 100000"),
            ("count = 10", "count = 10\nmiddle = 4"),
            ("count = 10", "arrangement = \"edge-dense\"\ncount = 10"),
            ("count = 10", "arrangement = \"edge-dense\"\ncount = 10\nmiddle = 5"),
            ("count = 10", "arrangement = \"edge-dense\"\ncount = 10\nmiddle = 4\nportion = [0.25]"),
            ("count = 10", "arrangement = \"explicit\""),
            ("count = 10", "positions = []"),
            ("count = 10", "positions = [\"20 mm\", \"401 mm\"]"),
            ("count = 10", "count = 10\nportion = [\"90 %\", \"10 %\"]"),
            ("count = 10", "positions = [\"20 mm\"]\nportion = [0.1, 0.9]"),
            ("count = 10", "arrangement = \"edgedense\"\ncount = 10"),
            ("count = 10", ""),
        ],
    );
    insta::assert_snapshot!(shown);
}

#[test]
fn a_bad_estimator_is_refused_with_a_caret() {
    let network = "kind = \"network\"";
    let with = |line: &str| pointed(&BENCH.replace(network, &format!("{network}\n{line}")));
    let shown = [
        pointed(&BENCH.replace("\"network\"", "\"netwrok\"")),
        with("hidden = [10, 0]"),
        with("hidden = 10"),
        with("momentum = 1"),
        with("momentum = -0.1"),
        with("learning_rate = 0"),
        with("learning_rate = nan"),
        with("aggregate_error = 0.0"),
        with("max_epochs = 0"),
        with("initial_weights = -0.5"),
        with("output = \"normalised\""),
        with("hidden_activation = \"sigmoid\""),
        with("order = \"random\""),
        with("input_scale = \"5 N\""),
        with("input_scale = \"fullscale\""),
        with("learning_rat = 0.7"),
        pointed(&BENCH.replace(network, "kind = \"influence\"\nfrom = \"mechanics\"")),
        pointed(&BENCH.replace(network, "kind = \"neighbours\"\nfrom = \"mechanics\"")),
    ];
    insta::assert_snapshot!(shown.join("\n\n"));
}

#[test]
fn a_false_alarm_rate_is_a_share_within_its_range() {
    let with = |kind: &str, rate: &str| {
        let estimator = format!("kind = \"{kind}\"\nfalse_alarm_rate = {rate}");
        BENCH.replace("kind = \"network\"", &estimator)
    };
    let rate = |kind: &str, rate: &str| match Rig::from_toml(&with(kind, rate)).unwrap().estimator {
        Estimator::Influence(influence) => influence.false_alarm_rate.share(),
        Estimator::ClosedForm(closed_form) => closed_form.false_alarm_rate.share(),
        other => panic!("{other:?}"),
    };
    assert_eq!([rate("influence", "\"1 %\""), rate("closed-form", "0.02")], [0.01, 0.02]);
    let shown = [("\"50 %\""), ("0"), ("\"1 mm\""), ("nan")].map(|rate| pointed(&with("influence", rate)));
    insta::assert_snapshot!(shown.join("\n\n"));
    assert!(pointed(&with("neighbours", "0.01")).contains("false_alarm_rate"));
}

#[test]
fn candidates_of_auto_are_kinds() {
    let with = |only: &str| BENCH.replace("kind = \"network\"", &format!("kind = \"auto\"\nonly = {only}"));
    let only = |text: &str| match Rig::from_toml(&with(text)).unwrap().estimator {
        Estimator::Auto(auto) => auto.only,
        other => panic!("{other:?}"),
    };
    assert_eq!(only("[\"influence\", \"neighbours\"]"), ["influence", "neighbours"]);
    let refused = ["[\"influence\", \"neighbour\"]", "[\"auto\"]", "\"influence\"", "[3]"];
    insta::assert_snapshot!(refused.map(|only| pointed(&with(only))).join("\n\n"));
}

#[test]
fn a_measured_surface_without_an_estimator_compares_the_quick_ones() {
    let text = "surface = { kind = \"measured\", length = \"100 mm\" }\n\
                sensors = { measure = \"raw\" }\n\
                recording = { position = \"x\", channels = [\"a\", \"b\"] }";
    assert_eq!(Rig::from_toml(text).unwrap().estimator, Estimator::Auto(Auto::quick()));
    assert_eq!(
        Rig::from_toml(&BENCH.replace("[estimator]\nkind = \"network\"\n", "")).unwrap().estimator,
        Estimator::default()
    );
}

#[test]
fn a_bad_recording_section_is_refused_with_a_caret() {
    let shown = refused(
        FSI_WATER,
        &[
            ("\"mm\"", "\"N\""),
            ("[\"Pl\", \"Pr\"]", "[\"Pl\"]"),
            ("[\"Pl\", \"Pr\"]", "[\"Pl\", \"Pl\"]"),
            ("[\"Pl\", \"Pr\"]", "[0, 1]"),
            ("position = \"X\"", "position = \"X\"\ny = \"Y\""),
            ("position = \"X\"", "x = \"X\""),
            ("position = \"X\"", "x = \"X\"\ny = \"Y\""),
            ("position = \"X\"", "position = \"X\"\nheader = false"),
            ("position = \"X\"", "position = \"X\"\nchannel_unit = \"mm\""),
            ("position = \"X\"", "position = \"X\"\nuntouched_times = [\"0 s..5 s\", \"10 s\"]"),
            ("force = \"F\"\n", ""),
        ],
    );
    insta::assert_snapshot!(shown);
}

#[test]
fn every_key_is_accepted() {
    let text = r#"
        [surface]
        kind = "beam"
        length = "40 cm"
        width = "40mm"
        thickness = "1200 um"
        youngs_modulus = "200 GPa"
        supports = "simple"
        [[sensors]]
        measure = "deflection"
        positions = ["100 mm", "200 mm", "300 mm"]
        noise = "5 um"
        resolution = "1 um"
        gain_error = "5 %"
        offset_error = "2 um"
        position_error = "0.5 mm"
        range = ["-5 mm", "5 mm"]
        dead = [3]
        [[sensors]]
        measure = "reaction"
        positions = ["0 mm", "400 mm"]
        [training]
        arrangement = "edge-dense"
        count = 10
        middle = 4
        portion = ["25 %", 0.75]
        repeats = 5
        [estimator]
        kind = "network"
        hidden = [12, 6]
        hidden_activation = "tanh"
        output_activation = "linear"
        biases = false
        output = "position"
        input_scale = "standardized"
        learning_rate = 1
        momentum = 0
        aggregate_error = 1e-4
        max_epochs = 1000
        order = "fixed"
        initial_weights = 0.1
        [recording]
        untouched = 8
        untouched_times = ["0 s..10 s", "95 s.."]
        repeated_readings = "collapse"
        zero = "last"
        header = false
        position = 1
        position_unit = "m"
        channels = [2, 3, 4, 5, 6]
        channel_unit = ["um", "um", "um", "N", "N"]
        force = 7
        force_unit = "mN"
        [[load]]
        from = "130 mm"
        to = "15 cm"
        force = "2 N"
    "#;
    insta::assert_debug_snapshot!(Rig::from_toml(text).unwrap());
}

#[test]
fn an_input_scale_is_a_reading_of_the_sensors() {
    let text = BENCH.replace("kind = \"network\"", "kind = \"network\"\ninput_scale = \"5 mm\"");
    let Estimator::Network(network) = Rig::from_toml(&text).unwrap().estimator else {
        panic!("not a network")
    };
    assert_eq!(network.input_scale, InputScale::DivideBy(0.005));
}

proptest::proptest! {
    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(proptest::arbitrary::any::<u8>(), 0..200)) {
        let _ = Rig::from_toml(&String::from_utf8_lossy(&bytes));
    }

    /// Edits of valid rigs reach more code than random bytes.
    #[test]
    fn no_damaged_rig_panics(from in 0..BENCH.len(), length in 0..30usize, patch in "[-\"0-9a-zN%\\[\\]=. \n]{0,12}") {
        for rig in [BENCH, PAPER, FSI_WATER] {
            let mut text: Vec<char> = rig.chars().collect();
            let start = from.min(text.len());
            let end = (start + length).min(text.len());
            text.splice(start..end, patch.chars());
            if let Err(error) = Rig::from_toml(&text.into_iter().collect::<String>()) {
                let _ = (error.to_string(), error.help());
            }
        }
    }
}

#[test]
fn arms_may_have_points_in_their_names() {
    let study = |name: &str| {
        let arm = format!("[[arm]]\nname = \"{name}\"\n");
        Study::from_toml(&format!("name = \"s\"\n{}\n{arm}", PAPER.replace("[recording]", "[design]")))
    };
    assert_eq!(study("noise-0.5").unwrap().arms[0].name, "noise-0.5");
    for name in ["", ".", "..", ".a", "a.", "a/b", "a b", "ü"] {
        let error = study(name).unwrap_err().to_string();
        assert!(
            error.ends_with("it must be of letters, digits, `-`, `_`, and `.` between them"),
            "{name}: {error}"
        );
    }
}

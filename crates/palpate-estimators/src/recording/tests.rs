use std::sync::LazyLock;

use proptest::prelude::*;

use super::*;
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;

static STRIP: LazyLock<Extent> = LazyLock::new(|| Extent::line(0.1).unwrap());

fn named(name: &str) -> Column {
    Column::Name(name.to_owned())
}

fn channel(column: Column) -> ValueColumn {
    ValueColumn { column, unit: Unit::NONE }
}

/// Foreign bench: position `X` in mm, two raw channels, force `F`.
fn foreign() -> Columns {
    Columns {
        header: Header::Present,
        position: PositionColumns::Along(named("X")),
        position_unit: Unit::from_symbol("mm").unwrap(),
        channels: vec![channel(named("Pl")), channel(named("Pr"))],
        force: Some(ForceColumn {
            values: ValueColumn { column: named("F"), unit: Unit::from_symbol("N").unwrap() },
            need: Need::Required,
        }),
        frame: Frame::default(),
        nuisance: None,
        further_nuisances: Vec::new(),
        time: None,
        untouched: None,
        untouched_times: Vec::new(),
        force_zero_n: None,
        separator: None,
        decimal: None,
        repeated_readings: RepeatedReadings::Auto,
        zero: Zero::None,
    }
}

fn numbered() -> Columns {
    let number = |number| channel(Column::Number(number));
    Columns {
        header: Header::Absent,
        position: PositionColumns::Plane { x: Column::Number(2), y: Column::Number(3) },
        channels: vec![number(2), number(4)],
        force: None,
        ..foreign()
    }
}

fn read_as(columns: &Columns, bytes: &[u8]) -> Result<Recording, CsvError> {
    let layout = Layout::even(SensorKind::Raw, 2, 0.1);
    read("bench.csv", bytes, &Schema { columns, layout: &layout, extent: *STRIP, known_force_n: None })
}

#[test]
fn columns_are_mapped_and_others_ignored() {
    let text = "note, X ,Pr,F,Pl\r\n\"a, b\",10,2.5,1,1.5\r\n\r\n,12,2.25,3,1.25\r\n";
    let recording = read_as(&foreign(), text.as_bytes()).unwrap();
    let row = |x_m, force_n, reading: [f64; 2]| Row {
        position: Position::along(x_m),
        force_n: Some(force_n),
        nuisances: Vec::new(),
        time_s: None,
        reading: reading.to_vec(),
    };
    assert_eq!(recording.rows, [row(0.01, 1.0, [1.5, 2.5]), row(0.012, 3.0, [1.25, 2.25])]);
    assert_eq!(recording.channels, ["raw_1", "raw_2"]);
    assert_eq!((recording.provenance.source.as_str(), recording.provenance.rows), ("bench.csv", 2));
    assert_eq!(recording.provenance.digests[0].len(), 64);
}

#[test]
fn rows_have_the_times_of_a_column() {
    let times = |columns: &Columns, text: &str| read_as(columns, text.as_bytes()).map(|read| read.times_s());
    let text =
        "X,Pl,Pr,F,Zeit,time_s\n10,1,2,3,03.04.2026 14:03:25,5\n12,1,2,3,03.04.2026 14:03:25.250,6.5\n";
    assert_eq!(times(&foreign().time("Zeit"), text).unwrap(), Some(vec![0.0, 0.25]));
    assert_eq!(times(&foreign(), text).unwrap(), Some(vec![5.0, 6.5]));
    assert_eq!(times(&foreign(), "X,Pl,Pr,F\n10,1,2,3\n").unwrap(), None);
    let milliseconds = ValueColumn { column: named("Zeit"), unit: Unit::from_symbol("ms").unwrap() };
    let columns = Columns { time: Some(milliseconds), ..foreign() };
    assert_eq!(times(&columns, "X,Pl,Pr,F,Zeit\n10,1,2,3,1500\n").unwrap(), Some(vec![1.5]));
    assert_eq!(times(&columns, "X;Pl;Pr;F;Zeit [ms]\n10;1;2;3;2,5\n").unwrap(), Some(vec![0.0025]));

    let missing = times(&foreign().time("Zeit"), "X,Pl,Pr,F\n10,1,2,3\n").unwrap_err().to_string();
    assert_eq!(missing, "bench.csv:1: column `Zeit` does not exist; the columns are `X`, `Pl`, `Pr`, `F`");
    let headless = times(&foreign(), "10,1,2.5,3\n12,1,2,3\n").unwrap_err().to_string();
    assert!(headless.contains("`2.5`, `3`: numbers; where no line names the columns"), "{headless}");
    let other = times(&foreign().time("Zeit"), "X,Pl,Pr,F,Zeit\n10,1,2,3,14:03:25\n11,1,2,3,4\n");
    assert!(other.unwrap_err().to_string().starts_with("bench.csv:3:5: `4` is written in another way"));
}

/// Returns a flag of each untouched row, and the remarks on the file.
fn untouched(columns: &Columns, text: &str) -> Result<(Vec<bool>, String), String> {
    let recording = read_as(columns, text.as_bytes()).map_err(|error| error.to_string())?;
    let said = recording.provenance.dialects.iter().map(ToString::to_string).collect();
    Ok((recording.rows.iter().map(|row| !row.touches()).collect(), said))
}

#[test]
fn untouched_rows_are_marked_by_force_column_or_time_or_found() {
    // By force 0, at any position.
    let text = "X,Pl,Pr,F\n10,1,2,3\n-5,1,2,0\n,1,2,0.0\n";
    let said = "1 row without a position, taken as untouched".to_owned();
    assert_eq!(untouched(&foreign(), text), Ok((vec![false, true, true], said)));
    // By a missing position, with or without a column of forces.
    let said = "2 rows without a position, taken as untouched".to_owned();
    let expected = Ok((vec![true, false, true], said));
    assert_eq!(untouched(&foreign(), "X,Pl,Pr,F\n,1,2,\n10,1,2,3\n,1,2,0\n"), expected);
    let columns = Columns { force: None, ..foreign() };
    assert_eq!(untouched(&columns, "X,Pl,Pr\n,1,2\n10,1,2\n,1,2\n"), expected);
    // By a column, for any reading of the load cell.
    let marked = Columns { untouched: Some(named("leer")), ..foreign() };
    let text = "X,Pl,Pr,F,leer\n10,1,2,0.02,ja\n10,1,2,3,\n,1,2,,1\n10,1,2,3,0\n";
    assert_eq!(untouched(&marked, text), Ok((vec![true, false, true, false], String::new())));
    // By time.
    let spans = ["0 s..1 s", "3 s.."].map(|span| span.parse().unwrap()).to_vec();
    let timed = Columns { untouched_times: spans, ..foreign() }.time("t");
    let text = "X,Pl,Pr,F,t\n10,1,2,0.1,0\n10,1,2,3,2\n11,1,2,,3\n";
    assert_eq!(untouched(&timed, text), Ok((vec![true, false, true], String::new())));
}

#[test]
fn invalid_marks_of_untouched_rows_are_refused() {
    let marked = Columns { untouched: Some(named("empty")), ..foreign() };
    let spans = vec!["95 s..".parse().unwrap()];
    let timed = Columns { untouched_times: spans, ..foreign() };
    let refused = [
        untouched(&marked, "X,Pl,Pr,F,empty\n10,1,2,3,perhaps\n"),
        untouched(&marked, "X,Pl,Pr,F\n10,1,2,3\n"),
        untouched(&timed, "X,Pl,Pr,F\n10,1,2,3\n"),
        untouched(&timed, "X,Pl,Pr,F,time_s\n10,1,2,3,0\n10,1,2,3,60\n"),
        untouched(&foreign(), "X,Pl,Pr,F\n,1,2,3\n"),
        untouched(&foreign(), "X,Pl,Pr,F\n10,1,2,\n"),
    ];
    insta::assert_snapshot!(refused.map(Result::unwrap_err).join("\n"));
}

/// A spreadsheet's export of a bench with `foreign` columns, and the same numbers as plain CSV.
const EXPORT: &str = "\u{feff}\"X [mm]\";\"Pl / mV\";\"Pr (mV)\";\"F [N]\";Zeit\r\n\
     10,5;0,1;-2,5e-3;1;03.04.2026 14:03:25,120\r\n\
     \"12\";1;3;2,25;03.04.2026 14:03:25,370\r\n;;;;\r\n;;;;\r\n";
const PLAIN: &str = "X,Pl,Pr,F,Zeit\n10.5,0.1,-2.5e-3,1,0\n12,1,3,2.25,0.25\n";

#[test]
fn a_spreadsheets_export_is_read_to_the_last_bit() {
    let columns = foreign().time("Zeit");
    let (export, plain) =
        (read_as(&columns, EXPORT.as_bytes()).unwrap(), read_as(&columns, PLAIN.as_bytes()).unwrap());
    assert_eq!(export.rows, plain.rows);
    assert_eq!(plain.provenance.dialects, []);
    let said = |recording: &Recording| recording.provenance.dialects[0].to_string();
    assert_eq!(said(&export), "semicolons, decimal commas, units in the header");

    let tabs = EXPORT.replace(';', "\t");
    let tabs = read_as(&columns, tabs.as_bytes()).unwrap();
    assert_eq!(
        (said(&tabs).as_str(), &tabs.rows),
        ("tabs, decimal commas, units in the header", &plain.rows)
    );

    let mut parser = ReadingParser::new("stdin", &foreign());
    let readings: Vec<_> =
        EXPORT.split_inclusive('\n').map(|line| parser.parse_line(line.as_bytes()).unwrap()).collect();
    let row = |i: usize| Some(plain.rows[i].reading.clone());
    assert_eq!(readings, [None, row(0), row(1), None, None]);
    assert_eq!(parser.progress().dialect().to_string(), "semicolons, decimal commas, units in the header");
}

#[test]
fn files_as_people_have_them_are_read() {
    let first = |text: &[u8]| {
        let recording = read_as(&foreign(), text).unwrap();
        let said = recording.provenance.dialects.first().map_or_else(String::new, Dialect::to_string);
        (recording.rows[0].position.x_m, recording.rows[0].reading.clone(), said)
    };
    let plain = |said: &str| (0.01, vec![1.5, 2.0], said.to_owned());
    assert_eq!(first(b"sep=;\r\nX;Pl;Pr;F\r\n10;1,5;2;3\r\n"), plain("semicolons, decimal commas"));
    assert_eq!(first(b";;;\nX;Pl;Pr;F;\n10;1.5;2;3;\n"), plain("semicolons"));
    assert_eq!(first(b"X,Pl,Pr,F\n10,\"1,5\",2,3,,\n"), plain("decimal commas"));
    assert_eq!(first(b"X,Pl,Pr,F\n10,1.5,2,3\n,,,\n"), plain(""));
    assert_eq!(first(b"# made\r#,X,Pl,Pr,F\r1,10,1.5,2,3\r"), plain(""));
    let old = b"Stra\xdfe;X, mm;Pl;Pr;F in N\n1;10;1,5;2;3\n";
    assert_eq!(first(old), plain("semicolons, decimal commas, units in the header, Windows-1252 text"));
    // Without a header.
    let layout = Layout::even(SensorKind::Raw, 2, 0.1);
    let extent = Extent::plane(0.1, 0.1).unwrap();
    let columns = numbered();
    let schema = Schema { columns: &columns, layout: &layout, extent, known_force_n: None };
    let rows = read("", &b"0,5;1,5;2;3\n"[..], &schema).unwrap().rows;
    assert_eq!((rows[0].position.x_m, rows[0].reading.as_slice()), (0.0015, &[1.5, 3.0][..]));
}

#[test]
fn ambiguous_marks_are_refused_at_their_place() {
    let with = |separator, decimal| Columns { separator, decimal, ..foreign() };
    let cases: [(Columns, &[u8]); 15] = [
        (foreign(), b"X [cm],Pl,Pr,F\n1,2,3,4\n"),
        (foreign(), b"X,Pl,Pr,F [kg]\n1,2,3,4\n"),
        (foreign(), b"X (left),X (right),Pl,Pr,F\n1,1,2,3,4\n"),
        (foreign(), b"X,Pl,Pr,F,;X;Pl;Pr;F\n1,2,3,4\n"),
        (foreign(), b"X;Pl;Pr;F,G\n1;2;3;4\n"),
        (foreign(), b"X,Pl,Pr,F\n10,\"1,234\",2,3\n"),
        (foreign(), b"X,Pl,Pr,F\n10,5,1,25,2,5,3,0\n"),
        (foreign(), b"X;Pl;Pr;F\n10;1,5;2;3\n10;1.5;2;3\n"),
        (foreign(), b"X;Pl;Pr;F\n10;1.234;2;3\n10;1,5;2;3\n"),
        (foreign(), b"X;Pl;Pr;F\n10;1.234,5;2;3\n"),
        (foreign(), b"X,Pl,Pr,F\n10,\x81,2,3\n"),
        (foreign(), b"\xff\xfeX\0,\0P\0l\0\n\0"),
        (with(None, Some(Decimal::Point)), b"X;Pl;Pr;F\n10;1,5;2;3\n"),
        (with(None, Some(Decimal::Comma)), b"X;Pl;Pr;F\n10;1.5;2;3\n"),
        (with(Some(Separator::Comma), None), b"X;Pl;Pr;F\n10;1,5;2;3\n"),
    ];
    let messages = cases.map(|(columns, text)| pointed(&read_as(&columns, text).unwrap_err()));
    insta::assert_snapshot!(messages.join("\n"));

    // A decimal mark in the rig removes the ambiguity.
    let said = with(Some(Separator::Comma), Some(Decimal::Comma));
    let rows = read_as(&said, b"X,Pl,Pr,F\n10,\"1,234\",2,3\n").unwrap().rows;
    assert_eq!(rows[0].reading, [1.234, 2.0]);
    // Units agree with the rig in another notation. Parentheses, and a heading given in full by the rig, may
    // contain any text.
    assert!(read_as(&foreign(), b"X / mm,Pl (left),Pr [V],F (front)\n1,2,3,4\n").is_ok());
    let written_out = Columns { position: PositionColumns::Along(named("X [div]")), ..foreign() };
    assert!(read_as(&written_out, b"X [div],Pl,Pr,F\n1,2,3,4\n").is_ok());
}

#[test]
fn readings_and_contacts_in_two_files_without_headers_pair_row_by_row() {
    let layout = Layout::even(SensorKind::Raw, 2, 0.1);
    let extent = Extent::plane(0.1, 0.1).unwrap();
    let columns = numbered();
    let schema = Schema { columns: &columns, layout: &layout, extent, known_force_n: Some(2.0) };
    let readings = "1.0,7,8,9\n1.1,5,6,7\n";
    let contacts = "1.0,10,20,0\n1.1,30,40,0\n";
    let pair =
        |contacts: &str| read_pair(("r.csv", readings.as_bytes()), ("c.csv", contacts.as_bytes()), &schema);
    let recording = pair(contacts).unwrap();
    assert_eq!(recording.rows[1].position, Position { x_m: 0.03, y_m: 0.04 });
    assert_eq!(recording.rows[1].reading, [5.0, 7.0]);
    assert_eq!(recording.rows[1].contact().map(|contact| contact.force_n), Some(2.0));
    assert_eq!(recording.provenance.digests.len(), 2);
    let message = pair("1.0,10,20,0\n").unwrap_err().to_string();
    assert_eq!(message, "c.csv: found 2 readings and 1 contacts; their numbers must be equal");
}

#[test]
fn columns_survive_json() {
    for columns in [foreign(), numbered()] {
        let json = serde_json::to_string(&columns).unwrap();
        assert_eq!(serde_json::from_str::<Columns>(&json).unwrap(), columns, "{json}");
    }
}

/// Returns the message and the line, marked at the place of the error.
fn pointed(error: &CsvError) -> String {
    let Some(place) = &error.place else { return error.to_string() };
    let before = place.text.get(..place.span.start).unwrap().chars().count();
    let marked = place.text.get(place.span.clone()).unwrap().chars().count();
    format!("{error}\n  {}\n  {}{}", place.text, " ".repeat(before), "^".repeat(marked.max(1)))
}

#[test]
fn a_bad_file_is_refused_with_line_and_column() {
    let bad: [&[u8]; 14] = [
        b"",
        b"\n  \n",
        b"X,Pl,Pr,F\n",
        b"X,Pl,F\n10,1,2\n",
        b"X,Pl,Pr,F,Pl\n10,1,2,3,4\n",
        b"X,Pl,Pr,F\n10,1,2,3\n12,1,two,3\n",
        b"X,Pl,Pr,F\n10,1,NaN,3\n",
        b"X,Pl,Pr,F\n10, inf ,2,3\n",
        b"X,Pl,Pr,F\n10,1e999,2,3\n",
        b"X,Pl,Pr,F\n110,1,2,3\n",
        b"X,Pl,Pr,F\n10,1,2\n",
        b"X,Pl,Pr,F\n10,1,2,\n",
        b"X,Pl,Pr,F\n10,1,\"2,3\n",
        b"X,Pl,Pr,F\n10,1,\xff,3\n",
    ];
    let messages: Vec<String> =
        bad.iter().map(|bytes| pointed(&read_as(&foreign(), bytes).unwrap_err())).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_file_without_a_header_is_refused_with_line_and_column() {
    let names = Columns { header: Header::Absent, ..foreign() };
    let along = PositionColumns::Along(Column::Number(5));
    let beyond = Columns { position: along, ..numbered() };
    let messages = [names, beyond].map(|columns| pointed(&read_as(&columns, b"1,2,3,4\n").unwrap_err()));
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_stream_goes_on_after_a_bad_line() {
    let mut parser = ReadingParser::new("stdin", &foreign());
    assert!(parser.progress().awaits_columns());
    assert_eq!(parser.parse_line(b"Pr,time,Pl\r\n").unwrap(), None);
    assert!(!parser.progress().awaits_columns());
    assert_eq!(parser.parse_line(b"2,0,1\r\n").unwrap(), Some(vec![1.0, 2.0]));
    assert_eq!(parser.parse_line(b"\n").unwrap(), None);
    let error = parser.parse_line(b"nan,0,1\n").unwrap_err();
    assert_eq!(error.to_string(), "stdin:4:1: `nan` is not a finite number");
    assert_eq!(
        parser.parse_line(b"2,1").unwrap_err().to_string(),
        "stdin:5: the row has 2 fields; it must have 3"
    );
    assert_eq!(parser.parse_line(b"4,0,3").unwrap(), Some(vec![3.0, 4.0]));

    let mut parser = ReadingParser::new("stdin", &numbered());
    assert_eq!(parser.parse_line(b"0,1,2,3").unwrap(), Some(vec![1.0, 3.0]));
    assert!(parser.parse_line(b"0,1,2").is_err());
}

#[test]
fn folds_hold_out_every_position_once_with_all_its_rows() {
    let text: String = (0..23).map(|i| format!("{},{i},0,1\n", (i * 7) % 11)).collect();
    let recording = read_as(&foreign(), format!("X,Pl,Pr,F\n{text}").as_bytes()).unwrap();
    let folds = recording.folds(5).unwrap();
    let mut seen = vec![0; 23];
    for (k, fold) in folds.iter().enumerate() {
        assert_eq!(fold.training.len() + fold.held_out.len(), 23);
        for row in &fold.held_out {
            seen[*row] += 1;
            assert_eq!((row * 7) % 11 % 5, k);
        }
    }
    assert_eq!(seen, [1; 23]);
    assert_eq!(recording.subset(&folds[0].held_out).distinct_positions().len(), 3);
    assert_eq!(recording.folds(12), Err(TooFewPositions { found: 11, needed: 12 }));
}

/// Two channels at ten positions in five sweeps, with a ripple as noise.
fn sweeps(reading: impl Fn(usize, usize) -> f64) -> Recording {
    let rows = (0..50).map(|row| Row {
        position: Position::along(0.01 * (row % 10) as f64),
        force_n: None,
        nuisances: Vec::new(),
        time_s: None,
        reading: vec![(row % 10) as f64 + 0.001 * ((row * 7919) % 13) as f64, reading(row % 10, row / 10)],
    });
    let provenance = Provenance {
        source: "sweeps".to_owned(),
        rows: 50,
        digests: Vec::new(),
        dialects: Vec::new(),
        repeats: None,
        seed: None,
        placement_sd_m: None,
        bench: None,
    };
    Recording {
        channels: vec!["good".to_owned(), "bad".to_owned()],
        kinds: vec![SensorKind::Raw; 2],
        rows: rows.collect(),
        provenance,
    }
}

#[test]
fn suspicious_channels_are_named() {
    let ripple = |position: usize, sweep: usize| 0.01 * ((position * 31 + sweep * 17) % 7) as f64;
    let dead = sweeps(|_, _| 0.25);
    let saturated = sweeps(|position, sweep| (position as f64 + ripple(position, sweep)).min(6.0));
    let disagreeing = sweeps(|position, sweep| {
        position as f64 + ripple(position, sweep) + if (position, sweep) == (3, 2) { 2.0 } else { 0.0 }
    });
    let drifting = sweeps(|position, sweep| position as f64 + ripple(position, sweep) + 0.1 * sweep as f64);
    let fine = sweeps(|position, sweep| position as f64 + ripple(position, sweep));
    let warnings = [dead, saturated, disagreeing, drifting, fine].map(|recording| recording.warnings());
    assert_eq!(warnings[4], []);
    let messages: Vec<String> = warnings.iter().flatten().map(Warning::to_string).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_slow_drift_is_no_disagreement_and_hides_none() {
    let ripple = |position: usize, sweep: usize| 0.01 * ((position * 31 + sweep * 17) % 7) as f64;
    let courses: [fn(f64) -> f64; 2] = [|t| 2.0 * t, |t| 2.0 * (3.0 * t).sin()];
    for course in courses {
        let drifting = |bad: f64| {
            sweeps(|position, sweep| {
                let of_row = if (position, sweep) == (3, 2) { bad } else { 0.0 };
                position as f64
                    + ripple(position, sweep)
                    + course((10 * sweep + position) as f64 / 50.0)
                    + of_row
            })
        };
        let disagreements = |recording: &Recording| {
            let warnings = recording.warnings().into_iter();
            warnings.filter(|warning| matches!(warning, Warning::RepeatsDisagree { .. })).collect::<Vec<_>>()
        };
        assert_eq!(disagreements(&drifting(0.0)), []);
        let found = disagreements(&drifting(0.5));
        let [Warning::RepeatsDisagree { rows: 1, worst_row: 24, deviation, .. }] = &found[..] else {
            panic!("{found:?}")
        };
        assert!((deviation.value - 0.5).abs() < 0.1, "{}", deviation.value);
    }
}

fn number() -> impl Strategy<Value = f64> {
    proptest::num::f64::NORMAL.prop_filter("what can be written in all units", |value| value.abs() < 1e290)
}

proptest! {
    #[test]
    fn a_recording_survives_writing_and_reading(
        rows in proptest::collection::vec((0.0..=0.1, number(), [number(), number()], [number(), number()]), 1..20),
        start_s in proptest::option::of(0.0..1e9),
        nuisances in 0..=2_usize,
    ) {
        let kind = SensorKind::Deflection;
        let layout = Layout::even(kind, 2, 0.1);
        let rows = rows.into_iter().enumerate().map(|(i, (x_m, force_n, reading, nuisance))| Row {
            position: Position::along(x_m),
            force_n: Some(force_n),
            nuisances: nuisance[..nuisances].to_vec(),
            time_s: start_s.map(|start_s| start_s + 0.1 * i as f64),
            reading: reading.to_vec(),
        });
        let rows: Vec<Row> = rows.collect();
        let recording = Recording::new(&layout, "", rows);
        let mut bytes = Vec::new();
        write(&recording, *STRIP, "a\ntest", &mut bytes).unwrap();
        let columns = Columns::own(&recording.channels, &recording.kinds, *STRIP);
        // Forces of all magnitudes do not resemble those of a load cell.
        let columns = Columns { force_zero_n: Some(0.0), ..columns };
        let columns = ["nuisance_1", "nuisance_2"][..nuisances].iter().fold(columns, |columns, name| columns.nuisance(*name, Unit::NONE));
        let schema = Schema { columns: &columns, layout: &layout, extent: *STRIP, known_force_n: None };
        prop_assert_eq!(read("", bytes.as_slice(), &schema).unwrap().rows, recording.rows);
    }

    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        never_panics(&bytes);
    }

    #[test]
    fn no_text_like_a_recording_panics(text in "(X,Pl,Pr,F\n)?([0-9.eE\"µ -]{0,4},?){0,6}\n([0-9a-f.\" ]{0,3},?\n?){0,20}") {
        never_panics(text.as_bytes());
    }
}

fn never_panics(bytes: &[u8]) {
    let _ = read_as(&numbered(), bytes).map(|recording| recording.warnings());
    if let Err(error) = read_as(&foreign(), bytes) {
        let _ = pointed(&error);
    }
    let mut parser = ReadingParser::new("", &foreign());
    let _ = parser.parse_line(b"Pl,Pr").and_then(|_| parser.parse_line(bytes));
    let _ = ReadingParser::new("", &foreign()).parse_line(bytes);
    let _ = ReadingParser::new("", &numbered()).parse_line(bytes);
}

#[test]
fn rows_without_contact_are_no_presses() {
    let mut recording = sweeps(|position, _| position as f64);
    let mut untouched = recording.rows[0].clone();
    untouched.position = Position::along(0.0);
    untouched.force_n = Some(0.0);
    recording.rows.push(untouched);
    assert_eq!((recording.distinct_positions().len(), recording.touched().rows.len()), (10, 50));
    assert_eq!(recording.touched().provenance, recording.provenance);
    for fold in recording.folds(2).unwrap() {
        assert!(fold.training.contains(&50) && !fold.held_out.contains(&50));
    }
}

#[test]
fn drift_of_untouched_rows_is_named_and_channels_share_a_line() {
    let count = 11;
    let layout = Layout::even(SensorKind::Raw, count, 0.1);
    let row = |i: usize, touched: bool| Row {
        position: Position::along(if touched { 0.01 * (i % 10) as f64 } else { 0.0 }),
        force_n: Some(if touched { 1.0 } else { 0.0 }),
        nuisances: Vec::new(),
        time_s: None,
        reading: (0..count)
            .map(|c| {
                let ripple = 0.01 * ((i * 31 + c * 17) % 7) as f64;
                ripple + if touched { (i % 10 + c) as f64 } else { 0.05 * i as f64 }
            })
            .collect(),
    };
    let rows = (0..100).map(|i| row(i, false)).chain((0..50).map(|i| row(i, true)));
    let recording = Recording::new(&layout, "drifting", rows.collect());
    insta::assert_snapshot!(recording.warning_lines().join("\n"));
}

type Course = fn(f64) -> f64;

#[test]
fn drift_alone_is_one_warning() {
    let layout = Layout::even(SensorKind::Raw, 2, 0.1);
    let courses: [(&str, Course); 4] = [
        ("linear", |at| 20.0 * at),
        ("quadratic", |at| 20.0 * at * at),
        ("settling", |at| 20.0 * (1.0 - (-at / 0.2).exp())),
        ("there and back", |at| 20.0 * (std::f64::consts::TAU * at).sin()),
    ];
    // Rows that drift, and presses of each place among the untouched rows.
    let benches = [("all rows", true, 2), ("untouched rows", false, 2), ("single presses", true, 1)];
    for (course, drift) in courses {
        for (bench, presses_drift, repeats) in benches {
            for count in [60, 400] {
                let row = |i: usize| {
                    let touched = i % 3 == 1;
                    let place = (i / 3) % (count / 3 / repeats);
                    let noise = 0.02 * (((i * 7919) % 97) as f64 / 48.0 - 1.0);
                    let course = if touched && !presses_drift { 0.0 } else { drift(i as f64 / count as f64) };
                    let press = if touched { 50.0 + 3.0 * place as f64 } else { 0.0 };
                    Row {
                        position: Position::along(if touched { 0.0001 * place as f64 } else { 0.0 }),
                        force_n: Some(if touched { 1.0 } else { 0.0 }),
                        nuisances: Vec::new(),
                        time_s: None,
                        reading: vec![press + course + noise, 2.0 * press - course + noise],
                    }
                };
                let recording = Recording::new(&layout, "drifting", (0..count).map(row).collect());
                let lines = recording.warning_lines();
                assert_eq!(lines.len(), 1, "{course}, {bench}, {count}: {lines:#?}");
                assert!(lines[0].contains("drift"), "{course}, {bench}, {count}: {lines:#?}");
                // A bad row among them is still detected.
                let mut bad = recording.clone();
                bad.rows[count / 2 / 3 * 3].reading[0] += 30.0;
                let lines = bad.warning_lines();
                assert_eq!(lines.len(), 2, "{course}, {bench}, {count}: {lines:#?}");
            }
        }
    }
}

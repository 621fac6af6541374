//! Tests with files of loggers and spreadsheets.

use super::*;
use palpate_mechanics::surface::Extent;
use proptest::prelude::*;

/// Four channels of a strip; the other files contain equal numbers.
const BASE: &str = include_str!("../../tests/data/field/base.csv");
const DUPLICATES: &[u8] = include_bytes!("../../tests/data/field/dup.csv");
const UNITS_ROW: &[u8] = include_bytes!("../../tests/data/field/units-row.csv");
const LABVIEW: &[u8] = include_bytes!("../../tests/data/field/press.lvm");
const TABS: &str = include_str!("../../tests/data/field/tabs.txt");
const ZERO_NOISE: &[u8] = include_bytes!("../../tests/data/field/zero-noise.csv");
const NEGATIVE: &[u8] = include_bytes!("../../tests/data/field/negforce.csv");

const HEADING: &str = "Position,Force,S1,S2,S3,S4";

fn columns<C: Into<Column> + Clone>(position: C, force: C, channels: [C; 4]) -> Columns {
    Columns { header: Header::Present, ..Columns::along(position, channels).force(force) }
}

fn titled() -> Columns {
    columns("Position", "Force", ["S1", "S2", "S3", "S4"])
}

fn own() -> Columns {
    columns("position_mm", "force_n", ["S1", "S2", "S3", "S4"])
}

fn read_as(columns: &Columns, text: &[u8]) -> Result<(Recording, String), String> {
    let layout = Layout::even(SensorKind::Raw, 4, 0.1);
    let extent = Extent::line(0.1).unwrap();
    let schema = Schema { columns, layout: &layout, extent, known_force_n: None };
    let recording = read("press.csv", text, &schema).map_err(|error| error.to_string())?;
    let said = recording.provenance.dialects.iter().map(ToString::to_string).collect();
    Ok((recording, said))
}

fn said(columns: &Columns, text: &str) -> String {
    read_as(columns, text.as_bytes()).map_or_else(|error| error, |(_, said)| said)
}

fn dressed(above: &str, heading: &str, separator: char, below: &str) -> String {
    let separated = |line: &str| line.replace(',', &separator.to_string()) + "\n";
    let rows: String = BASE.lines().skip(1).map(separated).collect();
    format!("{above}{}{rows}{below}", separated(heading))
}

fn utf16() -> Vec<u8> {
    let text = format!("\u{feff}{}", TABS.replace('\n', "\r\n"));
    text.encode_utf16().flat_map(u16::to_le_bytes).collect()
}

#[test]
fn files_of_loggers_are_the_plain_file() {
    let plain = read_as(&own(), BASE.as_bytes()).unwrap().0.rows;
    let numbered = columns(1, 2, [3, 4, 5, 6]);
    for (name, columns, text) in [
        ("units row", titled(), UNITS_ROW),
        ("LabVIEW", titled(), LABVIEW),
        ("UTF-16", titled(), &utf16()),
        ("numbers for duplicates", numbered.clone(), DUPLICATES),
        ("numbers below a preamble", numbered.clone(), LABVIEW),
        ("numbers and a units row", numbered, UNITS_ROW),
    ] {
        let (recording, _) = read_as(&columns, text).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(recording.rows, plain, "{name}");
    }
}

#[test]
fn skipped_lines_are_reported() {
    let of = |above: &str, heading: &str, separator, below: &str| {
        said(&titled(), &dressed(above, heading, separator, below))
    };
    let cases = [
        read_as(&titled(), UNITS_ROW).unwrap().1,
        read_as(&titled(), LABVIEW).unwrap().1,
        read_as(&titled(), &utf16()).unwrap().1,
        of("", HEADING, '|', ""),
        of("", HEADING, ',', "Total,,7000,8000,9000,9900\n"),
        of("", HEADING, ',', "\nEnd of file\n"),
        of("", HEADING, ',', "Rows,69\n# done\n"),
        of("", HEADING, ';', ";;;;;\nMittelwert;;1;2;3;4\nSumme:;;1;2;3;4\n"),
        of("Run #1,Run #1,Run #1,Run #1,Run #1,Run #1\n", HEADING, ',', ""),
        of("", &format!("{HEADING}\nRun 1"), ',', "Run 2\n60,1,1,2,3,4\n"),
        of("Messung vom 3.4.;;;;;\n\nBank:;A;;;;\n", HEADING, ';', ""),
        of("sep=|\n", HEADING, '|', &format!("{}\n", HEADING.replace(',', "|"))),
        of("", &format!("{HEADING}\nmm,N,mV,mV,mV,mV"), ',', ""),
    ];
    insta::assert_snapshot!(cases.join("\n"));
}

#[test]
fn lines_that_may_be_rows_are_refused() {
    let of = |heading: &str, below: &str| said(&titled(), &dressed("", heading, ',', below));
    let cases = [
        of(&format!("{HEADING}\n[cm],[N],[mV],[mV],[mV],[mV]"), ""),
        of("Position,Force,S1,S2,S2,S4", ""),
        of("Position,Force,S1,S2,s3,S4", ""),
        of(HEADING, "60,1,#N/A,#N/A,#N/A,#N/A\n"),
        of(HEADING, ",,ERR,ERR,ERR,ERR\n"),
        of(HEADING, "60,1,12\n"),
        of(HEADING, "60,1,x,2,3,4\n"),
        of(HEADING, "60,one,1,2,3,4\n"),
        said(&titled(), "Position Force S1 S2 S3 S4\n60 1 1 2 3 4\n 1 1 2 3 4\n"),
        said(&titled(), "A title\nPosition,Force,S1,S2,S5,S4\n60,1,1,2,3,4\n"),
        said(&titled(), "Words\nand words\n"),
    ];
    insta::assert_snapshot!(cases.join("\n"));
}

#[test]
fn blanks_separate_fields_as_in_frames() {
    let columns = titled();
    let first = |text: &str| {
        let (recording, said) = read_as(&columns, text.as_bytes()).unwrap();
        (recording.rows[0].reading.clone(), said)
    };
    let reading = || vec![1.5, 2.0, 3.0, 4.0];
    assert_eq!(
        first("Position [mm]  Force [N]  S1 S2   S3  S4\n  10  1  1.5  2 3 \t 4\n"),
        (reading(), "blanks, units in the header".to_owned())
    );
    assert_eq!(
        first("Position Force S1 S2 S3 S4\n[mm] [N] [V] [V] [V] [V]\n10 1 1,5 2 3 4\n"),
        (reading(), "blanks, decimal commas, units on line 2".to_owned())
    );
    let numbered = Columns { header: Header::Absent, ..self::columns(1, 2, [3, 4, 5, 6]) };
    for text in ["10 1 1,5 2 3 4\n", "10 1 1.5 2 3 4\n", "10, 1, 1.5, 2, 3, 4\n", "10|1|1,5|2|3|4\n"] {
        assert_eq!(read_as(&numbered, text.as_bytes()).unwrap().0.rows[0].reading, reading(), "{text}");
    }
}

#[test]
fn marks_that_may_be_of_thousands_are_refused_with_both_readings() {
    let of = |separator: char, numbers: &[&str]| {
        let rows: String = numbers.iter().map(|number| format!("10;1;{number};1;1;1\n")).collect();
        let text = format!("{HEADING}\n{rows}").replace([',', ';'], &separator.to_string());
        said(&titled(), &text.replace('_', ","))
    };
    let cases = [
        of(',', &["503", "998", "1.003"]),
        of(';', &["503", "998", "1.003"]),
        of(';', &["1_003", "503"]),
        of('\t', &["-1.003", "503", "-20"]),
        of(';', &["503", "1.003_5"]),
        of(',', &["503", "1.003", "1.5"]),
        of(',', &["503", "1.003", "1503"]),
        of(',', &["100", "103.125", "109.375"]),
        of(',', &["1.003", "1.998"]),
        of(',', &["0", "1.003", "1.998"]),
    ];
    insta::assert_snapshot!(cases.join("\n"));
    // A decimal mark in another column does not decide.
    let beside = said(&titled(), &format!("{HEADING}\n10.5,1,503,1,1,1\n10.5,1,1.003,1,1,1\n"));
    assert!(beside.contains("may be 1003 or 1.003"), "{beside}");
    let point = Columns { decimal: Some(Decimal::Point), ..titled() };
    let text = format!("{HEADING}\n10,1,503,1,1,1\n10,1,1.003,1,1,1\n");
    assert_eq!(read_as(&point, text.as_bytes()).unwrap().0.rows[1].reading[0], 1.003);
    let mut parser = ReadingParser::new("stdin", &titled());
    let lines: Vec<bool> = text.lines().map(|line| parser.parse_line(line.as_bytes()).is_ok()).collect();
    assert_eq!(lines, [true, true, false]);
}

#[test]
fn a_stream_finds_its_heading_and_loses_no_line_in_silence() {
    let mut parser = ReadingParser::new("stdin", &titled());
    let lines = LABVIEW.split_inclusive(|byte| *byte == b'\n');
    let readings = lines.filter_map(|line| parser.parse_line(line).unwrap()).count();
    assert_eq!(readings, 69);
    for line in ["boot", "V", "Run\t2", "\t\t\t\t\t\tboot"] {
        assert!(parser.parse_line(line.as_bytes()).is_err(), "{line}");
    }

    let mut parser = ReadingParser::new("stdin", &titled());
    assert_eq!(parser.parse_line(b"S1,S2,S3,S5").unwrap(), None);
    let error = parser.parse_line(b"1,2,3,4").unwrap_err().to_string();
    assert!(error.starts_with("stdin:1: column `S4` does not exist"), "{error}");
    assert!(parser.progress().awaits_columns());

    let mut parser = ReadingParser::new("stdin", &titled());
    let refused = (0..1000).position(|_| parser.parse_line(b"no, heading").is_err());
    assert_eq!(refused, Some(199));
}

/// Remarks on the base recording with changed forces; asserts correct untouched rows, if any.
fn with_forces(force: impl Fn(f64, usize) -> String, place: &str) -> String {
    let mut text = BASE.lines().next().unwrap().to_owned() + "\n";
    let mut expected = Vec::new();
    for (i, row) in BASE.lines().skip(1).enumerate() {
        let fields: Vec<&str> = row.split(',').collect();
        let force_n: f64 = fields[1].parse().unwrap();
        expected.push(force_n == 0.0);
        let place = if force_n == 0.0 { place } else { fields[0] };
        text += &format!("{place},{},{}\n", force(force_n, i), fields[2..].join(","));
    }
    match read_as(&own(), text.as_bytes()) {
        Ok((recording, said)) => {
            let untouched: Vec<bool> = recording.rows.iter().map(|row| !row.touches()).collect();
            assert!(untouched == expected || !untouched.contains(&true), "{said}");
            said
        }
        Err(error) => error,
    }
}

fn touches(recording: &Recording) -> Vec<bool> {
    recording.rows.iter().map(Row::touches).collect()
}

#[test]
fn forces_that_are_0_but_for_noise_are_untouched() {
    let (recording, said) = read_as(&own(), ZERO_NOISE).unwrap();
    assert!(said.contains("`force_zero = \""), "{said}");
    let pressed: Vec<bool> = recording.rows.iter().map(|row| row.position.x_m > 0.0).collect();
    assert_eq!(touches(&recording), pressed);
    let noise = |i: usize| 0.01 * ((i * 7919 % 13) as f64 - 6.5) / 3.0;
    let noisy = |force_n: f64, i| format!("{:.4}", force_n + noise(i));
    let cases = [
        with_forces(noisy, ""),
        with_forces(noisy, "50"),
        // An offset of the load cell.
        with_forces(|force_n, i| noisy(force_n + 0.03, i), ""),
        // Forces of noise only.
        with_forces(|_, i| noisy(0.0, i), "50"),
    ];
    insta::assert_snapshot!(cases.join("\n"));
}

#[test]
fn light_presses_are_no_untouched_rows() {
    // Presses of 1 N become presses of 0.02 N, with readings to match.
    let baseline = [100.0, 200.0, 300.0, 400.0];
    let mut text = String::new();
    for row in BASE.lines() {
        let fields: Vec<&str> = row.split(',').collect();
        match fields[1] {
            "0.0" => {}
            "1.0" => {
                let pressed = |i: usize| fields[i + 2].parse::<f64>().unwrap() - baseline[i];
                let reading: Vec<String> =
                    (0..4).map(|i| (baseline[i] + 0.02 * pressed(i)).to_string()).collect();
                text += &format!("{},0.02,{}\n", fields[0], reading.join(","));
            }
            _ => text += &format!("{row}\n"),
        }
    }
    let (recording, said) = read_as(&own(), text.as_bytes()).unwrap();
    assert!(recording.rows.iter().all(Row::touches) && said.is_empty(), "{said}");
}

#[test]
fn rows_without_a_header_are_all_rows() {
    let numbered = Columns { header: Header::Absent, ..columns(1, 2, [3, 4, 5, 6]) };
    let recording = read_as(&numbered, b"10,1,1,2,3,4,left\n10,1,1,2,3,4,left\n").unwrap().0;
    assert_eq!(recording.rows.len(), 2);
    assert!(read_as(&numbered, b"10,1,1,2,3,4\nTotal,1,1,2,3,4\n").is_err());
}

#[test]
fn the_rig_decides_which_forces_are_0() {
    let with = |force_zero_n| Columns { force_zero_n: Some(force_zero_n), ..own() };
    let found = read_as(&own(), ZERO_NOISE).unwrap().0;
    assert_eq!(touches(&read_as(&with(0.05), ZERO_NOISE).unwrap().0), touches(&found));
    let refused = read_as(&with(0.0), ZERO_NOISE).unwrap_err();
    assert!(refused.contains("the field is empty"), "{refused}");
    let text = "position_mm,force_n,S1,S2,S3,S4\n10,0.4,1,2,3,4\n20,0.6,1,2,3,4\n";
    assert_eq!(touches(&read_as(&with(0.5), text.as_bytes()).unwrap().0), [false, true]);
}

#[test]
fn forces_of_the_wrong_sign_are_warned_of() {
    let warnings = |forces: [&str; 3]| {
        let rows = forces.iter().enumerate().map(|(i, force)| format!("{},{force},{i},2,3,4\n", 10 * i));
        let text = format!("position_mm,force_n,S1,S2,S3,S4\n{}", rows.collect::<String>());
        let warnings = read_as(&own(), text.as_bytes()).unwrap().0.warnings();
        warnings.iter().map(ToString::to_string).find(|warning| warning.contains("force")).unwrap_or_default()
    };
    let negative = read_as(&own(), NEGATIVE).unwrap().0.warnings();
    let negative: Vec<String> = negative.iter().map(ToString::to_string).collect();
    let signs = [["0", "0", "0"], ["-1", "2", "3"], ["0", "2", "3"]].map(warnings);
    insta::assert_snapshot!([negative.join("\n"), signs.join("\n")].join("\n"));
}

#[test]
fn warnings_have_all_digits_of_a_reading() {
    let row = |i: i64| {
        let saturated = 8_388_607.min(8_388_600 + i);
        format!("{},1,{saturated},-8388608,0.1234567,{}\n", i % 5 * 10, i * i)
    };
    let text = format!("position_mm,force_n,S1,S2,S3,S4\n{}", (0..30).map(row).collect::<String>());
    let warnings = read_as(&own(), text.as_bytes()).unwrap().0.warnings();
    let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(warnings.join("\n"));
}

#[test]
fn tables_of_loggers_are_the_plain_table() {
    let base = Table::read("base.csv", BASE.as_bytes(), None, None).unwrap();
    for text in [UNITS_ROW, LABVIEW, &utf16()] {
        let table = Table::read("press.csv", text, None, None).unwrap();
        assert_eq!(table.rows, base.rows);
        assert!(table.columns[0].heading.starts_with("Position"), "{:?}", table.columns[0]);
        let contents = base.columns.iter().zip(&table.columns);
        contents.for_each(|(plain, column)| assert_eq!(column.numbers(), plain.numbers()));
    }
    let heading =
        |text: &[u8]| Table::read("press.csv", text, None, None).unwrap().columns[0].heading.clone();
    assert_eq!(heading(UNITS_ROW), "Position [mm]");
    assert_eq!(heading(b"Versuch;A;B\nOrt;S1;S2\nmm;mV;mV\n1;2;3\n4;5;6\n"), "Ort [mm]");
    assert_eq!(heading(b"Ort  S1  S2\n1 2 3\n4 5 6\n"), "Ort");
    assert_eq!(heading(b"Ort|S1|S2\n1,5|2|3\n4|5|6\n"), "Ort");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_file_of_a_logger_panics(
        text in "(Position,Force,S1,S2,S3,S4\n)?(X|S1|mm|\\[N\\]|Total|NaN|1\\.003|503|-0,01|0\\.5|5|3|;|\\||\t| |,|,|,|\n|\n|\"){0,80}"
    ) {
        let numbered = columns(1, 2, [3, 4, 1, 2]);
        let headless = Columns { header: Header::Absent, ..numbered.clone() };
        for columns in [titled(), numbered, headless] {
            if let Ok((recording, _)) = read_as(&columns, text.as_bytes()) {
                let _ = recording.warnings();
            }
            let mut parser = ReadingParser::new("stdin", &columns);
            let lines = text.split_inclusive('\n').map(|line| parser.parse_line(line.as_bytes()));
            let _ = lines.count();
            let _ = parser.progress().unfound();
        }
        let _ = Table::read("press.csv", text.as_bytes(), None, None);
    }

    #[test]
    fn forces_of_any_size_are_no_fault(forces in proptest::collection::vec((any::<bool>(), -300..300_i32, 0..9_u8), 1..40)) {
        let row = |(i, (is_placed, exponent, place)): (usize, &(bool, i32, u8))| {
            let place = if *is_placed { (10 * place).to_string() } else { String::new() };
            let sign = if i % 3 == 0 { "-" } else { "" };
            format!("{place},{sign}1e{exponent},{i},2,{},4\n", exponent * i as i32)
        };
        let rows: String = forces.iter().enumerate().map(row).collect();
        let text = format!("position_mm,force_n,S1,S2,S3,S4\n{rows}");
        if let Ok((recording, _)) = read_as(&own(), text.as_bytes()) {
            let zero = recording.provenance.dialects.iter().find_map(|dialect| dialect.zero_force);
            let untouched = recording.rows.iter().filter(|row| !row.touches()).count();
            prop_assert_eq!(untouched, zero.map_or(0, |zero| zero.rows));
        }
    }
}

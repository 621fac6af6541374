use super::*;

/// Thirty presses of a line, five times at six places; `row` formats place, force and number.
fn presses(heading: &str, row: impl Fn(f64, f64, usize) -> String) -> String {
    let rows = (0..30).map(|i| row(20.0 * (i % 6) as f64 + 10.0, 1.0 + (i % 4) as f64, i) + "\n");
    format!("{heading}\n{}", rows.collect::<String>())
}

fn guess(text: &str, hints: &Hints) -> Result<FirstRig, FirstRigError> {
    FirstRig::infer("presses.csv", text.as_bytes(), hints)
}

/// Reads the guessed rig.
fn rig(text: &str) -> Rig {
    Rig::from_toml(&guess(text, &Hints::default()).unwrap().to_toml("rig.toml")).unwrap()
}

fn summary(text: &str) -> String {
    guess(text, &Hints::default()).map_or_else(|error| error.to_string(), |first| first.summary())
}

#[test]
fn a_spreadsheets_export_becomes_a_rig() {
    let heading = "Nr.;Zeit;Position [mm];Kraft (N);Tiefe / mm;U1 [mV];U2 [mV];U3 [mV];Summe;Notiz;";
    let text = presses(heading, |x, force, i| {
        let comma = |value: f64| value.to_string().replace('.', ",");
        let signals = [0.5 + x * force, 0.25 - x, 7.0].map(comma).join(";");
        let depth = comma(0.5 * (i % 3) as f64);
        let note = if i == 4 { "schief, wiederholt" } else { "" };
        let (sum, x, force) = (comma(x * 2.0), comma(x), comma(force));
        format!("{};14:03:{i:02},5;{x};{force};{depth};{signals};{sum};{note};", i + 1)
    });
    let first = guess(&text, &Hints::default()).unwrap();
    insta::assert_snapshot!(format!("{}\n\n{}", first.summary(), first.to_toml("my rig.toml")));
    let rig = Rig::from_toml(&first.to_toml("")).unwrap();
    let recording = rig.setup.read_recording("presses.csv", text.as_bytes()).unwrap();
    assert_eq!((recording.rows.len(), recording.rows[3].time_s), (30, Some(3.0)));
}

#[test]
fn a_plain_plane_becomes_a_rig() {
    let text = presses("x_mm,y_mm,force_n,a,b", |x, force, i| {
        format!("{},{},{force},{},{}", x - 200.0, x * 0.5 + (i % 5) as f64, x * force, x - force)
    });
    let first = guess(&text, &Hints::default()).unwrap();
    insta::assert_snapshot!(format!("{}\n\n{}", first.summary(), first.to_toml("rig.toml")));
}

#[test]
fn columns_are_recognized_by_name_and_unit() {
    let named = |heading: &str| {
        let text = presses(heading, |x, force, i| format!("{x},{force},{},{}", x * force, i as f64 - x));
        summary(&text)
    };
    let lines = [
        "Ort,Last,S1,S2",
        "X-Position (cm),F,left,right",
        "pos_x,Fz [N],left,right",
        "Stelle in mm,applied force,S1,S2",
        "a [mm],b [N],S1,S2",
        "Abstand,F [kN],ch 1,ch 2",
        "Position,Kraft [kg],S1,S2",
        "Position,Frequenz,S1,S2",
        "Position [in],F,S1,S2",
        "Position,Ort,S1,S2",
        "links,rechts,oben,unten",
        "Position,Kraft,Nr,Tiefe",
    ];
    let told: Vec<String> = lines.iter().map(|heading| format!("{heading}: {}", named(heading))).collect();
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn hints_take_precedence_over_inference() {
    let text = presses("u,v,S1,S2", |x, force, i| format!("{x},{force},{},{i}", x * force));
    let named = |name: &str| Some(name.to_owned());
    let hints = Hints { position: named("u"), force: named("v"), ..Hints::default() };
    assert_eq!(guess(&text, &hints).unwrap().summary(), "position `u`, force `v`, 1 channel `S1`");
    let hints = Hints { channels: vec!["S2".to_owned()], ..hints };
    assert_eq!(guess(&text, &hints).unwrap().summary(), "position `u`, force `v`, 1 channel `S2`");
    let numbered = presses("1,2,3", |x, force, _| format!("{x},{force},{}", x * force));
    let hints = Hints { position: named("1"), force: named("2"), ..Hints::default() };
    let toml = guess(&numbered, &hints).unwrap().to_toml("");
    assert!(toml.contains("header = false") && toml.contains("channels = [3]"), "{toml}");

    let position = || Hints { position: named("Position"), ..Hints::default() };
    let refused = |text: &str, hints: Hints| guess(text, &hints).unwrap_err().to_string();
    let messages = [
        refused(&text, Hints::default()),
        refused(&text, Hints { position: named("w"), ..Hints::default() }),
        refused(&text, Hints { separator: Some(Separator::Semicolon), ..Hints::default() }),
        refused("Position;S1\n1;1.5\n2;2,5\n", Hints::default()),
        refused("Position;Kraft;S1\n1,5;1.5;3\n2;2.5;4\n", Hints::default()),
        refused("Position;S1\n5;1\n5;2\n", position()),
        refused("Position;S1\n5;1\n6;n/a\n", Hints { channels: vec!["S1".to_owned()], ..position() }),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn suspicious_channels_are_reported() {
    let text = presses("Position [mm],Force [N],S1,S2,S3,S4", |x, force, i| {
        let saturated = (x * force).min(100.0);
        let broken = if i == 7 { "NaN".to_owned() } else { x.to_string() };
        format!("{x},{force},{},{saturated},512,{broken}", x * force + i as f64)
    });
    let few = "Position,S1\n10,1\n20,2\n30,4\n10,1.5\n";
    let warnings =
        [text.as_str(), few].map(|text| guess(text, &Hints::default()).unwrap().warnings().join("\n"));
    insta::assert_snapshot!(warnings.join("\n---\n"));
}

#[test]
fn surfaces_are_inferred_from_their_presses() {
    let side = |low_m, high_m| {
        let Side { origin, size, .. } = Side::around(low_m, high_m);
        (origin, size)
    };
    let said = |origin: &str, size: &str| (origin.to_owned(), size.to_owned());
    assert_eq!(side(0.02, 0.28), said("0 mm", "300 mm"));
    assert_eq!(side(0.0, 0.0873), said("0 mm", "90 mm"));
    assert_eq!(side(-0.05, 0.05), said("-50 mm", "100 mm"));
    assert_eq!(side(1.274, 1.304), said("1274 mm", "30 mm"));
    assert_eq!(side(1e-6, 2e-5), said("0 mm", "0.021 mm"));
    assert_eq!(side(0.1, 35.0), said("0 mm", "36000 mm"));
    for (low_m, high_m) in [(-1e300, 1e300), (1e-320, 2e-320), (5.0, 5.0 + 1e-15), (1e9, 1e9 + 1e-3)] {
        let _ = Side::around(low_m, high_m);
    }
}

#[test]
fn headings_are_written_as_toml_and_comments() {
    let heading = "\"Ort \"\"A\"\" [mm]\",\"back\\slash\",c\u{7f}d";
    let text = presses(heading, |x, force, _| format!("{x},{force},{}", x * force));
    let hints = Hints { position: Some("Ort \"A\"".to_owned()), ..Hints::default() };
    let rig = Rig::from_toml(&guess(&text, &hints).unwrap().to_toml("a\nb")).unwrap();
    assert_eq!(rig.setup.layout().names(), ["back\\slash", "c\u{7f}d"]);
}

#[test]
fn inferred_rig_is_fitted() {
    use palpate_estimators::fit::Fit;

    let text = presses("Position [mm],Force [N],S1,S2", |x, force, i| {
        let noise = ((i * 7919) % 13) as f64 / 13.0;
        format!("{x},{force},{},{}", 500.0 + force * x + noise, 300.0 + force * (120.0 - x) - noise)
    });
    let rig = rig(&text);
    let recording = rig.setup.read_recording("presses.csv", text.as_bytes()).unwrap();
    let locator = rig.estimator.fit(&rig.setup, &recording).unwrap();
    let estimate = locator.locate(&recording.rows[8].reading).unwrap();
    assert!((estimate.contact.position.x_m - recording.rows[8].position.x_m).abs() < 2e-3);
}

#[test]
fn invalid_position_column_is_reported() {
    let of = |place: fn(usize) -> String| {
        let rows = (0..30).map(|i| format!("{},{},{}\n", place(i), i, i * i));
        summary(&format!("position_mm,S1,S2\n{}", rows.collect::<String>()))
    };
    assert_eq!(
        of(|_| "10".to_owned()),
        "column `position_mm` is 10 in every row; a rig needs presses at 2 positions or more"
    );
    assert_eq!(
        of(|i| if i == 7 { "left".to_owned() } else { i.to_string() }),
        "the position: column `position_mm` has `left` on line 9; every row must have a number"
    );
}

#[test]
fn very_many_columns_are_refused_and_not_all_listed() {
    let wide = |columns: usize| {
        let heading: Vec<String> = (0..columns).map(|i| format!("c{i}")).collect();
        let row = vec!["1"; columns].join(",");
        summary(&format!("{}\n{row}\n{row}\n", heading.join(",")))
    };
    assert_eq!(wide(200_000), "the file has 200000 columns; a rig is guessed for at most 10000");
    let listed = wide(150);
    assert!(listed.ends_with("`c99` (1 to 1), and 50 more"), "{listed}");
}

/// Messages and roles for a recording of four channels below a heading.
fn said_of_heading(heading: &str) -> String {
    let text = presses(heading, |x, force, i| {
        let noise = ((i * 7919) % 13) as f64 / 13.0;
        format!(
            "{x},{force},{},{},{},{}",
            x * force + noise,
            force - x + noise,
            force * 5.0 + noise,
            noise - x
        )
    });
    match guess(&text, &Hints::default()) {
        Ok(first) => {
            let toml = first.to_toml("rig.toml");
            let rig = Rig::from_toml(&toml).unwrap();
            let recording = rig.setup.read_recording("presses.csv", text.as_bytes()).unwrap();
            let channels =
                toml.lines().find(|line| line.starts_with("channels")).unwrap_or_default().to_owned();
            let warnings = first.warnings().join("\n  ");
            format!("{}\n  {channels}; {} rows\n  {warnings}", first.summary(), recording.rows.len())
        }
        Err(error) => error.to_string(),
    }
}

#[test]
fn columns_without_a_heading_are_named_by_number() {
    let headings = [
        "Position,Force,S1,S2,S2,S4",
        "Position,Force,S1,S2,,S4",
        "Position,Force,,,,",
        "Position,Force,S1,s1,S 2,S2",
        "Position,Position,S1,S2,S3,S4",
        "Position,Force,Force,S1,S2,S3",
        "Position [mm],Position [N],S1 [mV],S1 [V],S2,S3",
    ];
    insta::assert_snapshot!(
        headings.map(|heading| format!("{heading}\n  {}", said_of_heading(heading))).join("\n")
    );
}

#[test]
fn hints_name_columns_by_number() {
    let text = presses("Position,Force,Force,S1,S1", |x, force, i| {
        format!("{x},{force},{},{},{i}", 2.0 * force, x * force)
    });
    let named = |name: &str| Some(name.to_owned());
    let hints = Hints { force: named("3"), channels: vec!["5".to_owned()], ..Hints::default() };
    let toml = guess(&text, &hints).unwrap().to_toml("rig.toml");
    assert!(toml.contains("force = 3") && toml.contains("channels = [5]"), "{toml}");
    assert!(guess(&text, &Hints { force: named("6"), ..Hints::default() }).is_err());
}

#[test]
fn a_load_cell_that_is_never_0_is_written_down() {
    let pressed = presses("Position [cm],Force [kN],S1,S2", |x, force, i| {
        let noise = ((i * 7919) % 13) as f64 / 13.0;
        format!("{x},{},{},{}", 1e-3 * force, 100.0 + x * force + noise, 50.0 - x + noise)
    });
    let air = (0..12).map(|i| {
        let noise = ((i * 7919) % 13) as f64 - 6.2;
        format!("-80,{},{},{}\n", 3e-6 * noise, 100.0 + 0.08 * noise, 50.0 + 0.08 * noise)
    });
    let text = pressed + &air.collect::<String>();
    let toml = guess(&text, &Hints::default()).unwrap().to_toml("rig.toml");
    assert!(toml.contains("force_zero = \"0.2 N\""), "{toml}");
    // Rows in the air do not extend the surface.
    assert!(!toml.contains("origin"), "{toml}");
    let rig = Rig::from_toml(&toml).unwrap();
    let recording = rig.setup.read_recording("presses.csv", text.as_bytes()).unwrap();
    assert_eq!(recording.rows.iter().filter(|row| !row.touches()).count(), 12);
    assert_eq!(recording.provenance.dialects[0].zero_force, None);
}

#[test]
fn tables_below_a_preamble_become_rigs() {
    let table = presses("Ort\tKraft\tS1\tS2\n[mm]\t[N]\t[mV]\t[mV]", |x, force, i| {
        format!("{x}\t{force}\t{}\t{}", x * force + i as f64, force - x)
    });
    let text = format!("Bench\tB\n\nRate\t10 Hz\nNote\tby hand\n\n{table}");
    let first = guess(&text, &Hints::default()).unwrap();
    assert_eq!(first.summary(), "position `Ort [mm]`, force `Kraft [N]`, 2 channels `S1 [mV]` and `S2 [mV]`");
    let rig = rig(&text);
    let recording = rig.setup.read_recording("presses.csv", text.as_bytes()).unwrap();
    assert_eq!((recording.rows.len(), recording.rows[0].position.x_m), (30, 0.01));
    let thousands = presses("Ort;S1;S2", |x, _, i| format!("{x};{};1.{:03}", 503 + i, 3 + i)) + "10;5;900\n";
    let error = guess(&thousands, &Hints::default()).unwrap_err();
    assert_eq!(error.help(), Some("--decimal point selects the second"), "{error}");
}

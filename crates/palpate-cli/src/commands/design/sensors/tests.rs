use std::sync::LazyLock;

use super::super::with_changes;
use super::*;
use palpate_mechanics::contact::Position;
use palpate_rig::Rig;

const RIG: &str = "\
# My bench.
[surface]
kind = \"beam\"
length = \"400 mm\" # between the wedges
width = \"40 mm\"
thickness = \"1.2 mm\"
youngs_modulus = \"200 GPa\"

# Borrowed until May.
[sensors]
measure = \"deflection\"
count = 8
noise = \"5 um\"     # by the data sheet

[contact]
force = \"3 N\" # a weight
";

static LINE: LazyLock<Extent> = LazyLock::new(|| Extent::line(0.4).unwrap());

fn sensor(kind: SensorKind, x_m: f64, noise_sd: f64) -> Sensor {
    let channel = ChannelModel { noise_sd, ..ChannelModel::default() };
    Sensor { kind, position: Position::along(x_m), name: format!("{kind}_1"), channel }
}

#[test]
fn only_the_sensors_change() {
    let layout = Layout::new(vec![
        sensor(SensorKind::Deflection, 0.035, 5e-6),
        sensor(SensorKind::Deflection, 0.26, 5e-6),
        sensor(SensorKind::Strain, 0.1234567, 1e-6),
        sensor(SensorKind::Reaction, 0.4, 0.005),
    ])
    .unwrap();
    let written = with_changes(RIG, |rig| place_sensors(rig, &layout, &[], *LINE)).unwrap();
    insta::assert_snapshot!(written);
    let rig = Rig::from_toml(&written).unwrap();
    let places: Vec<f64> = rig.setup.layout().sensors().iter().map(|sensor| sensor.position.x_m).collect();
    assert_eq!(places, [0.035, 0.26, 0.123457, 0.4]);
    let again = with_changes(&written, |rig| place_sensors(rig, &layout, &[], *LINE)).unwrap();
    assert_eq!(again, written);
}

#[test]
fn ranges_are_read_and_others_refused() {
    assert_eq!(counts("2..16"), Ok(2..=16));
    assert_eq!(counts("3..=3"), Ok(3..=3));
    for text in ["", "5", "0..4", "5..2", "2..1000", "a..b", "-1..3"] {
        assert!(counts(text).is_err(), "{text}");
    }
}

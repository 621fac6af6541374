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
    let written = with_layout(RIG, &layout).unwrap();
    insta::assert_snapshot!(written);
    let rig = Rig::from_toml(&written).unwrap();
    let places: Vec<f64> = rig.setup.layout.sensors().iter().map(|sensor| sensor.position.x_m).collect();
    assert_eq!(places, [0.035, 0.26, 0.123457, 0.4]);
    let again = with_layout(&written, &layout).unwrap();
    assert_eq!(again, written);
}

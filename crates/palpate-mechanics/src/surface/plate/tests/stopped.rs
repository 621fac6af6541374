//! Cancelled work leaves no result.

use palpate_testing::stopping::stopped_at_every_look;

use super::*;

fn spec() -> PlateSpec {
    let supports = vec![simple_at(0.11, 0.07), elastic_at(0.2, 0.15, 3e3)];
    PlateSpec { supports, ..steel(0.3, 0.2, Edges::all(Edge::Simple), 10) }
}

#[test]
fn factoring_stops_at_any_check_and_restarts() {
    let (whole, interrupted) = (plate(spec()), Plate::new(spec()).unwrap());
    let ((), looks) = stopped_at_every_look(|watch| interrupted.check_solution_watched(watch));
    assert!(looks > 20, "{looks} looks");
    let (sensor, contact) = (at(0.1, 0.1), at(0.22, 0.06));
    assert_eq!(deflection(&interrupted, sensor, contact), deflection(&whole, sensor, contact));
}

#[test]
fn influence_functions_stop_at_any_check_and_repeat_equally() {
    let (whole, interrupted) = (plate(spec()), Plate::new(spec()).unwrap());
    let sensors: Vec<Position> = (0..60).map(|i| at(0.005 * f64::from(i), 0.1)).collect();
    let (found, _) = stopped_at_every_look(|watch| {
        interrupted.influence_functions_watched(SensorKind::Strain, &sensors, watch)
    });
    assert_eq!(found.len(), sensors.len());
    let there = |plate: &Plate| -> Vec<f64> {
        let functions = plate.influence_functions(SensorKind::Strain, &sensors);
        functions.iter().map(|function| function.at(at(0.2, 0.05))).collect()
    };
    assert_eq!(there(&interrupted), there(&whole));
}

//! Work that is stopped leaves nothing behind.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;

fn spec() -> PlateSpec {
    let supports = vec![simple_at(0.11, 0.07), elastic_at(0.2, 0.15, 3e3)];
    PlateSpec { supports, ..steel(0.3, 0.2, Edges::all(Edge::Simple), 10) }
}

/// Does `work` under watches that stop it at its first look, at its second and so on, until it comes to its end; gives the number of looks.
fn stopped_everywhere(mut work: impl FnMut(Watch) -> Result<(), Unsolvable>) -> usize {
    for n in 0.. {
        let looks = AtomicUsize::new(0);
        let watch = |_| looks.fetch_add(1, Ordering::Relaxed) < n;
        match work(Watch::new(&watch)) {
            Ok(()) => return n,
            Err(error) => assert!(Cancelled::caused(&error), "{n}: {error}"),
        }
        assert_eq!(looks.into_inner(), n + 1, "it went on");
    }
    unreachable!("it never ends")
}

#[test]
fn factoring_stops_at_any_look_and_begins_anew() {
    let (whole, interrupted) = (plate(spec()), Plate::new(spec()).unwrap());
    let looks = stopped_everywhere(|watch| interrupted.check_solution_watched(watch));
    assert!(looks > 20, "{looks} looks");
    let (sensor, contact) = (at(0.1, 0.1), at(0.22, 0.06));
    assert_eq!(deflection(&interrupted, sensor, contact), deflection(&whole, sensor, contact));
}

#[test]
fn influence_functions_stop_at_any_look_and_are_then_the_same() {
    let (whole, interrupted) = (plate(spec()), Plate::new(spec()).unwrap());
    let sensors: Vec<Position> = (0..60).map(|i| at(0.005 * f64::from(i), 0.1)).collect();
    stopped_everywhere(|watch| {
        let found = interrupted.influence_functions_watched(SensorKind::Strain, &sensors, watch)?;
        assert_eq!(found.len(), sensors.len());
        Ok(())
    });
    let there = |plate: &Plate| -> Vec<f64> {
        let functions = plate.influence_functions(SensorKind::Strain, &sensors);
        functions.iter().map(|function| function.at(at(0.2, 0.05))).collect()
    };
    assert_eq!(there(&interrupted), there(&whole));
}

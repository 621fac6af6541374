use super::*;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::Motion;
use palpate_testing::stopping::stopped_at_every_look;

use crate::fixtures::{
    Example, along_the_beam, faulty_paper, moving_beam, moving_plate, over_the_plate, paper, plate, strip,
    swinging_beam,
};
use palpate_mechanics::sensing::ChannelModel;

fn noisy() -> Example {
    let faults =
        ChannelModel { noise_sd: 5e-6, gain_error: 0.05, offset_error: 2e-6, ..ChannelModel::default() };
    faulty_paper(faults, 3)
}

#[test]
fn a_clean_simulation_is_force_times_influence() {
    let rig = paper(0.0, 1);
    let recording = rig.simulate(1);
    assert_eq!(recording.rows.len(), 10);
    let surface = rig.setup.surface().model().unwrap();
    for (i, row) in recording.rows.iter().enumerate() {
        assert_eq!(row.position.x_m, (i as f64 + 0.5) * 0.4 / 10.0);
        for (sensor, value) in rig.setup.layout().sensors().iter().zip(&row.reading) {
            let influence = surface.influence(SensorKind::Deflection, sensor.position, row.position);
            assert_eq!(*value, 3.0 * influence);
        }
    }
}

#[test]
fn one_seed_gives_one_recording_and_another_seed_another() {
    let rig = noisy();
    let recording = rig.simulate(7);
    assert_eq!(recording.rows.len(), 30);
    assert_eq!(rig.simulate(7), recording);
    assert_ne!(rig.simulate(8).rows, recording.rows);
    assert_eq!(recording.provenance.seed, Some(7));
}

#[test]
fn a_simulation_survives_its_file_bit_for_bit() {
    let rig = noisy();
    let recording = rig.simulate(7);
    let mut bytes = Vec::new();
    crate::recording::write(&recording, rig.setup.surface().extent(), "a simulation", &mut bytes).unwrap();
    assert!(bytes.starts_with(b"# a simulation\nposition_mm,force_n,deflection_1_mm,deflection_2_mm,"));
    assert_eq!(rig.setup.read_recording("again", bytes.as_slice()).unwrap().rows, recording.rows);
}

#[test]
fn what_a_moving_contact_reads_does_not_depend_on_how_often_it_is_asked() {
    let setup = paper(0.0, 1).setup;
    let along =
        |from, to, speed, turn| Motion::new(Position::along(from), Position::along(to), speed, turn).unwrap();
    let lifted = along(0.37, 0.05, 1.0, 0.004).with_passes(4).unwrap();
    let first = along(0.05, 0.35, 1.0, 0.05).with_passes(3).unwrap();
    for (touch_s, second) in [(0.02, None), (0.0, Some(lifted.with_lifts(0.033, 0.01).unwrap()))] {
        let motion = first.with_lifts(0.15, touch_s).unwrap();
        let contact = |motion| MovingContact { motion, force_n: None };
        let second = second.map(contact);
        let moving = |rate_hz| MovingContacts {
            first: contact(motion),
            second,
            beam: Some(crate::fixtures::swinging_beam()),
            rate_hz,
        };
        let fine = simulate_moving(&setup, &moving(10_000.0), 1).unwrap();
        let readings = |rate_hz| simulate_moving(&setup, &moving(rate_hz), 1).unwrap().recording.rows;
        let largest = fine
            .recording
            .rows
            .iter()
            .flat_map(|row| &row.reading)
            .fold(0.0, |most: f64, r| most.max(r.abs()));
        for rate_hz in [1.0, 10.0, 20.0, 1000.0] {
            let step = (10_000.0 / rate_hz) as usize;
            for (coarse, fine) in readings(rate_hz).iter().zip(fine.recording.rows.iter().step_by(step)) {
                assert_eq!(coarse.force_n, fine.force_n);
                for (a, b) in coarse.reading.iter().zip(&fine.reading) {
                    assert!((a - b).abs() < 1e-5 * largest, "{rate_hz} Hz: {a} {b} of {largest}");
                }
            }
        }
    }
}

#[test]
fn what_cannot_be_simulated_is_refused_with_the_reason() {
    let measured = strip();
    let mut no_force = paper(5e-6, 1);
    no_force.setup = no_force.setup.unknown_force();
    let here = [Position::along(0.1)];
    let messages = [
        simulate_at(&measured, &here, 1, 1).unwrap_err().to_string(),
        no_force.setup.simulate(&no_force.training, 1).unwrap_err().to_string(),
        simulate_at(&paper(5e-6, 1).setup, &[Position::along(0.1), Position::along(0.401)], 1, 1)
            .unwrap_err()
            .to_string(),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn sensors_sit_beside_their_places_by_no_more_than_they_may() {
    let line = Extent::line(0.4).unwrap();
    let mut here = Layout::even(SensorKind::Deflection, 8, 0.4);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    assert_eq!(displaced(&here, line, &mut rng), here);
    here.edit(|sensors| sensors[0].position.x_m = 0.0).unwrap();
    here.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.position_error_m = 5e-4))
        .unwrap();
    let mut moved = Vec::new();
    for _ in 0..200 {
        let placed = displaced(&here, line, &mut rng);
        assert!(placed.sensors()[0].position.x_m >= 0.0);
        moved.extend(
            placed.sensors()[1..]
                .iter()
                .zip(&here.sensors()[1..])
                .map(|(p, h)| p.position.x_m - h.position.x_m),
        );
        assert!(placed.sensors().iter().all(|sensor| sensor.position.y_m == 0.0));
    }
    let largest = moved.iter().fold(0.0, |most: f64, m| most.max(m.abs()));
    let mean = moved.iter().sum::<f64>() / moved.len() as f64;
    assert!(largest <= 5e-4 && largest > 4.9e-4 && mean.abs() < 5e-5, "{largest} {mean}");
}

#[test]
fn simulations_stop_at_any_look_and_are_otherwise_the_same() {
    let plate = plate(6, ChannelModel { noise_sd: 1e-6, position_error_m: 1e-3, ..ChannelModel::default() });
    for Example { setup, training } in [noisy(), plate] {
        let (made, _) =
            stopped_at_every_look(|watch| setup.simulate_watched(&training.clone().repeated(60), 3, watch));
        assert_eq!(made, setup.simulate(&training.repeated(60), 3).unwrap());
        let loads = [UniformLoad::along(0.05, 0.09, 2.0)];
        let (made, _) = stopped_at_every_look(|watch| simulate_loads_watched(&setup, &loads, 600, 3, watch));
        assert_eq!(made, simulate_loads(&setup, &loads, 600, 3).unwrap());
    }
    for Example { setup, .. } in [moving_beam(), moving_plate()] {
        let is_beam = setup.surface().extent().width_m().is_none();
        let motion = if is_beam { along_the_beam() } else { over_the_plate() };
        let moving = MovingContacts {
            first: MovingContact { motion, force_n: Some(2.0) },
            second: None,
            beam: is_beam.then(swinging_beam),
            rate_hz: 1000.0,
        };
        let setup = setup.with_force(Some(3.0)).unwrap();
        let (made, _) = stopped_at_every_look(|watch| simulate_moving_watched(&setup, &moving, 3, watch));
        assert_eq!(made, simulate_moving(&setup, &moving, 3).unwrap());
    }
}

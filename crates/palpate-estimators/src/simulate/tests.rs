use super::*;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::Motion;
use palpate_testing::stopping::stopped_at_every_look;

use crate::evaluation::Calibration;
use crate::fixtures::{
    Example, along_the_beam, faulty_paper, moving_beam, moving_plate, over_the_plate, paper, plate, strip,
    swinging_beam,
};
use crate::imperfections::{Amount, Imperfections, OffsetDrift, Schedule};
use crate::setup::SetupError;
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
fn readings_of_a_moving_contact_do_not_depend_on_the_sampling_rate() {
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
fn invalid_simulation_is_refused_with_the_reason() {
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
fn simulations_stop_at_any_check_and_repeat_equally() {
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

fn worn(imperfections: Imperfections) -> Example {
    let Example { setup, training } = paper(0.0, 2);
    Example { setup: setup.with_imperfections(imperfections).unwrap(), training }
}

#[test]
fn imperfect_recordings_have_untouched_rows_and_times_by_their_schedule() {
    let schedule = Schedule { rest_s: 4.0, untouched_rows: 3, settle_s: 2.0, rate_hz: 10.0, pause_s: 0.0 };
    let example = worn(Imperfections { schedule, ..Imperfections::default() });
    let rows = example.simulate(1).rows;
    assert_eq!(rows.len(), 10 * (3 + 2) + 3);
    let touched: Vec<bool> = rows.iter().map(Row::touches).collect();
    assert_eq!(touched[..6], [false, false, false, true, true, false]);
    let times_s: Vec<f64> = rows.iter().filter_map(|row| row.time_s).collect();
    let expected_s = [3.8, 3.9, 4.0, 6.0, 6.1, 9.9, 10.0, 10.1];
    assert!(
        times_s.iter().zip(expected_s).all(|(time_s, expected_s)| (time_s - expected_s).abs() < 1e-9),
        "{times_s:?}"
    );
    // An imperfection of size 0 does not change the readings.
    let clean = paper(0.0, 2).simulate(1).rows;
    let pressed: Vec<&Row> = rows.iter().filter(|row| row.touches()).collect();
    assert!(
        clean
            .iter()
            .zip(pressed)
            .all(|(clean, row)| clean.reading == row.reading && clean.position == row.position)
    );
    assert!(
        rows.iter().filter(|row| !row.touches()).all(|row| row.reading.iter().all(|value| *value == 0.0))
    );
}

#[test]
fn hysteresis_of_a_recording_is_its_share_of_each_channels_range() {
    let example = worn(Imperfections { hysteresis: 0.02, ..Imperfections::default() });
    let rows = example.simulate(1).rows;
    let last = &rows.last().unwrap().reading;
    let clean = CleanSensors::new(example.setup.surface().model().unwrap(), example.setup.layout());
    let grid = (1..20)
        .map(|i| clean.reading(Contact { position: Position::along(0.02 * f64::from(i)), force_n: 3.0 }));
    let ranges = grid.reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a.min(*b)).collect()).unwrap();
    for (left, range) in last.iter().zip(&ranges) {
        assert!((left / (0.01 * range) - 1.0).abs() < 1e-9, "{last:?} {ranges:?}");
    }
}

#[test]
fn presses_beside_their_places_are_recorded_at_the_asked_ones() {
    let mut example = worn(Imperfections::default());
    example.training = example.training.with_placement(2e-3);
    let recording = example.simulate(1);
    assert_eq!(recording.provenance.placement_sd_m, Some(2e-3));
    let asked = paper(0.0, 2).simulate(1);
    assert_eq!(recording.distinct_positions(), asked.distinct_positions());
    // Sensor 4 changes by the slope of its influence where the press is displaced; two rows of one press are
    // equal.
    let pressed: Vec<&Row> = recording.rows.iter().filter(|row| row.touches()).collect();
    let beside_m: Vec<f64> = pressed
        .iter()
        .zip(&asked.rows)
        .map(|(row, asked)| {
            let x_m = asked.position.x_m;
            let read = |x_m: f64| {
                let contact = Contact { position: Position::along(x_m), force_n: 3.0 };
                clean_reading(example.setup.surface().model().unwrap(), example.setup.layout(), contact)[0]
            };
            (row.reading[0] - read(x_m)) / ((read(x_m + 1e-4) - read(x_m - 1e-4)) / 2e-4)
        })
        .collect();
    assert!(beside_m.chunks_exact(2).all(|press| press[0] == press[1]));
    let away_from_the_turn =
        beside_m.iter().enumerate().filter(|(i, _)| !(4..8).contains(i)).map(|(_, error)| error.abs());
    let largest_m = away_from_the_turn.fold(0.0, f64::max);
    assert!(largest_m > 1e-3 && largest_m < 8e-3, "{beside_m:?}");
}

#[test]
fn a_fast_logger_repeats_its_readings() {
    let schedule = Schedule { untouched_rows: 4, ..Schedule::default() };
    let mut example = faulty_paper(ChannelModel { noise_sd: 5e-6, ..ChannelModel::default() }, 4);
    let imperfections = Imperfections { repeated_readings: 2, schedule, ..Imperfections::default() };
    example.setup = example.setup.with_imperfections(imperfections).unwrap();
    let rows = example.simulate(1).rows;
    assert!(
        rows.chunks(4).all(|rows| rows[0].reading == rows[1].reading && rows[0].reading == rows[2].reading)
    );
    assert!(rows.chunks(4).all(|rows| rows[0].reading != rows[3].reading));
}

#[test]
fn calibration_and_use_are_one_bench_that_goes_on() {
    let imperfections = Imperfections {
        hysteresis: 0.02,
        common_drift: OffsetDrift { line_per_s: Amount::Share(1e-5), walk_per_root_s: Amount::Share(1e-3) },
        schedule: Schedule { pause_s: 600.0, ..Schedule::default() },
        ..Imperfections::default()
    };
    let example = worn(imperfections);
    let calibration = Calibration::from_training(&example.setup, &example.training).unwrap();
    let split = calibration.simulate(3).unwrap();
    assert_eq!(split.training, example.simulate(3));
    let [end_s, start_s] =
        [split.training.rows.last(), split.held_out.rows.first()].map(|row| row.unwrap().time_s.unwrap());
    assert!((start_s - end_s - 606.0).abs() < 1e-9, "{start_s} {end_s}");
    // Evaluations continue from equal offsets too, with other walks.
    let contacts = [Contact { position: Position::along(0.1), force_n: 3.0 }];
    let used =
        simulate_use_watched(&example.setup, &split.training.provenance, &contacts, 9, Watch::NONE).unwrap();
    assert_eq!(used.rows[0].time_s, Some(start_s - 2.0));
    let state = split.training.provenance.bench.as_ref().unwrap();
    let walk_sd = 1e-3 * 604f64.sqrt();
    for (c, left) in state.channels.iter().enumerate() {
        let range = 100.0 * left.play.abs();
        let drifted = used.rows[0].reading[c] - left.play - left.walk - 1e-5 * (start_s - 2.0) * range;
        assert!(drifted.abs() < 4.0 * walk_sd * range, "channel {c}: {drifted} {range}");
    }
    assert_ne!(used.rows[0].reading, split.held_out.rows[0].reading);
    assert_eq!(used.rows.iter().filter(|row| row.touches()).count(), 1);
}

#[test]
fn a_setup_keeps_its_imperfections_in_its_file_and_refuses_bad_ones() {
    let example =
        worn(Imperfections { hysteresis: 0.02, noise_freedom: Some(5.0), ..Imperfections::default() });
    let text = serde_json::to_string(&example.setup).unwrap();
    assert_eq!(serde_json::from_str::<Setup>(&text).unwrap(), example.setup);
    let refused = serde_json::from_str::<Setup>(&text.replace("\"hysteresis\":0.02", "\"hysteresis\":2.0"));
    let message = "the hysteresis is 2; it must be at least 0 and below 1";
    assert!(refused.unwrap_err().to_string().starts_with(message));
    assert!(!serde_json::to_string(&paper(0.0, 1).setup).unwrap().contains("imperfections"));
    let layered = Imperfections { touch_width_m: 4e-3, ..Imperfections::default() };
    let digit = crate::fixtures::digit(palpate_mechanics::surface::ForceDirection::Normal, 2.0).setup;
    assert_eq!(digit.with_imperfections(layered), Err(SetupError::SoftLayerOnDigit));
}

#[test]
fn moving_contacts_and_loads_leave_hysteresis_and_drift_behind() {
    let Example { setup, .. } = moving_plate();
    let setup = setup.with_force(Some(3.0)).unwrap();
    let imperfections = Imperfections {
        hysteresis: 0.1,
        touch_width_m: 5e-3,
        common_drift: OffsetDrift { line_per_s: Amount::Share(1e-2), ..OffsetDrift::default() },
        ..Imperfections::default()
    };
    let worn = setup.clone().with_imperfections(imperfections).unwrap();
    let moving = MovingContacts {
        first: MovingContact { motion: over_the_plate(), force_n: None },
        second: None,
        beam: None,
        rate_hz: 50.0,
    };
    let rows = |setup: &Setup| simulate_moving(setup, &moving, 3).unwrap().recording.rows;
    let (clean, moved) = (rows(&setup), rows(&worn));
    assert!(clean.len() == moved.len() && clean.last().unwrap().reading != moved.last().unwrap().reading);
    let load = [UniformLoad::new(Position { x_m: 0.05, y_m: 0.05 }, Position { x_m: 0.09, y_m: 0.09 }, 2.0)];
    let loaded = |setup: &Setup| simulate_loads(setup, &load, 2, 3).unwrap();
    assert_ne!(loaded(&setup), loaded(&worn));
    assert_eq!(loaded(&worn), loaded(&worn));
}

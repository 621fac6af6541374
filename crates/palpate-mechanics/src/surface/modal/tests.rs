use std::f64::consts::PI;

use proptest::prelude::*;

use super::*;
use crate::contact::{Contact, Position};
use crate::sensing::SensorKind::{self, Deflection, Reaction, Slope, Strain};
use crate::surface::{Beam, Surface};

/// The founding paper's beam, of steel.
fn paper(damping_ratio: f64) -> ModalBeam {
    let beam = Beam::new(0.4, 0.04, 0.0012, 200e9).unwrap();
    ModalBeam::new(beam, 7850.0, damping_ratio).unwrap()
}

fn load(x_m: f64, force_n: f64) -> Contact {
    Contact { position: Position::along(x_m), force_n }
}

const SENSORS: [(SensorKind, f64); 5] =
    [(Deflection, 0.15), (Slope, 0.3), (Strain, 0.11), (Reaction, 0.0), (Reaction, 0.4)];

/// Frýba's equation 1.31 for an undamped beam at rest. A load W enters at x = 0 and t = 0 with constant speed
/// v: w = w₀·Σ_k sin(kπx/l)·(sin kωt − (α/k)·sin ω_k·t)/(k²·(k² − α²)), w₀ = 2·W·l³/(π⁴·E·I), α = v/v_cr, ω =
/// πv/l.
fn fryba(beam: &ModalBeam, speed: f64, x_m: f64, t: f64, force_n: f64) -> f64 {
    let alpha = speed / beam.critical_speed_m_per_s();
    let l = beam.beam.length_m();
    let w0 = 2.0 * force_n * l.powi(3) / (PI.powi(4) * beam.beam.bending_stiffness());
    let term = |k: i32| {
        let (n, own) = (f64::from(k), beam.angular_frequency(k as usize));
        let forced = (n * PI * speed * t / l).sin() - alpha / n * (own * t).sin();
        (n * PI * x_m / l).sin() * forced / (n * n * (n * n - alpha * alpha))
    };
    w0 * (1..400).map(term).sum::<f64>()
}

#[test]
fn the_papers_beam_swings_at_17_hertz_and_is_critical_at_14_metres_a_second() {
    let beam = paper(0.01);
    let told = format!(
        "{:.2} {:.2} {:.3}",
        beam.frequency_hz(1),
        beam.frequency_hz(2),
        beam.critical_speed_m_per_s()
    );
    assert_eq!(told, "17.17 68.66 13.733");
}

#[test]
fn steady_load_agrees_with_fryba_up_to_the_critical_speed() {
    let beam = paper(0.0);
    for ratio in [0.05, 0.3, 0.7, 0.999] {
        let speed = ratio * beam.critical_speed_m_per_s();
        let duration_s = 0.4 / speed;
        let mut response = beam.at_rest(24, &[load(0.0, 3.0)]);
        for i in 1..=10 {
            let t = duration_s * f64::from(i) / 10.0;
            response.advance(&[load(speed * t, 3.0)], duration_s / 10.0);
            for x_m in [0.1, 0.2, 0.3] {
                let (found, closed) =
                    (-response.reading(Deflection, Position::along(x_m)), fryba(&beam, speed, x_m, t, 3.0));
                assert!((found - closed).abs() < 1e-5 * 3.47e-3, "{ratio} {i} {x_m}: {found} {closed}");
            }
        }
    }
}

#[test]
fn a_creeping_load_reads_as_the_closed_form_does() {
    let beam = paper(0.01);
    let place = |t: f64| 0.2 - 0.1 * (PI * t / 1e7).cos();
    let mut response = beam.at_rest(16, &[load(place(0.0), 3.0)]);
    for i in 1..=200 {
        let a_m = place(5e4 * f64::from(i));
        response.advance(&[load(a_m, 3.0)], 5e4);
        for (kind, x_m) in SENSORS {
            let sensor = Position::along(x_m);
            let closed = 3.0 * beam.beam.influence(kind, sensor, Position::along(a_m));
            let scale = 3.0 * beam.beam.full_scale(kind);
            assert!((response.reading(kind, sensor) - closed).abs() < 1e-9 * scale, "{kind} {a_m}");
        }
    }
}

#[test]
fn a_sensors_modes_add_up_to_its_static_reading() {
    // After a sudden release the modes contain the static deflection, except for the neglected modes.
    let beam = paper(0.0);
    for ((kind, x_m), bound) in SENSORS.into_iter().zip([1e-7, 1e-5, 3e-3, 3e-3, 3e-3]) {
        let (sensor, before) = (Position::along(x_m), load(0.17, 3.0));
        let mut response = beam.at_rest(4000, &[before]);
        let read = response.reading(kind, sensor);
        response.change_loads(&[load(0.17, 0.0)]);
        let scale = 3.0 * beam.beam.full_scale(kind);
        assert!((response.reading(kind, sensor) - read).abs() < bound * scale, "{kind} at {x_m}");
    }
}

/// Kinetic and elastic energy of the modes, in joules.
fn energy_j(ModalResponse { beam, modes, .. }: &ModalResponse) -> f64 {
    let energy = |(i, mode): (usize, &State)| {
        let omega = beam.angular_frequency(i + 1);
        0.5 * beam.modal_mass() * (mode.velocity.powi(2) + (omega * mode.displacement).powi(2))
    };
    modes.iter().enumerate().map(energy).sum()
}

/// Power of the loads on the modes, in watts: Σ W_j·ẇ(a_j).
fn power_w(ModalResponse { beam, modes, loads, .. }: &ModalResponse) -> f64 {
    let speed_at = |x_m: f64| -> f64 {
        modes.iter().enumerate().map(|(i, mode)| (beam.wave_number(i + 1) * x_m).sin() * mode.velocity).sum()
    };
    loads.iter().map(|load| load.force_n * speed_at(load.position.x_m)).sum()
}

#[test]
fn a_beam_let_go_swings_with_its_damping() {
    let beam = paper(0.02);
    let mut response = beam.at_rest(1, &[load(0.2, 3.0)]);
    response.change_loads(&[load(0.2, 0.0)]);
    let start = energy_j(&response);
    let period = 1.0 / (beam.frequency_hz(1) * (1.0f64 - 0.02 * 0.02).sqrt());
    response.advance(&[load(0.2, 0.0)], 3.0 * period);
    let decay = (-2.0 * 0.02 * beam.angular_frequency(1) * 3.0 * period).exp();
    assert!((energy_j(&response) / start - decay).abs() < 1e-12);
}

#[test]
fn numbers_out_of_bounds_are_refused_with_their_value() {
    let beam = paper(0.0).beam;
    let bounds = [(0.0, 0.0), (f64::NAN, 0.0), (1e-320, 0.0), (7850.0, 1.0), (7850.0, -0.1)];
    let told =
        bounds.map(|(density, damping)| ModalBeam::new(beam, density, damping).unwrap_err().to_string());
    insta::assert_snapshot!(told.join("\n"), @r"
    the density is 0 kg/m3; it must be greater than 0 and finite
    the density is NaN kg/m3; it must be greater than 0 and finite
    the first natural frequency is inf Hz; it must be greater than 0 and finite
    the damping ratio is 1; it must be at least 0 and below 1
    the damping ratio is -0.1; it must be at least 0 and below 1
    ");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn without_damping_the_energy_is_the_loads_work(speed in 0.5..20.0, a in 0.05..0.35, touch in 0.0..3.0) {
        let beam = paper(0.0);
        let mut response = beam.at_rest(6, &[load(a, touch)]);
        let (start, mut work, dt) = (energy_j(&response), 0.0, 2e-5);
        let mut power = power_w(&response);
        for i in 1..=2000i32 {
            let t: f64 = dt * f64::from(i);
            let angle: f64 = speed * t;
            let x_m = 0.2 + (a - 0.2) * angle.cos();
            response.advance(&[load(x_m, touch + (3.0 - touch) * (200.0 * t).sin().powi(2))], dt);
            let now = power_w(&response);
            work += 0.5 * dt * (power + now);
            power = now;
        }
        let gained = energy_j(&response) - start;
        prop_assert!((gained - work).abs() < 1e-5 * energy_j(&response).max(start).max(1e-3), "{} {}", gained, work);
    }

    #[test]
    fn loads_superpose(a in 0.0..=0.4, b in 0.0..=0.4, to in 0.0..=0.4) {
        let beam = paper(0.01);
        let run = |loads: &[(f64, f64, f64)]| {
            let at = |end: bool| -> Vec<Contact> {
                loads.iter().map(|(from, to, force)| load(if end { *to } else { *from }, *force)).collect()
            };
            let mut response = beam.at_rest(8, &at(false));
            response.advance(&at(true), 0.01);
            SENSORS.map(|(kind, x_m)| response.reading(kind, Position::along(x_m)))
        };
        let (first, second) = (run(&[(a, to, 2.0)]), run(&[(b, a, 1.0)]));
        let both = run(&[(a, to, 2.0), (b, a, 1.0)]);
        for (i, (kind, _)) in SENSORS.iter().enumerate() {
            let scale = 3.0 * beam.beam.full_scale(*kind);
            prop_assert!((first[i] + second[i] - both[i]).abs() < 2e-5 * scale, "{}", kind);
        }
    }
}

use super::*;
use palpate_mechanics::contact::{Contact, Position};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

fn channels(imperfections: Imperfections, untouched: &[f64], ranges: &[f64]) -> ImperfectChannels {
    ImperfectChannels::new(imperfections, untouched, ranges, 7)
}

#[test]
fn drift_and_creep_follow_their_formulas() {
    let imperfections = Imperfections {
        drift: OffsetDrift { line_per_s: Amount::Value(0.5), ..OffsetDrift::default() },
        common_drift: OffsetDrift { line_per_s: Amount::Share(0.01), ..OffsetDrift::default() },
        creep: [Relaxation { share: 0.2, time_s: 2.0 }, Relaxation { share: 0.1, time_s: 30.0 }],
        ..Imperfections::default()
    };
    let mut channels = channels(imperfections, &[0.0; 2], &[10.0; 2]);
    let mut reading = Vec::new();
    for _ in 0..1000 {
        reading = channels.advance(&[10.0, 10.0], 3e-3);
    }
    // After 3 s: the creeps lack exp(−3/2) and exp(−3/30) of their shares, the lines are at ±1.5, and the common one at 0.1·3.
    let crept = 10.0 - 2.0 * (-1.5_f64).exp() - (-0.1_f64).exp();
    assert!((reading[0] - (crept + 1.5 + 0.3)).abs() < 1e-9, "{reading:?}");
    assert!((reading[1] - (crept - 1.5 + 0.3)).abs() < 1e-9, "{reading:?}");
}

#[test]
fn one_long_step_equals_many_short_ones() {
    let imperfections = Imperfections {
        hysteresis: 0.05,
        creep: [Relaxation { share: 0.2, time_s: 2.0 }, Relaxation { share: 0.1, time_s: 30.0 }],
        residue: Relaxation { share: 0.1, time_s: 5.0 },
        saturation: 0.15,
        common_gain_drift_per_s: 1e-3,
        ..Imperfections::default()
    };
    let read = |steps: usize| {
        let mut channels = channels(imperfections, &[1.0], &[10.0]);
        let mut reading = Vec::new();
        for clean in [1.0, 11.0, 1.0, -4.0, 1.0] {
            for _ in 0..steps {
                reading = channels.advance(&[clean], 3.0 / steps as f64);
            }
        }
        reading[0]
    };
    assert!((read(1) - read(1000)).abs() < 1e-9, "{} {}", read(1), read(1000));
}

#[test]
fn random_walks_grow_with_the_root_of_time_and_may_be_shared() {
    let walk = OffsetDrift { walk_per_root_s: Amount::Value(2.0), ..OffsetDrift::default() };
    let after_9_s = |imperfections: Imperfections| {
        let mut channels = channels(imperfections, &[0.0; 400], &[1.0; 400]);
        (0..900).fold(Vec::new(), |_, _| channels.advance(&[0.0; 400], 0.01))
    };
    let reading = after_9_s(Imperfections { drift: walk, ..Imperfections::default() });
    let variance = reading.iter().map(|x| x * x).sum::<f64>() / 400.0;
    // 9 s of a variance of 4 a second; the variance of 400 draws has a standard deviation of 7 %.
    assert!((variance / 36.0 - 1.0).abs() < 0.25, "{variance}");
    let reading = after_9_s(Imperfections { common_drift: walk, ..Imperfections::default() });
    assert!(reading[0] != 0.0 && reading.iter().all(|value| *value == reading[0]));
}

#[test]
fn hysteresis_leaves_half_its_width_after_a_touch() {
    let imperfections = Imperfections { hysteresis: 0.02, ..Imperfections::default() };
    let mut channels = channels(imperfections, &[100.0], &[50.0]);
    let read = [100.0, 150.0, 100.0, 50.0, 100.0].map(|value| channels.advance(&[value], 0.01)[0]);
    assert_eq!(read, [100.0, 149.5, 100.5, 50.5, 99.5]);
}

#[test]
fn residue_fades_after_a_touch() {
    let residue = Relaxation { share: 0.1, time_s: 2.0 };
    let mut channels = channels(Imperfections { residue, ..Imperfections::default() }, &[0.0], &[1.0]);
    assert_eq!(channels.advance(&[20.0], 1.0), [22.0]);
    let after = channels.advance(&[0.0], 1.0)[0];
    assert!((after - 2.0 * (-0.5_f64).exp()).abs() < 1e-12, "{after}");
}

#[test]
fn a_deviation_as_large_as_the_range_saturates_by_its_share() {
    let imperfections = Imperfections { saturation: 0.15, ..Imperfections::default() };
    let mut channels = channels(imperfections, &[1.0, 1.0, 1.0], &[10.0; 3]);
    let read = channels.advance(&[11.0, -9.0, 1.01], 1.0);
    assert!((read[0] - 9.5).abs() < 1e-12 && (read[1] + 7.5).abs() < 1e-12, "{read:?}");
    assert!((read[2] - 1.01).abs() < 3e-6, "{read:?}");
}

#[test]
fn gains_drift_together_and_apart() {
    let imperfections =
        Imperfections { gain_drift_per_s: 1e-3, common_gain_drift_per_s: 4e-3, ..Imperfections::default() };
    let mut channels = channels(imperfections, &[5.0; 2], &[10.0; 2]);
    let read = channels.advance(&[15.0, 15.0], 10.0);
    assert!((read[0] - 15.5).abs() < 1e-12 && (read[1] - 15.3).abs() < 1e-12, "{read:?}");
}

#[test]
fn noise_has_its_correlation_and_its_tails_at_a_variance_of_1() {
    let imperfections =
        Imperfections { noise_correlation: 0.6, noise_freedom: Some(5.0), ..Imperfections::default() };
    let noise = StandardNoise::new(Some(&imperfections));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let draws: Vec<Vec<f64>> = (0..20_000).map(|_| noise.draw(2, &mut rng)).collect();
    let mean = |of: &dyn Fn(&Vec<f64>) -> f64| draws.iter().map(of).sum::<f64>() / draws.len() as f64;
    let (variance, product) = (mean(&|draw| draw[0] * draw[0]), mean(&|draw| draw[0] * draw[1]));
    // The fourth moment of t with 5 degrees of freedom is 9 times its variance squared: ±2 % of 20,000 draws.
    assert!((variance - 1.0).abs() < 0.08 && (product - 0.6).abs() < 0.05, "{variance} {product}");
    let own = StandardNoise::new(Some(&Imperfections { noise_correlation: 0.0, ..imperfections }));
    let beyond = (0..20_000).filter(|_| own.draw(1, &mut rng)[0].abs() > 4.0).count();
    // P(|t₅| > 4·√(5/3)) = 0.36 %; of a normal distribution 0.006 %.
    assert!((40..=110).contains(&beyond), "{beyond}");
}

#[test]
fn a_soft_layer_spreads_the_force_over_its_width_and_stays_on_the_surface() {
    let line = Extent::line(0.1).unwrap();
    let contact = |x_m: f64, y_m: f64| Contact { position: Position { x_m, y_m }, force_n: 4.0 };
    let middle = distribute_contact(contact(0.05, 0.0), 0.01, line);
    let force: f64 = middle.iter().map(|point| point.force_n).sum();
    let mean = middle.iter().map(|point| point.position.x_m).sum::<f64>() / middle.len() as f64;
    let variance =
        middle.iter().map(|point| (point.position.x_m - mean).powi(2)).sum::<f64>() / middle.len() as f64;
    assert!((force - 4.0).abs() < 1e-12 && (mean - 0.05).abs() < 1e-12);
    // w²/12 of a uniform pressure, less 1/64.
    assert!((variance / (1e-4 / 12.0) - 63.0 / 64.0).abs() < 1e-9, "{variance}");
    let plane = Extent::plane(0.1, 0.08).unwrap();
    let corner = distribute_contact(contact(0.1, 0.0), 0.01, plane);
    assert!(corner.len() == 64 && corner.iter().all(|point| plane.contains(point.position)));
    assert!((corner.iter().map(|point| point.force_n).sum::<f64>() - 4.0).abs() < 1e-12);
    assert_eq!(distribute_contact(contact(0.05, 0.0), 0.0, line), [contact(0.05, 0.0)]);
}

#[test]
fn numbers_out_of_range_are_refused_by_name() {
    let extent = Extent::plane(0.4, 0.1).unwrap();
    let fast = Relaxation { share: 0.1, time_s: 0.0 };
    let none = Imperfections::default();
    let refused = [
        Imperfections { hysteresis: -0.01, ..none },
        Imperfections { saturation: 1.0, ..none },
        Imperfections { creep: [fast, Relaxation::default()], ..none },
        Imperfections { creep: [Relaxation { share: 0.6, time_s: 1.0 }; 2], ..none },
        Imperfections { residue: Relaxation { share: f64::NAN, time_s: 1.0 }, ..none },
        Imperfections { common_gain_drift_per_s: f64::INFINITY, ..none },
        Imperfections {
            drift: OffsetDrift { walk_per_root_s: Amount::Value(-1.0), ..OffsetDrift::default() },
            ..none
        },
        Imperfections { noise_freedom: Some(2.0), ..none },
        Imperfections { touch_width_m: 0.1, ..none },
        Imperfections { range_force_n: Some(0.0), ..none },
        Imperfections { schedule: Schedule { rate_hz: 0.0, ..Schedule::default() }, ..none },
        Imperfections { schedule: Schedule { pause_s: -1.0, ..Schedule::default() }, ..none },
    ];
    let messages = refused.map(|imperfections| imperfections.check(extent).unwrap_err().to_string());
    insta::assert_snapshot!(messages.join("\n"));
    none.check(extent).unwrap();
}

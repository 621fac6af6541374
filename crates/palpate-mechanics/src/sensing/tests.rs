use proptest::prelude::*;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::contact::Position;

const PERFECT: ChannelModel = ChannelModel {
    noise_sd: 0.0,
    resolution: 0.0,
    gain_error: 0.0,
    offset_error: 0.0,
    position_error_m: 0.0,
    range: None,
    disabled: false,
};

fn layout(channels: &[ChannelModel]) -> Layout {
    let mut layout = Layout::even(SensorKind::Deflection, channels.len(), 0.4);
    for (sensor, channel) in layout.sensors.iter_mut().zip(channels) {
        sensor.channel = *channel;
    }
    layout
}

fn reported(channels: &[ChannelModel], clean: &[f64], seed: u64) -> Vec<f64> {
    let layout = layout(channels);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let errors = ChannelErrors::draw(&layout, &mut rng);
    measure(&layout, clean, &errors, &mut rng)
}

#[test]
fn kinds_are_listed_as_they_are_declared() {
    assert!(SensorKind::ALL.iter().enumerate().all(|(index, kind)| *kind as usize == index));
}

#[test]
fn even_sensors_sit_at_multiples_of_a_ninth() {
    let layout = Layout::even(SensorKind::Deflection, 8, 0.4);
    let expected: Vec<Position> = (1..=8).map(|i| Position::along(f64::from(i) * 0.4 / 9.0)).collect();
    let found: Vec<Position> = layout.sensors().iter().map(|sensor| sensor.position).collect();
    assert_eq!(found, expected);
    assert_eq!(layout.names()[7], "deflection_8");
}

#[test]
fn every_kind_has_a_unit_of_its_dimension() {
    for kind in SensorKind::ALL {
        assert_eq!(kind.unit().dimension(), kind.dimension());
    }
}

#[test]
fn quantised_saturated_and_disabled_channels_have_their_readings() {
    let coarse = ChannelModel { resolution: 0.5, ..PERFECT };
    let narrow = ChannelModel { range: Some((-1.0, 1.0)), ..PERFECT };
    let dead = ChannelModel { disabled: true, ..PERFECT };
    assert_eq!(reported(&[coarse, narrow, narrow, dead], &[1.2, -3.0, 0.4, 7.0], 1), [1.0, -1.0, 0.4, 0.0]);
}

#[test]
fn noise_has_its_mean_and_standard_deviation() {
    const READINGS: usize = 20_000;
    let layout = layout(&[ChannelModel { noise_sd: 2e-6, ..PERFECT }]);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let none = ChannelErrors::none(&layout);
    let noise: Vec<f64> = (0..READINGS).map(|_| measure(&layout, &[0.0], &none, &mut rng)[0]).collect();
    let mean = noise.iter().sum::<f64>() / READINGS as f64;
    let variance = noise.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / READINGS as f64;
    assert!(mean.abs() < 5.0 * 2e-6 / (READINGS as f64).sqrt());
    assert!((variance.sqrt() / 2e-6 - 1.0).abs() < 0.03);
}

proptest! {
    #[test]
    fn a_fault_of_one_channel_leaves_the_others_as_they_were(seed: u64) {
        let noisy = ChannelModel { noise_sd: 1e-6, gain_error: 0.05, offset_error: 1e-6, ..PERFECT };
        let healthy = reported(&[noisy; 3], &[1e-3; 3], seed);
        let faulty = reported(&[noisy, ChannelModel { disabled: true, ..noisy }, noisy], &[1e-3; 3], seed);
        prop_assert_eq!([healthy[0], healthy[2]], [faulty[0], faulty[2]]);
        prop_assert_eq!(faulty[1], 0.0);
    }

    #[test]
    fn gains_and_offsets_stay_within_their_bounds(seed: u64) {
        let channel = ChannelModel { gain_error: 0.05, offset_error: 1e-4, ..PERFECT };
        let value = reported(&[channel], &[1.0], seed)[0];
        prop_assert!((value - 1.0).abs() <= 0.05 + 1e-4 + 1e-15);
        let errors = ChannelErrors::draw(&layout(&[PERFECT]), &mut Xoshiro256PlusPlus::seed_from_u64(seed));
        prop_assert_eq!(errors, ChannelErrors::none(&layout(&[PERFECT])));
    }
}

type Change = fn(&mut ChannelModel);

#[test]
fn a_number_of_a_channel_out_of_its_range_is_refused_from_callers_and_from_files() {
    let good = Layout::even(SensorKind::Deflection, 3, 0.4);
    let changes: [(Change, &str); 9] = [
        (|channel| channel.noise_sd = -1.0, "the noise is -1; it must be at least 0 and finite"),
        (|channel| channel.noise_sd = f64::NAN, "the noise is NaN; it must be at least 0 and finite"),
        (|channel| channel.resolution = -1.0, "the resolution is -1; it must be at least 0 and finite"),
        (|channel| channel.offset_error = -1.0, "the offset error is -1; it must be at least 0 and finite"),
        (
            |channel| channel.position_error_m = -1.0,
            "the position error in metres is -1; it must be at least 0 and finite",
        ),
        (|channel| channel.gain_error = 1.0, "the gain error is 1; it must be at least 0 and below 1"),
        (|channel| channel.gain_error = -0.1, "the gain error is -0.1; it must be at least 0 and below 1"),
        (
            |channel| channel.range = Some((0.0, f64::INFINITY)),
            "the upper end of the range is inf; it must be finite",
        ),
        (
            |channel| channel.range = Some((1.0, 1.0)),
            "the lower end of the range is 1; it must be finite and below the upper one",
        ),
    ];
    for (change, message) in changes {
        let mut sensors = good.clone().into_sensors();
        change(&mut sensors[1].channel);
        let text = serde_json::json!({ "sensors": sensors }).to_string();
        let refused = Layout::new(sensors).unwrap_err().to_string();
        assert_eq!(refused, format!("sensor 2: {message}"));
        assert!(serde_json::from_str::<Layout>(&text).is_err(), "{text}");
    }
}

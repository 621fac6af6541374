//! The limit compared with closed forms, simulation, and symmetries.

use std::sync::LazyLock;

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::contact::Position;
use crate::surface::{
    Beam, BeamSection, BeamSupport, BeamSupportKind, Extent, InfluenceFunction, Plate, SupportedBeam,
    SupportedBeamSpec,
};
use palpate_numerics::small::dot;

/// The founding paper's beam.
static BEAM: LazyLock<Beam> = LazyLock::new(|| Beam::new(0.4, 0.04, 0.0012, 200e9).unwrap());

fn with_noise(mut layout: Layout, noise_sd: f64) -> Layout {
    layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = noise_sd)).unwrap();
    layout
}

fn deflections(count: usize) -> Layout {
    with_noise(Layout::even(SensorKind::Deflection, count, BEAM.length_m()), 5e-6)
}

fn sd_mm(limit: &CramerRaoBound, a_mm: f64, force: Force) -> f64 {
    let contact = Contact { position: Position::along(a_mm * 1e-3), force_n: 3.0 };
    limit.bound_at(contact, force).unwrap().sd_x_m * 1e3
}

fn bound(layout: &Layout) -> CramerRaoBound<'static> {
    CramerRaoBound::new(&*BEAM, layout).unwrap()
}

fn warnings(layout: &Layout, force: Force) -> Vec<LimitWarning> {
    limit_warnings(&bound(layout), 3.0, force, Watch::NONE).unwrap()
}

#[test]
fn unknown_force_over_a_support_is_unidentifiable_and_not_in_the_summary() {
    let simple = |at_m| BeamSupport { at_m, kind: BeamSupportKind::Simple };
    let beam = SupportedBeam::new(SupportedBeamSpec {
        length_m: 24.0,
        youngs_modulus_pa: 30e9,
        sections: vec![BeamSection { to_m: 24.0, width_m: 0.3, thickness_m: 0.3 }],
        supports: vec![simple(0.0), simple(12.0), simple(24.0)],
    })
    .unwrap();
    for kind in [SensorKind::Strain, SensorKind::Slope, SensorKind::Deflection] {
        let layout = with_noise(Layout::even(kind, 6, 24.0), 1e-6);
        let limit = CramerRaoBound::new(&beam, &layout).unwrap();
        let at = |x_m, force| limit.bound_at(Contact { position: Position::along(x_m), force_n: 1e3 }, force);
        assert_eq!(at(12.0, Force::Unknown), None, "{kind}");
        assert!(at(12.0, Force::Known).is_some() && at(11.94, Force::Unknown).is_some(), "{kind}");
        let curve = LimitCurve::over_surface(&limit, 1e3, Force::Unknown).unwrap();
        let summary = curve.summary().unwrap();
        assert_eq!(summary.unidentifiable, 1);
        assert_eq!(curve.unidentifiable_text().unwrap(), "1 of 399 positions, 0.3 %, at 12000 mm");
        // The limit grows towards the support: its minimum is not over the support.
        let beside = at(11.94, Force::Unknown).unwrap().sd_position_m;
        assert!(summary.best.1 < beside && (summary.best.0.x_m - 12.0).abs() > 1.0, "{summary:?}");
        // A blind zone of several positions reports its largest limit, not the single position without one.
        let warnings = limit_warnings(&limit, 1e3, Force::Unknown, Watch::NONE).unwrap();
        let told = |warning: &LimitWarning| match warning {
            LimitWarning::Blind { zone, sd_m, .. } => zone.to.x_m - zone.from.x_m < 0.2 || sd_m.is_some(),
            _ => true,
        };
        assert!(warnings.iter().all(told), "{}", words(&warnings));
    }
}

fn words(warnings: &[LimitWarning]) -> String {
    warnings.iter().map(|warning| format!("{warning}\n  would help: {}\n", warning.help())).collect()
}

#[test]
fn the_papers_beam_has_the_limits_that_the_paper_leaves_room_for() {
    let limit = bound(&deflections(8));
    // The limit at 5 µm and 3 N, from an independent calculation.
    let known = [(1.0, 0.087), (50.0, 0.095), (100.0, 0.12), (200.0, 0.69)];
    let unknown = [(1.0, 8300.0), (20.0, 21.0), (50.0, 3.3), (200.0, 0.69)];
    for (force, figures) in [(Force::Known, known), (Force::Unknown, unknown)] {
        for (a_mm, limit_mm) in figures {
            let seen = sd_mm(&limit, a_mm, force);
            // The figures have two digits.
            assert!((seen / limit_mm - 1.0).abs() < 0.04, "{a_mm} mm, {force:?}: {seen}, not {limit_mm}");
        }
    }
    let summary = LimitCurve::over_surface(&limit, 3.0, Force::Known).unwrap().summary().unwrap();
    assert_eq!(format!("{:.3}", summary.mean_m * 1e3), "0.195");
    let ratio = summary.mean_error_m / summary.mean_m;
    assert!((ratio - std::f64::consts::FRAC_2_PI.sqrt()).abs() < 1e-9);
    assert_eq!(format!("{:.0} mm", summary.worst.0.x_m * 1e3), "200 mm");
    assert!(summary.best.1 <= summary.median_m && summary.median_m <= summary.mean_m);
    assert_eq!(summary.unidentifiable, 0);
}

#[test]
fn two_reactions_give_the_closed_form() {
    // R₁ = W·(l − a)/l and R₂ = W·a/l with noise σ: known force, σ·l/(W·√2); unknown force, position a = l·R₂/(R₁ + R₂)
    // and force R₁ + R₂ with σ·√((l − a)² + a²)/W and σ·√2.
    let mut layout = with_noise(Layout::even(SensorKind::Reaction, 2, BEAM.length_m()), 0.01);
    layout.edit(|sensors| sensors[0].position = Position::along(0.0)).unwrap();
    layout.edit(|sensors| sensors[1].position = Position::along(0.4)).unwrap();
    let limit = bound(&layout);
    for a_m in [0.0, 0.05, 0.2, 0.4] {
        let contact = Contact { position: Position::along(a_m), force_n: 3.0 };
        let known = limit.bound_at(contact, Force::Known).unwrap();
        assert!((known.sd_x_m - 0.01 * 0.4 / (3.0 * 2f64.sqrt())).abs() < 1e-12);
        assert_eq!((known.sd_force_n, known.sd_y_m), (None, 0.0));
        let unknown = limit.bound_at(contact, Force::Unknown).unwrap();
        assert!((unknown.sd_x_m - 0.01 * (0.4 - a_m).hypot(a_m) / 3.0).abs() < 1e-12);
        assert!((unknown.sd_force_n.unwrap() - 0.01 * 2f64.sqrt()).abs() < 1e-12);
    }
}

/// A plane with influence functions exp(−d²/2w²), with the distance d of sensor and contact.
struct Pad;

const PAD_WIDTH_M: f64 = 0.02;

struct Bump(Position);

impl InfluenceFunction for Bump {
    fn at(&self, contact: Position) -> f64 {
        1e-4 * (-0.5 * (self.0.distance_m(contact) / PAD_WIDTH_M).powi(2)).exp()
    }

    fn gradient(&self, contact: Position) -> [f64; 2] {
        let by_distance = -self.at(contact) / PAD_WIDTH_M.powi(2);
        [by_distance * (contact.x_m - self.0.x_m), by_distance * (contact.y_m - self.0.y_m)]
    }
}

impl Surface for Pad {
    fn influence_function(&self, _: SensorKind, sensor: Position) -> Arc<dyn InfluenceFunction + '_> {
        Arc::new(Bump(sensor))
    }

    fn is_supported_at(&self, _: Position) -> bool {
        false
    }

    fn full_scale(&self, kind: SensorKind) -> f64 {
        if kind == SensorKind::Deflection { 1e-4 } else { 0.0 }
    }

    fn extent(&self) -> Extent {
        Extent::plane(0.06, 0.04).unwrap()
    }
}

fn pad_layout(positions: &[(f64, f64)]) -> Layout {
    let mut layout = with_noise(Layout::even(SensorKind::Deflection, positions.len(), 0.06), 1e-6);
    let at = |sensors: &mut Vec<Sensor>| {
        for (sensor, &(x_m, y_m)) in sensors.iter_mut().zip(positions) {
            sensor.position = Position { x_m, y_m };
        }
    };
    layout.edit(at).unwrap();
    layout
}

#[test]
fn a_plane_has_a_bound_in_both_directions() {
    let corners = [(0.01, 0.01), (0.05, 0.01), (0.01, 0.03), (0.05, 0.03)];
    let four = pad_layout(&corners);
    let limit = CramerRaoBound::new(&Pad, &four).unwrap();
    let at =
        |x_m, y_m, force| limit.bound_at(Contact { position: Position { x_m, y_m }, force_n: 2.0 }, force);
    // In the centre of a symmetric layout the errors of x, y and force are independent: 1/√(Σ (∂y_i/∂x)²)
    // each.
    let centre = at(0.03, 0.02, Force::Unknown).unwrap();
    let reading = 2.0 * 1e-4 * (-0.5 * (4e-4 + 1e-4) / 4e-4_f64).exp() / 1e-6;
    let by_x = reading * 0.02 / 4e-4;
    assert!((centre.sd_x_m * 2.0 * by_x - 1.0).abs() < 1e-6, "{centre:?}");
    assert!((centre.sd_y_m / centre.sd_x_m - 2.0).abs() < 1e-6);
    assert!(centre.covariance_xy_m2.abs() < 1e-6 * centre.sd_x_m * centre.sd_y_m);
    assert!((centre.sd_position_m - centre.sd_x_m.hypot(centre.sd_y_m)).abs() < 1e-15);
    let known = at(0.035, 0.022, Force::Known).unwrap();
    let unknown = at(0.035, 0.022, Force::Unknown).unwrap();
    assert!(known.sd_x_m < unknown.sd_x_m && known.sd_position_m < unknown.sd_position_m);
    // Sensors on a line through the contact are insensitive to its motion across.
    let line = pad_layout(&corners.map(|(x_m, _)| (x_m, 0.02)));
    let limit = CramerRaoBound::new(&Pad, &line).unwrap();
    let contact = Contact { position: Position { x_m: 0.03, y_m: 0.02 }, force_n: 2.0 };
    assert_eq!(limit.bound_at(contact, Force::Known), None);
    let found = limit_warnings(&limit, 2.0, Force::Known, Watch::NONE).unwrap();
    // These sensors cannot distinguish the two sides of the line either.
    assert_eq!(found.iter().map(LimitWarning::kind).collect::<Vec<_>>(), ["mirror"], "{}", words(&found));
    let positions = positions_with_spacing(Pad.extent(), 5e-3).unwrap();
    let curve = LimitCurve::at_positions(&limit, 2.0, Force::Known, &positions).unwrap();
    assert_eq!(curve.points.len(), 11 * 7);
    assert_eq!(curve.summary().unwrap().unidentifiable, 11);
    // A figure by x is the mean across; every column has a position without a bound.
    let by_x = curve.by_x(|bound| bound.sd_position_m);
    assert_eq!(by_x.len(), 11);
    assert!(by_x.is_sorted_by(|a, b| a.0 < b.0) && by_x.iter().all(|(_, mean)| mean.is_nan()));
    let four = CramerRaoBound::new(&Pad, &four).unwrap();
    let at = [0.018, 0.022].map(|y_m| Position { x_m: 0.03, y_m });
    let curve = LimitCurve::at_positions(&four, 2.0, Force::Known, &at).unwrap();
    let bounds = curve.points.iter().map(|point| point.bound.unwrap().sd_x_m);
    assert_eq!(curve.by_x(|bound| bound.sd_x_m), [(0.03, bounds.sum::<f64>() / 2.0)]);
}

/// The position with the readings nearest to `reading` (whitened): maximum likelihood, with a fitted force if
/// it is unknown.
fn most_likely(limit: &CramerRaoBound, reading: &[f64], near_m: f64, step_m: f64, force: Force) -> f64 {
    let cost = |a_m: f64| {
        let shape = limit.whitened_reading(Contact { position: Position::along(a_m), force_n: 3.0 });
        let scale = match force {
            Force::Known => 1.0,
            Force::Unknown => dot(&shape, reading) / dot(&shape, &shape),
        };
        shape.iter().zip(reading).map(|(s, r)| (r - scale * s).powi(2)).sum::<f64>()
    };
    // Golden-section search: the cost has one minimum within a few standard deviations.
    let (mut low, mut high) = (near_m - step_m, near_m + step_m);
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    while high - low > 1e-4 * step_m {
        let (left, right) = (high - ratio * (high - low), low + ratio * (high - low));
        if cost(left) < cost(right) { high = right } else { low = left }
    }
    low.midpoint(high)
}

#[test]
fn maximum_likelihood_scatter_equals_the_bound() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(20);
    let limit = bound(&deflections(8));
    const DRAWS: usize = 4000;
    for (a_mm, force) in [
        (5.0, Force::Known),
        (50.0, Force::Known),
        (130.0, Force::Known),
        (130.0, Force::Unknown),
        (200.0, Force::Unknown),
    ] {
        let contact = Contact { position: Position::along(a_mm * 1e-3), force_n: 3.0 };
        let bound = limit.bound_at(contact, force).unwrap();
        let clean = limit.whitened_reading(contact);
        let errors: Vec<f64> = (0..DRAWS)
            .map(|_| {
                let noisy: Vec<f64> =
                    clean.iter().map(|value| value + rng.sample::<f64, _>(StandardNormal)).collect();
                most_likely(&limit, &noisy, contact.position.x_m, 8.0 * bound.sd_x_m, force)
                    - contact.position.x_m
            })
            .collect();
        let sd_m = (errors.iter().map(|e| e * e).sum::<f64>() / DRAWS as f64).sqrt();
        let mean_m = errors.iter().map(|e| e.abs()).sum::<f64>() / DRAWS as f64;
        // The relative error of the standard deviation of 4000 draws is 1/√8000 = 1.1 %; that of the mean 1.2
        // %.
        assert!((sd_m / bound.sd_x_m - 1.0).abs() < 0.04, "{a_mm} mm, {force:?}: {}", sd_m / bound.sd_x_m);
        assert!((mean_m / bound.mean_error_m() - 1.0).abs() < 0.045, "{a_mm} mm, {force:?}");
    }
}

proptest! {
    #[test]
    fn less_noise_more_force_and_more_sensors_lower_the_limit(a in 0.002..0.398_f64, factor in 1.5..10.0_f64) {
        let at = |layout: &Layout, force_n, force| {
            let contact = Contact { position: Position::along(a), force_n };
            bound(layout).bound_at(contact, force).unwrap().sd_x_m
        };
        let layout = deflections(8);
        for force in [Force::Known, Force::Unknown] {
            let limit = at(&layout, 3.0, force);
            prop_assert!((at(&with_noise(layout.clone(), factor * 5e-6), 3.0, force) / limit / factor - 1.0).abs() < 1e-6);
            prop_assert!((at(&layout, factor * 3.0, force) * factor / limit - 1.0).abs() < 1e-6);
            let mut more = layout.clone();
            more.edit(|sensors| sensors.extend(deflections(3).into_sensors())).unwrap();
            prop_assert!(at(&more, 3.0, force) < limit);
            let mirrored = bound(&layout).bound_at(Contact { position: Position::along(0.4 - a), force_n: 3.0 }, force);
            prop_assert!((mirrored.unwrap().sd_x_m / limit - 1.0).abs() < 1e-4);
        }
        prop_assert!(at(&layout, 3.0, Force::Known) <= at(&layout, 3.0, Force::Unknown) * (1.0 + 1e-9));
    }
}

#[test]
fn disabled_channel_equals_an_absent_one() {
    let mut dead = deflections(8);
    dead.set_disabled(2, true);
    // A dead channel needs no noise.
    dead.edit(|sensors| sensors[2].channel.noise_sd = 0.0).unwrap();
    let mut without = deflections(8);
    without.edit(|sensors| drop(sensors.remove(2))).unwrap();
    let (dead, without) = (bound(&dead), bound(&without));
    assert_eq!(dead.enabled_count(), 7);
    for force in [Force::Known, Force::Unknown] {
        assert_eq!(sd_mm(&dead, 130.0, force), sd_mm(&without, 130.0, force));
    }
    let whole = bound(&deflections(8));
    assert!(sd_mm(&dead, 130.0, Force::Known) > sd_mm(&whole, 130.0, Force::Known));
}

#[test]
fn quantisation_is_noise_of_a_twelfth_of_its_square() {
    let mut coarse = with_noise(deflections(8), 3e-6);
    coarse
        .edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.resolution = 4e-6 * 12f64.sqrt()))
        .unwrap();
    let (coarse, plain) = (bound(&coarse), bound(&deflections(8)));
    let ratio = sd_mm(&coarse, 70.0, Force::Known) / sd_mm(&plain, 70.0, Force::Known);
    assert!((ratio - 1.0).abs() < 1e-12);
    let mut silent = with_noise(deflections(8), 0.0);
    silent.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.resolution = 1e-6)).unwrap();
    assert!(CramerRaoBound::new(&*BEAM, &silent).is_ok());
}

#[test]
fn saturated_channel_has_no_information() {
    let mut saturating = deflections(8);
    saturating.edit(|sensors| sensors[3].channel.range = Some((-1e-3, 1e-3))).unwrap();
    let mut without = deflections(8);
    without.edit(|sensors| drop(sensors.remove(3))).unwrap();
    let whole = deflections(8);
    let [saturating, without, whole] = [saturating, without, whole].map(|layout| {
        let limit = bound(&layout);
        [10.0, 200.0].map(|a_mm| sd_mm(&limit, a_mm, Force::Known))
    });
    assert_eq!(saturating[1], without[1], "3 N at mid-span lower sensor 4 by more than 1 mm");
    assert_eq!(saturating[0], whole[0], "next to the support they lower it by less");
}

#[test]
fn missing_limit_has_a_reason() {
    let clean = with_noise(deflections(8), 0.0);
    let mut one_clean = deflections(8);
    one_clean.edit(|sensors| sensors[4].channel.noise_sd = 0.0).unwrap();
    let mut dead = deflections(2);
    dead.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.disabled = true)).unwrap();
    let said = |layout: &Layout| CramerRaoBound::new(&*BEAM, layout).err().unwrap().to_string();
    let no_model = LimitError::NoModel.to_string();
    let limit = bound(&deflections(8));
    let force = |force_n| LimitCurve::over_surface(&limit, force_n, Force::Known).unwrap_err().to_string();
    let every = |every_m| positions_with_spacing(BEAM.extent(), every_m).unwrap_err().to_string();
    insta::assert_snapshot!(
        [
            said(&clean),
            said(&one_clean),
            said(&dead),
            no_model,
            force(0.0),
            force(f64::NAN),
            every(0.5),
            every(1e-9)
        ]
        .join("\n")
    );
}

#[test]
fn no_information_is_none_and_never_infinite() {
    let limit = bound(&deflections(8));
    let at = |x_m, force_n, force| limit.bound_at(Contact { position: Position::along(x_m), force_n }, force);
    assert_eq!(at(0.0, 3.0, Force::Unknown), None);
    assert_eq!(at(0.4, 3.0, Force::Unknown), None);
    assert_eq!(at(0.2, 0.0, Force::Known), None);
    assert_eq!(at(0.2, f64::NAN, Force::Known), None);
    assert!(at(0.0, 3.0, Force::Known).is_some(), "the beam tilts when a known force leaves its support");
    // One sensor cannot determine two parameters, and is insensitive to a small motion of a force right above it.
    let one = bound(&deflections(1));
    let contact = |x_m| Contact { position: Position::along(x_m), force_n: 3.0 };
    assert_eq!(one.bound_at(contact(0.1), Force::Unknown), None);
    assert_eq!(one.bound_at(contact(0.2), Force::Known), None);
    assert!(one.bound_at(contact(0.1), Force::Known).is_some());
}

#[test]
fn the_papers_beam_is_ambiguous_next_to_its_supports_and_nowhere_else() {
    let found = warnings(&deflections(8), Force::Known);
    insta::assert_snapshot!(words(&found));
}

#[test]
fn with_an_unknown_force_the_papers_beam_is_blind_next_to_its_supports() {
    insta::assert_snapshot!(words(&warnings(&deflections(8), Force::Unknown)));
}

#[test]
fn one_sensor_at_mid_span_cannot_distinguish_left_from_right() {
    insta::assert_snapshot!(words(&warnings(&deflections(1), Force::Known)));
}

#[test]
fn loud_sensors_miss_contacts_next_to_the_supports() {
    insta::assert_snapshot!(words(&warnings(&with_noise(deflections(8), 5e-5), Force::Known)));
}

#[test]
fn reactions_are_sensitive_where_deflections_are_not() {
    let mut layout = deflections(8);
    let mut supports = with_noise(Layout::even(SensorKind::Reaction, 2, 0.4), 0.01);
    supports.edit(|sensors| sensors[0].position = Position::along(0.0)).unwrap();
    supports.edit(|sensors| sensors[1].position = Position::along(0.4)).unwrap();
    layout.edit(|sensors| sensors.extend(supports.into_sensors())).unwrap();
    assert_eq!(warnings(&layout, Force::Unknown), vec![]);
    assert_eq!(warnings(&layout, Force::Known), vec![]);
}

#[test]
fn many_sensors_solved_for_by_contact_have_the_limit_of_their_functions() {
    let plate = Plate::simply_supported((0.3, 0.2), 8e-4, 200e9, 0.3).unwrap().with_elements(24).unwrap();
    let mut layout = with_noise(Layout::even(SensorKind::Deflection, 30, 0.3), 5e-6);
    let spread = |sensors: &mut Vec<Sensor>| {
        for (i, sensor) in sensors.iter_mut().enumerate() {
            let [x_m, y_m] = [0.05 * (i % 6 + 1) as f64 - 0.025, 0.04 * (i / 6 + 1) as f64 - 0.02];
            sensor.position = Position { x_m, y_m };
        }
        sensors[7].channel.disabled = true;
        sensors[8].channel.range = Some((-1e-4, 1e-4));
    };
    layout.edit(spread).unwrap();
    let functions = CramerRaoBound::new(&plate, &layout).unwrap();
    let responses = Responses::with_most_functions(&plate, &layout, 3, Watch::NONE).unwrap();
    let by_contact = CramerRaoBound { responses, ..functions.clone() };
    let off_grid = Position { x_m: 0.123, y_m: 0.045 };
    by_contact.prepare(&[off_grid], Watch::NONE).unwrap();
    for force in [Force::Known, Force::Unknown] {
        let [one, other] = [&functions, &by_contact].map(|limit| {
            let summary = LimitCurve::over_surface(limit, 2.0, force).unwrap().summary().unwrap();
            let contact = Contact { position: Position { x_m: 0.0777, y_m: 0.1 }, force_n: 2.0 };
            let alone = limit.bound_at(contact, force).unwrap().sd_position_m;
            let signal = limit.signal_to_noise(Contact { position: off_grid, force_n: 2.0 });
            let warnings = limit_warnings(limit, 2.0, force, Watch::NONE).unwrap();
            ([summary.mean_m, summary.median_m, summary.worst.1, alone, signal], warnings)
        });
        assert!(one.0.iter().zip(&other.0).all(|(a, b)| (a / b - 1.0).abs() < 1e-7), "{one:?} {other:?}");
        assert_eq!(words(&one.1), words(&other.1));
        let mirrors: Vec<_> = other.1.iter().filter(|warning| warning.kind() == "mirror").collect();
        assert!(force == Force::Unknown || !mirrors.is_empty());
        for warning in mirrors {
            let LimitWarning::Mirror { at, twin, distance, .. } = *warning else { panic!("{warning}") };
            let [a, b] = [at, twin].map(|at| functions.whitened_readings(&[at], 2.0).remove(0));
            let found = match force {
                Force::Known => a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt(),
                Force::Unknown => (dot(&a, &a) - dot(&a, &b).powi(2) / dot(&b, &b)).sqrt(),
            };
            assert!((found - distance).abs() < 1e-5, "{warning}: {found}");
        }
    }
    let stop = |_| false;
    assert_eq!(by_contact.prepare(&[], Watch::new(&stop)), Err(Cancelled));
    let stopped = limit_warnings(&by_contact, 2.0, Force::Known, Watch::new(&stop));
    assert_eq!(stopped, Err(LimitError::Cancelled(Cancelled)));
}

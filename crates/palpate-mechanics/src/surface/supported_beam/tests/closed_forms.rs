//! Beams with tabulated influence functions (Young and Budynas, *Roark's Formulas*, table 8.1).

use super::*;

const L: f64 = 0.4;

fn stiffness() -> f64 {
    PAPER.bending_stiffness()
}

fn same(found: f64, expected: f64, scale: f64) {
    assert!((found - expected).abs() <= 1e-11 * scale.abs(), "{found} instead of {expected}");
}

fn contacts() -> impl Iterator<Item = f64> {
    (0..=16).map(|i| f64::from(i) * L / 16.0)
}

#[test]
fn on_two_simple_supports_it_is_the_closed_form_of_the_beam() {
    let found = beam(&paper_on(&[(0.0, Simple), (L, Simple)]));
    let difference = largest_difference(&*PAPER, &found, &[0.0, L]);
    assert!(difference < 1e-10, "{difference:e}");
    for kind in [Deflection, Slope, Strain, Reaction] {
        same(found.full_scale(kind), PAPER.full_scale(kind), PAPER.full_scale(kind));
    }
}

#[test]
fn a_cantilever() {
    let (found, ei) = (beam(&paper_on(&[(0.0, Clamped), (L, Free)])), stiffness());
    for a in contacts() {
        same(at(&found, Deflection, L, a), -a * a * (3.0 * L - a) / (6.0 * ei), L.powi(3) / (3.0 * ei));
        same(at(&found, Slope, L, a), -a * a / (2.0 * ei), L * L / (2.0 * ei));
        let root = -0.5 * PAPER.thickness_m() * a / ei;
        same(at(&found, Strain, 0.0, a), root, 0.5 * PAPER.thickness_m() * L / ei);
        same(at(&found, Reaction, 0.0, a), 1.0, 1.0);
    }
    same(found.full_scale(Deflection), L.powi(3) / (3.0 * ei), L.powi(3) / (3.0 * ei));
    same(found.full_scale(Strain), 0.5 * PAPER.thickness_m() * L / ei, found.full_scale(Strain));
    // With the clamp at the other end, the beam is mirrored.
    let mirrored = beam(&paper_on(&[(L, Clamped)]));
    same(at(&mirrored, Strain, L, 0.1), at(&found, Strain, 0.0, L - 0.1), found.full_scale(Strain));
    same(at(&mirrored, Slope, 0.1, 0.0), -at(&found, Slope, L - 0.1, L), found.full_scale(Slope));
}

#[test]
fn a_propped_cantilever() {
    let found = beam(&paper_on(&[(0.0, Clamped), (L, Simple)]));
    for a in contacts() {
        let prop = a * a * (3.0 * L - a) / (2.0 * L.powi(3));
        same(at(&found, Reaction, L, a), prop, 1.0);
        same(at(&found, Reaction, 0.0, a), 1.0 - prop, 1.0);
        // Moment at the clamp, of load and prop.
        let root = 0.5 * PAPER.thickness_m() * (prop * L - a) / stiffness();
        same(at(&found, Strain, 0.0, a), root, found.full_scale(Strain));
    }
}

#[test]
fn clamped_at_both_ends() {
    let found = beam(&paper_on(&[(0.0, Clamped), (L, Clamped)]));
    same(at(&found, Deflection, 0.2, 0.2), -L.powi(3) / (192.0 * stiffness()), found.full_scale(Deflection));
    for a in contacts() {
        let b = L - a;
        same(at(&found, Reaction, 0.0, a), b * b * (3.0 * a + b) / L.powi(3), 1.0);
        let root = -0.5 * PAPER.thickness_m() * a * b * b / (L * L * stiffness());
        same(at(&found, Strain, 0.0, a), root, found.full_scale(Strain));
    }
}

/// Clapeyron's equation of three moments, for a force on the left one of two equal spans.
#[test]
fn a_continuous_beam_of_two_spans() {
    let span = 0.5 * L;
    let found = beam(&paper_on(&[(0.0, Simple), (span, Simple), (L, Simple)]));
    for a in (0..=10).map(|i| f64::from(i) * span / 10.0) {
        let moment = a * (span * span - a * a) / (4.0 * span * span);
        same(at(&found, Reaction, 0.0, a), (span - a) / span - moment / span, 1.0);
        same(at(&found, Reaction, L, a), -moment / span, 1.0);
        same(at(&found, Reaction, span, a), a / span + 2.0 * moment / span, 1.0);
        let strain = -0.5 * PAPER.thickness_m() * moment / stiffness();
        same(at(&found, Strain, span, a), strain, found.full_scale(Strain));
    }
    same(at(&found, Reaction, span, 0.5 * span), 11.0 / 16.0, 1.0);
}

#[test]
fn an_overhang_rises_when_the_span_is_pressed_and_the_span_rises_when_the_overhang_is() {
    let (span, over, ei) = (0.3, 0.1, stiffness());
    let found = beam(&paper_on(&[(0.0, Simple), (span, Simple)]));
    same(at(&found, Deflection, L, L), -over * over * L / (3.0 * ei), found.full_scale(Deflection));
    for x in [0.05, 0.1, 0.2] {
        let rise = over * x * (span * span - x * x) / (6.0 * ei * span);
        same(at(&found, Deflection, x, L), rise, found.full_scale(Deflection));
        same(at(&found, Deflection, L, x), rise, found.full_scale(Deflection));
    }
    same(at(&found, Reaction, 0.0, L), -over / span, 1.0);
    same(at(&found, Reaction, span, L), 1.0 + over / span, 1.0);
    same(found.full_scale(Reaction), 1.0 + over / span, 1.0);
}

#[test]
fn a_spring_under_an_end_adds_its_own_give() {
    let k = 500.0;
    let found = beam(&paper_on(&[(0.0, Simple), (L, spring(k, None))]));
    for a in contacts() {
        for x in contacts() {
            let rigid = at(&*PAPER, Deflection, x, a);
            same(at(&found, Deflection, x, a), rigid - a * x / (L * L * k), found.full_scale(Deflection));
        }
        same(at(&found, Reaction, L, a), a / L, 1.0);
    }
    same(found.full_scale(Deflection), 1.0 / k, 1.0 / k);
}

#[test]
fn a_clamp_that_yields_and_turns() {
    let (k, turning, ei) = (300.0, 4.0, stiffness());
    let found = beam(&paper_on(&[(0.0, spring(k, Some(turning)))]));
    let tip = -(L.powi(3) / (3.0 * ei) + L * L / turning + 1.0 / k);
    same(at(&found, Deflection, L, L), tip, tip);
}

#[test]
fn a_slide_holds_the_slope_only() {
    let found = beam(&paper_on(&[(0.0, Clamped), (L, Guided)]));
    let tip = -L.powi(3) / (12.0 * stiffness());
    same(at(&found, Deflection, L, L), tip, tip);
    same(at(&found, Slope, L, 0.2), 0.0, found.full_scale(Slope));
    same(at(&found, Reaction, 0.0, 0.3), 1.0, 1.0);
    assert!(!found.is_supported_at(Position::along(L)));
}

#[test]
fn a_stepped_cantilever() {
    let sections = vec![
        BeamSection { to_m: 0.15, width_m: 0.04, thickness_m: 0.0024 },
        BeamSection { to_m: L, width_m: 0.02, thickness_m: 0.0012 },
    ];
    let spec = SupportedBeamSpec { sections, ..paper_on(&[(0.0, Clamped)]) };
    let [thick, thin] = [0, 1].map(|i| spec.sections[i].bending_stiffness(200e9));
    let found = beam(&spec);
    let rest = L - 0.15;
    let tip = -((L.powi(3) - rest.powi(3)) / (3.0 * thick) + rest.powi(3) / (3.0 * thin));
    same(at(&found, Deflection, L, L), tip, tip);
    // At the step the strain is that of the section to the right.
    let step = -0.5 * 0.0012 * rest / thin;
    same(at(&found, Strain, 0.15, L), step, step);
    same(at(&found, Strain, 0.15 - 1e-6, L), -0.5 * 0.0024 * (rest + 1e-6) / thick, step);
}

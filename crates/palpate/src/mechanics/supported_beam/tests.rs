use super::*;
use crate::mechanics::Beam;

const PAPER: Beam = Beam { length_m: 0.4, width_m: 0.04, thickness_m: 0.0012, youngs_modulus_pa: 200e9 };

fn paper_on(supports: &[(f64, BeamSupportKind)]) -> SupportedBeam {
    SupportedBeam::new(SupportedBeamSpec {
        length_m: 0.4,
        youngs_modulus_pa: 200e9,
        sections: vec![BeamSection { to_m: 0.4, width_m: 0.04, thickness_m: 0.0012 }],
        supports: supports.iter().map(|&(at_m, kind)| BeamSupport { at_m, kind }).collect(),
    })
    .unwrap()
}

#[test]
fn on_two_simple_supports_it_is_the_closed_form() {
    let beam = paper_on(&[(0.0, BeamSupportKind::Simple), (0.4, BeamSupportKind::Simple)]);
    for kind in SensorKind::ALL {
        let full_scale = PAPER.full_scale(kind);
        println!("{kind} {} {}", full_scale, beam.full_scale(kind)/full_scale-1.0);
        let mut worst: f64 = 0.0;
        for i in 0..=40 { for j in 0..=80 {
            let (s, a) = (Position::along(0.01*f64::from(i)), Position::along(0.005*f64::from(j)));
            let (f,g) = (PAPER.influence_function(kind, s), beam.influence_function(kind, s));
            let d = (f.at(a)-g.at(a)).abs()/full_scale.max(1e-300);
            if d > 1e-10 { println!("{kind} {s:?} {a:?} {} {}", f.at(a), g.at(a)); }
            worst = worst.max(d);
        }}
        println!("{kind} {worst:e}");
    }
}

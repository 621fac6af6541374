//! Strips whose presses are not quite where and as hard as the recording says.

use super::*;

/// Forces that are recorded wrong by so much of themselves, and positions by so much, in standard deviations.
#[derive(Clone, Copy, Debug)]
struct Wrong {
    force: f64,
    position_m: f64,
}

/// Presses at other places and with other forces than recorded.
fn record_wrong(bench: &mut Bench, wrong: Wrong) {
    for row in &mut bench.presses {
        let mut normal = || -> f64 { StandardNormal.sample(&mut bench.rng) };
        let force_n = row.force_n.unwrap() * (1.0 + wrong.force * normal());
        let position_m = (row.position.x_m + wrong.position_m * normal()).clamp(0.0, STRIP_M);
        row.reading = {
            let clean = (bench.influences)(Position::along(position_m)).into_iter().zip(&bench.offsets);
            clean.map(|(f, offset)| offset + force_n * f + normal()).collect()
        };
    }
}

#[test]
fn scattered_presses_are_weighed_by_their_scatter() {
    const CASES: [Wrong; 4] = [
        Wrong { force: 0.0, position_m: 0.0 },
        Wrong { force: 0.03, position_m: 0.0 },
        Wrong { force: 0.0, position_m: 1e-3 },
        Wrong { force: 0.03, position_m: 1e-3 },
    ];
    // The most presses take the most time, and tell scatter the best; docs/explanation/measured.md has all three.
    let sizes: &[(usize, usize)] =
        if benches(0) == 0 { &[(25, 9), (60, 15)] } else { &[(25, 9), (60, 15), (120, 30)] };
    for (presses, places) in sizes.iter().copied() {
        for wrong in CASES {
            let mut comparison = Comparison::default();
            for seed in 0..benches(2) {
                let mut bench = Bench::strip(seed, presses, places);
                let touches = bench.touches(100);
                record_wrong(&mut bench, wrong);
                let theirs = Regression::spline(places.min(15)).errors_mm(&bench.presses, &touches);
                comparison.add(&bench, &bench.fit_as(Structure::Auto), &touches, theirs);
            }
            comparison.print(&format!("strip, {presses} presses at {places} places, {wrong:?}"));
            let (_, [ours_mm, theirs_mm]) = Comparison::summary(&comparison.means);
            let covered = mean(comparison.covered.iter().copied());
            assert!(
                ours_mm < theirs_mm && (0.86..0.995).contains(&covered),
                "{wrong:?}: {ours_mm} mm, {covered}"
            );
        }
    }
}

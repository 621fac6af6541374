//! Log evidence of components.

use super::*;
use crate::influence::force_linear::component::Component;
use crate::influence::force_linear::noise_prior::NoisePrior;
use crate::influence::force_linear::prior::Source;
use crate::influence::force_linear::source_grid::SourceGrid;

/// Point sensors beside the smooth functions of a strip pressed at 12 places.
fn component(noises: &[NoisePrior], presses: &CalibrationRows, ratios: Vec<f64>) -> Component {
    let extent = Extent::line(STRIP_M).unwrap();
    let prior = Prior {
        source: Some(Source::Strain),
        lengths_m: vec![0.2 * STRIP_M],
        ..Prior::smooth(extent, presses)
    };
    Component::new(presses, prior, noises, &SourceGrid::new(extent), ratios).unwrap()
}

fn presses() -> CalibrationRows {
    let bench = Bench::strip(3, 12, 12);
    let (setup, recording) = (bench.setup(), bench.recording());
    CalibrationRows::of_recording(&setup, &recording, Averaging::Consecutive, &[]).unwrap()
}

/// Middles of equal steps of ln ρ over nine decades.
fn ratios(per_decade: i32) -> Vec<f64> {
    let log = |k: i32| (f64::from(k) + 0.5) / f64::from(per_decade) - 8.5;
    (0..9 * per_decade).map(|k| 10f64.powf(log(k))).collect()
}

#[test]
fn evidence_does_not_depend_on_the_step_of_the_ratios() {
    let presses = presses();
    let noises = NoisePrior::candidates(&presses);
    let log_evidence = |per_decade: i32| component(&noises, &presses, ratios(per_decade)).log_evidence();
    let [decades, halves, quarters] = [1, 2, 4].map(log_evidence);
    // Six channels with twice as many ratios each would add 6·ln 2 = 4.2.
    assert!((halves - decades).abs() < 0.05, "{decades} {halves}");
    assert!((quarters - halves).abs() < 0.01, "{halves} {quarters}");
}

#[test]
fn skipped_residues_do_not_change_the_evidence() {
    let presses = presses();
    let noises = NoisePrior::candidates(&presses);
    let together = component(&noises, &presses, ratios(1)).by_noise();
    for (noise, log_evidence) in noises.into_iter().zip(together) {
        // The widest prior of one is the prior itself, which skips more residues.
        let alone = component(&[noise], &presses, ratios(1)).by_noise()[0];
        assert!((alone - log_evidence).abs() < 1e-9, "{alone} {log_evidence}");
    }
}

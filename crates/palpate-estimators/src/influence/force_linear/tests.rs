//! Strips with raw gauges, by known physics: a clamped strip under random gauges, gains and offsets, pressed at a few places with recorded
//! forces and asked with unknown ones; beside it what fifteen lines of SciPy do: offset + force × cubic spline of the position.

use super::{ForceLinearLocator, Linearity, fit};
use crate::fit::{FitTask, Locate};
use crate::recording::{Provenance, Recording, Row};
use crate::setup::Setup;
use ndarray::{Array1, Array2};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::{BeamSection, BeamSupport, BeamSupportKind, SupportedBeam, SupportedBeamSpec};
use palpate_mechanics::surface::{Extent, Surface, SurfaceSpec};
use palpate_numerics::{Cholesky, mean, median};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const LENGTH_M: f64 = 0.3;
const GAUGES: usize = 6;
/// The outermost places.
const ENDS_M: (f64, f64) = (0.02, 0.28);

/// A strip, its raw gauges, and how it is pressed.
struct Bench {
    /// Counts per newton of each gauge as a function of the position.
    influence: Box<dyn Fn(f64) -> Vec<f64>>,
    offsets: Vec<f64>,
    presses: Vec<Touch>,
    touches: Vec<Touch>,
}

/// A contact and the counts that the gauges read.
struct Touch {
    x_m: f64,
    force_n: f64,
    counts: Vec<f64>,
}

impl Bench {
    fn new(seed: u64, presses: usize, places: usize) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let clamp = |at_m: f64| BeamSupport { at_m, kind: BeamSupportKind::Clamped };
        let strip = SupportedBeam::new(SupportedBeamSpec {
            length_m: LENGTH_M,
            youngs_modulus_pa: 70e9,
            supports: vec![clamp(0.0), clamp(LENGTH_M)],
            sections: vec![BeamSection { to_m: LENGTH_M, width_m: 0.03, thickness_m: 1e-3 }],
        });
        let strip = strip.unwrap();
        let pitch_m = LENGTH_M / GAUGES as f64;
        let places_m: Vec<f64> =
            (0..GAUGES).map(|i| pitch_m * (i as f64 + 0.5 + rng.random_range(-0.25..0.25))).collect();
        let gains: Vec<f64> = (0..GAUGES).map(|_| rng.random_range(0.7..1.3)).collect();
        let full_scale = strip.full_scale(SensorKind::Strain);
        let influence = move |x_m: f64| {
            let gauge = |(at_m, gain): (&f64, &f64)| {
                let function = strip.influence_function(SensorKind::Strain, Position::along(*at_m));
                60.0 * gain * function.at(Position::along(x_m)) / full_scale
            };
            places_m.iter().zip(&gains).map(gauge).collect::<Vec<f64>>()
        };
        let offsets: Vec<f64> = (0..GAUGES).map(|_| rng.random_range(-500.0..500.0)).collect();
        let mut bench = Self { influence: Box::new(influence), offsets, presses: Vec::new(), touches: Vec::new() };
        let place_m = |i: usize| ENDS_M.0 + (ENDS_M.1 - ENDS_M.0) * (i % places) as f64 / (places - 1) as f64;
        bench.presses = (0..presses).map(|i| bench.touch(place_m(i), &mut rng)).collect();
        bench.touches = (0..100)
            .map(|_| {
                let x_m = rng.random_range(ENDS_M.0..ENDS_M.1);
                bench.touch(x_m, &mut rng)
            })
            .collect();
        bench
    }

    fn touch(&self, x_m: f64, rng: &mut Xoshiro256PlusPlus) -> Touch {
        let force_n = rng.random_range(0.5..5.0);
        let clean = (self.influence)(x_m).into_iter().zip(&self.offsets);
        let counts = clean.map(|(f, offset)| {
            let noise: f64 = StandardNormal.sample(rng);
            offset + force_n * f + noise
        });
        Touch { x_m, force_n, counts: counts.collect() }
    }

    fn setup() -> Setup {
        let layout = Layout::even(SensorKind::Raw, GAUGES, LENGTH_M);
        let surface = SurfaceSpec::Measured(Extent::Line { length_m: LENGTH_M });
        Setup { surface, layout, force_n: None, columns: None }
    }

    fn recording(&self) -> Recording {
        let row = |press: &Touch| Row {
            position: Position::along(press.x_m),
            force_n: Some(press.force_n),
            nuisance: None,
            reading: press.counts.clone(),
        };
        Recording {
            channels: (0..GAUGES).map(|c| format!("gauge_{c}")).collect(),
            kinds: vec![SensorKind::Raw; GAUGES],
            rows: self.presses.iter().map(row).collect(),
            provenance: Provenance { source: "test".into(), rows: 0, digests: vec![], seed: None },
        }
    }

    fn fit(&self) -> ForceLinearLocator {
        let (setup, recording) = (Self::setup(), self.recording());
        fit(FitTask::new(&setup, &recording), Linearity::Forced).unwrap().unwrap()
    }

    /// Errors of the locator in millimetres, and the share of its intervals that hold the contact.
    fn errors_mm(&self) -> (Vec<f64>, f64) {
        let locator = self.fit();
        let (mut errors, mut covered) = (Vec::new(), 0);
        for touch in &self.touches {
            let estimate = locator.locate(&touch.counts);
            errors.push(1e3 * (estimate.contact.position.x_m - touch.x_m).abs());
            let (low_m, high_m) = estimate.contact.uncertainty.map_or((0.0, 0.0), |u| u.x_95_m);
            covered += usize::from((low_m..=high_m).contains(&touch.x_m));
        }
        (errors, covered as f64 / self.touches.len() as f64)
    }

    /// Errors of offset + force × cubic spline, fitted by least squares with a coefficient for every place, and asked by least squares.
    fn spline_errors_mm(&self, coefficients: usize) -> Vec<f64> {
        let basis = |x_m: f64| cubic_basis((x_m - ENDS_M.0) / (ENDS_M.1 - ENDS_M.0), coefficients);
        let n = 1 + coefficients;
        let design = Array2::from_shape_fn((self.presses.len(), n), |(i, j)| match j {
            0 => 1.0,
            _ => self.presses[i].force_n * basis(self.presses[i].x_m)[j - 1],
        });
        let normal = design.t().dot(&design) + Array2::from_diag(&Array1::from_elem(n, 1e-9));
        let normal = Cholesky::factor(normal).unwrap();
        let solutions: Vec<Array1<f64>> = (0..GAUGES)
            .map(|c| {
                let counts: Array1<f64> = self.presses.iter().map(|press| press.counts[c]).collect();
                normal.solve(&design.t().dot(&counts))
            })
            .collect();
        const STEPS: usize = 1300;
        let grid: Vec<(f64, Vec<f64>)> = (0..=STEPS)
            .map(|i| {
                let x_m = ENDS_M.0 + (ENDS_M.1 - ENDS_M.0) * i as f64 / STEPS as f64;
                let basis = basis(x_m);
                let f = |c: &Array1<f64>| basis.iter().zip(c.iter().skip(1)).map(|(b, c)| b * c).sum();
                (x_m, solutions.iter().map(f).collect())
            })
            .collect();
        let error = |touch: &Touch| {
            let d: Vec<f64> = touch.counts.iter().zip(&solutions).map(|(counts, c)| counts - c[0]).collect();
            let misfit = |f: &[f64]| {
                let (fd, ff) = f.iter().zip(&d).fold((0.0, 0.0), |(fd, ff), (f, d)| (fd + f * d, ff + f * f));
                let force_n = (fd / ff).max(0.0);
                f.iter().zip(&d).map(|(f, d)| (d - force_n * f).powi(2)).sum::<f64>()
            };
            let best = grid.iter().min_by(|a, b| misfit(&a.1).total_cmp(&misfit(&b.1))).unwrap();
            1e3 * (best.0 - touch.x_m).abs()
        };
        self.touches.iter().map(error).collect()
    }
}

/// The cubic B-splines over even knots from 0 to 1 with fourfold ends (de Boor's recursion).
fn cubic_basis(t: f64, count: usize) -> Vec<f64> {
    let pieces = count - 3;
    let knot = |i: usize| (i.saturating_sub(3).min(pieces)) as f64 / pieces as f64;
    let t = t.clamp(0.0, 1.0);
    let cell = ((t * pieces as f64) as usize).min(pieces - 1) + 3;
    let mut values: Vec<f64> = (0..count + 3).map(|i| f64::from(u8::from(i == cell))).collect();
    for degree in 1..=3 {
        for i in 0..count + 3 - degree {
            let part = |from: usize, to: usize, at: f64| {
                let width = knot(to) - knot(from);
                if width > 0.0 { at / width } else { 0.0 }
            };
            let left = part(i, i + degree, t - knot(i));
            let right = part(i + 1, i + degree + 1, knot(i + degree + 1) - t);
            values[i] = left * values[i] + right * values.get(i + 1).copied().unwrap_or(0.0);
        }
    }
    values.truncate(count);
    values
}

#[test]
fn print_strips() {
    let count: u64 = std::env::var("BENCHES").ok().and_then(|s| s.parse().ok()).unwrap_or(10);
    let presses: usize = std::env::var("PRESSES").ok().and_then(|s| s.parse().ok()).unwrap_or(25);
    let places: usize = std::env::var("PLACES").ok().and_then(|s| s.parse().ok()).unwrap_or(9);
    let (mut ours, mut theirs, mut cover) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..count {
        let bench = Bench::new(seed, presses, places);
        let (errors, covered) = bench.errors_mm();
        let spline = bench.spline_errors_mm(places.min(9));
        let m = |e: &[f64]| (median(e.to_vec()).unwrap(), mean(e.iter().copied()));
        let (a, b) = (m(&errors), m(&spline));
        let l = bench.fit();
        eprintln!("{seed}: ours {:.2}/{:.2}, spline {:.2}/{:.2}, covered {covered:.2} {:?} noise {:.2?}", a.0, a.1, b.0, b.1, l.correlation(), l.noise_sd().collect::<Vec<_>>());
        ours.push(a);
        theirs.push(b);
        cover.push(covered);
    }
    let all = |v: &[(f64, f64)]| (mean(v.iter().map(|v| v.0)), mean(v.iter().map(|v| v.1)));
    let wins = |f: fn(&(f64, f64)) -> f64| ours.iter().zip(&theirs).filter(|(a, b)| f(a) <= f(b)).count();
    eprintln!("all: ours {:.2?} spline {:.2?} cover {:.3} wins median {} mean {}", all(&ours), all(&theirs), mean(cover.iter().copied()), wins(|v| v.0), wins(|v| v.1));
}

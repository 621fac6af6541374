//! Strips and plates with raw gauges, by known physics: random gauges, gains and offsets, a calibration at a
//! few positions with recorded forces, and contacts of unknown force. The reference is a regression with
//! SciPy: offset + force × cubic spline of the position.

use super::locator::{ForceLinearContents, Tables};
use super::posterior::Functions;
use super::prior::Prior;
use super::{ForceLinearLocator, evidence, fit, fit_condensed, posterior};
use crate::fit::Fit;
use crate::fit::{FitTask, Locate};
use crate::fixtures::CoverageTally;
use crate::influence::calibration::{Averaging, CalibrationRows};
use crate::influence::{Influence, InfluenceFitError, InfluenceLocator, Structure};
use crate::recording::{Recording, Row};
use crate::setup::Setup;
use ndarray::{Array1, Array2};
use palpate_core::Status;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::plate::{Edge, Edges, PlateSpec};
use palpate_mechanics::surface::{
    BeamSection, BeamSupport, BeamSupportKind, SupportedBeam, SupportedBeamSpec,
};
use palpate_mechanics::surface::{Extent, Plate, Surface};
use palpate_numerics::watch::Watch;
use palpate_numerics::{Cholesky, mean, median};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::rc::Rc;

mod component;
mod drift;
mod edges;
mod ends;
mod few;
mod force_range;
mod likelihood;
mod loads;
mod missing_channel;
mod noise;
mod one_weight;
mod saturating;
mod scatter;

const STRIP_M: f64 = 0.3;
const PLATE_M: [f64; 2] = [0.2, 0.15];
const GAUGES: usize = 6;
/// Least distance of contacts from the surface's ends.
const MARGIN_M: f64 = 0.02;
/// Largest influence of a gauge of gain 1, in counts per newton.
const FULL_SCALE: f64 = 60.0;
const FORCES_N: std::ops::Range<f64> = 0.5..5.0;

/// Counts per newton of each gauge as a function of the position.
type Influences = Box<dyn Fn(Position) -> Vec<f64>>;

/// Raw gauges under a surface, and calibration rows.
struct Bench {
    extent: Extent,
    influences: Influences,
    offsets: Vec<f64>,
    rng: Xoshiro256PlusPlus,
    presses: Vec<Row>,
}

impl Bench {
    /// Clamped strip over strain gauges.
    fn strip(seed: u64, presses: usize, places: usize) -> Self {
        Self::strip_over(GAUGES, seed, presses, places)
    }

    fn strip_over(gauge_count: usize, seed: u64, presses: usize, places: usize) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let clamp = |at_m: f64| BeamSupport { at_m, kind: BeamSupportKind::Clamped };
        let strip = SupportedBeam::new(SupportedBeamSpec {
            length_m: STRIP_M,
            youngs_modulus_pa: 70e9,
            supports: vec![clamp(0.0), clamp(STRIP_M)],
            sections: vec![BeamSection { to_m: STRIP_M, width_m: 0.03, thickness_m: 1e-3 }],
        });
        let pitch_m = STRIP_M / gauge_count as f64;
        let gauges: Vec<Position> = (0..gauge_count)
            .map(|i| Position::along(pitch_m * (i as f64 + 0.5 + rng.random_range(-0.25..0.25))))
            .collect();
        let influences = raw_influences(strip.unwrap(), SensorKind::Strain, gauges, &mut rng);
        let place = |i: usize| {
            let share = (i % places) as f64 / (places - 1) as f64;
            Position::along(MARGIN_M + (STRIP_M - 2.0 * MARGIN_M) * share)
        };
        let pressed = (0..presses).map(place).collect();
        Self::new(Extent::line(STRIP_M).unwrap(), gauge_count, influences, pressed, rng)
    }

    /// Simply supported plate over deflection sensors, pressed twice at each of 10 × 8 positions.
    fn plate(seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let [length_m, width_m] = PLATE_M;
        let plate = Plate::new(PlateSpec {
            length_m,
            width_m,
            thickness_m: 1e-3,
            youngs_modulus_pa: 70e9,
            poissons_ratio: 0.3,
            edges: Edges::all(Edge::Simple),
            supports: Vec::new(),
            elements: 24,
        });
        let sensors = (0..GAUGES)
            .map(|i| Position {
                x_m: length_m * ((i % 3) as f64 + 1.0 + rng.random_range(-0.2..0.2)) / 4.0,
                y_m: width_m * ((i / 3) as f64 + 1.0 + rng.random_range(-0.2..0.2)) / 3.0,
            })
            .collect();
        let influences = raw_influences(plate.unwrap(), SensorKind::Deflection, sensors, &mut rng);
        let place = |i: usize| {
            let share = |k: usize, n: usize| k as f64 / (n - 1) as f64;
            Position {
                x_m: MARGIN_M + (length_m - 2.0 * MARGIN_M) * share(i % 10, 10),
                y_m: MARGIN_M + (width_m - 2.0 * MARGIN_M) * share(i / 10 % 8, 8),
            }
        };
        Self::new(
            Extent::plane(length_m, width_m).unwrap(),
            GAUGES,
            influences,
            (0..160).map(place).collect(),
            rng,
        )
    }

    fn new(
        extent: Extent,
        gauges: usize,
        influences: Influences,
        pressed: Vec<Position>,
        mut rng: Xoshiro256PlusPlus,
    ) -> Self {
        let offsets = (0..gauges).map(|_| rng.random_range(-500.0..500.0)).collect();
        let mut bench = Self { extent, influences, offsets, rng, presses: Vec::new() };
        bench.presses = pressed.into_iter().map(|at| bench.touch(at)).collect();
        bench
    }

    /// Contact of random force, with noise of one count on every gauge.
    fn touch(&mut self, position: Position) -> Row {
        let force_n = self.rng.random_range(FORCES_N);
        self.row(position, force_n)
    }

    fn row(&mut self, position: Position, force_n: f64) -> Row {
        let reading = self.counts(position, force_n);
        Row { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading }
    }

    fn counts(&mut self, position: Position, force_n: f64) -> Vec<f64> {
        let clean = (self.influences)(position).into_iter().zip(&self.offsets);
        let noise = || StandardNormal.sample(&mut self.rng);
        clean
            .map(|(f, offset)| offset + force_n * f)
            .zip(std::iter::repeat_with(noise))
            .map(|(a, b): (f64, f64)| a + b)
            .collect()
    }

    /// Contacts at random positions within the margins.
    fn touches(&mut self, count: usize) -> Vec<Row> {
        let size_m = [self.extent.length_m(), self.extent.width_m().unwrap_or(0.0)];
        (0..count)
            .map(|_| {
                let x_m = self.rng.random_range(MARGIN_M..size_m[0] - MARGIN_M);
                let across =
                    self.extent.width_m().map(|width_m| self.rng.random_range(MARGIN_M..width_m - MARGIN_M));
                self.touch(Position { x_m, y_m: across.unwrap_or(0.0) })
            })
            .collect()
    }

    fn setup(&self) -> Setup {
        let names: Vec<String> = (0..self.offsets.len()).map(|c| format!("gauge_{c}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let length_m = self.extent.length_m();
        match self.extent.width_m() {
            None => Setup::measured(length_m, &names),
            Some(width_m) => Setup::measured_plane(length_m, width_m, &names),
        }
        .unwrap()
    }

    fn recording(&self) -> Recording {
        Recording::new(self.setup().layout(), "bench", self.presses.clone())
    }

    fn fit_as(&self, structure: Structure) -> InfluenceLocator {
        let (setup, recording) = (self.setup(), self.recording());
        let config = Influence { structure, ..Influence::default() };
        config.fit_method(FitTask::new(&setup, &recording)).unwrap()
    }

    /// Locator with the true offsets, influence functions and noise.
    fn with_known_functions(&self, locator: &ForceLinearLocator) -> ForceLinearLocator {
        let mut stored = ForceLinearContents::from(locator.clone());
        let (x, y) = (stored.x, stored.y);
        let places =
            (0..x.count).flat_map(|i| (0..y.count).map(move |j| (x.value(i as f64), y.value(j as f64))));
        let readings: Vec<Vec<f64>> =
            places.map(|(x_m, y_m)| (self.influences)(Position { x_m, y_m })).collect();
        let functions: Vec<Functions> = (0..self.offsets.len())
            .map(|c| Functions {
                offset: self.offsets[c],
                noise_variance: 1.0,
                values: readings.iter().map(|reading| reading[c]).collect(),
                offset_variance: 0.0,
                variances: vec![0.0; readings.len()],
                covariances: vec![0.0; readings.len()],
            })
            .collect();
        stored.functions = Tables::new(&functions);
        stored.noise_freedom = 1e6;
        stored.into_locator()
    }

    fn fit(&self, structure: Structure) -> Option<ForceLinearLocator> {
        let (setup, recording) = (self.setup(), self.recording());
        fit(FitTask::new(&setup, &recording), structure).unwrap()
    }
}

/// Readings per newton of gauges with different gains, in counts.
fn raw_influences(
    surface: impl Surface + 'static,
    kind: SensorKind,
    gauges: Vec<Position>,
    rng: &mut Xoshiro256PlusPlus,
) -> Influences {
    let scale = FULL_SCALE / surface.full_scale(kind);
    let gains: Vec<f64> = gauges.iter().map(|_| scale * rng.random_range(0.7..1.3)).collect();
    Box::new(move |at| {
        let functions = gauges.iter().map(|gauge| surface.influence_function(kind, *gauge));
        functions.zip(&gains).map(|(function, gain)| gain * function.at(at)).collect()
    })
}

/// Least-squares regression of reading = offset + force × Σ coefficient × basis(position), and the grid on
/// which least squares locate readings.
#[derive(Clone)]
struct Regression {
    basis: Rc<dyn Fn(Position) -> Vec<f64>>,
    grid: Vec<Position>,
    drift: Drift,
}

/// Model of the offsets in a regression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drift {
    /// Constant.
    None,
    /// Proportional to time, or to the row number.
    Linear,
}

impl Regression {
    /// Cubic spline with a coefficient for every calibrated position.
    fn spline(places: usize) -> Self {
        const STEPS: usize = 1300;
        let span_m = STRIP_M - 2.0 * MARGIN_M;
        let basis = move |at: Position| cubic_basis((at.x_m - MARGIN_M) / span_m, places);
        let grid = (0..=STEPS).map(|i| Position::along(MARGIN_M + span_m * i as f64 / STEPS as f64));
        Self { basis: Rc::new(basis), grid: grid.collect(), drift: Drift::None }
    }

    /// Cubic radial basis functions r³ around every calibrated position, and a plane.
    fn radial_basis(presses: &[Row]) -> Self {
        const STEPS: [usize; 2] = [160, 110];
        let mut centres: Vec<Position> = presses.iter().map(|row| row.position).collect();
        centres.sort_by(Position::cmp_by_x_then_y);
        centres.dedup();
        let unit_m = PLATE_M[0];
        let basis = move |at: Position| {
            let radial = centres.iter().map(|centre| (at.distance_m(*centre) / unit_m).powi(3));
            radial.chain([1.0, at.x_m / unit_m, at.y_m / unit_m]).collect()
        };
        let place =
            |i: usize, n: usize, size_m: f64| MARGIN_M + (size_m - 2.0 * MARGIN_M) * i as f64 / n as f64;
        let grid = (0..=STEPS[0]).flat_map(|i| (0..=STEPS[1]).map(move |j| (i, j))).map(|(i, j)| Position {
            x_m: place(i, STEPS[0], PLATE_M[0]),
            y_m: place(j, STEPS[1], PLATE_M[1]),
        });
        Self { basis: Rc::new(basis), grid: grid.collect(), drift: Drift::None }
    }

    fn with_linear_drift(&self) -> Self {
        Self { drift: Drift::Linear, ..self.clone() }
    }

    fn errors_mm(&self, presses: &[Row], touches: &[Row]) -> Vec<f64> {
        // Time runs from -1 to 0: the constant is the offset at the recording's end.
        let time = |i: usize, row: &Row| match (self.drift, row.time_s, presses[presses.len() - 1].time_s) {
            (Drift::None, ..) => Vec::new(),
            (Drift::Linear, Some(time), Some(end)) => vec![time / end - 1.0],
            (Drift::Linear, ..) => vec![i as f64 / (presses.len() - 1) as f64 - 1.0],
        };
        let row = |(i, row): (usize, &Row)| -> Vec<f64> {
            let force_n = row.force_n.unwrap();
            let influences = (self.basis)(row.position).into_iter().map(|b| force_n * b);
            std::iter::once(1.0).chain(influences).chain(time(i, row)).collect()
        };
        let rows: Vec<Vec<f64>> = presses.iter().enumerate().map(row).collect();
        let design = Array2::from_shape_fn((rows.len(), rows[0].len()), |(i, j)| rows[i][j]);
        let ridge = Array2::from_diag(&Array1::from_elem(rows[0].len(), 1e-7));
        let normal = Cholesky::factor(design.t().dot(&design) + ridge).unwrap();
        let solutions: Vec<Array1<f64>> = (0..GAUGES)
            .map(|c| {
                let counts: Array1<f64> = presses.iter().map(|press| press.reading[c]).collect();
                normal.solve(&design.t().dot(&counts))
            })
            .collect();
        let influence = |at: &Position| -> Vec<f64> {
            let basis = (self.basis)(*at);
            solutions.iter().map(|c| basis.iter().zip(c.iter().skip(1)).map(|(b, c)| b * c).sum()).collect()
        };
        let table: Vec<Vec<f64>> = self.grid.iter().map(influence).collect();
        let error_mm = |touch: &Row| {
            let d: Vec<f64> = touch.reading.iter().zip(&solutions).map(|(counts, c)| counts - c[0]).collect();
            let misfit = |f: &[f64]| {
                let (fd, ff) = f.iter().zip(&d).fold((0.0, 0.0), |(fd, ff), (f, d)| (fd + f * d, ff + f * f));
                let force_n = (fd / ff).max(0.0);
                f.iter().zip(&d).map(|(f, d)| (d - force_n * f).powi(2)).sum::<f64>()
            };
            let misfits: Vec<f64> = table.iter().map(|f| misfit(f)).collect();
            let best = (0..misfits.len()).min_by(|a, b| misfits[*a].total_cmp(&misfits[*b])).unwrap();
            1e3 * self.grid[best].distance_m(touch.position)
        };
        touches.iter().map(error_mm).collect()
    }
}

/// Cubic B-splines over even knots from 0 to 1 with fourfold ends (de Boor's recursion).
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

/// Errors of a locator in millimetres, and coverage of the 95 % regions.
fn errors_mm(locator: &impl Locate, touches: &[Row]) -> (Vec<f64>, f64) {
    let (mut errors, mut covered) = (Vec::new(), 0);
    for touch in touches {
        let contact = locator.locate(&touch.reading).contact;
        errors.push(1e3 * contact.position.distance_m(touch.position));
        covered += usize::from(contact.uncertainty.is_some_and(|uncertainty| {
            let (low_m, high_m) = uncertainty.x_95_m;
            (low_m..=high_m).contains(&touch.position.x_m)
        }));
    }
    (errors, covered as f64 / touches.len() as f64)
}

/// Errors over many benches, beside those of a regression.
#[derive(Default)]
struct Comparison {
    /// Median and mean error of each bench in millimetres: locator, regression.
    medians: Vec<[f64; 2]>,
    means: Vec<[f64; 2]>,
    covered: Vec<f64>,
    /// Mean error of each bench in millimetres with known influence functions: the limit.
    limits: Vec<f64>,
}

impl Comparison {
    /// Adds a bench with the errors of a regression.
    fn add(&mut self, bench: &Bench, locator: &InfluenceLocator, touches: &[Row], theirs: Vec<f64>) {
        if let InfluenceLocator::ForceLinear(linear) = locator {
            let (limits, _) = errors_mm(&bench.with_known_functions(linear), touches);
            self.limits.push(mean(limits));
        }
        let (ours, covered) = errors_mm(locator, touches);
        self.means.push([&ours, &theirs].map(|errors| mean(errors.iter().copied())));
        self.medians.push([ours, theirs].map(|errors| median(errors).unwrap()));
        self.covered.push(covered);
    }

    /// Share of benches with errors no larger than the regression's; mean errors of both.
    fn summary(list: &[[f64; 2]]) -> (f64, [f64; 2]) {
        let won = list.iter().filter(|[ours, theirs]| ours <= theirs).count();
        (won as f64 / list.len() as f64, [0, 1].map(|side| mean(list.iter().map(|pair| pair[side]))))
    }
}

/// Locators of a structure on strips, beside the spline.
fn compare_strips(count: u64, (presses, places): (usize, usize), structure: Structure) -> Comparison {
    let mut comparison = Comparison::default();
    for seed in 0..count {
        let mut bench = Bench::strip(seed, presses, places);
        let touches = bench.touches(100);
        let theirs = Regression::spline(places.min(15)).errors_mm(&bench.presses, &touches);
        comparison.add(&bench, &bench.fit_as(structure), &touches, theirs);
    }
    comparison
}

/// Coverage of contacts by boards in turn; each board draws its own contacts.
fn covered(
    boards: &mut [(Bench, ForceLinearLocator)],
    readings: usize,
    mut contact: impl FnMut(&mut Xoshiro256PlusPlus) -> Contact,
) -> CoverageTally {
    let mut row = CoverageTally::default();
    let count = boards.len();
    for i in 0..readings {
        let (bench, locator) = &mut boards[i % count];
        let contact = contact(&mut bench.rng);
        let reading = bench.counts(contact.position, contact.force_n);
        row.add(&locator.locate(&reading), contact);
    }
    row
}

/// Sample of the experiment `raw-strips`.
#[test]
fn strips_are_located_better_than_by_a_spline() {
    for (presses, places) in [(25, 9), (60, 15)] {
        let comparison = compare_strips(2, (presses, places), Structure::Auto);
        let ((won, _), (won_mean, [ours_mm, theirs_mm])) =
            (Comparison::summary(&comparison.medians), Comparison::summary(&comparison.means));
        // On 50 strips of the experiment all errors are smaller, by half in the mean.
        assert!(won == 1.0 && won_mean == 1.0, "worse than the spline: {won} {won_mean}");
        assert!(ours_mm <= 0.8 * theirs_mm, "{ours_mm} {theirs_mm}");
        let (limit_mm, covered) =
            (mean(comparison.limits.iter().copied()), mean(comparison.covered.iter().copied()));
        assert!(
            presses < 60 || ours_mm <= 1.3 * limit_mm,
            "{ours_mm} mm, {limit_mm} mm with known functions"
        );
        // Four standard deviations of 200 touches below 95 %.
        assert!(covered >= 0.89, "{covered}");
    }
}

#[test]
fn the_structure_of_elastic_surfaces_is_worth_more_than_half_of_the_error() {
    let [linear, free] =
        [Structure::ForceLinear, Structure::Free].map(|structure| compare_strips(1, (25, 9), structure));
    let mean_mm = |comparison: &Comparison| Comparison::summary(&comparison.means).1[0];
    assert!(mean_mm(&linear) < 0.5 * mean_mm(&free), "{} {}", mean_mm(&linear), mean_mm(&free));
}

/// Sample of the experiment `raw-strips`: errors on plates are a seventh below the regression's, at the
/// limit.
#[test]
fn plates_are_located_better_than_by_radial_basis_functions() {
    let mut comparison = Comparison::default();
    let mut bench = Bench::plate(0);
    let touches = bench.touches(60);
    let theirs = Regression::radial_basis(&bench.presses).errors_mm(&bench.presses, &touches);
    comparison.add(&bench, &bench.fit_as(Structure::Auto), &touches, theirs);
    let (_, [ours_mm, theirs_mm]) = Comparison::summary(&comparison.means);
    let limit_mm = mean(comparison.limits.iter().copied());
    assert!(ours_mm < theirs_mm && ours_mm < 1.2 * limit_mm, "{ours_mm} {theirs_mm} {limit_mm}");
    // Three standard deviations of 60 touches below 95 %.
    let covered = mean(comparison.covered.iter().copied());
    assert!(covered >= 0.865, "{covered}");
}

#[test]
fn an_untouched_board_is_no_contact() {
    let mut bench = Bench::strip(1, 60, 15);
    let locator = bench.fit_as(Structure::Auto);
    const COUNT: usize = 3000;
    let untouched = (0..COUNT)
        .filter(|_| locator.locate(&bench.counts(Position::along(0.15), 0.0)).status == Status::NoContact);
    let touched = untouched.count();
    assert!(touched >= COUNT * 998 / 1000, "{touched} of {COUNT}");
}

#[test]
fn rows_without_force_teach_offset_and_noise() {
    let mut bench = Bench::strip(2, 5, 5);
    let few = bench.fit(Structure::ForceLinear).unwrap();
    for _ in 0..40 {
        let reading = bench.counts(Position::along(0.1), 0.0);
        bench.presses.push(Row {
            position: Position::along(0.1),
            force_n: Some(0.0),
            nuisances: Vec::new(),
            time_s: None,
            reading,
        });
    }
    let more = bench.fit(Structure::ForceLinear).unwrap();
    for (c, offset) in bench.offsets.iter().enumerate() {
        let [few, more] = [&few, &more].map(|locator| (locator.channels().nth(c).unwrap().1 - offset).abs());
        assert!(more < 0.6, "gauge {c}: offset off by {more}, by {few} without rows of force 0");
    }
    for (.., noise) in more.channels() {
        assert!((0.6..1.5).contains(&noise), "{noise}");
    }
}

/// Replaces readings by a power of the force, which may change along the strip.
fn bend_response(bench: &mut Bench, powers: [f64; 2]) {
    for row in &mut bench.presses {
        let force_n = row.force_n.unwrap();
        let power = powers[0] + (powers[1] - powers[0]) * row.position.x_m / STRIP_M;
        for (value, offset) in row.reading.iter_mut().zip(&bench.offsets) {
            *value = offset + (*value - offset) * (force_n / 5.0).powf(power - 1.0);
        }
    }
}

#[test]
fn a_response_that_all_places_share_is_found() {
    let mut bench = Bench::strip(3, 60, 15);
    assert_eq!(bench.fit(Structure::Auto).unwrap().response(), 1.0);
    bend_response(&mut bench, [1.6, 1.6]);
    let locator = bench.fit(Structure::Auto).unwrap();
    assert!((locator.response() - 1.6).abs() < 0.05, "{}", locator.response());
    let ratio = |row: &Row| locator.locate(&row.reading).contact.force_n.unwrap() / row.force_n.unwrap();
    let errors = bench.presses.iter().map(|row| ratio(row).ln().abs()).collect();
    assert!(median(errors).unwrap() < 0.05);
    assert_eq!(bench.fit(Structure::ForceLinear).unwrap().response(), 1.0);
}

#[test]
fn a_response_that_changes_along_the_surface_is_left_to_the_free_structure() {
    let mut bench = Bench::strip(3, 60, 15);
    bend_response(&mut bench, [0.7, 2.0]);
    assert!(bench.fit(Structure::Auto).is_none());
    assert!(matches!(bench.fit_as(Structure::Auto), InfluenceLocator::Measured(_)));
    assert!(matches!(bench.fit_as(Structure::ForceLinear), InfluenceLocator::ForceLinear(_)));
}

#[test]
fn readings_that_hardly_follow_the_force_are_left_to_the_free_structure() {
    let mut bench = Bench::strip(3, 60, 15);
    bend_response(&mut bench, [0.03, 0.03]);
    assert!(bench.fit(Structure::Auto).is_none());
    let forced = bench.fit(Structure::ForceMonotone).unwrap();
    assert!((0.1..0.3).contains(&forced.response()), "{}", forced.response());
}

#[test]
fn presses_that_nothing_explains_are_set_aside() {
    for (presses, places) in [(25, 9), (60, 15)] {
        let mut bench = Bench::strip(8, presses, places);
        assert_eq!(bench.fit(Structure::Auto).unwrap().set_aside(), [0usize; 0]);
        let touches = bench.touches(100);
        let clean = mean(errors_mm(&bench.fit(Structure::Auto).unwrap(), &touches).0);
        // One row has a wrong position, another a misread gauge.
        bench.presses[4].position.x_m += 0.05;
        bench.presses[16].reading[2] += 60.0;
        let locator = bench.fit(Structure::Auto).unwrap();
        assert_eq!(locator.set_aside(), [4, 16]);
        let mended = mean(errors_mm(&locator, &touches).0);
        assert!(mended < 1.3 * clean, "{mended} mm, {clean} mm without outliers");
    }
}

#[test]
fn one_force_alone_tells_no_offset() {
    let mut bench = Bench::strip(4, 30, 10);
    bench.presses.iter_mut().for_each(|row| row.force_n = Some(2.0));
    assert!(bench.fit(Structure::Auto).is_none());
    let (setup, recording) = (bench.setup(), bench.recording());
    let forced = Influence { structure: Structure::ForceLinear, ..Influence::default() };
    let error = forced.fit_method(FitTask::new(&setup, &recording)).unwrap_err();
    assert_eq!(error, InfluenceFitError::NoForces);
}

#[test]
fn a_channel_that_never_changes_is_left_out() {
    let mut bench = Bench::strip(5, 40, 10);
    bench.presses.iter_mut().for_each(|row| row.reading[2] = 7.0);
    let locator = bench.fit(Structure::ForceLinear).unwrap();
    assert_eq!(locator.channels().map(|(c, ..)| c).collect::<Vec<_>>(), [0, 1, 3, 4, 5]);
    let mut touch = bench.touch(Position::along(0.12));
    touch.reading[2] = -1e6;
    let contact = locator.locate(&touch.reading).contact;
    assert!((contact.position.x_m - 0.12).abs() < 5e-3 && contact.force_n.is_some(), "{contact:?}");
}

#[test]
fn a_file_gives_the_same_locator_and_bad_numbers_are_refused() {
    let bench = Bench::strip(6, 12, 6);
    let locator = bench.fit(Structure::ForceLinear).unwrap();
    let json = serde_json::to_string(&locator).unwrap();
    assert_eq!(serde_json::from_str::<ForceLinearLocator>(&json).unwrap(), locator);
    let bad = json.replacen("\"offset_variances\":[", "\"offset_variances\":[-", 1);
    let error = serde_json::from_str::<ForceLinearLocator>(&bad).unwrap_err().to_string();
    assert!(error.contains("offset variance"), "{error}");
    let mut file = serde_json::to_value(&locator).unwrap();
    file["shared_errors"] = serde_json::json!(vec![0.5; GAUGES]);
    let sharing: ForceLinearLocator = serde_json::from_value(file.clone()).unwrap();
    assert_eq!(serde_json::to_value(&sharing).unwrap(), file);
    for (loadings, what) in
        [(vec![0.5; 2], "loadings"), (vec![1.5; GAUGES], "loading"), (vec![-1e308; GAUGES], "-1")]
    {
        file["shared_errors"] = serde_json::json!(loadings);
        let error = serde_json::from_value::<ForceLinearLocator>(file.clone()).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
}

#[test]
fn the_determinant_of_many_gauges_does_not_overflow() {
    let mut bench = Bench::strip_over(48, 7, 60, 15);
    let locator = bench.fit(Structure::ForceLinear).unwrap();
    let mut file = serde_json::to_value(&locator).unwrap();
    // Nearly noiseless gauges: the product of their variances overflows.
    file["functions"]["offset_variances"] = serde_json::json!(vec![1e12; 48]);
    let locator: ForceLinearLocator = serde_json::from_value(file).unwrap();
    let touch = bench.touch(Position::along(0.1234));
    let contact = locator.locate(&touch.reading).contact;
    let (low_m, high_m) = contact.uncertainty.expect("some place explains the reading").x_95_m;
    assert!(low_m < high_m, "{contact:?}");
}

#[test]
fn estimates_are_those_of_a_plain_sum_over_the_grid() {
    const PER_NODE: usize = 40;
    let mut bench = Bench::strip(9, 25, 9);
    let touches = bench.touches(40);
    let mut precise = Bench::strip(10, 60, 15);
    for row in &mut precise.presses {
        // Nearly noiseless: a cell is many standard deviations wide.
        let clean = (precise.influences)(row.position);
        let force_n = row.force_n.unwrap();
        row.reading = clean.iter().zip(&precise.offsets).map(|(f, offset)| offset + force_n * f).collect();
    }
    // Uncertain influences, with common-mode errors.
    let mut open = ends::six_places(1, 1);
    let open_touches = open.touches(40);
    for (bench, touches) in [(&bench, &touches), (&precise, &precise.presses.clone()), (&open, &open_touches)]
    {
        let locator = bench.fit(Structure::ForceLinear).unwrap();
        for row in touches {
            let (found, all) =
                (locator.locate(&row.reading), locator.summed_everywhere(&row.reading, PER_NODE));
            let sd_m = all.uncertainty.unwrap().covariance[0].sqrt();
            let apart_m = found.contact.position.distance_m(all.position);
            assert!(found.contact.uncertainty.is_some(), "{found:?} {all:?}");
            // The estimate is one of several modes.
            assert!(
                found.status == Status::Ambiguous || apart_m < 0.1 * sd_m + 5e-5,
                "{apart_m} m of {sd_m} m: {found:?} {all:?}"
            );
        }
    }
}

/// Noise and signal of a gauge.
const GAUGE_FIT: evidence::ChannelFit =
    evidence::ChannelFit { ratio: 1e-4, signal: 1e4, evidence: 0.0, sources: Vec::new() };

/// Functions of the first gauge along a strip, under a smooth prior.
fn functions_of(presses: &CalibrationRows, prior: &Prior) -> Functions {
    let places_m: Vec<Vec<f64>> = (0..50).map(|i| vec![STRIP_M * f64::from(i) / 49.0]).collect();
    let conditions = posterior::Conditions::of_fits(prior, &[GAUGE_FIT], &[0]);
    posterior::functions(&conditions, presses, &[], &places_m, Watch::NONE).unwrap().remove(0)
}

#[test]
fn presses_that_come_to_their_places_again_are_thinned_at_all_of_them() {
    let bench = Bench::strip(0, 600, 10);
    let presses =
        CalibrationRows::of_recording(&bench.setup(), &bench.recording(), Averaging::Consecutive, &[])
            .unwrap();
    for most in [150, 60, 599] {
        let few = presses.thinned(most);
        assert_eq!((few.len(), few.positions_m().len()), (most, 10));
        assert!(few.row.is_sorted_by(|a, b| a < b));
    }
}

#[test]
fn presses_of_the_same_places_are_condensed_without_loss() {
    let bench = Bench::strip(3, 120, 15);
    let presses =
        CalibrationRows::of_recording(&bench.setup(), &bench.recording(), Averaging::Consecutive, &[])
            .unwrap();
    for response in [1.0, 0.7] {
        let prior = Prior { response, ..Prior::smooth(bench.extent, &presses) };
        let condensed = presses.condensed(&prior, &vec![GAUGE_FIT; GAUGES], 30, Watch::NONE).unwrap();
        assert_eq!((presses.len(), condensed.len()), (120, 30));
        let rows = |presses: &CalibrationRows| {
            presses.len() as f64 + presses.repeats.degrees_of_freedom.iter().sum::<f64>()
        };
        assert_eq!(rows(&presses), rows(&condensed));
        let [all, few] = [&presses, &condensed].map(|presses| functions_of(presses, &prior));
        let same = |a: f64, b: f64| (a - b).abs() < 1e-7 * a.abs().max(1.0);
        assert!(same(all.offset, few.offset) && same(all.offset_variance, few.offset_variance));
        for k in 0..all.values.len() {
            assert!(same(all.values[k], few.values[k]), "{} {}", all.values[k], few.values[k]);
            assert!(same(all.variances[k], few.variances[k]));
        }
    }
}

/// Mean errors in millimetres on a plate with random positions: by all presses, and by condensed ones.
fn condensed_mm(presses: usize, condensed: usize, touches: usize) -> [f64; 2] {
    let mut bench = Bench::plate(1);
    bench.presses = bench.touches(presses);
    let touches = bench.touches(touches);
    let (setup, recording) = (bench.setup(), bench.recording());
    let found = [usize::MAX, condensed].map(|most| {
        let task = FitTask::new(&setup, &recording);
        let locator = fit_condensed(task, Structure::ForceLinear, most).unwrap().unwrap();
        assert!(most < presses || locator.presses() == presses);
        mean(errors_mm(&locator, &touches).0)
    });
    eprintln!(
        "plate, {presses} presses: mean {:.3} mm; {:.3} mm from {condensed} in their place",
        found[0], found[1]
    );
    found
}

#[test]
fn many_presses_all_over_a_plate_are_condensed_with_hardly_a_loss() {
    let [exact_mm, condensed_mm] = condensed_mm(300, 100, 1000);
    assert!(condensed_mm < 1.05 * exact_mm, "{condensed_mm} mm, {exact_mm} mm");
}

#[test]
fn six_hundred_presses_all_over_a_plate_are_condensed_with_hardly_a_loss() {
    let [exact_mm, condensed_mm] = condensed_mm(600, 200, 1000);
    assert!(condensed_mm < 1.03 * exact_mm, "{condensed_mm} mm, {exact_mm} mm");
}

#[test]
fn presses_that_nothing_explains_are_set_aside_among_many() {
    let plate = |seed| {
        let mut bench = Bench::plate(seed);
        bench.presses = bench.touches(450);
        bench
    };
    for mut bench in [Bench::strip(21, 450, 60), plate(22)] {
        let condensed = |bench: &Bench| {
            let (setup, recording) = (bench.setup(), bench.recording());
            fit_condensed(FitTask::new(&setup, &recording), Structure::ForceLinear, 150).unwrap().unwrap()
        };
        let touches = bench.touches(200);
        let clean = condensed(&bench);
        assert_eq!(clean.set_aside(), [0usize; 0]);
        // Some rows have wrong positions, others a misread gauge.
        let moved = [17, 170, 333];
        let misread = [40, 41, 42, 200, 420];
        for row in moved {
            let x_m = &mut bench.presses[row].position.x_m;
            *x_m += if *x_m < 0.1 { 0.06 } else { -0.06 };
        }
        for row in misread {
            bench.presses[row].reading[2] += 100.0;
        }
        let mut wrong = [&moved[..], &misread[..]].concat();
        wrong.sort_unstable();
        let locator = condensed(&bench);
        assert_eq!(locator.set_aside(), wrong);
        let [mended, clean] = [locator, clean].map(|locator| mean(errors_mm(&locator, &touches).0));
        assert!(mended < 1.05 * clean, "{mended} mm, {clean} mm without outliers");
    }
}

#[test]
fn influences_at_the_nodes_are_those_of_the_strip_within_their_deviations() {
    let bench = Bench::strip(3, 25, 9);
    let InfluenceLocator::ForceLinear(linear) = bench.fit_as(Structure::ForceLinear) else { panic!() };
    let learnt = linear.influences_at_nodes();
    assert_eq!(learnt.channels, (0..GAUGES).collect::<Vec<_>>());
    let pressed = MARGIN_M..STRIP_M - MARGIN_M;
    let nodes = learnt.positions.iter().enumerate().filter(|(_, at)| pressed.contains(&at.x_m));
    let off = nodes.flat_map(|(node, at)| {
        let row = node * GAUGES..(node + 1) * GAUGES;
        let learnt = learnt.values[row.clone()].iter().zip(&learnt.sd[row]);
        learnt.zip((bench.influences)(*at)).map(|((value, sd), truth)| (value - truth) / sd)
    });
    let off: Vec<f64> = off.collect();
    let within = off.iter().filter(|off| off.abs() < 1.96).count() as f64 / off.len() as f64;
    assert!((0.85..=1.0).contains(&within), "{within} of {}", off.len());
    assert!(off.iter().any(|off| off.abs() > 0.5), "deviations are far too large");
}

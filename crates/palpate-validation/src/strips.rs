use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::raw_bench::{MARGIN_M, PLATE_M, RawBench, STRIP_M};
use crate::regression::{Regression, errors_with_known_functions_mm};
use crate::statistics::{Sample, Share};
use crate::table::{Column, Figure, Goal, Row as TableRow, Table};
use anyhow::{Context, Result};
use palpate::estimators::influence::{ForceLinearLocator, InfluenceLocator, Structure};
use palpate::prelude::{Contact, Locate, Position, Row, Status};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

pub const STRIPS: Experiment = Experiment {
    name: "raw-strips",
    title: "Raw strips and plates, and a regression",
    method: "Strips of 300 mm, clamped at both ends over six raw strain gauges, and plates of 200 × 150 mm on simple edges over six deflection sensors have noise of one count where a newton \
             moves a channel by up to 60, and are pressed and touched with 0.5 to 5 N. The regression is offset + force × cubic spline with a coefficient for every place (at most 15), or cubic \
             radial basis functions around every place, fitted and inverted by least squares; the last columns invert the true functions by least squares.",
    seed: 0,
    run: run_strips,
};

pub const DRIFTING: Experiment = Experiment {
    name: "drifting-strips",
    title: "Raw strips that drift while they are calibrated",
    method: "Each gauge of a strip of `raw-strips` drifts by 6 to 19 counts in the course of the presses: as a ramp, settling, or in a random walk; the presses follow evenly, or unevenly with a \
             pause of two thirds of the time and a column of times. Touches follow the calibration without a tare; the last regression has readings without the drift, which is unknown in practice.",
    seed: 0,
    run: run_drifting,
};

pub const SCATTERED: Experiment = Experiment {
    name: "scattered-presses",
    title: "Raw strips with wrong forces and places",
    method: "Presses of a strip of `raw-strips` have other forces (3 % standard deviation) and other places (1 mm standard deviation) than recorded. Errors are those from the true positions of \
             touches.",
    seed: 0,
    run: run_scattered,
};

pub const NOISE: Experiment = Experiment {
    name: "noise-by-place",
    title: "Raw strips whose noise differs by place",
    method: "Noise of presses and touches of `raw-strips` is four times as large on one half, rises fourfold from end to end, or is even. The figures without it are those of the same locators \
             with one noise at all places.",
    seed: 0,
    run: run_noise,
};

pub const FEW: Experiment = Experiment {
    name: "few-presses",
    title: "Raw strips with few presses",
    method: "Strips of `raw-strips` are pressed a few times, each time at another place, without rows of force 0. Touches and untouched readings follow.",
    seed: 0,
    run: run_few,
};

/// Per bench.
const TOUCHES: usize = 100;
const SIZES: [(usize, usize); 3] = [(25, 9), (60, 15), (120, 30)];

/// Errors in mm, and 95 % intervals that contain x.
struct Touched {
    errors_mm: Vec<f64>,
    covered: Vec<bool>,
}

fn touched(locator: &impl Locate, touches: &[Row]) -> Touched {
    let mut touched = Touched { errors_mm: Vec::new(), covered: Vec::new() };
    for touch in touches {
        let contact = locator.locate(&touch.reading).contact;
        touched.errors_mm.push(1e3 * contact.position.distance_m(touch.position));
        touched.covered.push(contact.uncertainty.is_some_and(|uncertainty| {
            let (low_m, high_m) = uncertainty.x_95_m;
            (low_m..=high_m).contains(&touch.position.x_m)
        }));
    }
    touched
}

/// Median and mean of each bench.
#[derive(Default)]
struct Errors {
    medians_mm: Sample,
    means_mm: Sample,
}

impl Errors {
    fn add(&mut self, bench: u64, errors_mm: &[f64]) {
        self.medians_mm.add(bench, median(errors_mm));
        self.means_mm.add(bench, mean(errors_mm));
    }

    fn figures(&self) -> [Option<Figure>; 2] {
        [self.medians_mm.mean(), self.means_mm.mean()]
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn median(values: &[f64]) -> f64 {
    palpate::numerics::median(values.to_vec()).unwrap_or(f64::NAN)
}

#[derive(Default)]
struct Comparison {
    own: Errors,
    regression: Errors,
    known_functions: Errors,
    /// Benches with no larger median and mean error.
    no_larger: [Share; 2],
    covered: Share,
}

impl Comparison {
    fn add(
        &mut self,
        seed: u64,
        bench: &RawBench,
        locator: &InfluenceLocator,
        touches: &[Row],
        regression_mm: &[f64],
    ) {
        let Touched { errors_mm, covered } = touched(locator, touches);
        self.own.add(seed, &errors_mm);
        self.regression.add(seed, regression_mm);
        self.known_functions.add(seed, &errors_with_known_functions_mm(bench, touches));
        for (share, of) in self.no_larger.iter_mut().zip([median, mean]) {
            share.add(seed, of(&errors_mm) <= of(regression_mm));
        }
        covered.into_iter().for_each(|covered| self.covered.add(seed, covered));
    }

    fn columns() -> Vec<Column> {
        vec![
            Column::mm("median error", Goal::Smaller),
            Column::mm("mean error", Goal::Smaller),
            Column::percent("covered", Goal::COVERAGE),
            Column::mm("median error of the regression", Goal::None),
            Column::mm("mean error of the regression", Goal::None),
            Column::percent("median not larger", Goal::Larger),
            Column::percent("mean not larger", Goal::Larger),
            Column::mm("median error with the true functions", Goal::None),
            Column::mm("mean error with the true functions", Goal::None),
        ]
    }

    fn figures(&self) -> Vec<Option<Figure>> {
        let [median, mean] = self.own.figures();
        let mut figures = vec![median, mean, self.covered.percent()];
        figures.extend(self.regression.figures());
        figures.extend(self.no_larger.each_ref().map(Share::percent));
        figures.extend(self.known_functions.figures());
        figures
    }
}

fn spline(places: usize) -> Regression {
    Regression::spline(places.min(15))
}

fn size_name((presses, places): (usize, usize)) -> String {
    format!("{presses} presses at {places} places")
}

enum StripCase {
    Strip((usize, usize), Structure),
    Plate,
}

impl StripCase {
    fn labels(&self) -> [String; 2] {
        match self {
            Self::Strip(size, Structure::Free) => [format!("strip, {}", size_name(*size)), "free".to_owned()],
            Self::Strip(size, _) => [format!("strip, {}", size_name(*size)), "auto".to_owned()],
            Self::Plate => ["plate, 160 presses at 80 places".to_owned(), "auto".to_owned()],
        }
    }

    fn row(&self, benches: u64) -> Result<TableRow> {
        let mut comparison = Comparison::default();
        for seed in 0..benches {
            match self {
                Self::Strip((presses, places), structure) => {
                    let mut bench = RawBench::strip(seed, *presses, *places)?;
                    let touches = bench.touches(TOUCHES);
                    let regression_mm = spline(*places).errors_mm(&bench.presses, &touches)?;
                    let locator = bench.fit(*structure, None)?;
                    comparison.add(seed, &bench, &locator, &touches, &regression_mm);
                }
                Self::Plate => {
                    let mut bench = RawBench::plate(seed)?;
                    let touches = bench.touches(60);
                    let regression = Regression::radial_basis(&bench.presses);
                    let regression_mm = regression.errors_mm(&bench.presses, &touches)?;
                    let locator = bench.fit(Structure::Auto, None)?;
                    comparison.add(seed, &bench, &locator, &touches, &regression_mm);
                }
            }
        }
        let labels = self.labels();
        Ok(TableRow::new(&labels.each_ref().map(String::as_str), comparison.figures()))
    }
}

fn run_strips(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let [first, second, third] = SIZES.map(|size| StripCase::Strip(size, Structure::Auto));
    let free = StripCase::Strip(SIZES[0], Structure::Free);
    let cases = [(first, 50, 3), (second, 50, 3), (free, 20, 1), (third, 50, 1), (StripCase::Plate, 20, 1)];
    let row = |(case, full, quick): &(StripCase, u64, u64)| case.row(size.pick(*full, *quick));
    let rows = in_parallel(&cases, row, |(case, ..)| case.labels().join(", "), progress);
    let mut table = Table::new("Means over the benches.", &["bench", "structure"], Comparison::columns());
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

/// Drift of a gauge from 0 to its amount.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    Ramp,
    /// Fast at first, as in a warming board.
    Settling,
    /// Random walk whose end has the amount as standard deviation.
    Walk,
}

const COURSES: [(Course, &str); 3] =
    [(Course::Ramp, "ramp"), (Course::Settling, "settling"), (Course::Walk, "random walk")];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pace {
    /// Without a column of times.
    Even,
    /// Pause of two thirds of the time, and a column of times.
    Uneven,
}

/// Drift over a recording, in counts.
const AMOUNTS: std::ops::Range<f64> = 6.0..19.0;

/// Drifts the gauges; returns the presses without drift, and the final drifts.
fn drift(bench: &mut RawBench, course: Course, pace: Pace) -> (Vec<Row>, Vec<f64>) {
    let still = bench.presses.clone();
    let rows = still.len();
    let pause = (pace == Pace::Uneven).then(|| bench.rng.random_range(rows / 5..rows * 4 / 5));
    let mut times = vec![0.0];
    for row in 1..rows {
        let step = match pace {
            Pace::Even => 1.0,
            Pace::Uneven => bench.rng.random_range(0.3..1.7),
        };
        let pause = if pause == Some(row) { 2.0 * rows as f64 } else { 0.0 };
        times.push(times[row - 1] + step + pause);
    }
    let end = times[rows - 1];
    let mut ends = Vec::new();
    for c in 0..bench.offsets.len() {
        let sign = if bench.rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let amount = sign * bench.rng.random_range(AMOUNTS);
        let (mut drift, mut walk, mut last) = (0.0, 0.0, 0.0);
        for (row, time) in bench.presses.iter_mut().zip(&times) {
            let share: f64 = time / end;
            let normal: f64 = StandardNormal.sample(&mut bench.rng);
            walk += normal * (share - last).sqrt();
            last = share;
            drift = amount
                * match course {
                    Course::Ramp => share,
                    Course::Settling => (1.0 - (-4.0 * share).exp()) / (1.0 - (-4f64).exp()),
                    Course::Walk => walk,
                };
            row.reading[c] += drift;
        }
        ends.push(drift);
    }
    if pace == Pace::Uneven {
        bench.presses.iter_mut().zip(&times).for_each(|(row, time)| row.time_s = Some(4.0 * time));
    }
    (still, ends)
}

fn moved(rows: &[Row], by: &[f64]) -> Vec<Row> {
    let mut rows = rows.to_vec();
    for row in &mut rows {
        row.reading.iter_mut().zip(by).for_each(|(value, by)| *value += by);
    }
    rows
}

struct DriftCase {
    size: (usize, usize),
    course: (Course, &'static str),
    pace: Pace,
}

impl DriftCase {
    fn labels(&self) -> [String; 3] {
        let pace = if self.pace == Pace::Even { "even" } else { "uneven" };
        [size_name(self.size), self.course.1.to_owned(), pace.to_owned()]
    }

    fn row(&self, benches: u64) -> Result<TableRow> {
        let [mut own, mut still_spline] = [Errors::default(), Errors::default()];
        let mut splines = [Errors::default(), Errors::default()];
        let (mut covered, mut tared_mm) = (Share::default(), Sample::default());
        let mut no_larger = [Share::default(), Share::default(), Share::default()];
        for seed in 0..benches {
            let mut bench = RawBench::strip(seed, self.size.0, self.size.1)?;
            let touches = bench.touches(TOUCHES);
            let (still, ends) = drift(&mut bench, self.course.0, self.pace);
            let locator = bench.fit(Structure::Auto, None)?;
            let later = moved(&touches, &ends);
            let spline = spline(self.size.1);
            let found = touched(&locator, &later);
            own.add(seed, &found.errors_mm);
            found.covered.into_iter().for_each(|is_covered| covered.add(seed, is_covered));
            let theirs = [
                spline.errors_mm(&bench.presses, &later)?,
                spline.with_linear_drift().errors_mm(&bench.presses, &later)?,
                spline.errors_mm(&still, &touches)?,
            ];
            let [first, second] = &mut splines;
            for (errors, theirs) in [first, second, &mut still_spline].into_iter().zip(&theirs) {
                errors.add(seed, theirs);
            }
            for (share, theirs) in no_larger.iter_mut().zip(&theirs) {
                share.add(seed, mean(&found.errors_mm) <= mean(theirs));
            }
            let learnt = locator.offsets().context("the locator has no offsets")?;
            let tare: Vec<f64> = learnt.iter().zip(&bench.offsets).map(|(a, b)| a - b).collect();
            tared_mm.add(seed, mean(&touched(&locator, &moved(&touches, &tare)).errors_mm));
        }
        let [median, mean] = own.figures();
        let mut figures = vec![median, mean, covered.percent(), tared_mm.mean()];
        figures.extend(splines.iter().chain([&still_spline]).flat_map(Errors::figures));
        figures.extend(no_larger.each_ref().map(Share::percent));
        let labels = self.labels();
        Ok(TableRow::new(&labels.each_ref().map(String::as_str), figures))
    }

    fn columns() -> Vec<Column> {
        let mut columns = vec![
            Column::mm("median error", Goal::Smaller),
            Column::mm("mean error", Goal::Smaller),
            Column::percent("covered", Goal::COVERAGE),
            Column::mm("mean error after a tare", Goal::Smaller),
        ];
        let others = ["spline", "spline and linear drift", "spline without the drift"];
        for other in others {
            columns.push(Column::mm(&format!("{other}: median"), Goal::None));
            columns.push(Column::mm(&format!("{other}: mean"), Goal::None));
        }
        columns.extend(others.map(|other| {
            Column::percent(&format!("mean not larger than that of the {other}"), Goal::Larger)
        }));
        columns
    }
}

fn run_drifting(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let mut cases = Vec::new();
    for course in COURSES {
        for size in &SIZES[..2] {
            cases.extend([Pace::Even, Pace::Uneven].map(|pace| DriftCase { size: *size, course, pace }));
        }
    }
    if size == Size::Quick {
        cases.retain(|case| case.size == SIZES[0] && case.pace == Pace::Even);
    }
    let benches = size.pick(20, 1);
    let name = |case: &DriftCase| case.labels().join(", ");
    let rows = in_parallel(&cases, |case| case.row(benches), name, progress);
    let mut table =
        Table::new("Means over the strips.", &["strip", "drift", "presses"], DriftCase::columns());
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

/// Standard deviations of forces (relative) and positions.
#[derive(Clone, Copy, Debug)]
pub struct PressErrors {
    force: f64,
    position_m: f64,
}

pub const PRESS_ERRORS: [(PressErrors, &str); 4] = [
    (PressErrors { force: 0.0, position_m: 0.0 }, "as recorded"),
    (PressErrors { force: 0.03, position_m: 0.0 }, "forces 3 %"),
    (PressErrors { force: 0.0, position_m: 1e-3 }, "positions 1 mm"),
    (PressErrors { force: 0.03, position_m: 1e-3 }, "both"),
];

/// Presses other places with other forces than recorded.
pub fn record_with_errors(bench: &mut RawBench, errors: PressErrors) {
    let length_m = bench.extent.length_m();
    let mut presses = std::mem::take(&mut bench.presses);
    for row in &mut presses {
        let mut normal = || -> f64 { StandardNormal.sample(&mut bench.rng) };
        let force_n = row.force_n.unwrap_or(0.0) * (1.0 + errors.force * normal());
        let x_m = (row.position.x_m + errors.position_m * normal()).clamp(0.0, length_m);
        row.reading = bench.reading(Contact { position: Position { x_m, ..row.position }, force_n });
    }
    bench.presses = presses;
}

fn run_scattered(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let sizes = &SIZES[..size.pick(3, 1)];
    let cases: Vec<_> =
        sizes.iter().flat_map(|size| PRESS_ERRORS.map(|(wrong, name)| (*size, wrong, name))).collect();
    let benches = size.pick(20, 1);
    let row = |(size, wrong, name): &((usize, usize), PressErrors, &str)| -> Result<TableRow> {
        let mut comparison = Comparison::default();
        for seed in 0..benches {
            let mut bench = RawBench::strip(seed, size.0, size.1)?;
            let touches = bench.touches(TOUCHES);
            record_with_errors(&mut bench, *wrong);
            let regression_mm = spline(size.1).errors_mm(&bench.presses, &touches)?;
            let locator = bench.fit(Structure::Auto, None)?;
            comparison.add(seed, &bench, &locator, &touches, &regression_mm);
        }
        Ok(TableRow::new(&[&size_name(*size), name], comparison.figures()))
    };
    let rows = in_parallel(&cases, row, |(size, _, name)| format!("{}, {name}", size_name(*size)), progress);
    let mut table = Table::new("Means over the strips.", &["strip", "wrong"], Comparison::columns());
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

/// Noise of touches relative to an untouched board, by place.
type NoiseAt = fn(Position) -> f64;

struct NoiseCase {
    /// Presses and places; `None` for the plate.
    strip: Option<(usize, usize)>,
    noise: (NoiseAt, &'static str),
}

const STRIP_NOISES: [(NoiseAt, &str); 3] = [
    (|_| 1.0, "even"),
    (|at| if at.x_m > 0.5 * STRIP_M { 4.0 } else { 1.0 }, "half"),
    (|at| (4f64.ln() * at.x_m / STRIP_M).exp(), "rising"),
];
const PLATE_NOISE: (NoiseAt, &str) = (|at| if at.x_m > 0.5 * PLATE_M[0] { 4.0 } else { 1.0 }, "half");

/// On the quiet and the noisy half.
#[derive(Default)]
struct Halves {
    errors_mm: [Sample; 2],
    covered: [Share; 2],
}

impl Halves {
    fn add(&mut self, bench: u64, locator: &ForceLinearLocator, touches: &[Row], middle_m: f64) {
        let Touched { errors_mm, covered } = touched(locator, touches);
        for ((touch, error_mm), covered) in touches.iter().zip(errors_mm).zip(covered) {
            let side = usize::from(touch.position.x_m > middle_m);
            self.errors_mm[side].add(bench, error_mm);
            self.covered[side].add(bench, covered);
        }
    }

    fn figures(&self) -> [Option<Figure>; 4] {
        let [quiet, noisy] = [0, 1].map(|side| (self.errors_mm[side].mean(), self.covered[side].percent()));
        [quiet.0, quiet.1, noisy.0, noisy.1]
    }
}

impl NoiseCase {
    fn labels(&self) -> [String; 2] {
        let bench = self.strip.map_or_else(
            || "plate, 160 presses at 80 places".to_owned(),
            |size| format!("strip, {}", size_name(size)),
        );
        [bench, self.noise.1.to_owned()]
    }

    fn make_noisy(&self, bench: &RawBench, rows: &mut [Row]) {
        for row in rows {
            let factor = (self.noise.0)(row.position);
            let contact = Contact { position: row.position, force_n: row.force_n.unwrap_or(0.0) };
            for (value, clean) in row.reading.iter_mut().zip(bench.clean_reading(contact)) {
                *value = clean + factor * (*value - clean);
            }
        }
    }

    fn row(&self, benches: u64) -> Result<TableRow> {
        let [mut with, mut without] = [Halves::default(), Halves::default()];
        let (mut found, mut ratios) = (Share::default(), Sample::default());
        for seed in 0..benches {
            let mut bench = match self.strip {
                Some((presses, places)) => RawBench::strip(seed, presses, places)?,
                None => RawBench::plate(seed)?,
            };
            let mut presses = std::mem::take(&mut bench.presses);
            let mut touches = bench.touches(2 * TOUCHES);
            self.make_noisy(&bench, &mut presses);
            self.make_noisy(&bench, &mut touches);
            bench.presses = presses;
            let InfluenceLocator::ForceLinear(locator) = bench.fit(Structure::Auto, None)? else {
                anyhow::bail!("{}: readings are not learnt as linear in the force", self.labels().join(", "))
            };
            let middle_m = 0.5 * bench.extent.length_m();
            let noise = locator.noise_by_place();
            found.add(seed, noise.is_some());
            if let Some([(smallest, _), (largest, _)]) = noise {
                ratios.add(seed, largest / smallest);
            }
            with.add(seed, &locator, &touches, middle_m);
            without.add(seed, &without_noise_by_place(&locator)?, &touches, middle_m);
        }
        let mut figures = vec![found.percent(), ratios.mean()];
        figures.extend(with.figures());
        figures.extend(without.figures());
        let labels = self.labels();
        Ok(TableRow::new(&labels.each_ref().map(String::as_str), figures))
    }
}

/// With the noise of an untouched board everywhere.
fn without_noise_by_place(locator: &ForceLinearLocator) -> Result<ForceLinearLocator> {
    let mut file = serde_json::to_value(locator).context("cannot write the locator")?;
    if let Some(prior) = file.get_mut("prior").and_then(|prior| prior.as_object_mut()) {
        prior.remove("noise_by_place");
    }
    let locator: ForceLinearLocator = serde_json::from_value(file).context("cannot read the locator")?;
    anyhow::ensure!(locator.noise_by_place().is_none(), "the file of a locator has its noise elsewhere");
    Ok(locator)
}

fn run_noise(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let sizes = &SIZES[..size.pick(3, 2)];
    let mut cases: Vec<NoiseCase> = sizes
        .iter()
        .flat_map(|size| STRIP_NOISES.map(|noise| NoiseCase { strip: Some(*size), noise }))
        .collect();
    if size == Size::Full {
        cases.push(NoiseCase { strip: None, noise: PLATE_NOISE });
    } else {
        cases.retain(|case| case.strip == Some(SIZES[1]) && case.noise.1 == "half");
    }
    let benches = size.pick(10, 1);
    let name = |case: &NoiseCase| case.labels().join(", ");
    let rows = in_parallel(&cases, |case| case.row(benches), name, progress);
    let mut columns = vec![
        Column::percent("noise by place found", Goal::None),
        Column::new("largest over smallest noise", "", Goal::None),
    ];
    for without in ["", " without it"] {
        for half in ["quiet", "noisy"] {
            let (error, coverage) =
                if without.is_empty() { (Goal::Smaller, Goal::COVERAGE) } else { (Goal::None, Goal::None) };
            columns.push(Column::mm(&format!("{half} half{without}: mean error"), error));
            columns.push(Column::percent(&format!("{half} half{without}: covered"), coverage));
        }
    }
    let mut table = Table::new("Touches on either half.", &["bench", "noise"], columns);
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

/// Presses at different places, and whether readings are whole counts.
struct FewCase {
    presses: usize,
    is_rounded: bool,
}

impl FewCase {
    fn name(&self) -> String {
        format!("{}{}", self.presses, if self.is_rounded { ", in whole counts" } else { "" })
    }

    fn row(&self, benches: u64) -> Result<TableRow> {
        let [mut noise, mut errors_mm, mut widths_mm] =
            [Sample::default(), Sample::default(), Sample::default()];
        let [mut covered, mut missed, mut untouched] = [Share::default(), Share::default(), Share::default()];
        for seed in 0..benches {
            let mut bench = RawBench::strip(seed, self.presses, self.presses)?;
            let mut touches = bench.touches(TOUCHES);
            if self.is_rounded {
                let readings = bench.presses.iter_mut().chain(&mut touches).flat_map(|row| &mut row.reading);
                readings.for_each(|value| *value = value.round());
            }
            let InfluenceLocator::ForceLinear(locator) = bench.fit(Structure::Auto, None)? else {
                anyhow::bail!("{} presses: readings are not learnt as linear in the force", self.presses)
            };
            let logarithms: Vec<f64> = locator.channels().map(|(.., noise)| noise.ln()).collect();
            noise.add(seed, mean(&logarithms).exp());
            for touch in &touches {
                let estimate = locator.locate(&touch.reading);
                errors_mm.add(seed, 1e3 * estimate.contact.position.distance_m(touch.position));
                missed.add(seed, estimate.status == Status::NoContact);
                if let Some(uncertainty) = estimate.contact.uncertainty {
                    let (low_m, high_m) = uncertainty.x_95_m;
                    covered.add(seed, (low_m..=high_m).contains(&touch.position.x_m));
                    widths_mm.add(seed, 1e3 * (high_m - low_m));
                }
            }
            for _ in 0..TOUCHES {
                let reading =
                    bench.reading(Contact { position: Position::along(STRIP_M - MARGIN_M), force_n: 0.0 });
                untouched.add(seed, locator.locate(&reading).status == Status::NoContact);
            }
        }
        let figures = vec![
            noise.mean(),
            errors_mm.mean(),
            widths_mm.mean(),
            covered.percent(),
            missed.percent(),
            untouched.percent(),
        ];
        Ok(TableRow::new(&[&self.name()], figures))
    }
}

fn run_few(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let case = |presses| FewCase { presses, is_rounded: false };
    let rounded = FewCase { presses: 5, is_rounded: true };
    let mut cases: Vec<FewCase> = [6, 8, 12, 16, 20, 24].map(case).into();
    cases.splice(0..0, [case(5), rounded]);
    cases.truncate(size.pick(8, 4));
    let benches = size.pick(20, 2);
    let rows = in_parallel(&cases, |case| case.row(benches), FewCase::name, progress);
    let columns = vec![
        Column::new("noise learnt", "counts", Goal::None),
        Column::mm("mean error", Goal::Smaller),
        Column::mm("mean width of the interval", Goal::None),
        Column::percent("covered", Goal::COVERAGE),
        Column::percent("touches `no_contact`", Goal::Smaller),
        Column::percent("untouched `no_contact`", Goal::None),
    ];
    let mut table = Table::new("Strips with noise of one count.", &["presses"], columns);
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_is_located_better_than_by_a_spline() {
        let row = StripCase::Strip((25, 9), Structure::Auto).row(1).unwrap();
        let figure = |name: &str| {
            let place = Comparison::columns().iter().position(|column| column.name == name).unwrap();
            row.figures[place].unwrap().value
        };
        assert!(figure("median error") < figure("median error of the regression"), "{row:?}");
        // The true functions are a bound, up to the noise of 100 touches.
        assert!(figure("median error") > 0.5 * figure("median error with the true functions"), "{row:?}");
    }

    #[test]
    fn every_gauge_ends_where_its_drift_does() {
        let mut bench = RawBench::strip(0, 30, 10).unwrap();
        let (still, ends) = drift(&mut bench, Course::Ramp, Pace::Uneven);
        for (c, end) in ends.iter().enumerate() {
            assert!(AMOUNTS.contains(&end.abs()), "{ends:?}");
            let moved = bench.presses[29].reading[c] - still[29].reading[c];
            assert!((moved - end).abs() < 1e-9 && bench.presses[0].reading[c] == still[0].reading[c]);
        }
        assert!(bench.presses.is_sorted_by(|a, b| a.time_s < b.time_s));
    }
}

//! `cargo bench -p palpate --bench cost`: seconds of one core and memory of fits, beside what is estimated before, each in a process of its
//! own. Presses are simulated on a beam of 8 sensors and a plate of 9; "measured" are the same without the model, "free" without forces too.
//! `-- plate` takes the benches whose names begin so.

use cpu_time::ThreadTime;
use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::{Estimator, contenders};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::sensing::SensorKind::{Deflection, Raw};
use palpate_mechanics::surface::{Beam, Plate};
use palpate_mechanics::units::{gpa, mm, newtons, um};

/// Surfaces, places along (and across), and presses at each.
const BENCHES: [(&str, usize, usize); 13] = [
    ("beam", 30, 10),
    ("beam", 300, 5),
    ("beam", 1500, 2),
    ("measured line", 100, 5),
    ("measured line", 1500, 2),
    ("free line", 300, 5),
    ("free line", 1500, 2),
    ("plate", 6, 5),
    ("plate", 20, 5),
    ("plate", 60, 5),
    ("measured plane", 20, 5),
    ("measured plane", 60, 5),
    ("free plane", 30, 5),
];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    if let ["fit", bench, kind] = arguments[..] {
        return report(BENCHES[bench.parse::<usize>().expect("a number")], kind);
    }
    let wanted = arguments.first().copied().unwrap_or_default();
    let this = std::env::current_exe().expect("it runs");
    println!("surface, estimator: rows at places: seconds (estimated), MB (estimated)");
    for (i, bench) in BENCHES.iter().enumerate().filter(|(_, bench)| bench.0.starts_with(wanted)) {
        let (setup, recording) = presses(*bench);
        for estimator in estimators(&setup, &recording) {
            let fit = ["fit", &i.to_string(), estimator.kind()];
            let status = std::process::Command::new(&this).args(fit).status();
            assert!(status.is_ok_and(|status| status.success()), "{fit:?} failed");
        }
    }
}

/// Estimators with a fit that depends on the rows by more than a sum.
fn estimators(setup: &Setup, recording: &Recording) -> Vec<Estimator> {
    let all = contenders(setup, &Estimator::default(), recording.rows.len()).into_iter();
    all.filter(|estimator| !matches!(estimator.kind(), "centroid" | "closed-form" | "digit")).collect()
}

/// A beam or plate, not yet solved, or a surface without a model as large.
fn setup(surface: &str) -> Setup {
    let setup = if is_line(surface) {
        let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).expect("it is a beam");
        Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))
    } else {
        let plate = Plate::simply_supported((mm(300.0), mm(300.0)), mm(0.8), gpa(200.0), 0.3);
        Setup::new(plate.expect("it is a plate")).sensors(Deflection.grid(3, 3).noise(um(5.0)))
    };
    let setup = setup.and_then(|setup| setup.known_force(newtons(5.0))).expect("the sensors suit");
    if !surface.contains(' ') {
        return setup;
    }
    let extent = setup.surface().extent();
    let layout = Layout::even(Raw, setup.layout().len(), extent.length_m());
    Setup::new(extent).with_layout(layout).expect("raw channels suit any surface")
}

fn is_line(surface: &str) -> bool {
    surface.contains("line") || surface == "beam"
}

fn presses((surface, places, repeats): (&str, usize, usize)) -> (Setup, Recording) {
    let is_line = is_line(surface);
    let model = setup(if is_line { "beam" } else { "plate" });
    let training = if is_line { Training::even(places) } else { Training::grid(places, places) };
    let mut recording = model.simulate(&training.repeated(repeats), 0).expect("the places suit");
    if !surface.contains(' ') {
        return (model, recording);
    }
    let is_free = surface.starts_with("free");
    for (i, row) in recording.rows.iter_mut().enumerate() {
        // These surfaces bend in proportion to the force.
        let share = if is_free { 1.0 } else { 0.6 + 0.2 * (i % 5) as f64 };
        row.force_n = (!is_free).then_some(5.0 * share);
        row.reading.iter_mut().for_each(|reading| *reading *= share);
    }
    let setup = setup(surface);
    let recording = Recording::new(setup.layout(), "bench", recording.rows);
    (setup, recording)
}

fn report(bench: (&str, usize, usize), kind: &str) {
    let (_, recording) = presses(bench);
    let setup = setup(bench.0);
    let estimator = estimators(&setup, &recording).into_iter().find(|other| other.kind() == kind);
    let estimator = estimator.expect("it suits the surface");
    let cost = estimator.fit_cost(&setup, &recording);
    // From now on the peak is that of the fit.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let (before_mb, start) = (memory_mb("VmRSS:"), ThreadTime::now());
    let fitted = estimator.fit_task(FitTask::new(&setup, &recording));
    let (seconds, mb) = (start.elapsed().as_secs_f64(), memory_mb("VmHWM:") - before_mb);
    let fitted = fitted.map_or_else(|error| format!(" {error}"), |_| String::new());
    let (surface, ..) = bench;
    let (rows, places) = (recording.rows.len(), recording.distinct_positions().len());
    println!(
        "{surface}, {kind}: {rows} rows at {places}: {seconds:.2} s ({:.2} s, {:.2} ×), {mb:.0} MB ({:.0} MB, {:.2} ×){fitted}",
        cost.seconds,
        cost.seconds / seconds,
        cost.memory_bytes / 1e6,
        cost.memory_bytes / 1e6 / mb,
    );
}

/// Memory of this process, now or at most; NaN where the system does not report it.
fn memory_mb(of: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(of));
    line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok())
        .map_or(f64::NAN, |kb| kb / 1e3)
}

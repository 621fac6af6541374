//! A plate of 200 × 200 elements with nine sensors: CPU seconds, all on one thread, and memory until their influences over
//! the whole plate are known, influences a second afterwards, what reciprocity saves, and the factors of coarser meshes.

use std::hint::black_box;

use cpu_time::ProcessTime;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::plate::{Edge, Edges, PlateSpec};
use palpate_mechanics::surface::{Plate, Surface};
use palpate_testing::figure::figure;

const SIDE_M: f64 = 0.3;
const EVALUATIONS: usize = 4_000_000;

fn main() {
    let plate = square(200);
    let start = ProcessTime::now();
    plate.solve().expect("the plate is sound");
    let factored_s = start.elapsed().as_secs_f64();
    let sensors: Vec<Position> =
        (0..9).map(|i| place((i % 3 + 1) as f64 / 4.0, (i / 3 + 1) as f64 / 4.0)).collect();
    let influences: Vec<_> =
        sensors.iter().map(|at| plate.influence_function(SensorKind::Deflection, *at)).collect();
    let seconds = start.elapsed().as_secs_f64();
    figure("plate: 200 × 200 elements, 9 sensors", seconds, "s");
    println!("200 × 200 elements, 9 sensors: {seconds:.2} s, of them {factored_s:.2} s for the factor");
    println!(
        "peak memory {:.0} MiB, estimated {:.0} MiB",
        peak_mib(),
        plate.estimated_bytes() / 2f64.powi(20)
    );

    let contacts: Vec<Position> = (0..1000).map(|i| place(fraction(i, 0.618), fraction(i, 0.755))).collect();
    let start = ProcessTime::now();
    for i in 0..EVALUATIONS {
        black_box(influences[i % 9].at(contacts[i % 1000]));
    }
    let each_s = start.elapsed().as_secs_f64() / EVALUATIONS as f64;
    figure("plate: an influence", each_s * 1e9, "ns");
    println!("an influence: {:.1} ns, {:.1} million/s", each_s * 1e9, 1e-6 / each_s);
    let start = ProcessTime::now();
    for i in 0..EVALUATIONS {
        black_box(influences[i % 9].gradient(contacts[i % 1000]));
    }
    let gradient_ns = start.elapsed().as_secs_f64() / EVALUATIONS as f64 * 1e9;
    figure("plate: a gradient", gradient_ns, "ns");
    println!("a gradient: {gradient_ns:.1} ns");

    let solution_s = (seconds - factored_s) / 9.0;
    let naive = solution_s / (9.0 * each_s);
    println!(
        "a solution: {:.1} ms; a contact's nine readings by a solution of its own cost {naive:.0} times as much",
        solution_s * 1e3
    );

    for elements in [48, PlateSpec::DEFAULT_ELEMENTS, 200] {
        let start = ProcessTime::now();
        let numbers = square(elements).factor_size().expect("the plate is sound");
        println!(
            "{elements} × {elements}: {:.2} s, {:.1} million numbers",
            start.elapsed().as_secs_f64(),
            numbers as f64 * 1e-6
        );
    }
}

fn square(elements: usize) -> Plate {
    let spec = PlateSpec {
        length_m: SIDE_M,
        width_m: SIDE_M,
        thickness_m: 0.8e-3,
        youngs_modulus_pa: 200e9,
        poissons_ratio: 0.3,
        edges: Edges::all(Edge::Simple),
        supports: Vec::new(),
        elements,
    };
    Plate::new(spec).expect("the plate is sound")
}

fn place(x: f64, y: f64) -> Position {
    Position { x_m: SIDE_M * x, y_m: SIDE_M * y }
}

/// Numbers that cover 0 … 1 evenly, in no order.
fn fraction(i: usize, step: f64) -> f64 {
    (i as f64 * step).fract()
}

/// The most memory that this process ever had, as the system counts it.
fn peak_mib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok());
    kib.map_or(f64::NAN, |kib| kib / 1024.0)
}

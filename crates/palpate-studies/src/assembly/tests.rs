//! Compares assembled studies with whole runs, and tests all errors.

use super::*;
use crate::run::RunOptions;
use crate::tables::RowProblem;
use palpate_rig::Study;
use std::sync::LazyLock;

/// Networks in lanes, networks of noisy sensors, an estimator with 95 % intervals and one without.
const SMALL: &str = r#"
    name = "small"
    [surface]
    kind = "beam"
    length = "400 mm"
    width = "40 mm"
    thickness = "1.2 mm"
    youngs_modulus = "200 GPa"
    [sensors]
    measure = "deflection"
    count = 4
    noise = "5 um"
    [contact]
    force = "3 N"
    [training]
    count = 10
    [evaluation]
    from = "20 mm"
    to = "380 mm"
    step = "40 mm"
    readings = 2
    portions = [["60 mm", "300 mm"]]
    [[arm]]
    name = "lanes"
    sensors = { measure = "deflection", count = 8 }
    estimator = { kind = "network", max_epochs = 60 }
    [[arm]]
    name = "more"
    sensors = { measure = "deflection", count = 8 }
    training = { count = 20 }
    estimator = { kind = "network", max_epochs = 60 }
    [[arm]]
    name = "noisy"
    estimator = { kind = "network", max_epochs = 60 }
    [[arm]]
    name = "influence"
    estimator = { kind = "influence" }
    [[arm]]
    name = "centroid"
    estimator = { kind = "centroid" }
"#;

/// Not a multiple of the lanes.
const SEEDS: u64 = 11;
const ARMS: usize = 5;

fn prepare(text: &str) -> PreparedStudy {
    PreparedStudy::new(Study::from_toml(text).unwrap(), Watch::NONE).unwrap()
}

static STUDY: LazyLock<PreparedStudy> = LazyLock::new(|| prepare(SMALL));
static WHOLE: LazyLock<Vec<ArmOutcome>> = LazyLock::new(|| {
    STUDY.run(RunOptions { seeds: SEEDS, threads: 2 }, Vec::new(), &|_| {}, Watch::NONE).unwrap()
});
/// Rows of all tasks in reverse order.
static ROWS: LazyLock<FitRows> = LazyLock::new(|| in_blocks(3));

fn in_blocks(block: u64) -> FitRows {
    let mut rows = FitRows::default();
    for task in STUDY.tasks(SEEDS, block).iter().rev() {
        rows.push(&STUDY.run_task(task, 1, Watch::NONE).unwrap());
    }
    rows
}

fn shards(of: u64, threads: usize) -> Vec<ShardTables> {
    (1..=of).map(|number| shard(Shard::new(number, of).unwrap(), SEEDS, threads)).collect()
}

fn shard(shard: Shard, seeds: u64, threads: usize) -> ShardTables {
    let tables = StudyTables::of_shard(&STUDY, shard, seeds);
    let fits = STUDY.fit_tasks(&tables.tasks(seeds), &[], threads, &|_| {}, Watch::NONE).unwrap();
    ShardTables { place: format!("out/{}", shard.number()), texts: tables.whole(&fits) }
}

fn refused(shards: &[ShardTables]) -> AssemblyError {
    let Err(error) = STUDY.merge(shards) else { panic!("shards that do not fit together are merged") };
    error
}

fn unassembled(rows: &FitRows) -> AssemblyError {
    let Err(error) = STUDY.assemble(SEEDS, rows) else {
        panic!("rows that do not fit together are assembled")
    };
    error
}

fn row_problem(error: AssemblyError) -> (usize, RowProblem) {
    match error {
        AssemblyError::Table { error: CheckpointError::Row { line, problem, .. }, .. } => (line, problem),
        other => panic!("{other}"),
    }
}

#[test]
fn tasks_in_any_blocks_and_order_assemble_to_the_whole_study() {
    assert_eq!(WHOLE.iter().map(|outcome| outcome.fits.len()).collect::<Vec<_>>(), [SEEDS as usize; ARMS]);
    let told = |outcome: &ArmOutcome| outcome.fits[0].evaluation.coverage_percent().is_some();
    assert_eq!(WHOLE.iter().map(told).collect::<Vec<_>>(), [false, false, false, true, false]);
    assert_eq!(STUDY.assemble(SEEDS, &ROWS).unwrap(), *WHOLE);
    for block in [1, 8, 100] {
        assert_eq!(STUDY.assemble(SEEDS, &in_blocks(block)).unwrap(), *WHOLE, "{block}");
    }
}

#[test]
fn shards_merge_to_the_bytes_of_the_whole_study() {
    let fits: Vec<ArmFit> = WHOLE
        .iter()
        .enumerate()
        .flat_map(|(arm, outcome)| outcome.fits.iter().map(move |fit| ArmFit { arm, fit: fit.clone() }))
        .collect();
    let tables = StudyTables::new(&STUDY);
    let whole = tables.whole(&fits);
    assert_eq!(whole.networks.lines().count(), 2 + ARMS * SEEDS as usize);
    assert_eq!(whole.evaluations.lines().count(), 2 + 2 * SEEDS as usize);
    for (of, threads) in [(1, 2), (3, 1), (16, 2)] {
        let merged = STUDY.merge(&shards(of, threads)).unwrap();
        assert_eq!(merged.seeds, SEEDS);
        assert_eq!(tables.whole(&merged.fits), whole, "{of}");
        assert_eq!(STUDY.by_arm(merged.fits, SEEDS), *WHOLE, "{of}");
    }
}

#[test]
fn a_shard_goes_on_from_its_rows() {
    let of_two = Shard::new(2, 2).unwrap();
    let tables = StudyTables::of_shard(&STUDY, of_two, SEEDS);
    let whole = shard(of_two, SEEDS, 1).texts;
    let mut begun = whole.clone();
    begun.networks.truncate(whole.networks.len() / 2);
    begun.evaluations.truncate(whole.evaluations.len() / 2);
    let checkpoint = tables.read(&begun).unwrap();
    assert_eq!(checkpoint.cut_off, [TableKind::Networks, TableKind::Evaluations]);
    let mut fits = checkpoint.done;
    assert!(!fits.is_empty());
    let more = STUDY.fit_tasks(&tables.tasks(SEEDS), &fits, 2, &|_| {}, Watch::NONE).unwrap();
    assert!(!more.is_empty());
    fits.extend(more);
    assert_eq!(tables.whole(&fits), whole);
}

#[test]
fn fits_whose_evaluations_are_lost_are_made_again() {
    let tables = StudyTables::new(&STUDY);
    let mut texts = tables.headings();
    texts.networks += &ROWS.networks;
    texts.evaluations.clear();
    let checkpoint = tables.read(&texts).unwrap();
    assert_eq!(checkpoint.without_evaluation, 2 * SEEDS as usize);
    assert_eq!(checkpoint.done.len(), 3 * SEEDS as usize);
}

#[test]
fn missing_unfinished_double_and_other_shards_are_refused() {
    let all = shards(3, 2);
    assert_eq!(
        refused(&[all[0].clone(), all[2].clone()]),
        AssemblyError::MissingShards { missing: vec![2], of: 3 }
    );
    assert_eq!(refused(&[]), AssemblyError::Nothing);
    let mut twice = all.clone();
    twice.push(ShardTables { place: "copy".to_owned(), ..all[1].clone() });
    assert_eq!(refused(&twice).to_string(), "shard 2/3 is there twice: out/2 and copy");
    let other = [all[0].clone(), shard(Shard::new(2, 4).unwrap(), SEEDS, 1)];
    assert_eq!(
        refused(&other).to_string(),
        "out/2 is shard 2/4 of 11 seeds, and out/1 is shard 1/3 of 11 seeds: all must be of one split"
    );
    let seeds = [all[0].clone(), shard(Shard::new(2, 3).unwrap(), 2, 1)];
    assert!(matches!(refused(&seeds), AssemblyError::Split { .. }));

    let mut begun = all.clone();
    let last = begun[1].texts.evaluations.trim_end().rfind('\n').unwrap();
    begun[1].texts.evaluations.truncate(last + 1);
    let unfinished = refused(&begun);
    assert!(
        matches!(&unfinished, AssemblyError::Unfinished { place, found, wanted, .. }
            if place == "out/2" && found + 1 == *wanted),
        "{unfinished}"
    );

    let whole = ShardTables { place: "whole".to_owned(), texts: StudyTables::new(&STUDY).headings() };
    assert_eq!(refused(&[whole]), AssemblyError::Whole { place: "whole".to_owned() });
}

#[test]
fn shards_of_another_study_precision_or_version_are_refused() {
    let foreign = |from: &str, to: &str| {
        let mut all = shards(1, 2);
        assert!(all[0].texts.networks.contains(from), "{from}");
        all[0].texts.networks = all[0].texts.networks.replacen(from, to, 1);
        let error = refused(&all);
        assert!(
            matches!(error, AssemblyError::Table { error: CheckpointError::Heading { .. }, .. }),
            "{error}"
        );
        error.to_string()
    };
    let digest = STUDY.study.digest.as_str();
    let told = foreign(digest, &"0".repeat(64));
    assert!(told.starts_with("out/1: networks.csv: line 1 belongs to another run") && told.contains(digest));
    foreign(", f64", ", f32");
    foreign(&format!("palpate {}", env!("CARGO_PKG_VERSION")), "palpate 99.0.0");
    foreign("shard 1/1", "shard 2/1");
    foreign("of 11 seeds", "of 1000001 seeds");
    foreign("of 11 seeds", "of seeds");
    let mut evaluations = shards(1, 2);
    evaluations[0].texts.evaluations = evaluations[0].texts.evaluations.replacen(digest, "0", 1);
    assert!(refused(&evaluations).to_string().contains("evaluations.csv: line 1 belongs to another run"));
}

#[test]
fn rows_of_other_shards_and_second_rows_are_refused() {
    let mut all = shards(3, 2);
    let row = |shard: &ShardTables| shard.texts.networks.lines().nth(2).unwrap().to_owned() + "\n";
    let (own, others) = (row(&all[0]), row(&all[1]));
    let lines = all[0].texts.networks.lines().count();
    all[0].texts.networks += &others;
    let (line, problem) = row_problem(refused(&all));
    assert!(matches!(problem, RowProblem::OtherShard { .. }), "{problem}");
    assert_eq!(line, lines + 1);
    all[0].texts.networks = all[0].texts.networks.replacen(&others, &own, 1);
    let (line, problem) = row_problem(refused(&all));
    assert!(matches!(problem, RowProblem::Twice { first: 3, .. }), "{problem}");
    assert_eq!(line, lines + 1);
}

#[test]
fn rows_that_are_wrong_are_refused_with_their_line_and_cell() {
    let evaluations = |change: &dyn Fn(&mut Vec<String>)| {
        let mut rows = ROWS.clone();
        let first = rows.evaluations.lines().next().unwrap().to_owned();
        let mut cells: Vec<String> = first.split(',').map(str::to_owned).collect();
        change(&mut cells);
        rows.evaluations = rows.evaluations.replacen(&first, &cells.join(","), 1);
        let (line, problem) = row_problem(unassembled(&rows));
        assert_eq!(line, 3);
        problem.to_string()
    };
    // 10 positions, 2 readings at each.
    let cell = |i: usize, text: &str| {
        let text = text.to_owned();
        evaluations(&move |cells| cells[i] = text.clone())
    };
    assert_eq!(cell(0, "nobody"), "the study has no arm `nobody`");
    assert_eq!(cell(0, "lanes"), "arm `lanes` consists of networks, and networks.csv contains them");
    assert_eq!(cell(1, "-1"), "seed: `-1` is not a whole number");
    assert_eq!(cell(2, "0.1 0.2"), "estimates_m: found 2 values; the arm is evaluated with 20 readings");
    assert_eq!(cell(2, "0.1 NaN"), "estimates_m: `NaN` is not a finite number");
    assert_eq!(cell(2, &["-"; 20].join(" ")), "estimates_m: `-` is not a finite number");
    assert_eq!(cell(3, "01x"), "held: `x` is not 1, 0 or -");
    assert_eq!(cell(3, "01"), "held: found 2 values; the arm is evaluated with 20 readings");
    assert_eq!(cell(4, "1e999"), "interval_scores_m: `1e999` is not a finite number");
    assert_eq!(cell(4, ""), "interval_scores_m: `` is not a finite number");
    assert_eq!(evaluations(&|cells| cells.truncate(4)), "the row has 4 cells; it must have 5");

    let networks = |from: &str, to: &str| {
        let mut rows = ROWS.clone();
        let at = rows.networks.find("lanes,").unwrap();
        let row = rows.networks[at..].lines().next().unwrap().to_owned();
        rows.networks = rows.networks.replacen(&row, &row.replacen(from, to, 1), 1);
        row_problem(unassembled(&rows)).1.to_string()
    };
    assert_eq!(networks("capped", "tired"), "status: `tired` is not `converged`, `capped` or `diverged`");
    assert_eq!(networks(",60,", ",6o,"), "epochs: `6o` is not a whole number");
    assert_eq!(networks(" ", " 0 "), "weights: found 102, which is not the network's number");
    assert_eq!(networks(",", ",,"), "the row has 14 cells; it must have 13");
}

#[test]
fn incomplete_and_double_rows_do_not_assemble() {
    let mut rows = ROWS.clone();
    let at = rows.networks.find("lanes,").unwrap();
    let length = rows.networks[at..].find('\n').unwrap() + 1;
    let row: String = rows.networks.drain(at..at + length).collect();
    let error = unassembled(&rows);
    let wanted = ARMS * SEEDS as usize;
    assert!(
        matches!(&error, AssemblyError::MissingFits { found, wanted: all, .. } if found + 1 == wanted && *all == wanted),
        "{error}"
    );
    rows.networks += &(row.clone() + &row);
    let (_, problem) = row_problem(unassembled(&rows));
    assert!(matches!(problem, RowProblem::Twice { .. }), "{problem}");
}

#[test]
fn a_task_of_an_unknown_arm_is_refused() {
    let task = Task { arm: "nobody".to_owned(), seeds: 0..1 };
    let error = STUDY.run_task(&task, 1, Watch::NONE).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the study has no arm `nobody`; it has lanes, more, noisy, influence, centroid"
    );
}

#[test]
fn finished_fits_are_not_tasks() {
    let study = prepare(SMALL);
    let lanes = study.lanes();
    assert_eq!(study.tasks_left(SEEDS, lanes, &[]), study.tasks(SEEDS, lanes));
    let task = Task { arm: "noisy".to_owned(), seeds: 3..5 };
    let done = study.fit_tasks(&[task], &[], 1, &|_| {}, Watch::NONE).unwrap();
    let left = study.tasks_left(SEEDS, 4, &done);
    let of_noisy: Vec<_> = left.iter().filter(|task| task.arm == "noisy").map(|t| t.seeds.clone()).collect();
    assert_eq!(of_noisy, [0..3, 5..9, 9..11]);
    assert_eq!(left.iter().map(Task::fits).sum::<u64>(), SEEDS * ARMS as u64 - 2);
    let all = study.fit_tasks(&study.tasks(1, 1), &[], 1, &|_| {}, Watch::NONE).unwrap();
    assert_eq!(study.tasks_left(1, 8, &all), []);
}

use crate::bench::{Bench, Forces, Knowledge, World, Zero};
use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::table::{Column, Goal, Row, Table};
use crate::tally::{Figures, Tally};
use anyhow::{Context, Result};
use palpate::prelude::{Estimator, GaussianProcessEstimator, Influence, Rig};

/// In the folder `examples`.
pub const BENCHES: [(&str, &str); 4] = [
    ("real-strip", include_str!("../../../examples/real-strip.toml")),
    ("real-finger", include_str!("../../../examples/real-finger.toml")),
    ("real-skin", include_str!("../../../examples/real-skin.toml")),
    ("real-floor", include_str!("../../../examples/real-floor.toml")),
];

pub const EXPERIMENT: Experiment = Experiment {
    name: "real-benches",
    title: "Benches with imperfections, and the same benches in a clean world",
    method: "Each rig `examples/real-*.toml` is calibrated with the model of its surface, and as raw channels with 1, 0.5 and 2 times the rig's force in turn; contacts \
             of these forces all over the surface are located afterwards, tared once before the first contact or before each. The clean world has noise and resolution alone; \
             light touches have five times the force that the locator detects with a probability of 95 %.",
    seed: 0,
    run,
};

#[derive(Clone, Copy, Debug, PartialEq)]
struct Repetitions {
    /// Of each line and each plane, from 0. Errors of a calibration are common to its contacts.
    seeds: [u64; 2],
    /// Per seed, about.
    contacts: usize,
}

const WORLDS: [(World, &str); 2] = [(World::Clean, "clean"), (World::Imperfect, "imperfect")];
const KNOWLEDGE: [(Knowledge, &str); 2] = [(Knowledge::Model, "model"), (Knowledge::Measured, "measured")];
const ZEROS: [(Zero, &str); 2] = [(Zero::Once, "once"), (Zero::Each, "each")];

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let repetitions =
        size.pick(Repetitions { seeds: [8, 2], contacts: 100 }, Repetitions { seeds: [1, 1], contacts: 24 });
    // The floor and the skin take most of the time.
    let benches: &[_] = size.pick(&BENCHES, &BENCHES[..1]);
    let cases = cases(benches)?;
    let name = |case: &Case| format!("{}, {}, {}", case.name, case.knowledge.1, case.world.1);
    let rows = in_parallel(&cases, |case| case.rows(repetitions), name, progress);
    let mut table = table();
    table.rows = rows.into_iter().collect::<Result<Vec<_>>>()?.concat();
    Ok(vec![table])
}

fn table() -> Table {
    let mut columns = Figures::columns();
    columns.extend([
        Column::percent("reported at held-out places", Goal::None),
        Column::percent("reported, widened", Goal::None),
        Column::percent("untouched `no_contact`", Goal::Larger),
        Column::percent("light touches detected", Goal::Larger),
    ]);
    let title = "Contacts of 1, 0.5 and 2 times the force of the presses in turn.";
    Table::new(title, &["bench", "surface", "estimator", "world", "tared"], columns)
}

struct Case {
    name: &'static str,
    rig: Rig,
    knowledge: (Knowledge, &'static str),
    world: (World, &'static str),
}

fn cases(benches: &[(&'static str, &'static str)]) -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    for (name, toml) in benches {
        let rig = Rig::from_toml(toml).with_context(|| format!("examples/{name}.toml"))?;
        for knowledge in KNOWLEDGE {
            cases.extend(WORLDS.map(|world| Case { name, rig: rig.clone(), knowledge, world }));
        }
    }
    Ok(cases)
}

impl Case {
    /// By estimator and zero, over all seeds.
    fn rows(&self, repetitions: Repetitions) -> Result<Vec<Row>> {
        let (world, knowledge) = (self.world.0, self.knowledge.0);
        let bench = Bench { rig: &self.rig, world, knowledge, forces: Forces::UNKNOWN };
        let estimators = estimators(&self.rig);
        let judged = judge(&bench, &estimators, repetitions).with_context(|| self.name.to_owned())?;
        let rows = judged.into_iter().flat_map(|EstimatorTallies { estimator, tallies, failure }| {
            ZEROS.into_iter().zip(tallies).map(move |((_, zero), tally)| {
                let labels = [self.name, self.knowledge.1, &estimator, self.world.1, zero];
                Row { failure: failure.clone(), ..Row::new(&labels, cells(&tally.figures())) }
            })
        });
        Ok(rows.collect())
    }
}

fn cells(figures: &Figures) -> Vec<Option<crate::table::Figure>> {
    let mut cells = figures.cells();
    cells.extend([
        figures.reported_before,
        figures.reported_after,
        figures.untouched_no_contact,
        figures.light_detected,
    ]);
    cells
}

/// That of the rig, and two that learn from a recording.
fn estimators(rig: &Rig) -> Vec<Estimator> {
    let mut estimators = vec![
        Estimator::Influence(Influence::default()),
        Estimator::GaussianProcess(GaussianProcessEstimator::default()),
    ];
    if estimators.iter().all(|estimator| estimator.kind() != rig.estimator.kind()) {
        estimators.insert(0, rig.estimator.clone());
    }
    estimators
}

/// By each of [`ZEROS`].
struct EstimatorTallies {
    estimator: String,
    tallies: [Tally; ZEROS.len()],
    failure: Option<String>,
}

fn judge(bench: &Bench, estimators: &[Estimator], repetitions: Repetitions) -> Result<Vec<EstimatorTallies>> {
    let begin = |estimator: &Estimator| EstimatorTallies {
        estimator: estimator.kind().to_owned(),
        tallies: Default::default(),
        failure: None,
    };
    let mut judged: Vec<EstimatorTallies> = estimators.iter().map(begin).collect();
    let is_plane = bench.rig.setup.surface().extent().width_m().is_some();
    for seed in 0..repetitions.seeds[usize::from(is_plane)] {
        let recordings = bench.record(repetitions.contacts, seed)?;
        for (estimator, judged) in estimators.iter().zip(&mut judged) {
            // An estimator that refuses a bench has a row with the reason.
            let zeros = ZEROS.map(|(zero, _)| zero);
            if let Err(error) = recordings.judge(estimator, seed, &zeros, &mut judged.tallies) {
                judged.failure = Some(format!("seed {seed}: {error:#}"));
                judged.tallies = Default::default();
            }
        }
    }
    Ok(judged)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_larger_in_an_imperfect_world() {
        // Fewer places than intervals are checked by.
        let (name, toml) = BENCHES[0];
        let small = toml.replace("count = 19", "count = 10").replace("repeats = 5", "repeats = 2");
        let rig = Rig::from_toml(&small).unwrap();
        let estimators = [Estimator::Influence(Influence::default())];
        for knowledge in [Knowledge::Model, Knowledge::Measured] {
            let error_mm = |world| {
                let bench = Bench { rig: &rig, world, knowledge, forces: Forces::UNKNOWN };
                let repetitions = Repetitions { seeds: [1, 1], contacts: 50 };
                let judged = judge(&bench, &estimators, repetitions).unwrap().remove(0);
                assert!(judged.failure.is_none() && judged.tallies.iter().all(|tally| tally.touches() == 50));
                judged.tallies[1].figures().median_error_mm.unwrap().value
            };
            let [clean_mm, imperfect_mm] = [World::Clean, World::Imperfect].map(error_mm);
            assert!(clean_mm < 1.0 || knowledge == Knowledge::Measured, "{name}: {clean_mm}");
            assert!(imperfect_mm > clean_mm, "{name}, {knowledge:?}: {imperfect_mm}, {clean_mm}");
        }
    }

    #[test]
    fn a_case_has_a_row_for_every_estimator_and_zero() {
        let rig = Rig::from_toml(BENCHES[0].1).unwrap();
        assert_eq!(estimators(&rig).len(), 2);
        assert_eq!(cases(&BENCHES).unwrap().len(), 4 * 2 * 2);
        let row = Row::new(&[""; 5], cells(&Tally::default().figures()));
        let table = table();
        assert_eq!((row.labels.len(), row.figures.len()), (table.labels.len(), table.columns.len()));
    }
}

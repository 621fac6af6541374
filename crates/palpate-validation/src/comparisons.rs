use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::{Sample, Share};
use crate::table::{Column, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::prelude::{Rig, Watch};
use palpate_studies::dead_areas::{self, DeadAreaResults, DeadAreas};
use palpate_studies::elliott::{self, Chain, ChainRow, Elliott, ElliottResults};

pub const ELLIOTT: Experiment = Experiment {
    name: "elliott",
    title: "Elliott's chain on a plate",
    method: "`palpate study elliott` with 6 calibrations: the plate of `examples/elliott.toml` is located by networks on principal components of its 25 readings, by a network on all readings, and by the influence locator. \
             Errors are those of presses within the inner 90 % of both sides, effective area is the share of these with errors of at most 5 mm, and the load that moves passes twice at 0.5 m/s.",
    seed: 0,
    run: elliott,
};

pub const DEAD_AREAS: Experiment = Experiment {
    name: "dead-areas",
    title: "Dead areas between sensors",
    method: "`palpate study dead-areas` with 10 calibrations: the beam of `examples/dead-areas.toml` with 2 to 16 deflection sensors, and arrays of as many sensors with local responses. \
             Effective length is the share of 399 contacts with errors of at most 2 mm; \"over sensors\" and \"between them\" are within a tenth of a pitch from a sensor and from the middle of a gap.",
    seed: 0,
    run: dead_areas,
};

/// Per calibration of [`DEAD_AREAS`].
const CONTACTS: u32 = 399;

fn elliott(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let rig = Rig::from_toml(elliott::RIG_TOML)?;
    let seeds: Vec<u64> = (ELLIOTT.seed..ELLIOTT.seed + size.pick(6, 2)).collect();
    // Quick networks are not trained, and are no rows.
    let (components, presentations) = size.pick((&elliott::COMPONENTS[..], elliott::PRESENTATIONS), (&[], 1));
    let study = |seed: &u64| Elliott {
        rig: rig.clone(),
        components: components.to_vec(),
        presentations,
        calibrations: 1,
        tolerance_m: 5e-3,
        seed: *seed,
    };
    let results = in_parallel(&seeds, |seed| study(seed).run(Watch::NONE), u64::to_string, progress);
    let results: Vec<ElliottResults> = results.into_iter().collect::<Result<_, _>>()?;
    let columns = vec![
        Column::mm("mean error", Goal::Smaller),
        Column::mm("bound's mean error", Goal::None),
        Column::percent("effective area", Goal::Larger),
        Column::mm("mean error of the moving load", Goal::Smaller),
    ];
    let mut table = Table::new("Chains.", &["chain"], columns);
    let chains = results.first().context("there is a calibration")?.rows.iter().map(|row| row.chain);
    let chains = chains.filter(|chain| size == Size::Full || *chain != Chain::Readings);
    table.rows = chains.map(|chain| chain_row(chain, &results)).collect();
    Ok(vec![table])
}

fn chain_row(chain: Chain, results: &[ElliottResults]) -> Row {
    let rows = || results.iter().flat_map(|results| &results.rows).filter(move |row| row.chain == chain);
    let mean = |figure: fn(&ChainRow) -> Option<f64>| {
        let mut sample = Sample::default();
        (0..).zip(rows().filter_map(figure)).for_each(|(seed, figure)| sample.add(seed, figure));
        sample.mean()
    };
    // The median over one calibration is its figure.
    let figures = vec![
        mean(|row| Some(1e3 * row.error_m?.median)),
        mean(|row| Some(1e3 * row.limit_m?)),
        mean(|row| Some(row.effective_percent?.median)),
        mean(|row| Some(1e3 * row.moving_error_m.median)),
    ];
    Row::new(&[&chain.to_string()], figures)
}

#[derive(Clone, Copy)]
struct DeadAreaCase {
    sensors: usize,
    seed: u64,
}

fn dead_areas(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let seeds = DEAD_AREAS.seed..DEAD_AREAS.seed + size.pick(10, 2);
    let counts = size.pick(&dead_areas::COUNTS[..], &[4]);
    let cases: Vec<DeadAreaCase> = counts
        .iter()
        .rev()
        .flat_map(|sensors| seeds.clone().map(|seed| DeadAreaCase { sensors: *sensors, seed }))
        .collect();
    let excluded = size.pick(&[][..], &["network", "network-lm"]);
    let name = |case: &DeadAreaCase| format!("{} sensors", case.sensors);
    let results = in_parallel(&cases, |case| case.results(excluded), name, progress);
    let results: Vec<DeadAreaResults> = results.into_iter().collect::<Result<_>>()?;
    let columns = vec![
        Column::percent("effective length", Goal::Larger),
        Column::mm("mean error", Goal::Smaller),
        Column::mm("mean error over sensors", Goal::Smaller),
        Column::mm("mean error between them", Goal::Smaller),
    ];
    let mut table = Table::new("Errors by estimator.", &["sensing", "estimator", "sensors"], columns);
    table.rows = dead_area_rows(&cases, &results, counts);
    Ok(vec![table])
}

impl DeadAreaCase {
    fn results(self, excluded: &[&'static str]) -> Result<DeadAreaResults> {
        let study = DeadAreas {
            rig: Rig::from_toml(dead_areas::RIG_TOML)?,
            counts: vec![self.sensors],
            calibrations: 1,
            tolerance_m: 2e-3,
            excluded: excluded.to_vec(),
            seed: self.seed,
        };
        Ok(study.run(Watch::NONE)?)
    }
}

fn dead_area_rows(cases: &[DeadAreaCase], results: &[DeadAreaResults], counts: &[usize]) -> Vec<Row> {
    let mut kinds: Vec<(&str, &str)> = Vec::new();
    for row in results.iter().flat_map(|results| &results.rows) {
        let kind = (row.sensing.as_str(), row.estimator);
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let row = |(sensing, estimator): (&str, &str), sensors: usize| {
        let (mut effective, mut errors) = (Share::default(), [(); 3].map(|()| Sample::default()));
        let mut failure = None;
        for (case, results) in cases.iter().zip(results).filter(|(case, _)| case.sensors == sensors) {
            for row in &results.rows {
                if (row.sensing.as_str(), row.estimator) == (sensing, estimator) {
                    let good = (row.effective_percent / 100.0 * f64::from(CONTACTS)).round() as u32;
                    (0..CONTACTS).for_each(|contact| effective.add(case.seed, contact < good));
                    let figures_m = [row.mean_error_m, row.folded.at_sensors_m, row.folded.between_m];
                    errors.iter_mut().zip(figures_m).for_each(|(sample, m)| sample.add(case.seed, 1e3 * m));
                }
            }
            let mut omitted = results.omitted.iter();
            failure = failure.or(omitted
                .find(|(of, kind, ..)| (of.as_str(), *kind) == (sensing, estimator))
                .map(|(.., reason)| reason.clone()));
        }
        let figures = std::iter::once(effective.percent()).chain(errors.iter().map(Sample::mean)).collect();
        Row { failure, ..Row::new(&[sensing, estimator, &sensors.to_string()], figures) }
    };
    kinds.into_iter().flat_map(|kind| counts.iter().map(move |sensors| row(kind, *sensors))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_influence_locator_has_no_dead_areas_and_a_centroid_has() {
        let cases = [DeadAreaCase { sensors: 4, seed: 0 }];
        let results = cases.map(|case| case.results(&["network", "network-lm", "gaussian-process"]).unwrap());
        let rows = dead_area_rows(&cases, &results, &[4]);
        let effective = |name: &str| {
            let row = rows.iter().find(|row| row.name() == name).unwrap_or_else(|| panic!("{rows:?}"));
            row.figures[0].unwrap().value
        };
        assert!(effective("distributive, influence, 4") > 98.0);
        assert!(effective("array, spread 10 mm, centroid, 4") < 20.0);
    }

    #[test]
    fn a_network_on_four_components_has_larger_errors_than_the_influence_locator() {
        let toml = elliott::RIG_TOML.replacen("edges =", "elements = 24\nedges =", 1);
        let study = Elliott {
            rig: Rig::from_toml(&toml).unwrap(),
            components: vec![4],
            presentations: 100_000,
            calibrations: 1,
            tolerance_m: 5e-3,
            seed: 0,
        };
        let results = [study.run(Watch::NONE).unwrap()];
        let error = |chain| chain_row(chain, &results).figures[0].unwrap().value;
        assert!(error(Chain::Influence) < 0.5 * error(Chain::Components(4)));
        assert_eq!(chain_row(Chain::Smoother, &results).figures[0], None);
    }
}

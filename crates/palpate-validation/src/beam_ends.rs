use crate::coverage::Coverage;
use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::surfaces::paper_beam;
use crate::table::{Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::fit::NoCheck;
use palpate::estimators::influence::InfluenceSource;
use palpate::estimators::simulate::clean_reading;
use palpate::mechanics::sensing::{ChannelErrors, measure};
use palpate::prelude::{
    ClosedForm, Contact, Fit, FitTask, Influence, Locate, Position, Setup, Training, mm, newtons, um,
};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

pub const EXPERIMENT: Experiment = Experiment {
    name: "beam-ends",
    title: "Contacts near the ends of a beam",
    method: "The founding paper's beam with eight deflection sensors of 5 µm noise is calibrated with presses of 3 N at even places, or located on by the model itself (closed form). \
             Contacts at fixed distances from the left end are located by the calibrations in turn; all but the share of detected contacts is of the detected ones.",
    seed: 15,
    run,
};

/// From the left end.
const PLACES_MM: [f64; 11] = [0.5, 1.0, 2.0, 4.0, 7.0, 10.0, 15.0, 22.0, 25.0, 40.0, 100.0];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Method {
    /// Mechanics, corrected by a recording of ten presses at each of ten places.
    Corrected,
    /// The recording alone: places, and presses at each.
    Learnt(usize, usize),
    ClosedForm,
}

impl Method {
    fn name(self) -> String {
        match self {
            Self::Corrected => "influence".to_owned(),
            Self::Learnt(places, repeats) => format!("influence from {places} places × {repeats}"),
            Self::ClosedForm => "closed form".to_owned(),
        }
    }
}

struct Case {
    method: Method,
    is_known: bool,
    forces_n: &'static [f64],
}

const CASES: [Case; 6] = [
    Case { method: Method::Corrected, is_known: false, forces_n: &[1.0, 3.0, 6.0] },
    Case { method: Method::ClosedForm, is_known: false, forces_n: &[1.0, 3.0, 6.0] },
    Case { method: Method::Learnt(20, 1), is_known: false, forces_n: &[3.0, 6.0] },
    Case { method: Method::Learnt(10, 10), is_known: false, forces_n: &[3.0, 6.0] },
    Case { method: Method::Corrected, is_known: true, forces_n: &[3.0] },
    Case { method: Method::ClosedForm, is_known: true, forces_n: &[3.0] },
];

#[derive(Clone, Copy, Debug)]
struct Repetitions {
    calibrations: u64,
    readings: u64,
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let repetitions = size.pick(
        Repetitions { calibrations: 200, readings: 4000 },
        Repetitions { calibrations: 20, readings: 200 },
    );
    let rows = in_parallel(&CASES, |case| case.rows(repetitions), |case| case.method.name(), progress);
    let title = "Contacts at a distance from the end.";
    let mut table = Table::new(title, &["estimator", "force", "from the end"], Coverage::line_columns());
    table.rows = rows.into_iter().collect::<Result<Vec<_>>>()?.concat();
    Ok(vec![table])
}

type BoxedLocator = Box<dyn Locate<Check = NoCheck>>;

impl Case {
    fn setup(&self) -> Result<Setup> {
        let setup = paper_beam(um(5.0))?;
        Ok(if self.is_known { setup.known_force(newtons(3.0))? } else { setup })
    }

    fn locators(&self, setup: &Setup, calibrations: u64) -> Result<Vec<BoxedLocator>> {
        let (places, repeats) = match self.method {
            Method::Learnt(places, repeats) => (places, repeats),
            Method::Corrected | Method::ClosedForm => (10, 10),
        };
        let training = Training::even(places).repeated(repeats);
        let training = if self.is_known { training } else { training.with_force(newtons(3.0)) };
        let source = match self.method {
            Method::Learnt(..) => InfluenceSource::Recording,
            Method::Corrected | Method::ClosedForm => InfluenceSource::Corrected,
        };
        // The closed form is the model itself: one calibration stands for all.
        let calibrations = if self.method == Method::ClosedForm { 1 } else { calibrations };
        let fit = |seed: u64| -> Result<BoxedLocator> {
            let recording = setup.simulate(&training, seed)?;
            let task = FitTask::new(setup, &recording);
            Ok(match self.method {
                Method::ClosedForm => Box::new(ClosedForm::default().fit_method(task)?),
                _ => Box::new(Influence { source, ..Influence::default() }.fit_beam(task)?),
            })
        };
        (0..calibrations).map(fit).collect()
    }

    fn rows(&self, repetitions: Repetitions) -> Result<Vec<Row>> {
        let setup = self.setup()?;
        let locators = self.locators(&setup, repetitions.calibrations)?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(EXPERIMENT.seed);
        let mut rows = Vec::new();
        for force_n in self.forces_n {
            for place_mm in PLACES_MM {
                let contact = Contact { position: Position::along(mm(place_mm)), force_n: *force_n };
                let coverage = cover(&setup, &locators, contact, repetitions.readings, &mut rng)?;
                let force = format!("{force_n} N{}", if self.is_known { ", known" } else { "" });
                let labels = [self.method.name(), force, format!("{place_mm} mm")];
                rows.push(Row::new(&labels.each_ref().map(String::as_str), coverage.line_figures()));
            }
        }
        Ok(rows)
    }
}

/// Locates readings of a contact by locators in turn.
fn cover(
    setup: &Setup,
    locators: &[BoxedLocator],
    contact: Contact,
    readings: u64,
    rng: &mut Xoshiro256PlusPlus,
) -> Result<Coverage> {
    let surface = setup.surface().model().context("the surface has no model")?;
    let truth = clean_reading(surface, setup.layout(), contact);
    let errors = ChannelErrors::none(setup.layout());
    let mut coverage = Coverage::default();
    for number in 0..readings {
        let calibration = number % locators.len() as u64;
        let locator = &locators[calibration as usize];
        let reading = measure(setup.layout(), &truth, &errors, rng);
        coverage.add(calibration, &locator.locate(&reading), contact, setup.surface().extent());
    }
    Ok(coverage)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_covers_the_middle_of_a_beam() {
        let rows = CASES[5].rows(Repetitions { calibrations: 1, readings: 100 }).unwrap();
        assert_eq!(rows.len(), PLACES_MM.len());
        let row = rows.last().unwrap();
        assert_eq!(row.labels, ["closed form", "3 N, known", "100 mm"]);
        // Of 100 intervals that cover 95 %, fewer than 87 cover with a probability of 1 in 1,000.
        let covered = row.figures[1].unwrap().value;
        assert!(row.figures[0].unwrap().value == 100.0 && covered >= 87.0, "{row:?}");
    }
}

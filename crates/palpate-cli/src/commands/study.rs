//! `palpate study`: a set of experiments, the founding paper's built in.

use crate::failure::{Complaint, Failure};
use crate::output::Table;
use crate::progress::Observer;
use crate::target::{Inputs, NETWORKS_CSV, RESULTS_JSON, TargetFolder};
use crate::{input, output, progress};
use palpate_estimators::evaluation::Quantiles;
use palpate_mechanics::units::format_count;
use palpate_numerics::simd::InstructionSet;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_report::{StudyReport, paper_report, study_report};
use palpate_studies::paper::{Agreement, Claim, PublishedFigure, STUDY_TOML, claims, published_figures};
use palpate_studies::{
    ArmOutcome, ArmResults, Checkpoint, NetworksCsv, PreparedStudy, RunFacts, RunOptions, StudyResults,
    StudyRunError,
};
use std::path::{Path, PathBuf};
use std::time::Instant;

mod built_in;
mod fits;

use fits::{CheckpointFile, Tally};

/// Run a set of experiments: arms by seeds; `paper` is the founding paper's study.
#[derive(clap::Args)]
pub struct Arguments {
    /// A study file, `paper`, `dead-areas`: what lies between sensors, or `elliott`: components of a plate's readings and a network
    study: PathBuf,
    /// Fits of each arm [default: what the study says]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seeds: Option<u64>,
    /// Threads that fit [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Folder for results and report [default: palpate-out/<study>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Go on from an earlier run, stopped or finished: networks are kept, what else there is is fitted again
    #[arg(long, conflicts_with = "overwrite")]
    resume: bool,
    /// Throw an earlier run away, finished or not
    #[arg(long)]
    overwrite: bool,
    /// Print results.json instead of tables
    #[arg(long)]
    json: bool,
}

/// The way an earlier run in the same folder is treated.
#[derive(Clone, Copy, PartialEq, Eq)]
enum EarlierRun {
    Leave,
    Resume,
    Overwrite,
}

impl Arguments {
    fn earlier_run(&self) -> EarlierRun {
        match (self.resume, self.overwrite) {
            (true, _) => EarlierRun::Resume,
            (false, true) => EarlierRun::Overwrite,
            (false, false) => EarlierRun::Leave,
        }
    }

    /// The folder for results and report of a study; it may hold no earlier run unless the command line says what is to become of it.
    fn folder(&self, study: &str) -> Result<TargetFolder, Failure> {
        let out = self.out.clone().unwrap_or_else(|| Path::new("palpate-out").join(study));
        let folder = TargetFolder::for_study(&out, &Inputs::new([self.study.as_path()]))?;
        let finished = out.join(RESULTS_JSON).exists();
        let begun = finished || out.join(NETWORKS_CSV).exists();
        if begun && self.earlier_run() == EarlierRun::Leave {
            let complaint = match finished {
                true => format!("{} holds the results of a run that was finished", out.display()),
                false => format!("{} is of a run that was not finished", out.join(NETWORKS_CSV).display()),
            };
            return Err(Complaint::new(complaint)
                .help("--resume goes on from its networks, --overwrite throws it away, --out names another folder")
                .into());
        }
        Ok(folder)
    }
}

/// Content of `results.json`.
#[derive(serde::Serialize)]
struct ResultsFile<'a> {
    #[serde(flatten)]
    run: &'a RunFacts,
    #[serde(flatten)]
    results: &'a StudyResults,
    #[serde(skip_serializing_if = "Option::is_none")]
    published: Option<Vec<PublishedFigure>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    claims: Option<Vec<Claim>>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match arguments.study.to_str() {
        Some("dead-areas") => return built_in::dead_areas(arguments),
        Some("elliott") => return built_in::elliott(arguments),
        _ => {}
    }
    let is_paper = arguments.study == Path::new("paper");
    let (name, text) = if is_paper {
        ("studies/paper.toml".to_owned(), STUDY_TOML.to_owned())
    } else {
        (arguments.study.display().to_string(), input::read_text(&arguments.study)?)
    };
    let study = input::parse_study(&name, &text)?;
    let options = RunOptions {
        seeds: arguments.seeds.unwrap_or(study.seeds),
        threads: arguments.threads.map_or_else(cores, usize::from),
    };
    let out = arguments.folder(&study.name)?;
    let prepared = Observer::of_stages()
        .watch(|watch| PreparedStudy::new(study, watch))
        .map_err(|error| complaint(&error, &name, &text))?;
    let (outcomes, facts) = train(&prepared, options, &out, arguments)?;

    let results = StudyResults::new(&outcomes, &prepared);
    let file = ResultsFile {
        run: &facts,
        results: &results,
        published: is_paper.then(|| published_figures(&results)),
        claims: is_paper.then(|| claims(&outcomes, prepared.judging())),
    };
    let report = StudyReport { study: &prepared, outcomes: &outcomes, results: &results, run: &facts };
    out.write_report(if is_paper { paper_report(&report) } else { study_report(&report) })?;
    out.write(RESULTS_JSON, (output::to_json(&file)? + "\n").as_bytes())?;
    if arguments.json {
        return output::say_json(&file);
    }
    print_tables(&file, out.path())
}

/// Complaint about a study, with a caret where its file asks for what cannot be had.
fn complaint(error: &StudyRunError, name: &str, text: &str) -> Failure {
    let complaint = Complaint::new(error);
    match error {
        StudyRunError::Cancelled(_) => Failure::stopped(),
        StudyRunError::Design { span, error, .. } => {
            complaint.help(super::design::help(error)).at_span(name, text, span.clone()).into()
        }
        _ => complaint.into(),
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Fits what an earlier run has not, keeping `networks.csv` up to date where there are networks; leaves it sorted, with a row for every fit.
fn train(
    prepared: &PreparedStudy,
    options: RunOptions,
    out: &TargetFolder,
    arguments: &Arguments,
) -> Result<(Vec<ArmOutcome>, RunFacts), Failure> {
    let table = NetworksCsv::new(prepared);
    out.make()?;
    let earlier = match arguments.earlier_run() {
        EarlierRun::Resume => fits::read(out, &table)?,
        EarlierRun::Leave | EarlierRun::Overwrite => Checkpoint::default(),
    };
    let surplus = fits::surplus(&earlier.rows, options);
    let keeps = (0..prepared.study.arms.len()).any(|arm| prepared.is_kept(arm));
    let file = match keeps {
        true => Some(CheckpointFile::begin(out, &table, &earlier.done, &surplus)?),
        false => None,
    };
    let done = earlier.done;
    let resumed: Vec<(usize, u64)> = done.iter().map(|trained| (trained.arm, trained.fit.seed)).collect();
    let tally = Tally::new(prepared, options, &table, file, &done);
    let start = Instant::now();
    let go_on = |_| !progress::interrupted() && !tally.failed();
    let outcomes = prepared.run(options, done, &|trained| tally.note(trained), Watch::new(&go_on));
    let seconds = start.elapsed().as_secs_f64();
    let finished = tally.finish()?;
    if matches!(outcomes, Err(StudyRunError::Cancelled(Cancelled))) {
        let wanted = prepared.study.arms.len() as u64 * options.seeds;
        return Err(Failure::Interrupted(if keeps {
            let kept = finished.iter().enumerate().filter(|(arm, _)| prepared.is_kept(*arm));
            let kept: u64 = kept.map(|(_, fits)| fits).sum();
            let path = out.path().join(NETWORKS_CSV);
            format!(
                "stopped; {kept} of {wanted} networks are in {}; --resume goes on from them",
                path.display()
            )
        } else {
            let finished: u64 = finished.iter().sum();
            format!("stopped after {finished} of {wanted} fits; nothing was written")
        }));
    }
    let outcomes = outcomes.map_err(Complaint::new)?;
    fits::write_sorted(out, &table, &outcomes, &surplus)?;
    Ok((outcomes.clone(), facts(prepared, options, &outcomes, &resumed, seconds)))
}

fn facts(
    prepared: &PreparedStudy,
    options: RunOptions,
    outcomes: &[ArmOutcome],
    resumed: &[(usize, u64)],
    seconds: f64,
) -> RunFacts {
    let mut presentations = 0;
    for (arm, outcome) in outcomes.iter().enumerate() {
        for fit in outcome.fits.iter().filter(|fit| !resumed.contains(&(arm, fit.seed))) {
            presentations += fits::presentations(prepared, arm, fit);
        }
    }
    let arithmetic = format!("{}, {} lanes", InstructionSet::best(), prepared.study.precision.lanes());
    RunFacts::new(prepared, options, arithmetic, presentations, seconds)
}

fn print_tables(file: &ResultsFile, out: &Path) -> Result<(), Failure> {
    output::say("Medians over the seeds (5th to 95th percentile)\n")?;
    output::say(arms_table(&file.results.arms))?;
    if let Some(figures) = &file.published {
        let Agreement { agreeing, within_seeds, compared } = Agreement::new(figures);
        output::say(format!(
            "\nPublished against replicated: {agreeing} of {compared} agree with our medians, as far as was fixed beforehand; \
             {within_seeds} lie within 5–95 % of our seeds\n"
        ))?;
        let show = |figure: &PublishedFigure, value: f64| {
            if figure.found.median >= 1000.0 { whole(value) } else { format!("{value:.2}") }
        };
        output::say(
            Table::from_rows(figures)
                .column("figure", |figure| format!("{}: {}", figure.arm, figure.what))
                .column("published", |figure| show(figure, figure.published))
                .column("ours", |figure| in_words(figure.found, |value| show(figure, value)))
                .column("agrees if within", |figure| {
                    figure.yardstick.in_words(&show(figure, figure.published))
                })
                .column("agrees", |figure| yes_or_no(figure.agrees))
                .column("in 5–95 %", |figure| yes_or_no(figure.within_seeds)),
        )?;
    }
    if let Some(claims) = &file.claims {
        output::say("\nThe paper's claims, in the medians and in the share of single seeds\n")?;
        output::say(
            Table::from_rows(claims)
                .column("claim", |claim| format!("{} {}", claim.id, short(claim.claim)))
                .column("verdict", |claim| if claim.holds { "holds" } else { "DOES NOT HOLD" }.to_owned())
                .column("seeds", |claim| format!("{:.0} %", 100.0 * claim.share_of_seeds)),
        )?;
    }
    let run = file.run;
    let seconds = progress::duration(run.seconds);
    output::say(if run.presentations > 0 {
        let rate = run.presentations_per_second / 1e6;
        format!("\n{seconds} on {} threads, {rate:.1} M presentations/s ({})", run.threads, run.arithmetic)
    } else {
        format!("\n{seconds} on {} threads", run.threads)
    })?;
    output::say_report("", Some(out))
}

fn yes_or_no(holds: bool) -> String {
    if holds { "yes" } else { "NO" }.to_owned()
}

/// Table of the arms; a column only where some arm fills it.
fn arms_table(arms: &[ArmResults]) -> String {
    let mut table = Table::from_rows(arms);
    for (heading, of) in arm_columns(arms) {
        if arms.iter().any(|arm| of(arm).is_some()) {
            table = table.column(heading, |arm| of(arm).unwrap_or_else(|| "–".to_owned()));
        }
    }
    table.to_string()
}

/// A heading, and what an arm has to say under it.
type ArmColumn = (String, Box<dyn Fn(&ArmResults) -> Option<String>>);

fn arm_columns(arms: &[ArmResults]) -> Vec<ArmColumn> {
    fn column(heading: &str, of: impl Fn(&ArmResults) -> Option<String> + 'static) -> ArmColumn {
        (heading.to_owned(), Box::new(of))
    }
    let spread = |spread: &Quantiles, digits: usize| in_words(*spread, |value| format!("{value:.digits$}"));
    let mut columns = vec![
        column("arm", |arm| Some(arm.name.clone())),
        column("converged", |arm| Some(format!("{}/{}", arm.converged?, arm.seeds))),
        column("epochs", |arm| Some(in_words(arm.epochs?, whole))),
        column("average error, %", move |arm| Some(spread(&arm.error_percent, 2))),
        column("between training, %", move |arm| {
            Some(spread(&arm.training_span.as_ref()?.error_percent_within_training?, 2))
        }),
        column("beyond, %", move |arm| {
            Some(spread(&arm.training_span.as_ref()?.error_percent_beyond_training?, 2))
        }),
        column("effective length, %", move |arm| Some(spread(&arm.effective_length_percent, 1))),
        column("limit, %", |arm| Some(format!("{:.3}", arm.limit.as_ref()?.limit_error_percent))),
    ];
    // Blind ends outweigh all else in the average; with noise, the portions are told beside it.
    let limited = arms.iter().find(|arm| arm.limit.is_some());
    for (i, portion) in limited.iter().flat_map(|arm| &arm.portions).map(|p| p.portion).enumerate() {
        let key = portion.key().replace('_', "–");
        columns.push(column(&format!("{key} mm: error, %"), move |arm| {
            Some(spread(&arm.portions.get(i)?.error_percent, 3))
        }));
        columns.push(column("limit, %", move |arm| {
            Some(format!("{:.3}", arm.portions.get(i)?.limit_error_percent?))
        }));
    }
    columns
        .push(column("over the limit", move |arm| Some(spread(&arm.limit.as_ref()?.error_over_limit?, 2))));
    columns.push(column("95 % hold, %", move |arm| Some(spread(&arm.coverage_percent?, 1))));
    columns
}

/// "2.38 (2.26–2.73)": the median, and the 5th and the 95th percentile.
fn in_words(spread: Quantiles, shown: impl Fn(f64) -> String) -> String {
    let [median, low, high] = [spread.median, spread.p05, spread.p95].map(shown);
    format!("{median} ({low}–{high})")
}

/// A count, or a percentile of counts, rounded.
fn whole(count: f64) -> String {
    format_count(count.round() as u64)
}

/// A claim as long as a table's line can be.
fn short(claim: &str) -> String {
    const MOST: usize = 90;
    if claim.chars().count() <= MOST {
        return claim.to_owned();
    }
    let cut: String = claim.chars().take(MOST).collect();
    let end = cut.rfind(' ').unwrap_or(cut.len());
    cut[..end].trim_end_matches(',').to_owned() + " …"
}

//! `palpate study`: a set of experiments, the founding paper's built in.

use crate::failure::{Complaint, Failure};
use crate::table::table;
use crate::{input, interrupt, output, progress};
use palpate::evaluation::Spread;
use palpate::network::InstructionSet;
use palpate::report::{StudyReport, paper_report, study_report};
use palpate::study::paper::{Agreement, Claim, PublishedFigure, STUDY_TOML, claims, published_figures};
use palpate::study::{
    ArmOutcome, NetworksCsv, Observer, PreparedStudy, RunFacts, RunOptions, StudyResults, Trained,
};
use palpate::units::format_count;
use std::path::{Path, PathBuf};
use std::time::Instant;

mod checkpoint;
mod dead_areas;
mod watch;

use checkpoint::CheckpointFile;
use watch::Watch;

/// Run a set of experiments: arms by seeds; `paper` is the founding paper's study.
#[derive(clap::Args)]
pub struct Arguments {
    /// A study file, `paper`, or `dead-areas`: what lies between sensors
    study: PathBuf,
    /// Networks that each arm trains [default: what the study says]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seeds: Option<u64>,
    /// Threads that train [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Folder for results and report [default: palpate-out/<study>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Go on from an earlier run that was stopped
    #[arg(long, conflicts_with = "overwrite")]
    resume: bool,
    /// Throw an earlier, unfinished run away
    #[arg(long)]
    overwrite: bool,
    /// Print results.json instead of tables
    #[arg(long)]
    json: bool,
}

/// Everything that `results.json` holds.
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
    if arguments.study == Path::new(dead_areas::NAME) {
        return dead_areas::run(arguments);
    }
    let is_paper = arguments.study == Path::new("paper");
    let study = if is_paper {
        input::parse_study("studies/paper.toml", STUDY_TOML)?
    } else {
        let text = input::read_text(&arguments.study)?;
        input::parse_study(&arguments.study.display().to_string(), &text)?
    };
    let options = RunOptions {
        seeds: arguments.seeds.unwrap_or(study.seeds),
        threads: arguments.threads.map_or_else(cores, usize::from),
        set: InstructionSet::best(),
    };
    let out = arguments.out.clone().unwrap_or_else(|| Path::new("palpate-out").join(&study.name));
    let prepared = PreparedStudy::new(study).map_err(Complaint::new)?;
    let (outcomes, facts) = train(&prepared, options, &out, arguments)?;

    let results = StudyResults::of(&outcomes, prepared.judging());
    let file = ResultsFile {
        run: &facts,
        results: &results,
        published: is_paper.then(|| published_figures(&results)),
        claims: is_paper.then(|| claims(&outcomes, prepared.judging())),
    };
    let report = StudyReport { study: &prepared, outcomes: &outcomes, results: &results, run: &facts };
    output::write_report(&out, if is_paper { paper_report(&report) } else { study_report(&report) })?;
    output::write_file(&out.join("results.json"), (output::to_json(&file)? + "\n").as_bytes())?;
    if arguments.json {
        return output::say_json(&file);
    }
    print_tables(&file, &out)
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Trains what an earlier run has not, keeping `networks.csv` up to date; leaves it sorted.
fn train(
    prepared: &PreparedStudy,
    options: RunOptions,
    out: &Path,
    arguments: &Arguments,
) -> Result<(Vec<ArmOutcome>, RunFacts), Failure> {
    let table = NetworksCsv::new(prepared);
    output::make_folder(out)?;
    let (file, done) = CheckpointFile::open(out, &table, arguments.resume, arguments.overwrite)?;
    let resumed: Vec<(usize, u64)> = done.iter().map(|trained| (trained.arm, trained.fit.seed)).collect();
    let watch = Watch::new(prepared, options, &table, file, &done);
    let start = Instant::now();
    let outcomes = prepared.run(options, done, &watch);
    let seconds = start.elapsed().as_secs_f64();
    watch.finish()?;

    let wanted = prepared.study.arms.len() as u64 * options.seeds;
    let finished: u64 = outcomes.iter().map(|outcome| outcome.fits.len() as u64).sum();
    if finished < wanted {
        return Err(Failure::Interrupted(format!(
            "stopped; {finished} of {wanted} networks are in {}; --resume goes on from them",
            out.join(checkpoint::NAME).display()
        )));
    }
    checkpoint::write_sorted(out, &table, &outcomes)?;
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
            presentations += watch::presentations(prepared, arm, fit);
        }
    }
    let precision = prepared.study.precision;
    RunFacts {
        palpate: env!("CARGO_PKG_VERSION"),
        study: prepared.study.name.clone(),
        study_sha256: prepared.study.digest.clone(),
        seeds: options.seeds,
        threads: options.threads,
        precision,
        arithmetic: format!("{}, {} lanes", options.set, options.set.lanes(precision)),
        presentations,
        seconds,
        presentations_per_second: presentations as f64 / seconds,
    }
}

fn print_tables(file: &ResultsFile, out: &Path) -> Result<(), Failure> {
    let spread =
        |s: &Spread, digits: usize| format!("{:.digits$} ({:.digits$}–{:.digits$})", s.median, s.p05, s.p95);
    let arms = file.results.arms.iter().map(|arm| {
        let epochs = [arm.epochs.median, arm.epochs.p05, arm.epochs.p95].map(whole);
        let epochs = format!("{} ({}–{})", epochs[0], epochs[1], epochs[2]);
        let converged = format!("{}/{}", arm.converged, arm.seeds);
        let effective = spread(&arm.effective_length_percent, 1);
        vec![arm.name.clone(), converged, epochs, spread(&arm.error_percent, 2), effective]
    });
    output::say("Medians over the seeds (5th to 95th percentile)\n")?;
    output::say(table(&["arm", "converged", "epochs", "average error, %", "effective length, %"], arms))?;
    if let Some(figures) = &file.published {
        let rows = figures.iter().map(|figure| {
            let digits = if figure.median >= 1000.0 { 0 } else { 2 };
            let show = |value: f64| if digits == 0 { whole(value) } else { format!("{value:.2}") };
            let ours = format!("{} ({}–{})", show(figure.median), show(figure.p05), show(figure.p95));
            let name = format!("{}: {}", figure.arm, figure.what);
            vec![name, show(figure.published), ours, if figure.agrees { "yes" } else { "NO" }.to_owned()]
        });
        let Agreement { agreeing, of } = Agreement::among(figures);
        output::say(format!("\nPublished against replicated: {agreeing} of {of} agree\n"))?;
        output::say(table(&["figure", "published", "ours", "agrees"], rows))?;
    }
    if let Some(claims) = &file.claims {
        let rows = claims.iter().map(|claim| {
            let verdict = if claim.holds { "holds" } else { "DOES NOT HOLD" };
            let share = format!("{:.0} %", 100.0 * claim.share_of_seeds);
            vec![format!("{} {}", claim.id, short(claim.claim)), verdict.to_owned(), share]
        });
        output::say("\nThe paper's claims, in the medians and in the share of single seeds\n")?;
        output::say(table(&["claim", "verdict", "seeds"], rows))?;
    }
    let run = file.run;
    let (seconds, rate) = (progress::duration(run.seconds), run.presentations_per_second / 1e6);
    output::say(format!(
        "\n{seconds} on {} threads, {rate:.1} M presentations/s ({})",
        run.threads, run.arithmetic
    ))?;
    output::say(format!("Report: {}", out.join("report.html").display()))
}

/// A count, or a spread of counts, rounded.
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

impl Observer for Watch<'_> {
    fn trained(&self, trained: &Trained) {
        self.note(trained);
    }

    fn keep_going(&self) -> bool {
        !interrupt::asked() && !self.failed()
    }
}

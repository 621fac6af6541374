//! `palpate study`: a set of experiments; the founding paper's is built in.

use crate::failure::{Failure, UserError};
use crate::output::Table;
use crate::progress::Observer;
use crate::target::{Inputs, NETWORKS_CSV, OF_A_STUDY, REPORT_HTML, RESULTS_JSON, SHARD_JSON, TargetFolder};
use crate::{input, output, progress};
use palpate_estimators::evaluation::Quantiles;
use palpate_mechanics::units::format_count;
use palpate_numerics::simd::InstructionSet;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_report::{StudyReport, paper_report, study_report};
use palpate_studies::paper::{Agreement, PublishedFigure, STUDY_TOML, claims, published_figures};
use palpate_studies::{
    ArmFit, ArmResults, Checkpoint, PreparedStudy, ResultsFile, RunFacts, RunOptions, Shard, Study,
    StudyResults, StudyRunError, StudyTables, Task,
};
use std::path::{Path, PathBuf};
use std::time::Instant;

mod built_in;
mod fits;
mod shards;

use fits::{FitFiles, Tally};

const EXAMPLES: &str = "\
Examples:
  # Replicate the founding paper with 2 fits of each arm instead of 100
  palpate study paper --seeds 2 -o paper

  # Continue with 3 fits of each arm
  palpate study paper --seeds 3 -o paper --resume";

/// Run a study: fit and evaluate every arm over several seeds
///
/// A study is a TOML file, or one of three built-in studies: `paper` replicates the founding paper, `dead-areas` measures the errors between
/// sensors, and `elliott` replicates the chain of principal components and a network on a plate.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Study file, or `paper`, `dead-areas` or `elliott`
    study: PathBuf,
    /// Number of fits of each arm [default: that of the study]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seeds: Option<u64>,
    /// Number of threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Write results and report into DIR [default: palpate-out/<study>]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run shard K of N, for jobs on several machines [default DIR: palpate-out/<study>/shard-K-of-N]
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Merge the shards in these folders into the results of the whole study
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["shard", "seeds", "threads", "resume"])]
    merge: Vec<PathBuf>,
    /// Continue an earlier run and keep its finished fits
    #[arg(long, conflicts_with = "overwrite")]
    resume: bool,
    /// Delete an earlier run, finished or not
    #[arg(long)]
    overwrite: bool,
    /// Print the content of results.json instead of tables
    #[arg(long)]
    json: bool,
}

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

    /// Folder of the study; an earlier run in it needs `--resume` or `--overwrite`.
    fn folder(&self, study: &str) -> Result<TargetFolder, Failure> {
        let whole = || Path::new("palpate-out").join(study);
        let out = self.out.clone().unwrap_or_else(|| match self.shard {
            Some(shard) => whole().join(format!("shard-{}-of-{}", shard.number(), shard.of())),
            None => whole(),
        });
        let tables = self.merge.iter().flat_map(|shard| OF_A_STUDY.map(|name| shard.join(name)));
        let read: Vec<PathBuf> = tables.chain([self.study.clone()]).collect();
        let folder = TargetFolder::for_study(&out, &Inputs::new(read.iter().map(PathBuf::as_path)))?;
        if let Some(found) = OF_A_STUDY.into_iter().find(|name| out.join(name).exists())
            && self.earlier_run() == EarlierRun::Leave
        {
            let message = match found {
                RESULTS_JSON => format!("{} contains the results of a finished run", out.display()),
                SHARD_JSON => format!("{} contains a finished shard", out.display()),
                table => format!("{} belongs to an unfinished run", out.join(table).display()),
            };
            let user_error = UserError::new(message);
            return Err(match self.merge.is_empty() {
                true => user_error
                    .help("--resume continues it, --overwrite deletes it, --out names another folder"),
                false => user_error.help("--overwrite deletes it, --out names another folder"),
            }
            .into());
        }
        if self.shard.is_some() && out.join(REPORT_HTML).exists() {
            let user_error =
                UserError::new(format!("{} contains a report, and a shard writes none", out.display()));
            return Err(user_error.help("--out names another folder").into());
        }
        Ok(folder)
    }
}

struct StudyRequest<'a> {
    arguments: &'a Arguments,
    is_paper: bool,
    name: String,
    text: String,
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
    let asked = StudyRequest { arguments, is_paper, name, text };
    if !arguments.merge.is_empty() {
        return shards::merge(&asked, study);
    }
    let options = RunOptions {
        seeds: arguments.seeds.unwrap_or(study.seeds),
        threads: arguments.threads.map_or_else(cores, usize::from),
    };
    let out = arguments.folder(&study.name)?;
    let prepared = asked.prepare(study)?;
    let tables = match arguments.shard {
        Some(shard) => StudyTables::of_shard(&prepared, shard, options.seeds),
        None => StudyTables::new(&prepared),
    };
    let (fits, facts) = train(&prepared, options, &tables, (&out, arguments))?;
    match arguments.shard {
        Some(shard) => shards::finish(shard, fits.len(), facts, (&out, arguments)),
        None => asked.finish(&prepared, fits, &facts, &out),
    }
}

impl StudyRequest<'_> {
    fn prepare(&self, study: Study) -> Result<PreparedStudy, Failure> {
        let prepared = Observer::of_stages().watch(|watch| PreparedStudy::new(study, watch));
        prepared.map_err(|error| user_error(&error, &self.name, &self.text))
    }

    fn finish(
        &self,
        prepared: &PreparedStudy,
        fits: Vec<ArmFit>,
        facts: &RunFacts,
        out: &TargetFolder,
    ) -> Result<(), Failure> {
        let outcomes = prepared.by_arm(fits, facts.seeds);
        let results = StudyResults::new(&outcomes, prepared);
        let file = ResultsFile {
            run: facts,
            results: &results,
            published: self.is_paper.then(|| published_figures(&results)),
            claims: self.is_paper.then(|| claims(&outcomes, prepared.evaluation_settings())),
        };
        let report = StudyReport { study: prepared, outcomes: &outcomes, results: &results, run: facts };
        out.write_report(if self.is_paper { paper_report(&report) } else { study_report(&report) })?;
        out.write(RESULTS_JSON, (output::to_json(&file)? + "\n").as_bytes())?;
        if self.arguments.json {
            return output::print_json(&file);
        }
        print_tables(&file, out.path())
    }
}

fn user_error(error: &StudyRunError, name: &str, text: &str) -> Failure {
    let user_error = UserError::new(error);
    match error {
        StudyRunError::Cancelled(_) => Failure::stopped(),
        StudyRunError::Design { span, error, .. } => {
            user_error.help(super::design::help(error)).at_span(name, text, span.clone()).into()
        }
        _ => user_error.into(),
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Fits the remaining tasks and returns all fits; the tables are sorted at the end.
fn train(
    prepared: &PreparedStudy,
    options: RunOptions,
    tables: &StudyTables,
    (out, arguments): (&TargetFolder, &Arguments),
) -> Result<(Vec<ArmFit>, RunFacts), Failure> {
    out.make()?;
    let earlier = match arguments.earlier_run() {
        EarlierRun::Resume => fits::read(out, tables)?,
        EarlierRun::Leave | EarlierRun::Overwrite => Checkpoint::default(),
    };
    fits::print_surplus(&earlier.done, options);
    let mut fits = earlier.done;
    let files = FitFiles::begin(out, tables, &fits)?;
    let tasks = tables.tasks(options.seeds);
    let tally = Tally::new(prepared, tables, files, (&tasks, &fits));
    let start = Instant::now();
    let go_on = |_| !progress::interrupted() && !tally.failed();
    let threads = options.threads;
    let fitted = prepared.fit_tasks(&tasks, &fits, threads, &|fit| tally.note(fit), Watch::new(&go_on));
    let seconds = start.elapsed().as_secs_f64();
    let finished = tally.finish()?;
    if matches!(fitted, Err(StudyRunError::Cancelled(Cancelled))) {
        let wanted: u64 = tasks.iter().map(Task::fits).sum();
        let path = out.path().join(NETWORKS_CSV);
        return Err(Failure::Interrupted(format!(
            "stopped; {finished} of {wanted} fits are in {}; --resume continues from them",
            path.display()
        )));
    }
    let fitted = fitted.map_err(UserError::new)?;
    let presentations = fitted.iter().map(|fit| prepared.presentations(fit)).sum();
    let arithmetic = format!("{}, {} lanes", InstructionSet::best(), prepared.lanes());
    fits.extend(fitted);
    fits::write(out, &tables.whole(&fits))?;
    Ok((fits, RunFacts::new(prepared, options, arithmetic, presentations, seconds)))
}

fn print_tables(file: &ResultsFile, out: &Path) -> Result<(), Failure> {
    output::print_line("Medians over the seeds (5th to 95th percentile)\n")?;
    output::print_line(arms_table(&file.results.arms))?;
    if let Some(figures) = &file.published {
        let Agreement { agreeing, within_seeds, compared } = Agreement::new(figures);
        output::print_line(format!(
            "\nPublished against replicated: {agreeing} of {compared} agree with our medians, as far as was fixed beforehand; \
             {within_seeds} lie within 5–95 % of our seeds\n"
        ))?;
        let show = |figure: &PublishedFigure, value: f64| {
            if figure.result.median >= 1000.0 { whole(value) } else { format!("{value:.2}") }
        };
        output::print_line(
            Table::from_rows(figures)
                .column("figure", |figure| format!("{}: {}", figure.arm, figure.label))
                .column("published", |figure| show(figure, figure.published))
                .column("ours", |figure| in_words(figure.result, |value| show(figure, value)))
                .column("agrees if within", |figure| {
                    figure.criterion.in_words(&show(figure, figure.published))
                })
                .column("agrees", |figure| yes_or_no(figure.agrees))
                .column("in 5–95 %", |figure| yes_or_no(figure.within_seeds)),
        )?;
    }
    if let Some(claims) = &file.claims {
        output::print_line("\nThe paper's claims, in the medians and in the share of single seeds\n")?;
        output::print_line(
            Table::from_rows(claims)
                .column("claim", |claim| format!("{} {}", claim.id, short(claim.claim)))
                .column("verdict", |claim| if claim.holds { "holds" } else { "DOES NOT HOLD" }.to_owned())
                .column("seeds", |claim| format!("{:.0} %", 100.0 * claim.share_of_seeds)),
        )?;
    }
    output::print_line(time_in_words(file.run))?;
    output::print_report_path("", Some(out))
}

/// Formats "40 s on 2 threads, 12.3 M presentations/s (AVX2, 8 lanes)".
fn time_in_words(run: &RunFacts) -> String {
    let seconds = progress::duration(run.seconds);
    let threads = match run.shards {
        Some(shards) => format!("in {shards} shards of {} threads", run.threads),
        None => format!("on {} threads", run.threads),
    };
    match run.presentations {
        0 => format!("\n{seconds} {threads}"),
        _ => {
            let rate = run.presentations_per_second / 1e6;
            format!("\n{seconds} {threads}, {rate:.1} M presentations/s ({})", run.arithmetic)
        }
    }
}

fn yes_or_no(holds: bool) -> String {
    if holds { "yes" } else { "NO" }.to_owned()
}

/// Columns that are empty for all arms are omitted.
fn arms_table(arms: &[ArmResults]) -> String {
    let mut table = Table::from_rows(arms);
    for (heading, of) in arm_columns(arms) {
        if arms.iter().any(|arm| of(arm).is_some()) {
            table = table.column(heading, |arm| of(arm).unwrap_or_else(|| "–".to_owned()));
        }
    }
    table.to_string()
}

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
    // Blind ends dominate the average; with noise, columns for the portions are added.
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
    columns.push(column("95 % coverage, %", move |arm| Some(spread(&arm.coverage_percent?, 1))));
    columns
}

/// Formats median, 5th and 95th percentile as "2.38 (2.26–2.73)".
fn in_words(spread: Quantiles, shown: impl Fn(f64) -> String) -> String {
    let [median, low, high] = [spread.median, spread.p05, spread.p95].map(shown);
    format!("{median} ({low}–{high})")
}

fn whole(count: f64) -> String {
    format_count(count.round() as u64)
}

/// Shortens a claim to a line of a table.
fn short(claim: &str) -> String {
    const MOST: usize = 90;
    if claim.chars().count() <= MOST {
        return claim.to_owned();
    }
    let cut: String = claim.chars().take(MOST).collect();
    let end = cut.rfind(' ').unwrap_or(cut.len());
    cut[..end].trim_end_matches(',').to_owned() + " …"
}

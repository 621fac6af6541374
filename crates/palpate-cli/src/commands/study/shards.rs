//! Shards of a study: the end of one, and the merge of all into the files of a single machine.

use super::fits;
use super::{Arguments, StudyRequest, time_in_words};
use crate::failure::{Failure, UserError};
use crate::target::{NETWORKS_CSV, SHARD_JSON, TargetFolder};
use crate::{input, output};
use palpate_mechanics::units::format_count;
use palpate_studies::{AssemblyError, CheckpointError, RunFacts, Shard, ShardTables, Study, StudyTables};
use std::path::Path;

#[derive(serde::Serialize, serde::Deserialize)]
struct ShardFile {
    shard: u64,
    of: u64,
    fits: usize,
    #[serde(flatten)]
    run: RunFacts,
}

/// Writes the facts of a shard, which mark it as finished.
pub fn finish(
    shard: Shard,
    fits: usize,
    run: RunFacts,
    (out, arguments): (&TargetFolder, &Arguments),
) -> Result<(), Failure> {
    let file = ShardFile { shard: shard.number(), of: shard.of(), fits, run };
    out.write(SHARD_JSON, (output::to_json(&file)? + "\n").as_bytes())?;
    if arguments.json {
        return output::print_json(&file);
    }
    output::print_line(format!(
        "Shard {shard} of {} seeds: {} fits in {}{}",
        file.run.seeds,
        format_count(fits as u64),
        out.path().display(),
        time_in_words(&file.run)
    ))
}

/// `palpate study FILE --merge DIR…`
pub fn merge(asked: &StudyRequest, study: Study) -> Result<(), Failure> {
    let folders = &asked.arguments.merge;
    let out = asked.arguments.folder(&study.name)?;
    let shards = folders.iter().map(|folder| read_tables(folder)).collect::<Result<Vec<_>, _>>()?;
    let prepared = asked.prepare(study)?;
    let merged = prepared.merge(&shards).map_err(|error| user_error(&error, &shards))?;
    let facts = folders.iter().map(|folder| read_facts(folder)).collect::<Result<Vec<_>, _>>()?;
    let facts = RunFacts::of_shards(&facts).ok_or_else(|| UserError::new(AssemblyError::Nothing))?;
    let facts = RunFacts { seeds: merged.seeds, ..facts };
    fits::write(&out, &StudyTables::new(&prepared).whole(&merged.fits))?;
    out.remove(SHARD_JSON)?;
    asked.finish(&prepared, merged.fits, &facts, &out)
}

fn read_tables(folder: &Path) -> Result<ShardTables, Failure> {
    let networks = folder.join(NETWORKS_CSV);
    if !networks.exists() {
        let user_error = UserError::new(format!("{}: {NETWORKS_CSV} is missing", folder.display()));
        return Err(user_error.help("--merge takes the folders that --shard K/N wrote").into());
    }
    Ok(ShardTables { place: folder.display().to_string(), texts: fits::read_texts(folder)? })
}

fn read_facts(folder: &Path) -> Result<RunFacts, Failure> {
    let path = folder.join(SHARD_JSON);
    if !path.exists() {
        let user_error = UserError::new(format!("{}: {SHARD_JSON} is missing", folder.display()));
        return Err(user_error.help("run the shard again with --resume, which writes it").into());
    }
    let file: Result<ShardFile, _> = serde_json::from_str(&input::read_text(&path)?);
    let file = file.map_err(|error| {
        UserError::for_path(&path, error).help("run the shard again with --resume, which writes it again")
    })?;
    Ok(file.run)
}

fn user_error(error: &AssemblyError, shards: &[ShardTables]) -> UserError {
    let user_error = UserError::new(error);
    match error {
        AssemblyError::Table { place, error: row } => match row {
            CheckpointError::Heading { .. } => user_error
                .help("name the study file that the shard is of, or run the shard again with --overwrite"),
            CheckpointError::Row { table, .. } => {
                let name = Path::new(place).join(table.file_name()).display().to_string();
                let Some(shard) = shards.iter().find(|shard| shard.place == *place) else {
                    return user_error;
                };
                fits::at_row(user_error, &name, &shard.texts, row)
            }
        },
        AssemblyError::Whole { .. } | AssemblyError::Nothing => {
            user_error.help("--merge takes the folders that --shard K/N wrote")
        }
        AssemblyError::Split { .. } => user_error.help("leave out those of the other split"),
        AssemblyError::TwoOfAShard { .. } => user_error.help("name one of the two"),
        AssemblyError::Unfinished { place, shard, .. } => {
            user_error.help(format!("--shard {shard} --out {place} --resume continues from them"))
        }
        AssemblyError::MissingShards { missing, of } => {
            let first = missing.first().copied().unwrap_or(1);
            user_error.help(format!("name their folders too; --shard {first}/{of} runs the first of them"))
        }
        AssemblyError::TwoOfAFit { .. } | AssemblyError::MissingFits { .. } => user_error,
    }
}

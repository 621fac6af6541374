//! `palpate init --example`: a rig with data and the next commands.
//!
//! `samples` contains copies of files of the project's `examples`, as a package contains its own files
//! only; `cargo xtask tidy` compares them. Benches with a model have simulated data with fixed
//! seeds.

use super::simulate::simulated_csv;
use crate::failure::{Failure, UserError};
use crate::input;
use crate::json::object;
use crate::output;
use crate::target::{Inputs, Target};
use palpate_rig::{FirstRig, Hints, shell_word};
use std::fs;
use std::path::{Path, PathBuf};

/// A bench with data.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum SampleBench {
    /// Steel beam on two supports over eight deflection sensors, with its model
    Beam,
    /// Steel strip with six strain gauges, without a model: a board of your own
    Board,
    /// Silicone pad over twelve distance sensors, without a model
    Skin,
    /// Steel plate over nine deflection sensors, with its model
    Plate,
    /// Flexible finger with five strain gauges, with its model
    Finger,
}

pub struct Request<'a> {
    pub bench: SampleBench,
    pub folder: &'a Path,
    pub overwrite: bool,
    pub json: bool,
}

struct Files {
    rig: String,
    presses: Vec<u8>,
    touches: Vec<u8>,
}

/// Seed of the simulated touches; that of the presses is 0.
const TOUCH_SEED: u64 = 1;

impl SampleBench {
    fn name(self) -> &'static str {
        match self {
            Self::Beam => "beam",
            Self::Board => "board",
            Self::Skin => "skin",
            Self::Plate => "plate",
            Self::Finger => "finger",
        }
    }

    fn files(self, rig_name: &str, presses_name: &str) -> Result<Files, Failure> {
        let modelled = |rig: &str, spacing_m: f64| {
            let path = Path::new(rig_name);
            let mut parsed = input::parse_rig(path, rig)?;
            let presses = simulated_csv(&parsed, path, None, 0)?.1;
            parsed.training.iter_mut().for_each(|training| training.repeats = 1);
            let touches = simulated_csv(&parsed, path, Some(spacing_m), TOUCH_SEED)?.1;
            Ok(Files { rig: rig.to_owned(), presses, touches })
        };
        let recorded = |presses: &[u8], touches: &[u8]| {
            let first = FirstRig::infer(presses_name, presses, &Hints::default()).map_err(UserError::new)?;
            Ok(Files { rig: first.to_toml(rig_name), presses: presses.to_vec(), touches: touches.to_vec() })
        };
        match self {
            Self::Beam => modelled(include_str!("../../samples/noisy-beam.toml"), 7e-3),
            Self::Plate => modelled(include_str!("../../samples/plate.toml"), 35e-3),
            Self::Finger => modelled(include_str!("../../samples/digit.toml"), 3e-3),
            Self::Board => recorded(
                include_bytes!("../../samples/strip-presses.csv"),
                include_bytes!("../../samples/strip-touches.csv"),
            ),
            Self::Skin => recorded(
                include_bytes!("../../samples/skin-presses.csv"),
                include_bytes!("../../samples/skin-touches.csv"),
            ),
        }
    }

    fn next_commands(self, paths: &Paths) -> Vec<String> {
        let [rig, presses, touches, locator] = paths.words();
        // The offsets of a bench without a model drift.
        let tare = if self.has_model() { "" } else { " --tare auto" };
        let mut commands = vec![
            format!("palpate fit {rig} --data {presses} -o {locator}"),
            format!("palpate locate {locator} {touches}{tare}"),
            format!("palpate evaluate {locator} --data {touches}{tare}"),
        ];
        if self.has_model() {
            // The finger's presses and contacts have different forces.
            let force = if self == Self::Finger { " --force \"4 N\"" } else { "" };
            commands.push(format!("palpate limit {rig}{force}"));
            commands.push(format!(
                "palpate serve {locator} --from {}",
                shell_word(&format!("simulated:{}", paths.rig.display()))
            ));
        }
        commands
    }

    fn has_model(self) -> bool {
        matches!(self, Self::Beam | Self::Plate | Self::Finger)
    }
}

struct Paths {
    rig: PathBuf,
    presses: PathBuf,
    touches: PathBuf,
    locator: PathBuf,
}

impl Paths {
    fn new(bench: SampleBench, folder: &Path) -> Self {
        Self {
            rig: folder.join(format!("{}.toml", bench.name())),
            presses: folder.join("presses.csv"),
            touches: folder.join("touches.csv"),
            locator: folder.join(format!("{}.json", bench.name())),
        }
    }

    /// Paths quoted for a shell.
    fn words(&self) -> [String; 4] {
        [&self.rig, &self.presses, &self.touches, &self.locator]
            .map(|path| shell_word(&path.display().to_string()))
    }
}

pub fn run(request: &Request) -> Result<(), Failure> {
    let Request { bench, folder, overwrite, json } = *request;
    let paths = Paths::new(bench, folder);
    let written = [&paths.rig, &paths.presses, &paths.touches];
    if let (false, Some(path)) = (overwrite, written.iter().find(|path| path.exists())) {
        let user_error = UserError::new(format!("{} already exists", path.display()));
        return Err(user_error.help("name another folder, or overwrite its files by --overwrite").into());
    }
    let files = bench.files(&file_name(&paths.rig), &file_name(&paths.presses))?;
    fs::create_dir_all(folder).map_err(|error| crate::target::cannot("make the folder", folder, &error))?;
    let inputs = Inputs::new([]);
    let targets = written.map(|path| Target::new(path, &inputs));
    for (target, bytes) in targets.into_iter().zip([files.rig.as_bytes(), &files.presses, &files.touches]) {
        target?.write(bytes)?;
    }
    let commands = bench.next_commands(&paths);
    if json {
        return output::print_json(&object! {
            "palpate": env!("CARGO_PKG_VERSION"),
            "rig": paths.rig.display().to_string(),
            "files": written.map(|path| path.display().to_string()),
            "commands": commands,
        });
    }
    for path in written {
        output::print_line(path.display())?;
    }
    output::print_line("Next:")?;
    commands.iter().try_for_each(|command| output::print_line(format!("  {command}")))
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

//! Rig from a form, without a model of the surface.

use crate::calibration::{PlanError, Statements, Weights, plan};
use crate::source::{SourceUrl, SourceUrlError};
use palpate_estimators::force_prior::ForceRange;
use palpate_files as whole_file;
use palpate_rig::{Rig, RigError};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::{Path, PathBuf};

const LONGEST_NAME: usize = 100;

const MOST_COUNT: usize = 100_000;

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigForm {
    pub file: String,
    /// In the order of the board; an empty name excludes a channel.
    pub channels: Vec<String>,
    pub length_mm: f64,
    /// Width, for two directions.
    #[serde(default)]
    pub width_mm: Option<f64>,
    /// Number of places along each direction.
    pub places: Vec<usize>,
    pub repeats: usize,
    #[serde(default)]
    pub force_n: Option<f64>,
    /// Second force, for every other place.
    #[serde(default)]
    pub second_force_n: Option<f64>,
    /// Standard deviation of the placement.
    #[serde(default)]
    pub placement_mm: Option<f64>,
    #[serde(default)]
    pub sensor_places_mm: Option<Vec<Vec<f64>>>,
    /// True if contacts in use have this force.
    pub force_is_known: bool,
    #[serde(default)]
    pub overwrite: bool,
    #[serde(default)]
    pub write: bool,
}

/// Error of a form.
#[derive(Debug, thiserror::Error)]
pub enum RigFormError {
    /// Invalid value of a field.
    #[error("{problem}")]
    Field {
        /// Name of the field in the form.
        field: &'static str,
        /// Problem and bound.
        problem: String,
    },
    /// Invalid file name.
    #[error("`{name}` cannot name a rig: use letters, digits, `-`, `_`, and `.toml` at the end")]
    Name {
        /// Name.
        name: String,
    },
    /// Wrong number of channels.
    #[error("{given} channels, and the board sends {sent} values")]
    Channels {
        /// Channels of the form.
        given: usize,
        /// Values of the board.
        sent: usize,
    },
    /// Channel name that differs from the board's.
    #[error("channel `{given}`: the board calls it `{sent}`")]
    Renamed {
        /// Name of the form.
        given: String,
        /// Name of the board.
        sent: String,
    },
    /// Wrong number of place counts.
    #[error("{given} numbers of places, and the surface has {directions} directions")]
    Places {
        /// Counts of the form.
        given: usize,
        /// Directions of the surface.
        directions: usize,
    },
    /// Source that cannot exclude values.
    #[error("the source {from} cannot leave unnamed values out")]
    LeftOut {
        /// URL of the source.
        from: String,
    },
    /// Invalid entry of the rig.
    #[error("{0}")]
    Rig(#[from] RigError),
    /// Error of the plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Names unsuitable for a URL.
    #[error("{0}")]
    Columns(#[from] SourceUrlError),
    /// Existing file.
    #[error("{path} exists already")]
    Exists {
        /// File name.
        path: String,
    },
    /// Presses of an earlier calibration.
    #[error("{path} has presses of an earlier calibration: choose another name for the rig")]
    Presses {
        /// File name.
        path: String,
    },
    /// Unwritable file.
    #[error("cannot write {path}: {error}")]
    Write {
        /// File name.
        path: String,
        /// Cause.
        error: std::io::Error,
    },
}

impl RigFormError {
    /// Form field to be corrected, if any.
    pub fn field(&self) -> Option<&'static str> {
        match self {
            Self::Field { field, .. } => Some(field),
            Self::Name { .. } | Self::Exists { .. } | Self::Presses { .. } => Some("file"),
            Self::Channels { .. } | Self::Renamed { .. } | Self::LeftOut { .. } | Self::Columns(_) => {
                Some("channels")
            }
            Self::Places { .. } | Self::Plan(_) => Some("places"),
            Self::Rig(_) | Self::Write { .. } => None,
        }
    }
}

#[derive(Debug)]
pub struct NewRig {
    pub rig: Rig,
    pub from: SourceUrl,
    pub record: NewRigRecord,
    path: PathBuf,
    pub presses: PathBuf,
    pub out: PathBuf,
    pub statements: Statements,
}

#[derive(Clone, Debug, Serialize)]
pub struct NewRigRecord {
    pub file: String,
    pub text: String,
    /// Command for a later calibration.
    pub command: String,
    pub written: bool,
    pub exists: Vec<String>,
}

impl NewRig {
    pub fn new(
        form: &RigForm,
        from: &SourceUrl,
        (sent, named): &(Vec<String>, bool),
        folder: &Path,
    ) -> Result<Self, RigFormError> {
        let stem = checked_stem(&form.file)?;
        check_numbers(form)?;
        let used = used_channels(form, sent, *named)?;
        let from = if *named { from.clone() } else { with_columns(from, form)? };
        let text = text_of(form, &used)?;
        let rig = Rig::from_toml(&text)?;
        plan(&rig, Weights::default(), &[], &[])?;
        let names = [form.file.clone(), format!("{stem}-presses.csv"), format!("{stem}.locator.json")];
        let [path, presses, out] = names.clone().map(|name| folder.join(name));
        let [file, presses_name, out_name] = names;
        let exists = [(&file, &path), (&out_name, &out)];
        let exists = exists.into_iter().filter(|(_, path)| is_there(path)).map(|(name, _)| name.clone());
        let record = NewRigRecord {
            exists: exists.collect(),
            command: command(form, &from, [&file, &presses_name, &out_name]),
            file,
            text,
            written: false,
        };
        let statements = Statements {
            placement_sd_m: form.placement_mm.map(|sd_mm| sd_mm * 1e-3),
            second_force_n: form.second_force_n,
            force_is_known: form.force_is_known,
        };
        Ok(Self { rig, from, record, path, presses, out, statements })
    }

    /// Writes the rig file.
    ///
    /// # Errors
    /// [`RigFormError::Exists`] unless `overwrite`, `Presses`, or `Write`.
    pub fn write(&mut self, overwrite: bool) -> Result<(), RigFormError> {
        let name = |path: &Path| path.display().to_string();
        if is_there(&self.presses) {
            return Err(RigFormError::Presses { path: name(&self.presses) });
        }
        if let Some(path) = self.record.exists.first().filter(|_| !overwrite) {
            return Err(RigFormError::Exists { path: path.clone() });
        }
        whole_file::write(&self.path, self.record.text.as_bytes())
            .map_err(|error| RigFormError::Write { path: name(&self.path), error })?;
        self.record.written = true;
        Ok(())
    }
}

fn is_there(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

fn command(form: &RigForm, from: &SourceUrl, [rig, presses, out]: [&str; 3]) -> String {
    let second = form.second_force_n.map_or(String::new(), |n| format!(" --second-force '{n} N'"));
    format!("palpate serve {rig} --calibrate --from '{from}' --presses {presses} --out {out}{second}")
}

fn check_numbers(form: &RigForm) -> Result<(), RigFormError> {
    let refuse = |field, problem| Err(RigFormError::Field { field, problem });
    let positive = [
        ("length_mm", "the length", "mm", Some(form.length_mm)),
        ("width_mm", "the width", "mm", form.width_mm),
        ("force_n", "the force", "N", form.force_n),
        ("second_force_n", "the second force", "N", form.second_force_n),
        ("placement_mm", "the placement", "mm", form.placement_mm),
    ];
    for (field, name, unit, value) in positive {
        if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
            return refuse(field, format!("{name} is {value} {unit}; it must be greater than 0 {unit}"));
        }
    }
    let sides_mm: Vec<f64> = [form.length_mm].into_iter().chain(form.width_mm).collect();
    let longest_mm = sides_mm.iter().copied().fold(0.0, f64::max);
    if let Some(placement_mm) = form.placement_mm.filter(|placement_mm| *placement_mm >= longest_mm) {
        let most = format!("it must be less than {longest_mm} mm, the longest side");
        return refuse("placement_mm", format!("the placement is {placement_mm} mm; {most}"));
    }
    let counts = form.places.iter().map(|count| ("places", "the number of places", *count));
    let counts = counts.chain([("repeats", "the number of presses of each place", form.repeats)]);
    for (field, name, count) in counts {
        if !(1..=MOST_COUNT).contains(&count) {
            return refuse(field, format!("{name} is {count}; it must be from 1 to {MOST_COUNT}"));
        }
    }
    if form.second_force_n.is_some() && form.force_n.is_none() {
        return refuse("second_force_n", "a second force needs a first one".to_owned());
    }
    if form.second_force_n.is_some() && form.force_is_known {
        return refuse(
            "second_force_n",
            "leave it out where contacts in use have the first force".to_owned(),
        );
    }
    if form.force_is_known && form.force_n.is_none() {
        return refuse(
            "force_n",
            "contacts in use have the force of the presses, which is not given".to_owned(),
        );
    }
    check_sensor_places(form, &sides_mm)
}

fn check_sensor_places(form: &RigForm, sides_mm: &[f64]) -> Result<(), RigFormError> {
    let Some(places) = &form.sensor_places_mm else { return Ok(()) };
    let refuse = |problem| Err(RigFormError::Field { field: "sensor_places_mm", problem });
    if places.len() != form.channels.len() {
        return refuse(format!("{} places of {} sensors", places.len(), form.channels.len()));
    }
    let used = places.iter().zip(&form.channels).filter(|(_, channel)| !channel.is_empty());
    for (place_mm, channel) in used {
        if place_mm.len() != sides_mm.len() {
            return refuse(format!("`{channel}` has {} coordinates, not {}", place_mm.len(), sides_mm.len()));
        }
        let mut pairs = place_mm.iter().zip(sides_mm);
        if let Some((at_mm, side_mm)) = pairs.find(|(at_mm, side_mm)| !(0.0..=**side_mm).contains(*at_mm)) {
            return refuse(format!("`{channel}` is at {at_mm} mm; it must be from 0 mm to {side_mm} mm"));
        }
    }
    Ok(())
}

/// Stem of a `.toml` file name.
fn checked_stem(name: &str) -> Result<&str, RigFormError> {
    let plain = |stem: &&str| {
        let is_plain = |one: char| one.is_ascii_alphanumeric() || matches!(one, '-' | '_' | '.');
        !stem.is_empty()
            && !stem.starts_with(['.', '-'])
            && stem.len() <= LONGEST_NAME
            && stem.chars().all(is_plain)
    };
    let stem = name.strip_suffix(".toml").filter(plain);
    stem.ok_or_else(|| RigFormError::Name { name: name.chars().take(LONGEST_NAME).collect() })
}

/// Included channels, under the board's names.
fn used_channels(form: &RigForm, sent: &[String], named: bool) -> Result<Vec<String>, RigFormError> {
    if form.channels.len() != sent.len() {
        return Err(RigFormError::Channels { given: form.channels.len(), sent: sent.len() });
    }
    let pairs = form.channels.iter().zip(sent).filter(|(given, _)| !given.is_empty());
    if let Some((given, sent)) = pairs.clone().find(|(given, sent)| named && given != sent) {
        return Err(RigFormError::Renamed { given: given.clone(), sent: sent.clone() });
    }
    Ok(pairs.map(|(given, _)| given.clone()).collect())
}

/// Source with names, including excluded values.
fn with_columns(from: &SourceUrl, form: &RigForm) -> Result<SourceUrl, RigFormError> {
    let left_out = form.channels.iter().any(String::is_empty);
    let mut named = from.clone();
    match &mut named {
        SourceUrl::Serial { columns, .. }
        | SourceUrl::Tcp { columns, .. }
        | SourceUrl::Udp { columns, .. }
        | SourceUrl::Mqtt { columns, .. } => {
            let name = |(i, name): (usize, &String)| match name.as_str() {
                "" => format!("unused-{}", i + 1),
                name => name.to_owned(),
            };
            *columns = form.channels.iter().enumerate().map(name).collect();
        }
        _ if left_out => return Err(RigFormError::LeftOut { from: from.to_string() }),
        _ => {}
    }
    // Refuses names that the URL would split.
    let text = named.to_string();
    let again: SourceUrl = text.parse()?;
    if again == named {
        return Ok(named);
    }
    let problem = "a name of a channel has a character that separates names there".to_owned();
    Err(SourceUrlError::Parameter { text, problem }.into())
}

/// In the notation of a rig file.
fn point(place_mm: &[f64]) -> String {
    let lengths: Vec<String> =
        place_mm.iter().map(|at_mm| toml::Value::from(format!("{at_mm} mm")).to_string()).collect();
    match lengths.as_slice() {
        [along] => along.clone(),
        _ => format!("[{}]", lengths.join(", ")),
    }
}

/// Force range given by the presses alone, in the notation of a rig file.
fn press_force_range(form: &RigForm) -> Option<String> {
    let forces_n = form.force_n.into_iter().chain(form.second_force_n);
    let (least_n, greatest_n) = ForceRange::of_presses(forces_n)?.ends_n();
    Some(format!("[\"{least_n} N\", \"{greatest_n} N\"]"))
}

fn text_of(form: &RigForm, channels: &[String]) -> Result<String, RigFormError> {
    let quoted = |text: &str| toml::Value::from(text).to_string();
    let mm = |value: f64| quoted(&format!("{value} mm"));
    let force = form.force_n.map(|force_n| quoted(&format!("{force_n} N")));
    let names: Vec<String> = channels.iter().map(|name| quoted(name)).collect();
    let mut text = String::from("# Made on the dashboard's page for a board without a rig.\n\n[surface]\n");
    let mut line = |line: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{line}");
    };
    line("kind = \"measured\"  # no model: the influence functions come from the presses".to_owned());
    line(format!("length = {}", mm(form.length_mm)));
    if let Some(width_mm) = form.width_mm {
        line(format!("width = {}", mm(width_mm)));
    }
    line("\n[sensors]\nmeasure = \"raw\"  # in the unit of the channels: counts, volts".to_owned());
    if let Some(places) = &form.sensor_places_mm {
        let used = places.iter().zip(&form.channels).filter(|(_, channel)| !channel.is_empty());
        let places: Vec<String> = used.map(|(place_mm, _)| point(place_mm)).collect();
        line(format!("positions = [{}]", places.join(", ")));
    }
    line(format!("\n[recording]\nchannels = [{}]", names.join(", ")));
    if let Some(force) = force.as_ref().filter(|_| form.force_is_known) {
        line(format!("\n[contact]\nforce = {force}  # of every contact"));
    } else if let Some(range) = press_force_range(form) {
        line(format!(
            "\n# [contact]\n# force_range = {range}  # where forces in use are known better than this"
        ));
    }
    line("\n[training]".to_owned());
    match (form.width_mm, form.places.as_slice()) {
        (None, [count]) => line(format!("arrangement = \"even\"\ncount = {count}")),
        (Some(_), [columns, rows]) => line(format!("arrangement = \"grid\"\ngrid = [{columns}, {rows}]")),
        (width_mm, places) => {
            let directions = 1 + usize::from(width_mm.is_some());
            return Err(RigFormError::Places { given: places.len(), directions });
        }
    }
    line(format!("repeats = {}", form.repeats));
    if let Some(force) = &force {
        line(format!("force = {force}  # of every press"));
    }
    if let Some(placement_mm) = form.placement_mm {
        line(format!(
            "placement = {}  # standard deviation between requested and pressed position",
            mm(placement_mm)
        ));
    }
    line("\n[estimator]\nkind = \"influence\"".to_owned());
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_mechanics::contact::Position;

    fn form() -> RigForm {
        RigForm {
            file: "strip.toml".to_owned(),
            channels: vec!["left".to_owned(), String::new(), "right \"b\"".to_owned()],
            length_mm: 300.0,
            width_mm: None,
            places: vec![10],
            repeats: 2,
            force_n: Some(2.0),
            second_force_n: None,
            placement_mm: None,
            sensor_places_mm: None,
            force_is_known: false,
            overwrite: false,
            write: true,
        }
    }

    fn serial() -> SourceUrl {
        "serial:///dev/ttyACM0?baud=115200".parse().unwrap()
    }

    fn sent() -> (Vec<String>, bool) {
        (["s1", "s2", "s3"].map(String::from).to_vec(), false)
    }

    #[test]
    fn makes_a_rig_of_a_line_whose_source_names_its_values() {
        let folder = tempfile::tempdir().unwrap();
        let made = NewRig::new(&form(), &serial(), &sent(), folder.path()).unwrap();
        let channels = crate::frame::Channel::all_of(&made.rig.setup);
        let labels: Vec<&str> = channels.iter().map(|channel| channel.label.as_str()).collect();
        assert_eq!(labels, ["left", "right \"b\""]);
        assert_eq!(made.from.columns(), ["left", "unused-2", "right \"b\""]);
        assert_eq!(plan(&made.rig, Weights::default(), &[], &[]).unwrap().len(), 20);
        assert_eq!(made.rig.setup.force_n(), None);
        assert!(made.record.command.contains("--from 'serial:///dev/ttyACM0?"), "{}", made.record.command);
    }

    #[test]
    fn makes_a_rig_of_a_plane_and_of_a_board_that_names_its_values() {
        let plane = RigForm {
            width_mm: Some(120.0),
            places: vec![5, 3],
            force_is_known: true,
            channels: vec!["a".to_owned(), String::new()],
            ..form()
        };
        let named = (vec!["a".to_owned(), "b".to_owned()], true);
        let made = NewRig::new(&plane, &serial(), &named, Path::new("")).unwrap();
        assert_eq!(plan(&made.rig, Weights::default(), &[], &[]).unwrap().len(), 30);
        assert_eq!((made.rig.setup.force_n(), made.from), (Some(2.0), serial()));
    }

    #[test]
    fn rig_has_second_weight_placement_and_places_of_the_sensors() {
        let whole = RigForm {
            second_force_n: Some(4.0),
            placement_mm: Some(2.0),
            sensor_places_mm: Some(vec![vec![50.0], vec![], vec![250.0]]),
            ..form()
        };
        let made = NewRig::new(&whole, &serial(), &sent(), Path::new("")).unwrap();
        let sensors = made.rig.setup.layout().sensors();
        let places_m: Vec<f64> = sensors.iter().map(|sensor| sensor.position.x_m).collect();
        assert_eq!(places_m, [0.05, 0.25]);
        let placement_sd_m = made.rig.training.as_ref().unwrap().placement_sd_m;
        assert_eq!((placement_sd_m, made.statements.placement_sd_m), (Some(2e-3), Some(2e-3)));
        assert!(made.record.command.ends_with("--second-force '4 N'"), "{}", made.record.command);
        // The second weight applies to every other of 10 places.
        assert_eq!(plan(&made.rig, made.statements.weights(None), &[], &[]).unwrap().len(), 20 + 10);
        // The range extends a decade to either side, unless the comment becomes a line.
        assert_eq!(made.rig.setup.force_range(), None);
        let stated =
            made.record.text.replace("# [contact]", "[contact]").replace("# force_range", "force_range");
        let range = Rig::from_toml(&stated).unwrap().setup.force_range().unwrap();
        assert_eq!(range.ends_n(), (0.3, 30.0));
        let plane = RigForm {
            width_mm: Some(120.0),
            places: vec![5, 3],
            sensor_places_mm: Some(vec![vec![50.0, 20.0], vec![], vec![250.0, 100.0]]),
            ..form()
        };
        let made = NewRig::new(&plane, &serial(), &sent(), Path::new("")).unwrap();
        assert_eq!(made.rig.setup.layout().sensors()[1].position, Position { x_m: 0.25, y_m: 0.1 });
    }

    #[test]
    fn rig_without_a_force_asks_for_presses_of_unknown_force() {
        let made =
            NewRig::new(&RigForm { force_n: None, ..form() }, &serial(), &sent(), Path::new("")).unwrap();
        let presses = plan(&made.rig, made.statements.weights(None), &[], &[]).unwrap();
        assert!(presses.len() == 20 && presses.iter().all(|press| press.force_n.is_none()), "{presses:?}");
        assert!(!made.record.text.contains("force"), "{}", made.record.text);
    }

    #[test]
    fn refusals_name_the_field() {
        let field = |change: fn(&mut RigForm)| {
            let mut form = form();
            change(&mut form);
            let refused = NewRig::new(&form, &serial(), &sent(), Path::new("")).unwrap_err();
            refused.field().unwrap_or_else(|| panic!("{refused}"))
        };
        assert_eq!(field(|form| form.file = "../a".to_owned()), "file");
        assert_eq!(field(|form| form.channels.truncate(1)), "channels");
        assert_eq!(field(|form| form.length_mm = f64::INFINITY), "length_mm");
        assert_eq!(field(|form| form.width_mm = Some(-1.0)), "width_mm");
        assert_eq!(field(|form| form.places = vec![2, 2]), "places");
        assert_eq!(field(|form| form.places = vec![usize::MAX]), "places");
        assert_eq!(field(|form| form.repeats = 0), "repeats");
        assert_eq!(field(|form| form.force_n = Some(f64::NAN)), "force_n");
        assert_eq!(field(|form| (form.force_n, form.force_is_known) = (None, true)), "force_n");
        assert_eq!(field(|form| form.second_force_n = Some(-1.0)), "second_force_n");
        assert_eq!(field(|form| (form.force_n, form.second_force_n) = (None, Some(1.0))), "second_force_n");
        assert_eq!(field(|form| form.placement_mm = Some(300.0)), "placement_mm");
        assert_eq!(field(|form| form.sensor_places_mm = Some(vec![])), "sensor_places_mm");
        let beyond = |form: &mut RigForm| form.sensor_places_mm = Some(vec![vec![301.0], vec![], vec![0.0]]);
        assert_eq!(field(beyond), "sensor_places_mm");
    }

    #[test]
    fn refuses_to_replace_files_without_a_word_and_presses_altogether() {
        let folder = tempfile::tempdir().unwrap();
        let made = || NewRig::new(&form(), &serial(), &sent(), folder.path()).unwrap();
        std::fs::write(folder.path().join("strip.toml"), "mine").unwrap();
        assert_eq!(made().record.exists, ["strip.toml"]);
        assert!(matches!(made().write(false), Err(RigFormError::Exists { .. })));
        assert_eq!(std::fs::read_to_string(folder.path().join("strip.toml")).unwrap(), "mine");
        made().write(true).unwrap();
        assert!(std::fs::read_to_string(folder.path().join("strip.toml")).unwrap().contains("300 mm"));
        std::fs::write(folder.path().join("strip-presses.csv"), "").unwrap();
        assert!(matches!(made().write(true), Err(RigFormError::Presses { .. })));
    }

    #[test]
    fn refuses_names_of_other_folders_and_forms_that_cannot_be() {
        let refused = |change: fn(&mut RigForm)| {
            let mut form = form();
            change(&mut form);
            NewRig::new(&form, &serial(), &sent(), Path::new("")).unwrap_err().to_string()
        };
        for name in
            ["../a.toml", "/a.toml", "a/b.toml", ".toml", "..toml", ".a.toml", "a.txt", "a b.toml", "-a.toml"]
        {
            let form = RigForm { file: name.to_owned(), ..form() };
            let made = NewRig::new(&form, &serial(), &sent(), Path::new(""));
            assert!(matches!(made, Err(RigFormError::Name { .. })), "{name}");
        }
        assert!(refused(|form| form.length_mm = -1.0).contains("length"));
        assert!(refused(|form| form.length_mm = f64::NAN).contains("length"));
        assert!(refused(|form| form.force_n = Some(0.0)).contains("force"));
        assert!(refused(|form| form.places = vec![0]).contains("places is 0"));
        assert!(refused(|form| form.places = vec![2, 2]).contains("directions"));
        assert!(refused(|form| form.channels.truncate(1)).contains("board sends 3"));
        assert!(refused(|form| form.channels = vec![String::new(); 3]).len() > 5);
        assert!(refused(|form| form.channels[2] = "left".to_owned()).len() > 5);
        assert!(refused(|form| form.channels[2] = "a,b".to_owned()).contains("separates"));
        let named = (vec!["a".to_owned(), "b".to_owned(), "c".to_owned()], true);
        let made = NewRig::new(&form(), &serial(), &named, Path::new(""));
        assert!(matches!(made, Err(RigFormError::Renamed { .. })));
        let replay = "file:a.mcap".parse().unwrap();
        assert!(matches!(
            NewRig::new(&form(), &replay, &sent(), Path::new("")),
            Err(RigFormError::LeftOut { .. })
        ));
    }
}

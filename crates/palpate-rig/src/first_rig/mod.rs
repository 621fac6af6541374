//! First rig for a recording, with guesses as comments.

mod roles;

use std::fmt::Write;

use palpate_estimators::estimator::Auto;
use palpate_estimators::recording::{
    Content, CsvError, CsvProblem, Decimal, Header, Heading, Recording, Separator, Table, TableColumn,
    ZeroForce,
};
use palpate_mechanics::units::{Dimension, Unit, format_length_mm};

use crate::error::RigError;
use crate::rig::Rig;
use roles::{PositionRole, Roles, UnusedReason, name_and_unit, range};

/// Columns by heading or by number from 1.
#[derive(Clone, Debug, Default)]
pub struct Hints {
    /// Position along a line.
    pub position: Option<String>,
    /// Position along a plane.
    pub x: Option<String>,
    /// Position across a plane.
    pub y: Option<String>,
    /// Force.
    pub force: Option<String>,
    /// Time.
    pub time: Option<String>,
    /// Nuisance coordinate.
    pub nuisance: Option<String>,
    /// Marks of untouched rows.
    pub untouched: Option<String>,
    /// Channels; guessed if empty.
    pub channels: Vec<String>,
    /// Field separator.
    pub separator: Option<Separator>,
    /// Decimal mark.
    pub decimal: Option<Decimal>,
}

/// Limit for a reasonable time: every name is compared with every other.
const MOST_COLUMNS: usize = 10_000;

/// Reason why no rig can be guessed.
#[derive(Debug, thiserror::Error)]
pub enum FirstRigError {
    /// Unreadable file.
    #[error(transparent)]
    Csv(#[from] CsvError),
    /// Too many columns.
    #[error("the file has {columns} columns; a rig is guessed for at most {MOST_COLUMNS}")]
    TooManyColumns {
        /// Number of columns.
        columns: usize,
    },
    /// Missing position.
    #[error("no column has the name of a position; the columns are {columns}")]
    NoPosition {
        /// Columns and contents.
        columns: String,
    },
    /// Ambiguous position.
    #[error("more than one column may be the position: {candidates}")]
    ManyPositions {
        /// Headings.
        candidates: String,
    },
    /// Missing channel.
    #[error(
        "no column is left that may be a channel: a channel has a number in every row, and not always the same; the columns are {columns}"
    )]
    NoChannels {
        /// Columns and contents.
        columns: String,
    },
    /// Hint without a unique column.
    #[error("{flag}: column `{name}` is missing or not unique; the columns are {columns}")]
    NoSuchColumn {
        /// Flag of the hint.
        flag: &'static str,
        /// Name.
        name: String,
        /// Columns and contents.
        columns: String,
    },
    /// Hint of a column with text.
    #[error("{flag}: column `{column}` has `{text}` on line {line}; every row must have a number")]
    NotNumbers {
        /// Flag of the hint.
        flag: &'static str,
        /// Heading.
        column: String,
        /// First text.
        text: String,
        /// Line.
        line: usize,
    },
    /// Hint of a column without marks.
    #[error("--untouched: every row of column `{column}` must be 1, true or yes, or 0, false, no or empty")]
    NotMarks {
        /// Heading.
        column: String,
    },
    /// Hint of a column without numbers.
    #[error("{flag}: column `{column}` has no numbers")]
    NoNumbers {
        /// Flag of the hint.
        flag: &'static str,
        /// Heading.
        column: String,
    },
    /// Presses at one position.
    #[error("column `{column}` is {value} in every row; a rig needs presses at 2 positions or more")]
    OnePosition {
        /// Heading of the position.
        column: String,
        /// Value.
        value: f64,
    },
    /// Unit of another quantity.
    #[error("column `{column}` is in `{unit}`; {} is one of {}", wanted.noun(), symbols(*wanted))]
    ForeignUnit {
        /// Heading.
        column: String,
        /// Unit.
        unit: String,
        /// Expected quantity.
        wanted: Dimension,
    },
    /// Invalid guessed rig.
    #[error("the rig that was guessed from the file cannot be used: {0}")]
    Refused(RigError),
}

fn symbols(dimension: Dimension) -> String {
    dimension.units().map(|unit| unit.symbol()).collect::<Vec<_>>().join(", ")
}

impl FirstRigError {
    /// Flags of `palpate init` that resolve the error.
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::NoPosition { .. } | Self::ManyPositions { .. } => Some(
                "name the columns: --position NAME, or --x NAME --y NAME on a plane; --force NAME, --time NAME and --channel NAME where they are \
                 not guessed either; NAME may be a column's number",
            ),
            Self::NoChannels { .. } => Some("name the channels, each with --channel NAME"),
            Self::ForeignUnit { .. } => Some("convert the column, or name another one"),
            Self::Csv(CsvError { problem: CsvProblem::ManySeparators { .. }, .. }) => {
                Some("choose it with --separator")
            }
            Self::Csv(CsvError { problem: CsvProblem::DoubtfulNumber { .. }, .. }) => {
                Some("--decimal comma selects the second")
            }
            Self::Csv(CsvError { problem: CsvProblem::DoubtfulThousands { text, .. }, .. }) => {
                Some(if text.contains(',') {
                    "--decimal comma selects the second"
                } else {
                    "--decimal point selects the second"
                })
            }
            _ => None,
        }
    }
}

/// Rig guessed from a recording.
///
/// ```
/// use palpate_rig::{FirstRig, Hints, Rig};
///
/// let presses = "Ort [mm];Kraft [N];S1;S2\n10,5;1;100;20\n60;2;120;250\n95;1;20;130\n";
/// let first = FirstRig::infer("presses.csv", presses.as_bytes(), &Hints::default())?;
/// let rig = Rig::from_toml(&first.to_toml("rig.toml"))?;
/// assert_eq!(rig.setup.surface().extent().length_m(), 0.11);
/// assert_eq!(rig.setup.read_recording("presses.csv", presses.as_bytes())?.rows[0].force_n, Some(1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct FirstRig {
    source: String,
    table: Table,
    hints: Hints,
    roles: Roles,
    sides: Vec<Side>,
    zero_force: Option<ZeroForce>,
    warnings: Vec<String>,
}

impl FirstRig {
    /// Guesses a rig; `source` is the file name.
    ///
    /// # Errors
    /// [`FirstRigError`] for an unreadable file or unclear columns.
    pub fn infer(source: &str, bytes: &[u8], hints: &Hints) -> Result<Self, FirstRigError> {
        let table = Table::read(source, bytes, hints.separator, hints.decimal)?;
        let columns = table.columns.len();
        if columns > MOST_COLUMNS {
            return Err(FirstRigError::TooManyColumns { columns });
        }
        let roles = Roles::infer(&table, hints)?;
        let mut first = Self {
            source: source.to_owned(),
            hints: hints.clone(),
            sides: Vec::new(),
            zero_force: None,
            warnings: Vec::new(),
            table,
            roles,
        };
        first.sides = first.sides()?;
        let checked = [(first.roles.force, Dimension::Force), (first.roles.time, Dimension::Time)];
        for (column, wanted) in checked.into_iter().filter_map(|(column, wanted)| Some((column?, wanted))) {
            first.unit(column, wanted)?;
        }
        let rig = Rig::from_toml(&first.to_toml("rig.toml")).map_err(FirstRigError::Refused)?;
        let recording = rig.setup.read_recording(source, bytes)?;
        first.zero_force = recording.provenance.dialects.iter().find_map(|dialect| dialect.zero_force);
        if first.zero_force.is_some() {
            // Untouched rows can have any position, also off the surface.
            first.sides = first.sides()?;
        }
        first.warnings = first.column_comments(&recording);
        Ok(first)
    }

    fn sides(&self) -> Result<Vec<Side>, FirstRigError> {
        self.roles.position.columns().into_iter().map(|column| self.side(column)).collect()
    }

    /// Warnings for the owner of the bench.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Roles of the columns in one line.
    pub fn summary(&self) -> String {
        let name = |column: usize| format!("`{}`", self.table.columns[column].heading);
        let position: Vec<String> = self.roles.position.columns().into_iter().map(name).collect();
        let mut words = vec![format!("position {}", position.join(" and "))];
        words.extend(self.roles.force.map(|column| format!("force {}", name(column))));
        words.extend(self.roles.time.map(|column| format!("time {}", name(column))));
        words.extend(self.roles.nuisance.map(|column| format!("nuisance {}", name(column))));
        words.extend(self.roles.untouched.map(|column| format!("untouched rows {}", name(column))));
        let channels = &self.roles.channels;
        let ends = match channels.as_slice() {
            [only] => name(*only),
            [first, second] => format!("{} and {}", name(*first), name(*second)),
            [first, .., last] => format!("{} to {}", name(*first), name(*last)),
            [] => String::new(),
        };
        words.push(format!(
            "{} channel{} {ends}",
            channels.len(),
            if channels.len() == 1 { "" } else { "s" }
        ));
        words.join(", ")
    }

    /// Next commands for the file `rig`.
    pub fn next_commands(&self, rig: &str) -> [String; 3] {
        let [rig, data] = [rig, &self.source].map(shell_word);
        [
            format!("palpate fit {rig} --data {data} -o locator.json"),
            format!("palpate evaluate {rig} --data {data}"),
            "palpate locate locator.json READINGS.csv".to_owned(),
        ]
    }

    /// Formats the rig file under `name`.
    pub fn to_toml(&self, name: &str) -> String {
        let mut toml = Toml::default();
        let rows = self.table.rows;
        toml.comment(&format!(
            "A first rig for {}, guessed from its {rows} rows by palpate init.",
            self.source
        ));
        toml.comment("Guesses are marked; correct them where they are wrong.");
        self.warnings.iter().for_each(|warning| toml.comment(&format!("Warning: {warning}")));
        self.write_surface(&mut toml);
        toml.section("sensors");
        toml.line("measure = \"raw\"", "in the unit of the channels: counts, volts");
        self.write_recording(&mut toml);
        toml.section("estimator");
        let Auto { only } = Auto::quick();
        toml.line("kind = \"auto\"", "the best of these at held-out positions");
        let quoted: Vec<String> = only.iter().map(|kind| format!("\"{kind}\"")).collect();
        toml.line(&format!("only = [{}]", quoted.join(", ")), "the candidates that take seconds");
        toml.text.push('\n');
        toml.comment("Next:");
        self.next_commands(name).iter().for_each(|command| toml.comment(&format!("  {command}")));
        toml.text
    }

    fn write_surface(&self, toml: &mut Toml) {
        toml.section("surface");
        toml.line("kind = \"measured\"", "no model: all is learnt from the presses");
        for (key, side) in ["length", "width"].into_iter().zip(&self.sides) {
            let guess = format!(
                "a guess: presses lie between {} and {}; write the real {key}",
                format_length_mm(side.pressed_m.0),
                format_length_mm(side.pressed_m.1)
            );
            toml.line(&format!("{key} = \"{}\"", side.size), &guess);
        }
        toml.text.push('\n');
        toml.comment("[contact]");
        if self.roles.force.is_none() {
            toml.line("# force = \"3 N\"", "where every contact, also in use, has one known force");
        }
        let range = "forces in use, where not from a tenth to ten times those of the presses";
        toml.line("# force_range = [\"0.5 N\", \"10 N\"]", range);
    }

    fn write_recording(&self, toml: &mut Toml) {
        let roles = &self.roles;
        toml.section("recording");
        if self.table.header == Header::Absent {
            toml.line("header = false", "columns by their numbers");
        }
        if let Some(separator) = self.hints.separator {
            toml.line(&format!("separator = \"{}\"", separator.name()), "as given");
        }
        if let Some(decimal) = self.hints.decimal {
            toml.line(&format!("decimal = \"{}\"", decimal.name()), "as given");
        }
        let keys: &[&str] = match roles.position {
            PositionRole::Along(_) => &["position"],
            PositionRole::Plane(..) => &["x", "y"],
        };
        for (key, column) in keys.iter().zip(roles.position.columns()) {
            self.write_column(toml, key, column);
        }
        self.write_unit(toml, "position_unit", roles.position.columns()[0], Dimension::Length);
        if self.sides.iter().any(|side| side.origin != "0 mm") {
            let origins: Vec<String> = self.sides.iter().map(|side| quoted(&side.origin)).collect();
            let place = if origins.len() == 1 { "left end" } else { "lower left corner" };
            let comment = format!("a guess: the file's coordinates of the surface's {place}");
            toml.line(&format!("origin = [{}]", origins.join(", ")), &comment);
        }
        if let Some(force) = roles.force {
            self.write_column(toml, "force", force);
            self.write_unit(toml, "force_unit", force, Dimension::Force);
            if let Some(ZeroForce { zero_n, rows, .. }) = self.zero_force {
                let newton = usual_unit(Dimension::Force);
                let zero = newton.format_si(zero_n);
                let comment = format!("a guess: {rows} rows have less, and read as without contact");
                toml.line(&format!("force_zero = \"{zero} {newton}\""), &comment);
            }
        }
        if let Some(time) = roles.time {
            self.write_column(toml, "time", time);
            if let Content::Numbers(_) = self.table.columns[time].content {
                self.write_unit(toml, "time_unit", time, Dimension::Time);
            }
        }
        if let Some(nuisance) = roles.nuisance {
            self.write_column(toml, "nuisance", nuisance);
            if let Some(unit) = own_unit(&self.table.columns[nuisance]) {
                toml.line(&format!("nuisance_unit = \"{unit}\""), "");
            }
        }
        if let Some(untouched) = roles.untouched {
            let marks = self.table.columns[untouched].marks().unwrap_or_default();
            let count = marks.iter().filter(|mark| **mark).count();
            let marked = format!("{count} of {} rows, recorded untouched", marks.len());
            let comment = match self.hints.untouched {
                Some(_) => marked,
                None => format!("a guess by its name: it marks {marked}"),
            };
            toml.line(&format!("untouched = {}", self.key(untouched)), &comment);
        }
        let channels: Vec<String> = roles.channels.iter().map(|column| self.key(*column)).collect();
        toml.line(&format!("channels = [{}]", channels.join(", ")), "");
        for (column, left) in &roles.left {
            toml.comment(&format!("Left alone: {}", self.describe_unused_column(*column, left)));
        }
    }

    fn write_column(&self, toml: &mut Toml, key: &str, column: usize) {
        let heading = &self.table.columns[column].heading;
        let name = self.key(column);
        let comment = if name == quoted(heading) { String::new() } else { format!("`{heading}`") };
        let comment = if self.table.header == Header::Absent { String::new() } else { comment };
        toml.line(&format!("{key} = {name}"), &comment);
    }

    fn write_unit(&self, toml: &mut Toml, key: &str, column: usize, wanted: Dimension) {
        let unit = own_unit(&self.table.columns[column]);
        let comment = if unit.is_some() { "" } else { "a guess: the header has no unit" };
        let unit = unit.unwrap_or_else(|| usual_unit(wanted));
        toml.line(&format!("{key} = \"{unit}\""), comment);
    }

    /// Column in a rig: without a clear unit, by number if its heading is not unique.
    fn key(&self, column: usize) -> String {
        let heading = &self.table.columns[column].heading;
        if self.table.header == Header::Absent {
            return heading.clone();
        }
        let name = Heading::parse(heading).name;
        let same =
            |other: &&TableColumn| other.heading == name || Heading::parse(&other.heading).name == name;
        let is_heading = |other: &&TableColumn| other.heading == *heading;
        match self.table.columns.iter().filter(same).count() {
            1 if !name.is_empty() => quoted(name),
            _ if heading.is_empty() || self.table.columns.iter().filter(is_heading).count() > 1 => {
                (column + 1).to_string()
            }
            _ => quoted(heading),
        }
    }

    fn describe_unused_column(&self, column: usize, left: &UnusedReason) -> String {
        let heading = &self.table.columns[column].heading;
        let reason = match left {
            UnusedReason::Empty => "it is empty".to_owned(),
            UnusedReason::Words => "it contains words".to_owned(),
            UnusedReason::Word { line, text } => format!("`{text}` on line {line} is not a number"),
            UnusedReason::Gap { line } => format!("it is empty on line {line}"),
            UnusedReason::Unnamed => format!("column {} has no heading", column + 1),
            UnusedReason::Constant(value) => format!("it is {value} in every row"),
            UnusedReason::Dead(value) => format!("it is {value} in every row, so it carries no information"),
            UnusedReason::Counter => "it numbers the rows".to_owned(),
            UnusedReason::Circumstance => {
                let unit = own_unit(&self.table.columns[column]);
                let unit = unit.map_or(String::new(), |unit| format!(" and nuisance_unit = \"{unit}\""));
                format!(
                    "if readings depend on it and it is unknown in use, set nuisance = {}{unit}",
                    self.key(column)
                )
            }
            UnusedReason::Single => {
                "if it is a channel, add it to `channels`; if readings depend on it, set it as `nuisance`"
                    .to_owned()
            }
            UnusedReason::OneOfForces => {
                format!("it is one of several possible forces: set force = {}", self.key(column))
            }
            UnusedReason::Second => "another column has the role that its name suggests".to_owned(),
            UnusedReason::Unit(unit) => format!("palpate does not read it in `{unit}`; convert it"),
        };
        format!("`{heading}`: {reason}.")
    }

    fn unit(&self, column: usize, wanted: Dimension) -> Result<Unit, FirstRigError> {
        let TableColumn { heading, .. } = &self.table.columns[column];
        let foreign = |unit: &str| FirstRigError::ForeignUnit {
            column: heading.clone(),
            unit: unit.to_owned(),
            wanted,
        };
        match (own_unit(&self.table.columns[column]), Heading::parse(heading).unit) {
            (Some(unit), _) if unit.dimension() == wanted => Ok(unit),
            (Some(unit), _) => Err(foreign(unit.symbol())),
            (None, Some(unit)) if heading.ends_with(']') && wanted != Dimension::Time => Err(foreign(unit)),
            (None, _) => Ok(usual_unit(wanted)),
        }
    }

    fn side(&self, column: usize) -> Result<Side, FirstRigError> {
        let unit = self.unit(column, Dimension::Length)?;
        let heading = &self.table.columns[column].heading;
        let numbers = self.press_values(column);
        if numbers.is_empty() {
            return Err(FirstRigError::NoNumbers { flag: "--position", column: heading.clone() });
        }
        let (low, high) = range(&numbers);
        if low == high {
            return Err(FirstRigError::OnePosition { column: heading.clone(), value: low });
        }
        let metres = |value: f64| unit.parse_si(&value.to_string()).unwrap_or(value);
        Ok(Side::around(metres(low), metres(high)))
    }

    fn press_values(&self, column: usize) -> Vec<f64> {
        let numbers = self.table.columns[column].numbers().unwrap_or_default();
        let forces = self.roles.force.and_then(|force| self.table.columns[force].numbers());
        let marks = self.roles.untouched.and_then(|untouched| self.table.columns[untouched].marks());
        let zero_n = self.zero_force.map_or(0.0, |zero| zero.zero_n);
        let unit = self.roles.force.and_then(|force| own_unit(&self.table.columns[force]));
        let unit = unit.unwrap_or_else(|| usual_unit(Dimension::Force));
        let is_zero = |force: f64| (force * unit.factor()).abs() <= zero_n;
        let is_touched = |row: usize| {
            let force = forces.as_ref().and_then(|forces| forces[row]);
            !force.is_some_and(is_zero) && !marks.as_ref().is_some_and(|marks| marks[row])
        };
        let rows = || numbers.iter().enumerate().filter_map(|(row, number)| Some((row, (*number)?)));
        let touched: Vec<f64> =
            rows().filter(|(row, _)| is_touched(*row)).map(|(_, number)| number).collect();
        if touched.is_empty() { rows().map(|(_, number)| number).collect() } else { touched }
    }

    fn column_comments(&self, recording: &Recording) -> Vec<String> {
        let left = |(column, left): &(usize, UnusedReason)| {
            let heading = &self.table.columns[*column].heading;
            match left {
                UnusedReason::Dead(value) => Some(format!(
                    "column `{heading}` is {value} in every row and was left out: is it a channel, and is it connected?"
                )),
                UnusedReason::Word { line, text } => {
                    Some(format!("column `{heading}` was left out: `{text}` on line {line} is not a number"))
                }
                UnusedReason::Gap { line } => {
                    Some(format!("column `{heading}` was left out: it is empty on line {line}"))
                }
                UnusedReason::Unit(unit) => Some(format!(
                    "column `{heading}` was left out: palpate does not read it in `{unit}`; convert it"
                )),
                UnusedReason::Unnamed => Some(format!(
                    "column {number} has no heading and was left out; if it is a channel, add {number} to `channels`",
                    number = column + 1
                )),
                _ => None,
            }
        };
        let mut warnings: Vec<String> = self.roles.left.iter().filter_map(left).collect();
        warnings.extend(self.warnings_of_headings());
        warnings.extend(self.zero_force.map(|zero| zero.to_string()));
        warnings.extend(recording.warning_lines());
        let positions = recording.distinct_positions().len();
        let enough = if self.sides.len() == 1 { 5 } else { 9 };
        if positions < enough {
            warnings.push(format!(
                "the presses are at only {positions} positions; an estimator cannot interpolate reliably between them: press at {enough} or more"
            ));
        }
        warnings
    }

    /// Warns of equal headings, up to case and blanks.
    fn warnings_of_headings(&self) -> Vec<String> {
        if self.table.header == Header::Absent {
            return Vec::new();
        }
        let folded = |heading: &str| -> String {
            heading.chars().filter(|c| !c.is_whitespace()).flat_map(char::to_lowercase).collect()
        };
        let mut columns: Vec<(String, usize)> = self
            .table
            .columns
            .iter()
            .enumerate()
            .map(|(i, column)| (folded(&column.heading), i))
            .filter(|(heading, _)| !heading.is_empty())
            .collect();
        columns.sort();
        let mut alike: Vec<&[(String, usize)]> =
            columns.chunk_by(|a, b| a.0 == b.0).filter(|columns| columns.len() > 1).collect();
        alike.sort_by_key(|columns| columns[0].1);
        let mut warnings: Vec<String> =
            alike.into_iter().map(|columns| self.warning_of_alike(columns)).collect();
        let is_unnamed = |column: &&usize| self.table.columns[**column].heading.is_empty();
        let unnamed: Vec<String> =
            self.roles.channels.iter().filter(is_unnamed).map(|column| (column + 1).to_string()).collect();
        if !unnamed.is_empty() {
            warnings.push(format!(
                "columns without a heading are taken as channels by their numbers: {}",
                unnamed.join(", ")
            ));
        }
        if !self.roles.many_forces.is_empty() {
            let forces: Vec<String> = self.roles.many_forces.iter().map(|column| self.key(*column)).collect();
            warnings.push(format!(
                "columns {} may all be the force, and none was chosen; choose one with --force",
                forces.join(", ")
            ));
        }
        warnings
    }

    fn warning_of_alike(&self, columns: &[(String, usize)]) -> String {
        let heading = |column: &usize| self.table.columns[*column].heading.as_str();
        let indices: Vec<usize> = columns.iter().map(|(_, column)| *column).collect();
        let numbers: Vec<String> = indices.iter().map(|column| (column + 1).to_string()).collect();
        let numbers = numbers.join(", ");
        let first = heading(&indices[0]);
        if indices.iter().all(|column| heading(column) == first) {
            format!("columns {numbers} share the heading `{first}`; the rig names them by their numbers")
        } else {
            let names: Vec<String> = indices.iter().map(|column| format!("`{}`", heading(column))).collect();
            format!("columns {numbers} are named alike but for case or blanks: {}", names.join(", "))
        }
    }
}

fn own_unit(column: &TableColumn) -> Option<Unit> {
    name_and_unit(Heading::parse(&column.heading)).1
}

fn usual_unit(dimension: Dimension) -> Unit {
    let symbol = match dimension {
        Dimension::Length => "mm",
        Dimension::Force => "N",
        _ => "s",
    };
    Unit::from_symbol(symbol).unwrap_or(Unit::NONE)
}

#[derive(Clone, Debug, PartialEq)]
struct Side {
    origin: String,
    size: String,
    pressed_m: (f64, f64),
}

impl Side {
    /// Creates a side from 0 if the presses begin near it, with equal margins and round numbers.
    fn around(low_m: f64, high_m: f64) -> Self {
        let span_m = high_m - low_m;
        let (digit, exponent) = round_step(span_m / 20.0);
        let step_m = decimal(digit, exponent);
        let first = if low_m < 0.0 || low_m > span_m { (low_m / step_m + 1e-9).floor() } else { 0.0 };
        let margin_m = low_m - first * step_m;
        let last = ((high_m + margin_m) / step_m - 1e-9).ceil().max(first + 1.0);
        let said = |steps: f64| {
            let millimetre = usual_unit(Dimension::Length);
            format!(
                "{} {millimetre}",
                millimetre.format_si(decimal(digit.saturating_mul(steps as i64), exponent))
            )
        };
        Self { origin: said(first), size: said(last - first), pressed_m: (low_m, high_m) }
    }
}

/// Returns the least of 1, 2 or 5 times a power of ten that is at least `value`.
fn round_step(value: f64) -> (i64, i32) {
    let exponent = value.log10().floor();
    let mantissa = value / 10f64.powf(exponent);
    let digit = [1, 2, 5].into_iter().find(|digit| mantissa <= *digit as f64 * (1.0 + 1e-9));
    digit.map_or((1, exponent as i32 + 1), |digit| (digit, exponent as i32))
}

/// `digits` · 10^`exponent`, rounded once.
fn decimal(digits: i64, exponent: i32) -> f64 {
    format!("{digits}e{exponent}").parse().unwrap_or(f64::NAN)
}

#[derive(Default)]
struct Toml {
    text: String,
}

impl Toml {
    fn section(&mut self, name: &str) {
        let _ = write!(self.text, "\n[{name}]\n");
    }

    fn line(&mut self, code: &str, comment: &str) {
        self.text += code;
        if !comment.is_empty() {
            let gap = 34usize.saturating_sub(code.chars().count()).max(2);
            let _ = write!(self.text, "{}# {}", " ".repeat(gap), printable(comment));
        }
        self.text.push('\n');
    }

    fn comment(&mut self, text: &str) {
        let _ = writeln!(self.text, "# {}", printable(text));
    }
}

fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}

fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// Quotes a file name for a shell.
pub fn shell_word(name: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "._-/\\:".contains(c);
    if !name.is_empty() && name.chars().all(plain) { name.to_owned() } else { format!("\"{name}\"") }
}

#[cfg(test)]
mod tests;

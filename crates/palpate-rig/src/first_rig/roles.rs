//! Roles of columns, guessed by English and German names, units and contents.

use palpate_estimators::recording::{Content, Header, Heading, Table};
use palpate_mechanics::units::{Dimension, Unit};

use super::{FirstRigError, Hints};

const PLACE: &[&str] = &[
    "position",
    "pos",
    "ort",
    "stelle",
    "lage",
    "place",
    "location",
    "coordinate",
    "coord",
    "koordinate",
    "messort",
    "druckort",
    "kontaktort",
    "messstelle",
    "druckstelle",
    "kontaktposition",
];
/// Names of a position if no column has a better one.
const DISTANCE: &[&str] = &["distance", "abstand", "weg", "strecke"];
const FORCE: &[&str] = &[
    "force",
    "kraft",
    "f",
    "fz",
    "fn",
    "load",
    "last",
    "belastung",
    "normalkraft",
    "druckkraft",
    "presskraft",
    "anpresskraft",
];
const TIME: &[&str] = &[
    "time",
    "zeit",
    "t",
    "timestamp",
    "zeitstempel",
    "datetime",
    "date",
    "datum",
    "uhrzeit",
    "messzeit",
    "zeitpunkt",
    "elapsed",
    "seconds",
    "sekunden",
];
/// Names of a column that marks untouched rows, with joined words.
const UNTOUCHED: &[&str] = &[
    "untouched",
    "nottouched",
    "notouch",
    "nocontact",
    "idle",
    "baseline",
    "tare",
    "unloaded",
    "unberührt",
    "unberuehrt",
    "unbelastet",
    "keinkontakt",
    "ohnekontakt",
    "keineberührung",
    "ohneberührung",
    "ruhe",
    "ruhelage",
    "leerlauf",
    "frei",
    "nullpunkt",
    "nulllinie",
];
/// Words without a meaning of their own.
const FILLERS: &[&str] = &[
    "true", "actual", "measured", "ist", "soll", "contact", "kontakt", "press", "applied", "normal", "axis",
    "achse", "achsen", "richtung", "der", "des", "of", "the", "und", "and", "in", "am", "z",
];
/// Row counters.
const COUNTERS: &[&str] = &[
    "nr",
    "no",
    "num",
    "number",
    "nummer",
    "index",
    "idx",
    "id",
    "i",
    "n",
    "row",
    "zeile",
    "sample",
    "messung",
    "measurement",
    "press",
    "versuch",
    "trial",
    "run",
    "lauf",
    "repeat",
    "repetition",
    "wiederholung",
    "wdh",
    "rep",
    "cycle",
    "zyklus",
    "sweep",
    "count",
    "punkt",
    "point",
    "frame",
    "step",
    "schritt",
];
/// Other properties of a press.
const CIRCUMSTANCES: &[&str] = &[
    "depth",
    "tiefe",
    "eindrucktiefe",
    "eindringtiefe",
    "indentation",
    "angle",
    "winkel",
    "speed",
    "geschwindigkeit",
    "velocity",
    "temperature",
    "temperatur",
    "temp",
    "humidity",
    "feuchte",
    "luftfeuchte",
    "luftfeuchtigkeit",
    "z",
    "radius",
    "diameter",
    "durchmesser",
    "height",
    "hoehe",
    "höhe",
];

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Roles {
    pub position: PositionRole,
    pub force: Option<usize>,
    pub many_forces: Vec<usize>,
    pub time: Option<usize>,
    pub nuisance: Option<usize>,
    pub untouched: Option<usize>,
    pub channels: Vec<usize>,
    pub left: Vec<(usize, UnusedReason)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PositionRole {
    Along(usize),
    Plane(usize, usize),
}

/// Reason why a column has no role.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum UnusedReason {
    Empty,
    Words,
    Word {
        line: usize,
        text: String,
    },
    Gap {
        line: usize,
    },
    Unnamed,
    /// Constant property of the press.
    Constant(f64),
    /// Constant channel.
    Dead(f64),
    Counter,
    /// Other property of the press.
    Circumstance,
    /// Outside the numbered series of channels.
    Single,
    /// Another column has the suggested role.
    Second,
    /// Other columns can be the force.
    OneOfForces,
    /// Unit that does not suit the role.
    Unit(String),
}

impl PositionRole {
    pub fn columns(self) -> Vec<usize> {
        match self {
            Self::Along(x) => vec![x],
            Self::Plane(x, y) => vec![x, y],
        }
    }
}

impl Roles {
    /// Assigns hinted roles, then the likeliest others.
    pub fn infer(table: &Table, hints: &Hints) -> Result<Self, FirstRigError> {
        let names: Vec<ColumnName> = (0..table.columns.len()).map(|i| ColumnName::new(table, i)).collect();
        let guess = RoleInference { table, names: &names };
        let told = ExplicitRoles::find(table, hints)?;
        let untouched = told.untouched.or_else(|| guess.untouched(&told));
        let position = match told.position {
            Some(position) => position,
            None => guess.position(&told, untouched)?,
        };
        let mut taken = position.columns();
        let others = told.force.iter().chain(&told.time).chain(&told.nuisance).chain(&untouched);
        taken.extend(others.chain(&told.channels));
        let forces =
            if told.force.is_some() { Vec::new() } else { guess.forces(&taken, position, untouched) };
        let force = told.force.or(forces.first().copied().filter(|_| forces.len() == 1));
        taken.extend(force);
        let time = told.time.or_else(|| guess.time(&taken));
        taken.extend(time);
        let channels = if told.channels.is_empty() { guess.channels(&taken) } else { told.channels };
        if channels.is_empty() {
            return Err(FirstRigError::NoChannels { columns: described(table) });
        }
        let roles = position.columns().into_iter().chain(force).chain(time).chain(told.nuisance);
        let roles: Vec<usize> = roles.chain(untouched).chain(channels.iter().copied()).collect();
        // Separators at the ends of lines make empty columns without a heading.
        let blank = |i: &usize| names[*i].words.is_empty() && table.columns[*i].content == Content::Empty;
        let left = (0..names.len()).filter(|i| !roles.contains(i) && !blank(i));
        let reason = |i: usize| match forces.contains(&i) {
            true if force.is_none() => UnusedReason::OneOfForces,
            _ => guess.reason(i, force.is_some()),
        };
        let left = left.map(|i| (i, reason(i))).collect();
        let many_forces = if forces.len() > 1 { forces } else { Vec::new() };
        Ok(Self { position, force, many_forces, time, nuisance: told.nuisance, untouched, channels, left })
    }
}

struct ExplicitRoles {
    position: Option<PositionRole>,
    force: Option<usize>,
    time: Option<usize>,
    nuisance: Option<usize>,
    untouched: Option<usize>,
    channels: Vec<usize>,
}

impl ExplicitRoles {
    fn find(table: &Table, hints: &Hints) -> Result<Self, FirstRigError> {
        let find = |flag: &'static str, name: &Option<String>| {
            name.as_ref().map(|name| find(table, flag, name)).transpose()
        };
        // Untouched rows may have empty fields there.
        let numbers = |flag: &'static str, name: &Option<String>| {
            let found = find(flag, name)?;
            found
                .map(|i| table.columns[i].numbers().map_or_else(|| checked(table, flag, i), |_| Ok(i)))
                .transpose()
        };
        let untouched = find("--untouched", &hints.untouched)?;
        if let Some(i) = untouched.filter(|i| table.columns[*i].marks().is_none()) {
            return Err(FirstRigError::NotMarks { column: table.columns[i].heading.clone() });
        }
        let along = numbers("--position", &hints.position)?;
        let position = match (along, numbers("--x", &hints.x)?, numbers("--y", &hints.y)?) {
            (Some(x), _, _) => Some(PositionRole::Along(x)),
            (None, Some(x), Some(y)) => Some(PositionRole::Plane(x, y)),
            (None, Some(x), None) | (None, None, Some(x)) => Some(PositionRole::Along(x)),
            (None, None, None) => None,
        };
        let channels = hints.channels.iter();
        let channels =
            channels.map(|name| checked(table, "--channel", self::find(table, "--channel", name)?));
        Ok(Self {
            position,
            force: numbers("--force", &hints.force)?,
            time: find("--time", &hints.time)?,
            nuisance: numbers("--nuisance", &hints.nuisance)?,
            untouched,
            channels: channels.collect::<Result<_, _>>()?,
        })
    }
}

fn find(table: &Table, flag: &'static str, name: &str) -> Result<usize, FirstRigError> {
    let name = name.trim();
    let exact = |heading: &str| heading == name;
    let without_unit = |heading: &str| Heading::parse(heading).name == name;
    let all = |fits: &dyn Fn(&str) -> bool| -> Vec<usize> {
        (0..table.columns.len()).filter(|i| fits(&table.columns[*i].heading)).collect()
    };
    let number = name.parse::<usize>().ok().filter(|number| (1..=table.columns.len()).contains(number));
    match (all(&exact).as_slice(), all(&without_unit).as_slice()) {
        ([only], _) | ([], [only]) => Ok(*only),
        ([], []) if number.is_some() => Ok(number.unwrap_or(1) - 1),
        _ => Err(FirstRigError::NoSuchColumn { flag, name: name.to_owned(), columns: described(table) }),
    }
}

fn checked(table: &Table, flag: &'static str, column: usize) -> Result<usize, FirstRigError> {
    let heading = || table.columns[column].heading.clone();
    match &table.columns[column].content {
        Content::Numbers(_) => Ok(column),
        Content::Other { line, text, .. } => {
            Err(FirstRigError::NotNumbers { flag, column: heading(), text: text.clone(), line: *line })
        }
        Content::Gaps { line, .. } => {
            Err(FirstRigError::NotNumbers { flag, column: heading(), text: String::new(), line: *line })
        }
        Content::Empty | Content::Times | Content::Marks(_) => {
            Err(FirstRigError::NoNumbers { flag, column: heading() })
        }
    }
}

pub(super) fn described(table: &Table) -> String {
    const MOST: usize = 100;
    let words = table.columns.iter().take(MOST).map(|column| {
        let content = match &column.content {
            Content::Empty => "empty".to_owned(),
            Content::Times => "timestamps".to_owned(),
            Content::Numbers(numbers) => {
                let (low, high) = range(numbers);
                format!("{low} to {high}")
            }
            Content::Gaps { line, .. } => format!("numbers, but empty on line {line}"),
            Content::Other { numbers: 0, .. } | Content::Marks(_) => "words".to_owned(),
            Content::Other { line, text, .. } => format!("numbers, but `{text}` on line {line}"),
        };
        format!("`{}` ({content})", column.heading)
    });
    let more = table.columns.len().saturating_sub(MOST);
    let more = (more > 0).then(|| format!("and {more} more"));
    words.chain(more).collect::<Vec<_>>().join(", ")
}

pub(super) fn range(numbers: &[f64]) -> (f64, f64) {
    let low = numbers.iter().copied().fold(f64::INFINITY, f64::min);
    (low, numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

struct ColumnName {
    /// Lowercase words without the unit.
    words: Vec<String>,
    /// Heading without its final number, if any.
    stem: (String, bool),
    unit: Option<Unit>,
    /// Unknown unit.
    foreign_unit: Option<String>,
    has_heading: bool,
}

impl ColumnName {
    fn new(table: &Table, index: usize) -> Self {
        let text = &table.columns[index].heading;
        let heading = Heading::parse(text);
        let (name, unit) = name_and_unit(heading);
        let foreign_unit = heading.unit.filter(|_| unit.is_none()).map(str::to_owned);
        let words = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        Self {
            words: words.map(str::to_lowercase).collect(),
            stem: (stem.trim().to_lowercase(), stem.len() < name.len()),
            unit,
            foreign_unit,
            has_heading: table.header == Header::Absent || !text.is_empty(),
        }
    }

    /// True if a word is among `names` and the others are fillers or in `beside`.
    fn is(&self, names: &[&str], beside: &[&[&str]]) -> bool {
        let among = |word: &String, lists: &[&[&str]]| lists.iter().any(|list| list.contains(&word.as_str()));
        let others = |word: &String| among(word, &[names, FILLERS]) || among(word, beside);
        self.words.iter().any(|word| names.contains(&word.as_str())) && self.words.iter().all(others)
    }

    fn is_of_untouched(&self) -> bool {
        let words: Vec<&str> = self.words.iter().map(String::as_str).filter(|word| *word != "is").collect();
        UNTOUCHED.contains(&words.concat().as_str())
    }

    fn measures(&self, dimension: Dimension) -> bool {
        match (&self.unit, &self.foreign_unit) {
            (Some(unit), _) => unit.dimension() == dimension,
            (None, foreign) => foreign.is_none(),
        }
    }
}

struct RoleInference<'a> {
    table: &'a Table,
    names: &'a [ColumnName],
}

impl RoleInference<'_> {
    fn columns(&self, taken: &[usize], fit: impl Fn(&ColumnName) -> bool) -> Vec<usize> {
        let free = (0..self.names.len()).filter(|i| !taken.contains(i) && self.names[*i].has_heading);
        free.filter(|i| fit(&self.names[*i])).collect()
    }

    fn numbers(&self, column: usize) -> Option<&[f64]> {
        match &self.table.columns[column].content {
            Content::Numbers(numbers) => Some(numbers),
            _ => None,
        }
    }

    fn varies(&self, column: usize) -> bool {
        self.numbers(column).map(range).is_some_and(|(low, high)| low < high)
    }

    /// Finds a column with a suitable name and both marked and unmarked rows.
    fn untouched(&self, told: &ExplicitRoles) -> Option<usize> {
        let taken: Vec<usize> = [told.force, told.time, told.nuisance].into_iter().flatten().collect();
        let taken = [taken.as_slice(), told.channels.as_slice()].concat();
        let marks = |i: &usize| {
            let marks = self.table.columns[*i].marks().unwrap_or_default();
            marks.contains(&true) && marks.contains(&false)
        };
        let named = self.columns(&taken, ColumnName::is_of_untouched);
        named.into_iter().find(marks)
    }

    /// Columns with a number in every row (else with gaps), not constant.
    fn places(&self, columns: Vec<usize>) -> Vec<usize> {
        let (full, gaps): (Vec<usize>, Vec<usize>) =
            columns.into_iter().partition(|i| self.numbers(*i).is_some());
        let varies_between_gaps = |i: &usize| {
            let numbers: Vec<f64> =
                self.table.columns[*i].numbers().unwrap_or_default().into_iter().flatten().collect();
            !numbers.is_empty() && range(&numbers).0 < range(&numbers).1
        };
        let full: Vec<usize> = full.into_iter().filter(|i| self.varies(*i)).collect();
        if full.is_empty() { gaps.into_iter().filter(varies_between_gaps).collect() } else { full }
    }

    fn position(
        &self,
        told: &ExplicitRoles,
        untouched: Option<usize>,
    ) -> Result<PositionRole, FirstRigError> {
        let taken: Vec<usize> =
            [told.force, told.time, told.nuisance, untouched].into_iter().flatten().collect();
        let taken = [taken.as_slice(), told.channels.as_slice()].concat();
        let of = |fit: &dyn Fn(&ColumnName) -> bool| {
            let length = |name: &ColumnName| fit(name) && name.measures(Dimension::Length);
            self.places(self.columns(&taken, length))
        };
        let x = of(&|name| name.is(&["x"], &[PLACE]));
        let y = of(&|name| name.is(&["y"], &[PLACE]));
        let in_lengths = |name: &ColumnName| name.unit.is_some() && !self.in_family(name);
        let circumstance = |name: &ColumnName| name.is(CIRCUMSTANCES, &[]) || name.is(COUNTERS, &[]);
        let ranks = [
            of(&|name| name.is(PLACE, &[])),
            [x.as_slice(), y.as_slice()].concat(),
            of(&|name| name.is(DISTANCE, &[PLACE])),
            of(&|name| in_lengths(name) && !circumstance(name)),
        ];
        match ranks.iter().find(|columns| !columns.is_empty()).map(Vec::as_slice) {
            Some([only]) => Ok(PositionRole::Along(*only)),
            Some(_) if ranks[0].is_empty() && x.len() == 1 && y.len() == 1 => {
                Ok(PositionRole::Plane(x[0], y[0]))
            }
            Some(many) => {
                let name = |i: &usize| format!("`{}` (column {})", self.table.columns[*i].heading, i + 1);
                let names: Vec<String> = many.iter().map(name).collect();
                Err(FirstRigError::ManyPositions { candidates: names.join(", ") })
            }
            None => Err(self.no_position(&taken)),
        }
    }

    fn no_position(&self, taken: &[usize]) -> FirstRigError {
        let place = |name: &ColumnName| name.is(PLACE, &[]) || name.is(&["x", "y"], &[PLACE]);
        let Some(named) = self.columns(taken, place).first().copied() else {
            return FirstRigError::NoPosition { columns: described(self.table) };
        };
        let column = self.table.columns[named].heading.clone();
        if let Some(unit) = self.names[named].foreign_unit.clone() {
            return FirstRigError::ForeignUnit { column, unit, wanted: Dimension::Length };
        }
        match (checked(self.table, "the position", named), self.numbers(named)) {
            (Err(error), _) => error,
            (Ok(_), Some([value, ..])) if !self.varies(named) => {
                FirstRigError::OnePosition { column, value: *value }
            }
            _ => FirstRigError::NoPosition { columns: described(self.table) },
        }
    }

    /// Candidates for the force; rows without one must be untouched or have no position.
    fn forces(&self, taken: &[usize], position: PositionRole, untouched: Option<usize>) -> Vec<usize> {
        let places: Vec<_> =
            position.columns().into_iter().map(|i| self.table.columns[i].numbers()).collect();
        let marks = untouched.and_then(|i| self.table.columns[i].marks());
        let is_untouched = |row: usize| {
            let nowhere = places.iter().flatten().all(|numbers| numbers[row].is_none());
            nowhere || marks.as_ref().is_some_and(|marks| marks[row])
        };
        let is_force = |i: &usize| {
            let numbers = self.table.columns[*i].numbers();
            let complete = |force: Vec<Option<f64>>| {
                force.iter().enumerate().all(|(row, force)| force.is_some() || is_untouched(row))
            };
            numbers.is_some_and(complete)
        };
        let named = self.columns(taken, |name| name.is(FORCE, &[]) && name.measures(Dimension::Force));
        let by_unit = || {
            let newtons =
                |name: &ColumnName| name.unit.is_some_and(|unit| unit.dimension() == Dimension::Force);
            self.columns(taken, |name| newtons(name) && !self.in_family(name))
        };
        let columns = if named.is_empty() { by_unit() } else { named };
        columns.into_iter().filter(is_force).collect()
    }

    fn time(&self, taken: &[usize]) -> Option<usize> {
        let stamps = self.columns(taken, |_| true);
        let stamps = stamps.into_iter().find(|i| self.table.columns[*i].content == Content::Times);
        let named = || self.columns(taken, |name| name.is(TIME, &[]) && name.measures(Dimension::Time));
        stamps.or_else(|| named().into_iter().find(|i| self.numbers(*i).is_some()))
    }

    /// Varying columns without another name; only a numbered series, if any.
    fn channels(&self, taken: &[usize]) -> Vec<usize> {
        let mut columns = self.columns(taken, |name| !is_no_channel(name));
        columns.retain(|i| self.varies(*i) && !self.counts(*i));
        if columns.is_empty() {
            let unnamed = (0..self.names.len()).filter(|i| !taken.contains(i) && !self.names[*i].has_heading);
            return unnamed.filter(|i| self.varies(*i) && !self.counts(*i)).collect();
        }
        let families: Vec<usize> =
            columns.iter().copied().filter(|i| self.in_family(&self.names[*i])).collect();
        if families.is_empty() {
            // A column with a unit beside raw channels, such as a length, a force or a time, has another role.
            columns.retain(|i| self.names[*i].unit.is_none() || columns_agree(self.names, *i));
            return columns;
        }
        families
    }

    /// True for at least 10 consecutive whole numbers.
    fn counts(&self, column: usize) -> bool {
        self.numbers(column).is_some_and(|numbers| {
            numbers.len() >= 10
                && numbers[0].fract() == 0.0
                && numbers.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
        })
    }

    /// True if another column differs only in its final number.
    fn in_family(&self, name: &ColumnName) -> bool {
        name.stem.1 && self.names.iter().filter(|other| other.stem == name.stem).count() > 1
    }

    fn reason(&self, column: usize, has_force: bool) -> UnusedReason {
        let name = &self.names[column];
        let foreign = |name: &ColumnName| {
            let symbol = name.unit.map(|unit| unit.symbol().to_owned());
            UnusedReason::Unit(name.foreign_unit.clone().or(symbol).unwrap_or_default())
        };
        match &self.table.columns[column].content {
            Content::Empty => UnusedReason::Empty,
            Content::Marks(_) => UnusedReason::Words,
            Content::Gaps { line, .. } => UnusedReason::Gap { line: *line },
            Content::Other { numbers: 0, .. } => UnusedReason::Words,
            Content::Other { line, text, .. } => UnusedReason::Word { line: *line, text: text.clone() },
            Content::Numbers(numbers) if !name.has_heading && range(numbers).0 == range(numbers).1 => {
                UnusedReason::Constant(numbers[0])
            }
            _ if !name.has_heading && self.counts(column) => UnusedReason::Counter,
            _ if !name.has_heading => UnusedReason::Unnamed,
            Content::Times => UnusedReason::Second,
            Content::Numbers(numbers) if range(numbers).0 == range(numbers).1 => {
                let other = is_no_channel(name);
                if other { UnusedReason::Constant(numbers[0]) } else { UnusedReason::Dead(numbers[0]) }
            }
            Content::Numbers(_) if name.is(FORCE, &[]) && !has_force && !name.measures(Dimension::Force) => {
                foreign(name)
            }
            Content::Numbers(_) if name.is(TIME, &[]) && !name.measures(Dimension::Time) => foreign(name),
            Content::Numbers(_) if name.is(COUNTERS, &[]) || self.counts(column) => UnusedReason::Counter,
            Content::Numbers(_) if name.is(CIRCUMSTANCES, &[]) => UnusedReason::Circumstance,
            Content::Numbers(_) if [PLACE, FORCE, TIME].iter().any(|names| name.is(names, &[])) => {
                UnusedReason::Second
            }
            Content::Numbers(_) => UnusedReason::Single,
        }
    }
}

pub(super) fn name_and_unit(heading: Heading<'_>) -> (&str, Option<Unit>) {
    match suffixed(heading.name).filter(|_| heading.unit.is_none()) {
        Some((name, unit)) => (name, Some(unit)),
        None => (heading.name, heading.known_unit()),
    }
}

/// Parts of palpate's own headings: `position_mm`, `force_n`.
fn suffixed(name: &str) -> Option<(&str, Unit)> {
    let (name, unit) = name.rsplit_once('_').filter(|(name, _)| !name.is_empty())?;
    let unit = Unit::from_symbol(if unit == "n" { "N" } else { unit })?;
    (unit != Unit::NONE).then_some((name, unit))
}

fn is_no_channel(name: &ColumnName) -> bool {
    let others = [COUNTERS, CIRCUMSTANCES, TIME, PLACE, FORCE].iter().any(|names| name.is(names, &[]));
    others || name.is(&["x", "y"], &[PLACE]) || name.is_of_untouched()
}

fn columns_agree(names: &[ColumnName], column: usize) -> bool {
    let same = |other: &&ColumnName| other.unit == names[column].unit;
    names.iter().filter(same).count() > 1
}

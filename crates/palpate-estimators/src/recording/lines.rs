//! Sequential CSV reader.

use super::cells::{Cells, split};
use super::columns::{Column, Columns, Header, PositionColumns};
use super::csv_error::{CsvError, CsvProblem};
use super::dialect::Dialect;
use super::grouping::Groupings;
use super::marks::{Decimal, Separator};
use super::notes::{self, LineKind, Origin};
use super::text::windows_1252;

/// Preambles of loggers have 20 to 60 lines.
const MOST_PREAMBLE: usize = 200;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reading {
    pub header: Header,
    pub separator: Option<Separator>,
    pub decimal: Option<Decimal>,
    /// True if a line with all columns must be the heading.
    pub has_names: bool,
    pub least_width: usize,
    pub origin: Origin,
}

impl Reading {
    pub fn of(columns: &Columns, origin: Origin) -> Self {
        let positions = match &columns.position {
            PositionColumns::Along(x) => vec![x],
            PositionColumns::Plane { x, y } => vec![x, y],
        };
        let channels = columns.channels.iter().map(|channel| &channel.column);
        let has_names = channels.chain(positions).any(|column| matches!(column, Column::Name(_)));
        let (header, separator, decimal) = (columns.header, columns.separator, columns.decimal);
        Self { header, separator, decimal, has_names, least_width: columns.channels.len(), origin }
    }
}

#[derive(Debug)]
pub(super) struct Lines<F> {
    dialect: Dialect,
    groupings: Groupings,
    reading: Reading,
    /// Last line that was not UTF-8.
    decoded: String,
    count: usize,
    search: Search<F>,
    body: Option<Body<F>>,
}

#[derive(Debug)]
struct Search<F> {
    /// Non-blank lines above the heading.
    skipped: usize,
    /// Last line with all columns by number, with its line number.
    candidate: Option<(Head<F>, usize)>,
    /// Error of the line most similar to a heading, with its likeness.
    refused: Option<(usize, CsvError)>,
}

/// Heading, or first row without a heading.
#[derive(Clone, Debug)]
struct Head<F> {
    fields: F,
    dialect: Dialect,
    texts: Vec<String>,
}

#[derive(Clone, Debug)]
struct Body<F> {
    fields: F,
    heading: Vec<String>,
    units: Option<Vec<String>>,
    /// Columns with words in the last row.
    words: Option<Vec<bool>>,
}

impl<F> Lines<F> {
    pub fn new(source: &str, reading: Reading) -> Self {
        Self {
            dialect: Dialect::new(source, reading.decimal),
            groupings: Groupings::new(reading.decimal),
            reading,
            decoded: String::new(),
            count: 0,
            search: Search { skipped: 0, candidate: None, refused: None },
            body: None,
        }
    }

    /// Next row; `None` for preamble, heading, units, blank lines, comments, and notes in files.
    pub fn next<'a>(
        &'a mut self,
        line: &'a [u8],
        find: impl Fn(&mut Cells) -> Result<F, CsvError>,
    ) -> Result<Option<(Cells<'a>, &'a F)>, CsvError> {
        self.count += 1;
        let Self { dialect, groupings, reading, decoded, count, search, body } = self;
        let Some(text) = written(line, *count, dialect, decoded)? else { return Ok(None) };
        let body = match body {
            Some(body) => body,
            none => {
                let Some((found, role)) = search.next(*count, text, reading, dialect, &find)? else {
                    return Ok(None);
                };
                let body = none.insert(found);
                if role == Role::Heading {
                    return Ok(None);
                }
                body
            }
        };
        let mut cells = Cells::parse(*count, text, dialect, groupings)?;
        let is_row = !cells.is_blank() && body.is_row(&mut cells, reading, &find)?;
        Ok(is_row.then_some((cells, &body.fields)))
    }

    /// Error of the line most similar to a heading.
    pub fn unfound(&mut self) -> Option<CsvError> {
        let refused = self.search.refused.take().filter(|_| self.body.is_none());
        refused.map(|(_, error)| error)
    }

    /// Error for a column with ambiguous separators of thousands.
    pub fn into_dialect(self) -> Result<Dialect, CsvError> {
        match self.groupings.doubt(&self.dialect.source) {
            Some(error) => Err(error),
            None => Ok(self.dialect),
        }
    }

    pub fn fields(&self) -> Option<&F> {
        self.body.as_ref().map(|body| &body.fields)
    }

    pub fn units(&self) -> Option<&[String]> {
        self.body.as_ref()?.units.as_deref()
    }
}

/// Progress of a [`LineParser`](super::LineParser).
pub trait LineProgress {
    /// Counts a skipped line.
    fn skip_line(&mut self);

    /// True until a line determines the columns; an error then prevents all reading.
    fn awaits_columns(&self) -> bool;

    /// Current dialect.
    fn dialect(&self) -> &Dialect;

    /// Returns the error of the line most similar to a heading if none was found; for use after the last
    /// line.
    fn unfound(&mut self) -> Option<CsvError>;
}

impl<F> LineProgress for Lines<F> {
    fn skip_line(&mut self) {
        self.count += 1;
    }

    fn awaits_columns(&self) -> bool {
        self.body.is_none()
    }

    fn dialect(&self) -> &Dialect {
        &self.dialect
    }

    fn unfound(&mut self) -> Option<CsvError> {
        Self::unfound(self)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Heading,
    Row,
}

impl<F> Search<F> {
    /// Table that begins with this line or the heading above it.
    fn next(
        &mut self,
        line: usize,
        text: &str,
        reading: &mut Reading,
        dialect: &mut Dialect,
        find: impl Fn(&mut Cells) -> Result<F, CsvError>,
    ) -> Result<Option<(Body<F>, Role)>, CsvError> {
        if let Some(separator) = Separator::from_declaration(text) {
            reading.separator = Some(separator);
            return Ok(None);
        }
        let separators = reading.separator.map_or_else(|| separators(text, reading.header), |one| vec![one]);
        let head = match Head::find(line, text, &separators, dialect, find) {
            Ok(None) => return Ok(None),
            Ok(Some(head)) => Ok(head),
            Err(error) => Err(error),
        };
        if reading.header == Header::Absent {
            return head.map(|head| Some((head.accept(dialect), Role::Row)));
        }
        let is_row = separators.iter().any(|one| is_row_of_values(text, *one, reading.least_width));
        if let Some((candidate, at)) = self.candidate.take_if(|_| is_row) {
            dialect.note_preamble(at, self.skipped - 1);
            return Ok(Some((candidate.accept(dialect), Role::Row)));
        }
        match head {
            Ok(head) if reading.has_names || (!is_row && head.is_heading()) => {
                dialect.note_preamble(line, self.skipped);
                return Ok(Some((head.accept(dialect), Role::Heading)));
            }
            Ok(head) => self.candidate = Some((head, line)),
            Err(error) => {
                let likeness = separators.iter().map(|one| notes::heading_likeness(text, *one)).max();
                let likeness = likeness.unwrap_or_default();
                if self.refused.as_ref().is_none_or(|(most, _)| likeness > *most) {
                    self.refused = Some((likeness, error));
                }
            }
        }
        self.skipped += 1;
        match self.refused.take_if(|_| is_row || self.skipped == MOST_PREAMBLE) {
            Some((_, error)) => Err(error),
            None => Ok(None),
        }
    }
}

impl<F> Head<F> {
    /// Head by the only separator that succeeds; `None` for empty fields.
    fn find(
        line: usize,
        text: &str,
        separators: &[Separator],
        dialect: &Dialect,
        find: impl Fn(&mut Cells) -> Result<F, CsvError>,
    ) -> Result<Option<Self>, CsvError> {
        let mut found: Option<Self> = None;
        let mut refused: Option<(usize, CsvError)> = None;
        for separator in separators {
            let mut dialect = Dialect { separator: *separator, ..dialect.clone() };
            let mut groupings = Groupings::default();
            let mut cells = Cells::parse(line, text, &mut dialect, &mut groupings)?;
            if cells.is_blank() {
                return Ok(None);
            }
            let width = cells.width();
            match (find(&mut cells), &found) {
                (Ok(fields), None) => {
                    let texts = cells.texts().map(str::to_owned).collect();
                    found = Some(Self { fields, texts, dialect });
                }
                (Ok(_), Some(other)) => {
                    let first = other.dialect.separator;
                    let problem = CsvProblem::ManySeparators { first, second: *separator };
                    return Err(cells.line_error(problem));
                }
                (Err(error), _) if refused.as_ref().is_none_or(|(most, _)| width > *most) => {
                    refused = Some((width, error));
                }
                (Err(_), _) => {}
            }
        }
        match (found, refused) {
            (None, Some((_, error))) => Err(error),
            (found, _) => Ok(found),
        }
    }

    fn accept(self, dialect: &mut Dialect) -> Body<F> {
        dialect.separator = self.dialect.separator;
        dialect.units_in_header = self.dialect.units_in_header;
        Body { fields: self.fields, heading: self.texts, units: None, words: None }
    }

    /// Distinct words in most fields.
    fn is_heading(&self) -> bool {
        let texts: Vec<&str> = self.texts.iter().map(String::as_str).collect();
        let words = notes::distinct_words(&texts);
        !texts.iter().any(|text| notes::is_value(text))
            && (words > 1 || texts.len() == 1)
            && 2 * words >= texts.len()
    }
}

impl<F> Body<F> {
    /// Records units and notes in the dialect.
    fn is_row(
        &mut self,
        cells: &mut Cells,
        reading: &Reading,
        find: impl Fn(&mut Cells) -> Result<F, CsvError>,
    ) -> Result<bool, CsvError> {
        // Most rows contain numbers only.
        if cells.texts().all(|text| text.is_empty() || notes::begins_like_a_value(text)) {
            cells.check_width(self.heading.len())?;
            self.words.get_or_insert_default().clear();
            return Ok(true);
        }
        let texts: Vec<&str> = cells.texts().collect();
        let is_below_heading = reading.header == Header::Present && self.words.is_none();
        let kind = match reading.header {
            Header::Absent => LineKind::Row,
            Header::Present => notes::kind_of(&texts, &self.heading, self.words.as_deref(), reading.origin),
        };
        match kind {
            LineKind::Units if is_below_heading && self.units.is_none() => {
                let units: Vec<String> = texts.into_iter().map(str::to_owned).collect();
                self.check_units(cells, &units, find)?;
                self.units = Some(units);
                cells.note_units();
                Ok(false)
            }
            LineKind::Units | LineKind::Note => {
                cells.note_line();
                Ok(false)
            }
            LineKind::Row => {
                cells.check_width(self.heading.len())?;
                let words = cells.texts().map(|text| !text.is_empty() && !notes::is_value(text)).collect();
                self.words = Some(words);
                Ok(true)
            }
        }
    }

    fn check_units(
        &self,
        cells: &Cells,
        units: &[String],
        find: impl Fn(&mut Cells) -> Result<F, CsvError>,
    ) -> Result<(), CsvError> {
        let headings = notes::with_units(&self.heading, units);
        let (mut dialect, mut groupings) = (cells.dialect().clone(), Groupings::default());
        let mut composed = Cells::of_texts(&headings, &mut dialect, &mut groupings);
        match find(&mut composed) {
            Err(CsvError { problem: problem @ CsvProblem::OtherUnit { .. }, place: Some(place), .. }) => {
                Err(cells.error(place.column.unwrap_or(1) - 1, problem))
            }
            _ => Ok(()),
        }
    }
}

fn separators(text: &str, header: Header) -> Vec<Separator> {
    let width = |separator: Separator| split(text, separator).map_or(0, |fields| fields.len());
    let mut separators: Vec<Separator> =
        Separator::MARKS.into_iter().filter(|separator| width(*separator) > 1).collect();
    // Between numbers, a comma beside another separator is a decimal mark.
    if header == Header::Absent {
        let blanks = Some(Separator::Blanks).filter(|blanks| width(*blanks) > 1);
        let is_cut_better = |blanks: &Separator| {
            separators.iter().all(|other| words_among(text, *blanks) < words_among(text, *other))
        };
        if let Some(blanks) = blanks.filter(is_cut_better) {
            return vec![blanks];
        }
        if separators.len() > 1 {
            separators.retain(|separator| *separator != Separator::Comma);
        }
    }
    match separators.is_empty() {
        true if width(Separator::Blanks) > 1 => vec![Separator::Blanks],
        true => vec![Separator::Comma],
        false => separators,
    }
}

pub(super) fn words_among(text: &str, separator: Separator) -> usize {
    let fields = split(text, separator).unwrap_or_default();
    fields.iter().filter(|field| !notes::is_value(&field.value)).count()
}

/// Values or empty fields, at least one a value.
pub(super) fn is_row_of_values(text: &str, separator: Separator, least_width: usize) -> bool {
    let Ok(fields) = split(text, separator) else { return false };
    let mut texts =
        fields.iter().map(|field| field.value.as_ref()).filter(|text| !text.is_empty()).peekable();
    fields.len() >= least_width && texts.peek().is_some() && texts.all(notes::is_value)
}

/// `None` for a blank line or a comment; `decoded` stores text that is not UTF-8.
pub(super) fn written<'a>(
    bytes: &'a [u8],
    line: usize,
    dialect: &mut Dialect,
    decoded: &'a mut String,
) -> Result<Option<&'a str>, CsvError> {
    let text = match std::str::from_utf8(bytes).map_err(|error| (error, windows_1252(bytes))) {
        Ok(text) => text,
        Err((_, Some(text))) => {
            dialect.windows_1252 = true;
            *decoded = text;
            decoded.as_str()
        }
        Err((error, None)) => {
            let (good, bad) = bytes.split_at(error.valid_up_to());
            let shown = |part| String::from_utf8_lossy(part).trim_end().replace(char::is_control, "\u{fffd}");
            let (before, after) = (shown(good), shown(bad));
            let mark = before.len()..before.len() + after.chars().next().map_or(0, char::len_utf8);
            return Err(CsvProblem::NotText.in_line(&dialect.source, line, before + &after, mark));
        }
    };
    let text = text.trim_end_matches(['\r', '\n']);
    // Some spreadsheets begin a file with a byte-order mark.
    let text = if line == 1 { text.strip_prefix('\u{feff}').unwrap_or(text) } else { text };
    // A heading may be `#`, for the row number.
    let is_comment = text.strip_prefix('#').is_some_and(|rest| !rest.starts_with([',', ';', '\t', '|']));
    Ok(Some(text).filter(|text| !text.trim().is_empty() && !is_comment))
}

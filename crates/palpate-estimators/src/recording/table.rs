//! CSV table without roles.

use std::io::Read;

use super::cells::split;
use super::columns::Header;
use super::csv_error::{CsvError, CsvProblem};
use super::csv_in::File;
use super::dialect::Dialect;
use super::lines::{self, LineProgress, Lines, Reading};
use super::marks::{Decimal, Separator};
use super::notes::{self, Origin};
use super::timestamp::Clock;
use super::untouched::is_mark;
use palpate_mechanics::units::Unit;
use std::cmp::Reverse;
use std::ops::Range;

/// CSV table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Absent if the first line has only numbers and times.
    pub header: Header,
    /// Columns.
    pub columns: Vec<TableColumn>,
    /// Number of rows.
    pub rows: usize,
}

/// Column of a [`Table`].
#[derive(Clone, Debug, PartialEq)]
pub struct TableColumn {
    /// Name, or number from 1 without header.
    pub heading: String,
    /// Content.
    pub content: Content,
}

impl TableColumn {
    /// Number of each row, `None` for an empty field; `None` for other content.
    pub fn numbers(&self) -> Option<Vec<Option<f64>>> {
        match &self.content {
            Content::Numbers(numbers) => Some(numbers.iter().copied().map(Some).collect()),
            Content::Gaps { numbers, .. } => Some(numbers.clone()),
            _ => None,
        }
    }

    /// Marks; `None` for other content.
    pub fn marks(&self) -> Option<Vec<bool>> {
        let mark = |number: Option<f64>| match number {
            Some(1.0) => Some(true),
            None | Some(0.0) => Some(false),
            Some(_) => None,
        };
        match &self.content {
            Content::Marks(marks) => Some(marks.clone()),
            _ => self.numbers()?.into_iter().map(mark).collect(),
        }
    }
}

/// Content of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Empty rows only.
    Empty,
    /// Number in every row.
    Numbers(Vec<f64>),
    /// Numbers and empty rows.
    Gaps {
        /// Numbers.
        numbers: Vec<Option<f64>>,
        /// First line without number.
        line: usize,
    },
    /// Timestamps.
    Times,
    /// Yes, no or empty; true for yes.
    Marks(Vec<bool>),
    /// Anything else.
    Other {
        /// Rows with numbers.
        numbers: usize,
        /// First other line.
        line: usize,
        /// Text there.
        text: String,
    },
}

impl Table {
    /// Reads a file; detects separator and decimal mark unless given.
    ///
    /// ```
    /// use palpate_estimators::recording::{Content, Table};
    ///
    /// let table = Table::read("presses.csv", &b"Ort [mm];Notiz\n1,5;links\n2,5;\n"[..], None, None)?;
    /// assert_eq!((table.columns[0].heading.as_str(), table.rows), ("Ort [mm]", 2));
    /// assert_eq!(table.columns[0].content, Content::Numbers(vec![1.5, 2.5]));
    /// # Ok::<(), palpate_estimators::recording::CsvError>(())
    /// ```
    ///
    /// # Errors
    /// [`CsvError`], with line and column.
    pub fn read(
        source: &str,
        bytes: impl Read,
        separator: Option<Separator>,
        decimal: Option<Decimal>,
    ) -> Result<Self, CsvError> {
        let file = File::read(source, bytes)?;
        let Shape { separator, header, line: first_line } = Shape::find(&file, separator)?;
        let reading = Reading {
            header,
            separator: Some(separator),
            decimal,
            has_names: true,
            least_width: 1,
            origin: Origin::File,
        };
        let mut lines = Lines::new(source, reading);
        let mut columns: Vec<Column> = Vec::new();
        let mut rows = 0;
        for (i, bytes) in file.lines().enumerate() {
            let line = i + 1;
            if line < first_line {
                lines.skip_line();
                continue;
            }
            let next = lines.next(bytes, |head| Ok(head.texts().map(str::to_owned).collect::<Vec<_>>()))?;
            let Some((cells, headings)) = next else { continue };
            rows += 1;
            if columns.is_empty() {
                let unread = || Column::new(source, separator, decimal);
                columns = headings.iter().map(|_| unread()).collect();
            }
            for (i, (column, text)) in columns.iter_mut().zip(cells.texts()).enumerate() {
                column.push(line, text).map_err(|problem| cells.error(i, problem))?;
            }
        }
        let Some(headings) = lines.fields() else { return Err(CsvProblem::Empty.in_file(source)) };
        if rows == 0 {
            return Err(CsvProblem::NoRows.in_file(source));
        }
        let headings = match lines.units() {
            Some(units) => notes::with_units(headings, units),
            None => headings.clone(),
        };
        let heading = |(i, heading): (usize, &String)| match header {
            Header::Present => heading.clone(),
            Header::Absent => (i + 1).to_string(),
        };
        let headings = headings.iter().enumerate().map(heading).collect::<Vec<_>>().into_iter();
        let columns =
            headings.zip(columns).map(|(heading, column)| TableColumn { heading, content: column.content() });
        Ok(Self { header, columns: columns.collect(), rows })
    }
}

/// Lines that determine the shape.
const MOST_LINES: usize = 1000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shape {
    separator: Separator,
    header: Header,
    line: usize,
}

impl Shape {
    /// Longest run of lines with equal numbers of fields.
    fn find(file: &File, separator: Option<Separator>) -> Result<Self, CsvError> {
        let mut texts = Texts::default();
        for (i, bytes) in file.lines().enumerate() {
            texts.push(i + 1, bytes, file.source)?;
            if texts.lines.len() == MOST_LINES {
                break;
            }
        }
        let Some((first_line, first)) = texts.lines.first() else {
            return Err(CsvProblem::Empty.in_file(file.source));
        };
        let separator = separator.or(texts.declared);
        let all: &[Separator] = separator.as_ref().map_or(&Separator::ALL, std::slice::from_ref);
        let mut blocks: Vec<Block> =
            all.iter().filter_map(|one| Block::longest(&texts.lines, *one)).collect();
        blocks.sort_by_key(Block::rank);
        let (separator, block) = match blocks.as_slice() {
            [one, other, ..] if one.rank() == other.rank() => {
                let problem = CsvProblem::ManySeparators { first: one.separator, second: other.separator };
                let (line, text) = &texts.lines[one.lines.start];
                return Err(problem.in_line(file.source, *line, text.clone(), 0..text.len()));
            }
            [block, ..] => (block.separator, &texts.lines[block.lines.clone()]),
            [] => {
                // No two lines are alike: choose the separator with the most fields in the first line.
                let fields = |one: &Separator| split(first, *one).map_or(0, |fields| fields.len());
                let separator =
                    separator.or(Separator::MARKS.into_iter().rev().max_by_key(fields)).unwrap_or_default();
                let header = header_of(first, separator);
                return Ok(Self { separator, header, line: *first_line });
            }
        };
        let Some((line, text)) = heading(block, separator) else {
            return Ok(Self { separator, header: Header::Present, line: *first_line });
        };
        Ok(Self { separator, header: header_of(text, separator), line: *line })
    }
}

#[derive(Default)]
struct Texts {
    lines: Vec<(usize, String)>,
    /// Declared by a line `sep=;`.
    declared: Option<Separator>,
}

impl Texts {
    fn push(&mut self, line: usize, bytes: &[u8], source: &str) -> Result<(), CsvError> {
        let (mut dialect, mut decoded) = (Dialect::new(source, None), String::new());
        let Some(text) = lines::written(bytes, line, &mut dialect, &mut decoded)? else { return Ok(()) };
        match Separator::from_declaration(text) {
            Some(separator) if self.lines.is_empty() => self.declared = Some(separator),
            _ if text.chars().all(|c| c.is_whitespace() || matches!(c, '"' | ',' | ';' | '|')) => {}
            _ => self.lines.push((line, text.to_owned())),
        }
        Ok(())
    }
}

/// Lines with equal numbers of fields.
struct Block {
    separator: Separator,
    lines: Range<usize>,
    fields: usize,
    /// Words in the last line.
    words: usize,
}

impl Block {
    fn longest(lines: &[(usize, String)], separator: Separator) -> Option<Self> {
        let width = |(_, text): &(usize, String)| split(text, separator).map_or(0, |fields| fields.len());
        let widths: Vec<usize> = lines.iter().map(width).collect();
        let mut start = 0;
        let blocks = widths.chunk_by(|a, b| a == b).map(|chunk| {
            start += chunk.len();
            (start - chunk.len()..start, chunk[0])
        });
        let least = lines.len().min(2);
        let cut = blocks.filter(|(lines, fields)| *fields > 1 && lines.len() >= least);
        let (range, fields) = cut.min_by_key(|(lines, _)| Reverse(lines.len()))?;
        let words = lines::words_among(&lines[range.end - 1].1, separator);
        Some(Self { separator, lines: range, fields, words })
    }

    /// Most lines, fewest words, no blanks, most fields.
    fn rank(&self) -> (Reverse<usize>, usize, bool, Reverse<usize>) {
        let is_blanks = self.separator == Separator::Blanks;
        (Reverse(self.lines.len()), self.words, is_blanks, Reverse(self.fields))
    }
}

/// Last line with most distinct words above the first row of values.
fn heading(block: &[(usize, String)], separator: Separator) -> Option<&(usize, String)> {
    let is_row = |(_, text): &(usize, String)| lines::is_row_of_values(text, separator, 1);
    let above = block.iter().position(is_row).unwrap_or(1).max(1);
    let likeness = |(_, text): &&(usize, String)| notes::heading_likeness(text, separator);
    block[..above.min(block.len())].iter().max_by_key(likeness)
}

fn header_of(text: &str, separator: Separator) -> Header {
    if lines::is_row_of_values(text, separator, 1) { Header::Absent } else { Header::Present }
}

/// Column with its own dialect, because unused columns may have any notation.
struct Column {
    dialect: Dialect,
    clock: Clock,
    filled: usize,
    numbers: Vec<Option<f64>>,
    times: usize,
    marks: Option<Vec<bool>>,
    gap: Option<usize>,
    other: Option<(usize, String)>,
}

impl Column {
    fn new(source: &str, separator: Separator, decimal: Option<Decimal>) -> Self {
        let dialect = Dialect { separator, ..Dialect::new(source, decimal) };
        Self {
            dialect,
            clock: Clock::default(),
            filled: 0,
            numbers: Vec::new(),
            times: 0,
            marks: Some(Vec::new()),
            gap: None,
            other: None,
        }
    }

    /// An ambiguous number is an error, because it may be wrong by a factor of 1000.
    fn push(&mut self, line: usize, text: &str) -> Result<(), CsvProblem> {
        self.marks = self.marks.take().zip(is_mark(text)).map(|(mut marks, mark)| {
            marks.push(mark);
            marks
        });
        if text.is_empty() {
            self.gap.get_or_insert(line);
            self.numbers.push(None);
            return Ok(());
        }
        self.filled += 1;
        let read = if text.contains(':') {
            self.clock.read(text, || Err(CsvProblem::EmptyField)).map(|_| self.times += 1)
        } else {
            self.dialect.number(text, Unit::NONE).map(|number| self.numbers.push(Some(number)))
        };
        let both = self.times > 0 && self.numbers.iter().any(Option::is_some);
        if self.other.is_none() && (read.is_err() || both) {
            self.other = Some((line, text.to_owned()));
        }
        match read {
            Err(doubt @ CsvProblem::DoubtfulNumber { .. }) => Err(doubt),
            _ => Ok(()),
        }
    }

    fn content(self) -> Content {
        let Self { filled, numbers, times, marks, gap, other, .. } = self;
        match (other, gap) {
            _ if filled == 0 => Content::Empty,
            (Some((line, text)), _) => match marks {
                Some(marks) => Content::Marks(marks),
                None => Content::Other { numbers: numbers.iter().flatten().count(), line, text },
            },
            (None, Some(line)) if times > 0 => Content::Other { numbers: 0, line, text: String::new() },
            (None, None) if times > 0 => Content::Times,
            (None, Some(line)) => Content::Gaps { numbers, line },
            (None, None) => Content::Numbers(numbers.into_iter().flatten().collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        Table::read("t.csv", text.as_bytes(), None, None).unwrap()
    }

    #[test]
    fn columns_are_recognized_by_their_content() {
        let text = "\u{feff}sep=;\nOrt [mm];Zeit;Notiz;leer;S1;S2;Kraft;frei\n;;;;;;;\n\
                    1,5;10:00:00;links, oben;;-3;4;;ja\n2;10:00:01;;;1e3;n/a;2,5;\n;;;;;;;\n";
        let table = table(text);
        let headings: Vec<&str> = table.columns.iter().map(|column| column.heading.as_str()).collect();
        assert_eq!(headings, ["Ort [mm]", "Zeit", "Notiz", "leer", "S1", "S2", "Kraft", "frei"]);
        assert_eq!((table.header, table.rows), (Header::Present, 2));
        let other = |numbers, line, text: &str| Content::Other { numbers, line, text: text.to_owned() };
        let contents = [
            Content::Numbers(vec![1.5, 2.0]),
            Content::Times,
            other(0, 4, "links, oben"),
            Content::Empty,
            Content::Numbers(vec![-3.0, 1000.0]),
            other(1, 5, "n/a"),
            Content::Gaps { numbers: vec![None, Some(2.5)], line: 4 },
            Content::Marks(vec![true, false]),
        ];
        assert_eq!(table.columns.into_iter().map(|column| column.content).collect::<Vec<_>>(), contents);
    }

    #[test]
    fn the_separator_is_that_which_gives_the_most_numbers() {
        let widths = |text| {
            let table = table(text);
            (table.header, table.columns.len())
        };
        assert_eq!(widths("Position, mm;Kraft, N\n1,5;2,5\n"), (Header::Present, 2));
        assert_eq!(widths("a,b;c\n1,2\n"), (Header::Present, 2));
        assert_eq!(widths("1,5;2,5;3\n"), (Header::Absent, 3));
        assert_eq!(widths("1,5\t2,5\n"), (Header::Absent, 2));
        assert_eq!(widths("1.5,2.5,10:00:00\n"), (Header::Absent, 3));
        assert_eq!(widths("a\n1\n"), (Header::Present, 1));
        let doubtful = "t.csv:2:2: `1,234` may be 1234 or 1.234";
        let refused = |text: &str| Table::read("t.csv", text.as_bytes(), None, None).unwrap_err().to_string();
        assert_eq!(
            refused("a,b;c\nx,y;z\n").split(';').next(),
            Some("t.csv:1: fields may be separated by commas or by semicolons")
        );
        assert_eq!(refused("a;b\n1;2;3\n"), "t.csv:2: the row has 3 fields; it must have 2");
        assert_eq!(refused("a;b\n;\n"), "t.csv: a recording has at least 1 row below the header, found 0");
        assert!(refused("a,b\n1,\"1,234\"\n").starts_with(doubtful));
        assert_eq!(refused("\n#\n"), "t.csv: the file is empty; a recording has at least 1 row");
    }
}

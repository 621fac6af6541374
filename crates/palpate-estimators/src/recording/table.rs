//! A CSV file of which no column has a role yet.

use std::io::Read;

use super::cells::split;
use super::columns::Header;
use super::csv_error::{CsvError, CsvProblem};
use super::csv_in::{File, Lines};
use super::dialect::Dialect;
use super::marks::{Decimal, Separator};
use super::timestamp::Clock;
use super::untouched::is_mark;
use palpate_mechanics::units::Unit;

/// The columns of a CSV file, and what is in them.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Whether the first line names the columns: it does unless every field of it is a number or a time.
    pub header: Header,
    /// The columns, from left to right.
    pub columns: Vec<TableColumn>,
    /// Number of rows.
    pub rows: usize,
}

/// One column of a [`Table`].
#[derive(Clone, Debug, PartialEq)]
pub struct TableColumn {
    /// Name in the header; its number, from 1, where there is no header.
    pub heading: String,
    /// Text of its rows.
    pub content: Content,
}

impl TableColumn {
    /// The number of each row, where no row has anything else; `None` where a row has something else, or none has a number.
    pub fn numbers(&self) -> Option<Vec<Option<f64>>> {
        match &self.content {
            Content::Numbers(numbers) => Some(numbers.iter().copied().map(Some).collect()),
            Content::Gaps { numbers, .. } => Some(numbers.clone()),
            _ => None,
        }
    }

    /// Marks of the rows, true by 1, a yes or the like; `None` where a row has neither that nor a no, 0 or nothing.
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
    /// Nothing in any row.
    Empty,
    /// A finite number in every row, as written.
    Numbers(Vec<f64>),
    /// A finite number in some rows, and nothing in the others.
    Gaps {
        /// The number of each row.
        numbers: Vec<Option<f64>>,
        /// The line of the first row without one.
        line: usize,
    },
    /// A timestamp in every row.
    Times,
    /// A yes, a no or nothing in every row, as marks of untouched rows are: whether it is a yes.
    Marks(Vec<bool>),
    /// Anything else.
    Other {
        /// Rows that have a number.
        numbers: usize,
        /// The line of the first field that is neither number nor timestamp, or of another kind than the first.
        line: usize,
        /// That field.
        text: String,
    },
}

impl Table {
    /// Reads a file of any dialect; the separator and the decimal mark are those that are said, or those that the file tells.
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
    /// [`CsvError`], with line and column: a row of another length than the first line, an empty file, no rows, bytes that are no text,
    /// separators that cannot be told apart, a number that may have a decimal comma or thousands.
    pub fn read(
        source: &str,
        bytes: impl Read,
        separator: Option<Separator>,
        decimal: Option<Decimal>,
    ) -> Result<Self, CsvError> {
        let file = File::read(source, bytes)?;
        let (separator, header) = shape(&file, separator)?;
        let mut lines = Lines::new(source, Some(separator), decimal);
        let mut columns: Vec<Column> = Vec::new();
        let mut rows = 0;
        let mut line = 0;
        for bytes in file.lines() {
            line += 1;
            let next =
                lines.next(bytes, header, |head| Ok(head.texts().map(str::to_owned).collect::<Vec<_>>()))?;
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
        let heading = |(i, heading): (usize, &String)| match header {
            Header::Present => heading.clone(),
            Header::Absent => (i + 1).to_string(),
        };
        let headings = headings.iter().enumerate().map(heading);
        let columns =
            headings.zip(columns).map(|(heading, column)| TableColumn { heading, content: column.content() });
        Ok(Self { header, columns: columns.collect(), rows })
    }
}

/// The separator of a file, and whether it has a header, from its first two lines.
fn shape(file: &File, told: Option<Separator>) -> Result<(Separator, Header), CsvError> {
    let mut lines = Lines::<()>::new(file.source, told, None);
    let mut texts = Vec::new();
    for bytes in file.lines() {
        let text = lines.text(bytes)?.map(str::to_owned);
        texts.extend(text.map(|text| (lines.count(), text)));
        if texts.len() == 2 {
            break;
        }
    }
    let Some((line, first)) = texts.first() else { return Err(CsvProblem::Empty.in_file(file.source)) };
    let second = texts.get(1).map_or(first, |(_, second)| second);
    let separator = match lines.separator() {
        Some(separator) => separator,
        None => best_separator(first, second)
            .map_err(|problem| problem.in_line(file.source, *line, first.clone(), 0..first.len()))?,
    };
    let fields = split(first, separator).unwrap_or_default();
    let mut values =
        fields.iter().map(|field| field.value.as_ref()).filter(|text| !text.is_empty()).peekable();
    let is_row = values.peek().is_some() && values.all(is_value);
    Ok((separator, if is_row { Header::Absent } else { Header::Present }))
}

/// The separator that cuts two lines into equally many fields, and leaves the fewest in the second that are no numbers.
fn best_separator(first: &str, second: &str) -> Result<Separator, CsvProblem> {
    let cut = |separator: Separator| {
        let (head, row) = (split(first, separator).ok()?, split(second, separator).ok()?);
        let words = row.iter().filter(|field| !is_value(&field.value)).count();
        let fields = row.len();
        (fields > 1 && head.len() == fields).then_some(((words, std::cmp::Reverse(fields)), separator))
    };
    let mut cuts: Vec<_> = Separator::ALL.into_iter().filter_map(cut).collect();
    cuts.sort_by_key(|(order, _)| *order);
    match cuts.as_slice() {
        [(order, first), (other, second), ..] if order == other => {
            Err(CsvProblem::ManySeparators { first: *first, second: *second })
        }
        [(_, separator), ..] => Ok(*separator),
        [] => {
            // No two lines alike: whatever cuts the first into the most fields lets the second be refused for its length.
            let fields = |separator: &Separator| split(first, *separator).map_or(0, |fields| fields.len());
            Ok(Separator::ALL.into_iter().rev().max_by_key(fields).unwrap_or_default())
        }
    }
}

/// Whether a text is a number with either decimal mark, or looks like a timestamp.
fn is_value(text: &str) -> bool {
    let number = Unit::NONE.parse_si(&text.replacen(',', ".", 1)).is_some();
    number || (text.contains(':') && text.starts_with(|c: char| c.is_ascii_digit()))
}

/// A column that is being read: by a dialect of its own, since a column without a role may be written in any way.
struct Column {
    dialect: Dialect,
    clock: Clock,
    filled: usize,
    numbers: Vec<Option<f64>>,
    times: usize,
    /// Marks of the rows; nothing from the first that is neither marked nor not.
    marks: Option<Vec<bool>>,
    /// The line of the first row without anything.
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

    /// Takes the next field; a doubt that would make its numbers a thousand times as large is the caller's to settle.
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
    fn columns_are_told_by_what_is_in_them() {
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
        assert_eq!(
            refused("a;b\n;\n"),
            "t.csv: there are 0 rows below the header; a recording has at least 1"
        );
        assert!(refused("a,b\n1,\"1,234\"\n").starts_with(doubtful));
        assert_eq!(refused("\n#\n"), "t.csv: the file is empty; a recording has at least 1 row");
    }
}

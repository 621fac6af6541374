//! Failure of a command: a message with its place, and an exit code.

use crate::progress;
use crate::remark::{alert, remark};
use miette::{
    Diagnostic, LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents,
};
use palpate_numerics::watch::Cancelled;
use std::fmt;
use std::io::IsTerminal;
use std::ops::Range;
use std::path::Path;
use std::process::ExitCode;

/// Outcome of a command other than success.
#[derive(Debug)]
pub enum Failure {
    /// Exit code 1: the command ran, but missed a stated goal.
    GoalMissed(String),
    /// Exit code 2: bad input; no file was written.
    BadInput(Box<UserError>),
    /// Exit code 3: the command finished, but data was lost and reported.
    DataLost(String),
    /// Exit code 128 and the signal: 130 after Ctrl-C, 143 after SIGTERM.
    Interrupted(String),
    /// The reader of the output has closed it, which is allowed.
    NobodyReads,
}

impl Failure {
    pub fn stopped() -> Self {
        Self::Interrupted("stopped; no output was written".to_owned())
    }

    pub fn from_error(error: &(dyn std::error::Error + 'static)) -> Self {
        if Cancelled::caused(error) { Self::stopped() } else { UserError::new(error).into() }
    }

    /// Failure of long work: it was stopped, or its input is bad, with details in `user_error`.
    pub fn of_work<E>(error: E, user_error: impl FnOnce(E) -> UserError) -> Self
    where
        E: std::error::Error + 'static,
    {
        if Cancelled::caused(&error) { Self::stopped() } else { user_error(error).into() }
    }

    pub fn report(self) -> ExitCode {
        let (message, code) = match self {
            Self::BadInput(user_error) => {
                alert!("{:?}", miette::Report::new(*user_error));
                return ExitCode::from(2);
            }
            Self::NobodyReads => return ExitCode::SUCCESS,
            Self::GoalMissed(message) => (message, 1),
            Self::DataLost(message) => (message, 3),
            Self::Interrupted(message) => (message, progress::interrupted_code()),
        };
        alert!("palpate: {message}");
        ExitCode::from(code)
    }
}

#[derive(Debug)]
pub struct UserError {
    message: String,
    help: Option<String>,
    excerpt: Option<Excerpt>,
}

#[derive(Debug)]
struct Excerpt {
    file: String,
    /// Number of the line, from 0.
    line: usize,
    text: String,
    span: Range<usize>,
}

impl UserError {
    pub fn new(message: impl fmt::Display) -> Self {
        Self { message: message.to_string(), help: None, excerpt: None }
    }

    pub fn for_path(path: &Path, problem: impl fmt::Display) -> Self {
        Self::new(format!("{}: {problem}", path.display()))
    }

    pub fn help(mut self, help: impl fmt::Display) -> Self {
        self.help = Some(help.to_string());
        self
    }

    /// Adds the place: bytes `span` of a whole text.
    pub fn at_span(self, file: &str, text: &str, span: Range<usize>) -> Self {
        let start = floor_char(text, span.start);
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |at| start + at);
        let line = text[..line_start].matches('\n').count();
        let end = floor_char(text, span.end.max(start)).min(line_end);
        let span = start - line_start..end.max(start) - line_start;
        self.at_line(file, line + 1, &text[line_start..line_end], span)
    }

    /// Adds the place: bytes `span` of line `line` (from 1) with the content `text`.
    pub fn at_line(mut self, file: &str, line: usize, text: &str, span: Range<usize>) -> Self {
        // A very long line, as in networks.csv, would make the message unreadable.
        const MOST: usize = 400;
        let begin = floor_char(text, span.start.saturating_sub(MOST / 2));
        let text = &text[begin..floor_char(text, begin + MOST)];
        let within = |at: usize| floor_char(text, at.saturating_sub(begin));
        let span = within(span.start)..within(span.end);
        self.excerpt =
            Some(Excerpt { file: file.to_owned(), line: line.max(1) - 1, text: text.to_owned(), span });
        self
    }
}

impl From<UserError> for Failure {
    fn from(user_error: UserError) -> Self {
        Self::BadInput(Box::new(user_error))
    }
}

/// Returns the nearest character boundary at or before `at`.
fn floor_char(text: &str, at: usize) -> usize {
    text.floor_char_boundary(at.min(text.len()))
}

impl fmt::Display for UserError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for UserError {}

impl Diagnostic for UserError {
    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.excerpt.as_ref().map(|excerpt| excerpt as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.excerpt.as_ref()?.span.clone();
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(Some("here".to_owned()), span))))
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        _lines_before: usize,
        _lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        // The heading contains line and column of the span; the line is drawn from its first
        // character.
        let column = self.text[..span.offset().min(self.text.len())].chars().count();
        let whole = SourceSpan::from(0..self.text.len());
        let (file, line) = (self.file.clone(), self.line);
        let data = self.text.as_bytes();
        let column = if span.is_empty() || *span == SourceSpan::from(self.span.clone()) { column } else { 0 };
        Ok(Box::new(MietteSpanContents::new_named(file, data, whole, line, column, 1)))
    }
}

/// Draws complaints in colour on a terminal, in plain characters elsewhere.
pub fn install_handler() {
    let no_colour = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    let colour = std::io::stderr().is_terminal() && !no_colour;
    let installed = miette::set_hook(Box::new(move |_| {
        Box::new(miette::MietteHandlerOpts::new().color(colour).terminal_links(false).width(100).build())
    }));
    if installed.is_err() {
        remark!("palpate: messages will look plainer than usual");
    }
}

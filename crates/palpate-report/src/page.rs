//! The frame of a self-contained HTML page: what it holds is inside it, and a browser asks nobody for anything.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{PngError, ReportError, ReportFile, svg_to_png};

/// Pixels of a PNG for one of its SVG.
const PNG_SCALE: f32 = 2.0;

const STYLE: &str = include_str!("page.css");

/// A page: title, opening, sections and footer.
pub(crate) struct Page {
    pub title: String,
    /// What stands between the title and the list of sections.
    pub opening: Markup,
    pub sections: Vec<Section>,
    pub footer: Markup,
}

/// A headed part of a page, which links can lead to.
pub(crate) struct Section {
    pub id: &'static str,
    pub heading: &'static str,
    pub body: Markup,
}

/// A numbered figure.
pub(crate) struct Figure {
    pub number: usize,
    /// What it shows, in a few words, for readers who cannot see it.
    pub alternative: String,
    pub svg: String,
    pub caption: Markup,
}

/// The figures of a page, by number.
pub(crate) struct Figures(pub Vec<Figure>);

/// A numbered table.
pub(crate) struct Table {
    pub number: usize,
    pub caption: Markup,
    pub columns: Vec<Column>,
    /// Cells by row, as many as there are columns. The first cell of a row is its heading.
    pub rows: Vec<Vec<Markup>>,
}

/// A column's heading and the CSS class of its cells.
pub(crate) struct Column {
    pub heading: String,
    pub class: &'static str,
}

/// A column of words.
pub(crate) fn words(heading: impl Into<String>) -> Column {
    Column { heading: heading.into(), class: "text" }
}

/// A column of words that are not broken over lines.
pub(crate) fn short(heading: impl Into<String>) -> Column {
    Column { heading: heading.into(), class: "short" }
}

/// A column of sentences, which needs room.
pub(crate) fn wide(heading: impl Into<String>) -> Column {
    Column { heading: heading.into(), class: "wide" }
}

/// A column of numbers.
pub(crate) fn numeric(heading: impl Into<String>) -> Column {
    Column { heading: heading.into(), class: "number" }
}

/// A text as markup.
pub(crate) fn text(text: impl AsRef<str>) -> Markup {
    html! { (text.as_ref()) }
}

/// A good or bad verdict in words.
pub(crate) fn verdict(good: bool, yes: &str, no: &str) -> Markup {
    if good {
        html! { span.yes { "✓ " (yes) } }
    } else {
        html! { span.no { "✗ " (no) } }
    }
}

impl Page {
    /// The page and its figures as files.
    pub fn into_files(self, figures: Figures) -> Result<Vec<ReportFile>, ReportError> {
        let mut files = vec![ReportFile { name: "report.html".to_owned(), bytes: self.html().into_bytes() }];
        for figure in figures.0 {
            files.extend(
                figure.files().map_err(|error| ReportError::Picture { number: figure.number, error })?,
            );
        }
        Ok(files)
    }

    fn html(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    link rel="icon" href="data:,";
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    header { h1 { (self.title) } (self.opening) }
                    nav aria-label="Contents" {
                        ul { @for section in &self.sections { li { a href={ "#" (section.id) } { (section.heading) } } } }
                    }
                    main {
                        @for section in &self.sections {
                            section id=(section.id) { h2 { (section.heading) } (section.body) }
                        }
                    }
                    footer { (self.footer) }
                }
            }
        };
        page.into_string()
    }
}

impl Figure {
    /// The drawing stands in the page as it is: it holds no ids that could meet those of another.
    fn markup(&self) -> Markup {
        let root = html! { svg role="img" aria-label=(self.alternative) {} }.into_string();
        let root = root.trim_end_matches("></svg>");
        let svg = self.svg.replacen("<svg", root, 1);
        html! {
            figure id={ "figure-" (self.number) } {
                (PreEscaped(svg))
                figcaption { b { "Figure " (self.number) ". " } (self.caption) }
            }
        }
    }

    fn files(&self) -> Result<[ReportFile; 2], PngError> {
        let file = |kind: &str, bytes| ReportFile { name: format!("figure-{}.{kind}", self.number), bytes };
        let png = svg_to_png(&self.svg, PNG_SCALE)?;
        Ok([file("svg", self.svg.clone().into_bytes()), file("png", png)])
    }
}

impl Figures {
    /// The figure of that number; nothing where there is none.
    pub fn show(&self, number: usize) -> Markup {
        html! { @for figure in self.0.iter().filter(|figure| figure.number == number) { (figure.markup()) } }
    }
}

impl Table {
    pub fn markup(&self) -> Markup {
        html! {
            div.table id={ "table-" (self.number) } role="region" tabindex="0" aria-label={ "Table " (self.number) } {
                table {
                    caption { b { "Table " (self.number) ". " } (self.caption) }
                    thead { tr { @for column in &self.columns { th.(column.class) scope="col" { (column.heading) } } } }
                    tbody { @for row in &self.rows { (self.row(row)) } }
                }
            }
        }
    }

    fn row(&self, cells: &[Markup]) -> Markup {
        html! {
            tr {
                @for (i, (cell, column)) in cells.iter().zip(&self.columns).enumerate() {
                    @if i == 0 { th.(column.class) scope="row" { (cell) } } @else { td.(column.class) { (cell) } }
                }
            }
        }
    }
}

//! Self-contained HTML pages, which load no other file.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::beam_drawing::BeamDrawing;
use super::drawing::svg::{Colour, IN_THE_DARK};
use super::numbers::number;
use super::{Chart, HeatMap, chart_to_svg, heat_map_to_svg};

const STYLE: &str = include_str!("page.css");

/// File of a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportFile {
    /// Name in the report's folder: "report.html", "figure-2.svg".
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
}

pub(crate) struct Page {
    title: String,
    lead: Markup,
    summary: Markup,
    sections: Vec<Section>,
    source: Markup,
}

pub(crate) struct Section {
    id: &'static str,
    heading: &'static str,
    blocks: Vec<Block>,
}

enum Block {
    Text(Markup),
    Figure(Figure),
    Table(Table),
}

impl Section {
    pub fn new(id: &'static str, heading: &'static str) -> Self {
        Self { id, heading, blocks: Vec::new() }
    }

    pub fn text(self, text: Markup) -> Self {
        self.block(Block::Text(text))
    }

    pub fn figure(self, figure: impl Into<Option<Figure>>) -> Self {
        match figure.into() {
            Some(figure) => self.block(Block::Figure(figure)),
            None => self,
        }
    }

    pub fn figures(self, figures: impl IntoIterator<Item = Figure>) -> Self {
        figures.into_iter().fold(self, Self::figure)
    }

    pub fn table(self, table: Table) -> Self {
        if table.rows.is_empty() { self } else { self.block(Block::Table(table)) }
    }

    fn block(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }
}

pub(crate) struct Figure {
    /// For readers who cannot see the figure.
    alternative: String,
    svg: String,
    /// For a phone, 360 pixels wide.
    narrow_svg: String,
    caption: Markup,
}

const NARROW_PX: u32 = 360;
const NARROW_HEIGHT_PX: u32 = 420;

impl Figure {
    fn new(alternative: impl Into<String>, [svg, narrow_svg]: [String; 2], caption: Markup) -> Self {
        Self { alternative: alternative.into(), svg, narrow_svg, caption }
    }

    pub fn chart(chart: &Chart, caption: Markup) -> Self {
        let height_px = chart.height_px.min(NARROW_HEIGHT_PX);
        let narrow = Chart { width_px: NARROW_PX, height_px, ..chart.clone() };
        Self::new(&chart.title, [chart, &narrow].map(chart_to_svg), caption)
    }

    pub fn map(map: &HeatMap, caption: Markup) -> Self {
        let narrow = HeatMap { width_px: NARROW_PX, ..map.clone() };
        Self::new(&map.title, [map, &narrow].map(heat_map_to_svg), caption)
    }

    pub fn beam(alternative: impl Into<String>, drawing: &BeamDrawing, caption: Markup) -> Self {
        let narrow = BeamDrawing { width_px: NARROW_PX, ..drawing.clone() };
        Self::new(alternative, [drawing, &narrow].map(BeamDrawing::svg), caption)
    }

    /// The drawings contain no ids, which could collide.
    fn markup(&self, number: usize) -> Markup {
        let [wide, narrow] =
            [("wide-drawing", &self.svg), ("narrow", &self.narrow_svg)].map(|(class, svg)| {
                let root =
                    html! { svg class=(class) role="img" aria-label=(self.alternative) {} }.into_string();
                PreEscaped(svg.replacen("<svg", root.trim_end_matches("></svg>"), 1))
            });
        html! {
            figure id={ "figure-" (number) } {
                (wide) (narrow)
                figcaption { b { "Figure " (number) ". " } (self.caption) }
            }
        }
    }
}

pub(crate) struct Table {
    caption: Markup,
    columns: Vec<Column>,
    /// The first cell is the heading.
    rows: Vec<Vec<Markup>>,
}

impl Table {
    /// The first column heads the rows.
    pub fn from_rows<R>(rows: impl IntoIterator<Item = R>) -> Columns<R> {
        let rows: Vec<R> = rows.into_iter().collect();
        Columns { cells: rows.iter().map(|_| Vec::new()).collect(), columns: Vec::new(), rows }
    }

    fn markup(&self, number: usize) -> Markup {
        html! {
            figure.of-table id={ "table-" (number) } {
                figcaption id={ "caption-" (number) } { b { "Table " (number) ". " } (self.caption) }
                div.table role="region" tabindex="0" aria-label={ "Table " (number) } { table aria-describedby={ "caption-" (number) } {
                    thead { tr { @for column in &self.columns { th.(column.class) scope="col" { (column.heading) } } } }
                    tbody { @for row in &self.rows { (self.row(row)) } }
                } }
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

pub(crate) struct Column {
    heading: String,
    class: &'static str,
}

/// Table built by columns.
pub(crate) struct Columns<R> {
    rows: Vec<R>,
    columns: Vec<Column>,
    cells: Vec<Vec<Markup>>,
}

impl<R> Columns<R> {
    pub fn words<T: AsRef<str>>(self, heading: impl Into<String>, cell: impl Fn(&R) -> T) -> Self {
        self.column("text", heading, |row| text(cell(row)))
    }

    /// Without line breaks.
    pub fn short<T: AsRef<str>>(self, heading: impl Into<String>, cell: impl Fn(&R) -> T) -> Self {
        self.column("short", heading, |row| text(cell(row)))
    }

    pub fn wide<T: AsRef<str>>(self, heading: impl Into<String>, cell: impl Fn(&R) -> T) -> Self {
        self.column("wide", heading, |row| text(cell(row)))
    }

    pub fn numeric<T: AsRef<str>>(self, heading: impl Into<String>, cell: impl Fn(&R) -> T) -> Self {
        self.column("number", heading, |row| text(cell(row)))
    }

    /// About three digits; a dash for a missing number.
    pub fn number<T: Into<Option<f64>>>(self, heading: impl Into<String>, cell: impl Fn(&R) -> T) -> Self {
        self.column("number", heading, |row| text(number(cell(row).into().unwrap_or(f64::NAN))))
    }

    /// Metres in millimetres; a dash if missing.
    pub fn mm<T: Into<Option<f64>>>(self, heading: impl Into<String>, cell: impl Fn(&R) -> T) -> Self {
        self.number(heading, |row| cell(row).into().map(|length_m| length_m * 1e3))
    }

    pub fn column(
        mut self,
        class: &'static str,
        heading: impl Into<String>,
        cell: impl Fn(&R) -> Markup,
    ) -> Self {
        self.columns.push(Column { heading: heading.into(), class });
        self.cells.iter_mut().zip(&self.rows).for_each(|(cells, row)| cells.push(cell(row)));
        self
    }

    pub fn caption(self, caption: Markup) -> Table {
        Table { caption, columns: self.columns, rows: self.cells }
    }
}

pub(crate) fn text(text: impl AsRef<str>) -> Markup {
    html! { (text.as_ref()) }
}

pub(crate) fn verdict(good: bool, yes: &str, no: &str) -> Markup {
    if good {
        html! { span.yes { "✓ " (yes) } }
    } else {
        html! { span.no { "✗ " (no) } }
    }
}

fn dark_drawings() -> String {
    let rule = |(light, dark): &(Colour, Colour)| {
        format!(
            "figure svg [fill=\"{light}\"] {{ fill: {dark}; }} figure svg [stroke=\"{light}\"] {{ stroke: {dark}; }}\n"
        )
    };
    let rules: String = IN_THE_DARK.iter().map(rule).collect();
    format!("@media screen and (prefers-color-scheme: dark) {{\n{rules}}}\n")
}

impl Page {
    pub fn new(title: impl Into<String>, summary: Markup, sections: Vec<Section>) -> Self {
        Self { title: title.into(), lead: Markup::default(), summary, sections, source: Markup::default() }
    }

    pub fn with_lead(self, lead: Markup) -> Self {
        Self { lead, ..self }
    }

    pub fn with_source(self, source: Markup) -> Self {
        Self { source, ..self }
    }

    pub fn files(self) -> Vec<ReportFile> {
        let (mut figures, mut tables) = (0, 0);
        let mut drawings = Vec::new();
        let mut bodies = Vec::new();
        for section in &self.sections {
            let mut body = Vec::new();
            for block in &section.blocks {
                match block {
                    Block::Text(text) => body.push(text.clone()),
                    Block::Figure(figure) => {
                        figures += 1;
                        body.push(figure.markup(figures));
                        let bytes = figure.svg.clone().into_bytes();
                        drawings.push(ReportFile { name: format!("figure-{figures}.svg"), bytes });
                    }
                    Block::Table(table) => {
                        tables += 1;
                        body.push(table.markup(tables));
                    }
                }
            }
            bodies.push(html! {
                section id=(section.id) { h2 { (section.heading) } @for block in &body { (block) } }
            });
        }
        let page = ReportFile { name: "report.html".to_owned(), bytes: self.html(&bodies).into_bytes() };
        std::iter::once(page).chain(drawings).collect()
    }

    fn html(&self, bodies: &[Markup]) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    link rel="icon" href="data:,";
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) (PreEscaped(dark_drawings())) }
                }
                body {
                    header { h1 { (self.title) } (self.lead) @if !self.summary.0.is_empty() { div.summary { ul { (self.summary) } } } }
                    nav aria-label="Contents" {
                        ul { @for section in &self.sections { li { a href={ "#" (section.id) } { (section.heading) } } } }
                    }
                    main { @for body in bodies { (body) } }
                    footer { p { "Made by palpate " (env!("CARGO_PKG_VERSION")) (self.source) "." } }
                }
            }
        };
        page.into_string()
    }
}

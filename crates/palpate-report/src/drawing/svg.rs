use super::geometry::{Point, Rect};
use std::fmt::{self, Write};

/// From the middle of the capitals to the baseline, in units of the font size.
const CAPITALS_HALF_HEIGHT: f64 = 0.36;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Colour {
    pub rgb: [u8; 3],
    pub opacity: f64,
}

pub(crate) const INK: Colour = Colour::opaque(34, 34, 34);
pub(crate) const QUIET_INK: Colour = Colour::opaque(90, 90, 90);
pub(crate) const REFERENCE: Colour = Colour::opaque(110, 110, 110);
pub(crate) const GRID: Colour = Colour::opaque(228, 228, 228);
pub(crate) const MINOR_GRID: Colour = Colour::opaque(243, 243, 243);
pub(crate) const WHITE: Colour = Colour::opaque(255, 255, 255);
pub(crate) const BLACK: Colour = Colour::opaque(0, 0, 0);

/// Okabe and Ito's colours, without the yellow, which is hard to see on white.
const PALETTE: [Colour; 7] = [
    Colour::opaque(0, 114, 178),
    Colour::opaque(213, 94, 0),
    Colour::opaque(0, 158, 115),
    Colour::opaque(204, 121, 167),
    Colour::opaque(86, 180, 233),
    Colour::opaque(230, 159, 0),
    BLACK,
];

/// Replacements on a dark page; colours of a map's values stay.
pub(crate) const IN_THE_DARK: [(Colour, Colour); 13] = [
    (INK, Colour::opaque(227, 230, 232)),
    (QUIET_INK, Colour::opaque(176, 182, 187)),
    (REFERENCE, Colour::opaque(150, 158, 164)),
    (GRID, Colour::opaque(52, 58, 64)),
    (MINOR_GRID, Colour::opaque(34, 39, 43)),
    (WHITE, Colour::opaque(22, 25, 28)),
    (BLACK, Colour::opaque(242, 242, 242)),
    (PALETTE[0], Colour::opaque(64, 144, 216)),
    (PALETTE[1], Colour::opaque(255, 134, 61)),
    (PALETTE[2], Colour::opaque(47, 199, 154)),
    (PALETTE[3], Colour::opaque(227, 154, 196)),
    (PALETTE[4], Colour::opaque(158, 218, 255)),
    (PALETTE[5], Colour::opaque(255, 200, 87)),
];

pub(crate) fn palette(index: usize) -> Colour {
    PALETTE[index % PALETTE.len()]
}

impl Colour {
    pub const fn opaque(red: u8, green: u8, blue: u8) -> Self {
        Self { rgb: [red, green, blue], opacity: 1.0 }
    }

    pub const fn with_opacity(self, opacity: f64) -> Self {
        Self { opacity, ..self }
    }
}

impl fmt::Display for Colour {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [red, green, blue] = self.rgb;
        write!(out, "#{red:02x}{green:02x}{blue:02x}")
    }
}

struct Fill(Colour);

impl fmt::Display for Fill {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "fill=\"{}\"", self.0)?;
        if self.0.opacity < 1.0 { write!(out, " fill-opacity=\"{}\"", self.0.opacity) } else { Ok(()) }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Label {
    pub text: String,
    /// Horizontally the position of `anchor`, vertically the middle of the capitals.
    pub at: Point,
    pub anchor: Anchor,
    pub size: f64,
    pub colour: Colour,
}

/// Parts beyond the edge of the document are invisible.
pub(crate) struct Svg {
    text: String,
}

impl Svg {
    /// White image with the reader's sans-serif font.
    pub fn new(width_px: u32, height_px: u32) -> Self {
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_px}\" height=\"{height_px}\" viewBox=\"0 0 {width_px} \
             {height_px}\" font-family=\"sans-serif\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n"
        );
        let mut svg = Self { text };
        let image = Rect { left: 0.0, top: 0.0, right: width_px.into(), bottom: height_px.into() };
        svg.rectangle(image, WHITE);
        svg
    }

    pub fn finish(mut self) -> String {
        self.text += "</svg>\n";
        self.text
    }

    pub fn line(&mut self, points: &[Point], width: f64, colour: Colour) {
        self.polyline(points, width, colour, "");
    }

    pub fn dashed_line(&mut self, points: &[Point], width: f64, colour: Colour) {
        self.polyline(points, width, colour, " stroke-dasharray=\"6 5\"");
    }

    fn polyline(&mut self, points: &[Point], width: f64, colour: Colour, dashes: &str) {
        if points.len() > 1 {
            let (points, width) = (point_list(points), decimal(width));
            self.element(format_args!(
                "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{dashes}/>"
            ));
        }
    }

    pub fn polygon(&mut self, corners: &[Point], colour: Colour) {
        if corners.len() > 2 {
            let (corners, fill) = (point_list(corners), Fill(colour));
            self.element(format_args!("<polygon points=\"{corners}\" {fill}/>"));
        }
    }

    pub fn rectangle(&mut self, rect: Rect, colour: Colour) {
        let [x, y, width, height] = [rect.left, rect.top, rect.width(), rect.height()].map(decimal);
        let fill = Fill(colour);
        self.element(format_args!(
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" {fill}/>"
        ));
    }

    pub fn disc(&mut self, (x, y): Point, radius: f64, colour: Colour) {
        let [x, y, radius] = [x, y, radius].map(decimal);
        let fill = Fill(colour);
        self.element(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" {fill}/>"));
    }

    /// Characters that are not allowed in XML become spaces.
    pub fn text(&mut self, label: &Label) {
        let Label { text, at, anchor, size, colour } = label;
        let [x, y, size] = [at.0, at.1 + CAPITALS_HALF_HEIGHT * size, *size].map(decimal);
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let (text, fill) = (escaped(text), Fill(*colour));
        self.element(format_args!(
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\" font-size=\"{size}\" {fill}>{text}</text>"
        ));
    }

    fn element(&mut self, element: fmt::Arguments<'_>) {
        writeln!(self.text, "{element}").expect("writing into a String cannot fail");
    }
}

/// Two decimals: a hundredth of a pixel is finer than any screen.
fn decimal(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn point_list(points: &[Point]) -> String {
    let points: Vec<String> = points.iter().map(|&(x, y)| format!("{},{}", decimal(x), decimal(y))).collect();
    points.join(" ")
}

fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '\u{fffe}' | '\u{ffff}' => escaped.push(' '),
            _ if character.is_control() => escaped.push(' '),
            _ => escaped.push(character),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    /// WCAG 2.2, section 1.4.3.
    fn contrast(a: Colour, b: Colour) -> f64 {
        let linear = |value: u8| {
            let value = f64::from(value) / 255.0;
            if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        };
        let luminance = |colour: Colour| {
            let [r, g, b] = colour.rgb.map(linear);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
        if a > b { a / b } else { b / a }
    }

    #[test]
    fn drawings_are_read_in_the_dark() {
        let dark =
            |colour: Colour| IN_THE_DARK.iter().find(|(light, _)| *light == colour).expect("it has one").1;
        for text in [INK, QUIET_INK, REFERENCE] {
            assert!(contrast(dark(text), dark(WHITE)) > 4.5, "{text}");
        }
        for colour in PALETTE {
            assert!(contrast(dark(colour), dark(WHITE)) > 4.5, "{colour}");
        }
        for grid in [GRID, MINOR_GRID] {
            assert!(contrast(dark(grid), dark(WHITE)) < 2.0, "{grid}");
        }
    }
}

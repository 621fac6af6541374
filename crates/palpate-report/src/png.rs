//! SVG to PNG with a built-in font, equal on every machine.

use super::ReportFile;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{self, fontdb};
use std::sync::{Arc, LazyLock};

const FONT_FAMILY: &str = "Noto Sans";
const COPY_SCALE: f32 = 2.0;
const MAX_SIDE_PX: u32 = 16_384;

/// Error of a PNG.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// The text is not an SVG document.
    #[error("not an SVG document: {0}")]
    Svg(#[from] usvg::Error),
    /// The scale gives less than one pixel, or too long a side.
    #[error(
        "scale {scale} gives {width_px} × {height_px} pixels; each side needs 1 to {max}",
        max = MAX_SIDE_PX
    )]
    Size {
        /// Requested scale.
        scale: f32,
        /// Resulting width.
        width_px: f32,
        /// Resulting height.
        height_px: f32,
    },
    /// The pixels could not be compressed.
    #[error("the PNG could not be written: {0}")]
    Encoding(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// Adds a PNG copy after each figure.
///
/// # Errors
/// As for [`svg_to_png`].
pub fn with_png_copies(files: Vec<ReportFile>) -> Result<Vec<ReportFile>, PngError> {
    let mut all = Vec::new();
    for file in files {
        let copy = file.name.strip_suffix(".svg").map(|stem| {
            let svg = String::from_utf8_lossy(&file.bytes);
            svg_to_png(&svg, COPY_SCALE).map(|bytes| ReportFile { name: format!("{stem}.png"), bytes })
        });
        all.push(file);
        all.extend(copy.transpose()?);
    }
    Ok(all)
}

/// Draws an SVG document as PNG at `scale` times its size, in the built-in font.
///
/// ```
/// use palpate_report::{Chart, chart_to_svg, svg_to_png};
///
/// let png = svg_to_png(&chart_to_svg(&Chart::default()), 2.0)?;
/// assert!(png.starts_with(b"\x89PNG"));
/// # Ok::<(), palpate_report::PngError>(())
/// ```
///
/// # Errors
/// [`PngError`] for text that is not SVG, and for a scale that gives no pixels or a side longer
/// than 16,384.
pub fn svg_to_png(svg: &str, scale: f32) -> Result<Vec<u8>, PngError> {
    let tree = parse(svg)?;
    let (width_px, height_px) =
        ((tree.size().width() * scale).round(), (tree.size().height() * scale).round());
    let valid = 1.0..=MAX_SIDE_PX as f32;
    let size = PngError::Size { scale, width_px, height_px };
    if !valid.contains(&width_px) || !valid.contains(&height_px) {
        return Err(size);
    }
    let mut pixels = Pixmap::new(width_px as u32, height_px as u32).ok_or(size)?;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| PngError::Encoding(Box::new(error)))
}

pub(crate) fn parse(svg: &str) -> Result<usvg::Tree, usvg::Error> {
    let options = usvg::Options {
        font_family: FONT_FAMILY.to_owned(),
        fontdb: Arc::clone(&FONTS),
        ..usvg::Options::default()
    };
    usvg::Tree::from_str(svg, &options)
}

static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(ttf_noto_sans::REGULAR.to_vec());
    fonts.set_sans_serif_family(FONT_FAMILY);
    fonts.set_serif_family(FONT_FAMILY);
    fonts.set_monospace_family(FONT_FAMILY);
    Arc::new(fonts)
});

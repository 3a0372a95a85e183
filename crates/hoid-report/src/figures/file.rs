//! Figures as files: the width on paper, and the file format given by the extension.
//!
//! Every figure is drawn as SVG. PDF, with vector lines and text, and PNG, with a resolution of [`DPI`], are made from
//! the SVG with the fonts of the system (feature `pdf-png`).

use std::path::Path;

use crate::ReportError;

/// Resolution of a PNG in dots per inch, as journals require for colour line art. A width of 85 mm gives 1004 dots.
pub const DPI: f64 = 300.0;

/// Formats in which a figure can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FigureFormat {
    /// Vector graphics, the format in which figures are drawn.
    Svg,
    /// A single page with the size of the figure.
    Pdf,
    /// Pixels on a white background.
    Png,
}

impl FigureFormat {
    /// The format given by the extension of a file name; `None` for any other extension.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "svg" => Some(Self::Svg),
            "pdf" => Some(Self::Pdf),
            "png" => Some(Self::Png),
            _ => None,
        }
    }

    /// True if this build of hoid can write the format: PDF and PNG need the feature `pdf-png`.
    pub const fn is_built(self) -> bool {
        matches!(self, Self::Svg) || cfg!(feature = "pdf-png")
    }

    /// Returns the contents of the file.
    ///
    /// # Errors
    /// [`ReportError::Figure`] if this build cannot write the format, or the system has no font.
    pub fn bytes(self, svg: &str) -> Result<Vec<u8>, ReportError> {
        match self {
            Self::Svg => Ok(svg.as_bytes().to_vec()),
            #[cfg(feature = "pdf-png")]
            Self::Pdf => converted::pdf(svg),
            #[cfg(feature = "pdf-png")]
            Self::Png => converted::png(svg),
            #[cfg(not(feature = "pdf-png"))]
            Self::Pdf | Self::Png => Err(ReportError::Figure {
                reason: "this build of hoid cannot write PDF or PNG (feature pdf-png)".to_owned(),
            }),
        }
    }
}

/// Scales the figure to a width in mm and the height in proportion. The text is scaled too, to 7.5 pt at 85 mm.
pub fn with_width_mm(svg: &str, width_mm: f64) -> String {
    let size = |name: &str| -> Option<f64> {
        let (_, rest) = svg.split_once(&format!(" {name}=\""))?;
        rest.split_once('"')?.0.parse().ok()
    };
    let (Some(width), Some(height)) = (size("width"), size("height")) else {
        return svg.to_owned();
    };
    let height_mm = height / width * width_mm;
    svg.replacen(&format!(" width=\"{width}\""), &format!(" width=\"{width_mm}mm\""), 1)
        .replacen(
            &format!(" height=\"{height}\""),
            &format!(" height=\"{height_mm:.2}mm\""),
            1,
        )
}

#[cfg(feature = "pdf-png")]
mod converted {
    //! Conversion by svg2pdf and resvg from the same parsed SVG tree.

    use resvg::{
        tiny_skia::{Pixmap, Transform},
        usvg::{Options, Tree, fontdb::Database},
    };
    use svg2pdf::{ConversionOptions, PageOptions};

    use super::DPI;
    use crate::ReportError;

    /// Pixels per inch of an SVG without units (CSS).
    const PIXELS_PER_INCH: f64 = 96.0;
    /// Font families of the figures, with their replacements on Linux.
    const SANS_SERIF: [&str; 5] = ["Helvetica", "Arial", "Liberation Sans", "DejaVu Sans", "Noto Sans"];

    pub fn pdf(svg: &str) -> Result<Vec<u8>, ReportError> {
        let page = PageOptions {
            dpi: PIXELS_PER_INCH as f32,
        };
        svg2pdf::to_pdf(&tree(svg)?, ConversionOptions::default(), page).map_err(|e| figure_error(&e))
    }

    pub fn png(svg: &str) -> Result<Vec<u8>, ReportError> {
        let tree = tree(svg)?;
        let scale = (DPI / PIXELS_PER_INCH) as f32;
        let size = (tree.size().to_int_size().scale_by(scale)).ok_or_else(|| figure_error(&"it has no size"))?;
        let mut dots = Pixmap::new(size.width(), size.height())
            .ok_or_else(|| figure_error(&"it has more pixels than fit in memory"))?;
        resvg::render(&tree, Transform::from_scale(scale, scale), &mut dots.as_mut());
        dots.encode_png().map_err(|e| figure_error(&e))
    }

    fn tree(svg: &str) -> Result<Tree, ReportError> {
        let mut options = Options::default();
        let fonts = options.fontdb_mut();
        fonts.load_system_fonts();
        let family = sans_serif(fonts).ok_or_else(|| {
            figure_error(
                &"the system has no font; install one, such as DejaVu (fonts-dejavu), or write the figure as .svg",
            )
        })?;
        fonts.set_sans_serif_family(family.clone());
        options.font_family = family;
        Tree::from_str(svg, &options).map_err(|e| figure_error(&e))
    }

    /// A font family of the system: the first family of [`SANS_SERIF`] that exists, otherwise any family.
    fn sans_serif(fonts: &Database) -> Option<String> {
        let has = |name: &&str| {
            fonts
                .faces()
                .any(|face| face.families.iter().any(|(family, _)| family == name))
        };
        let known = SANS_SERIF.iter().find(|name| has(name)).map(|name| (*name).to_owned());
        known.or_else(|| fonts.faces().next()?.families.first().map(|(family, _)| family.clone()))
    }

    fn figure_error(reason: &dyn std::fmt::Display) -> ReportError {
        ReportError::Figure {
            reason: reason.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"420\" height=\"210\" viewBox=\"0 0 420 210\">\
                       <rect width=\"100%\" height=\"100%\" fill=\"white\"/><text x=\"9\" y=\"99\">omega</text></svg>";

    #[test]
    fn requested_width_is_set() {
        let wide = with_width_mm(SVG, 85.0);
        assert!(
            wide.contains("width=\"85mm\" height=\"42.50mm\"") && wide.contains("100%"),
            "{wide}"
        );
        assert_eq!(with_width_mm("<svg>", 85.0), "<svg>");
    }

    #[test]
    fn format_follows_the_extension() {
        let of = |name: &str| FigureFormat::of(Path::new(name));
        assert_eq!(of("a.SVG"), Some(FigureFormat::Svg));
        assert_eq!(
            (of("a.b.pdf"), of("a.png")),
            (Some(FigureFormat::Pdf), Some(FigureFormat::Png))
        );
        assert_eq!((of("a"), of("a.eps"), of("svg")), (None, None, None));
        assert_eq!(FigureFormat::Svg.bytes(SVG).unwrap(), SVG.as_bytes());
    }

    #[test]
    #[cfg(not(feature = "pdf-png"))]
    fn error_names_the_missing_feature() {
        for format in [FigureFormat::Pdf, FigureFormat::Png] {
            assert!(!format.is_built());
            assert!(format.bytes(SVG).unwrap_err().to_string().contains("pdf-png"));
        }
    }

    #[test]
    #[cfg(feature = "pdf-png")]
    fn pdf_and_png_have_the_requested_size() {
        let svg = with_width_mm(SVG, 85.0);
        let pdf = FigureFormat::Pdf.bytes(&svg).unwrap();
        assert!(pdf.starts_with(b"%PDF-"));
        // A width of 85 mm is 240.9 pt.
        let text = String::from_utf8_lossy(&pdf);
        assert!(text.contains("/MediaBox [0 0 240.9"), "{text}");
        assert!(text.contains("/Font"), "letters are letters");
        let png = FigureFormat::Png.bytes(&svg).unwrap();
        // The first chunk contains width and height: 85 mm at 300 dots per inch.
        let dots = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
        assert!(
            dots(16).abs_diff(1004) <= 4 && dots(20).abs_diff(502) <= 4,
            "{} x {}",
            dots(16),
            dots(20)
        );
        assert!(FigureFormat::Pdf.bytes("<svg").is_err());
    }
}

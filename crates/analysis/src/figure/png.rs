//! SVG → PNG. Text is turned into outlines of a font that is in the program: the same picture on every machine, whatever fonts it
//! has, and without the renderer's own text engine, which would be most of its size.

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use std::fmt::Write as _;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

const FONT: &[u8] = include_bytes!("../../assets/dejavu-sans-subset.ttf");

/// Draws an SVG of this crate with `scale` pixels per pixel.
///
/// # Errors
/// What the renderer says; for the figures of this crate only a scale that is no number or makes the picture too large.
pub fn png(svg: &str, scale: f32) -> Result<Vec<u8>, String> {
    let face = Face::parse(FONT, 0).map_err(|error| error.to_string())?;
    let tree =
        Tree::from_str(&outlined(svg, &face), &Options::default()).map_err(|error| error.to_string())?;
    let size = tree.size().to_int_size().scale_by(scale).ok_or("the picture has no size")?;
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or("the picture is too large")?;
    // The last row and column may be covered in part only.
    pixels.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| error.to_string())
}

/// The same picture with every text element, each on a line of its own, as a path.
fn outlined(svg: &str, face: &Face<'_>) -> String {
    let mut out = String::with_capacity(2 * svg.len());
    for line in svg.lines() {
        if !(line.starts_with("<text ") && text(line, face, &mut out).is_some()) {
            out.push_str(line);
        }
        out.push('\n');
    }
    out
}

/// One text element as a path; `None` if it is not as this crate writes it.
fn text(line: &str, face: &Face<'_>, out: &mut String) -> Option<()> {
    let (head, rest) = line.split_once('>')?;
    let content = rest.strip_suffix("</text>")?;
    let attribute = |name: &str| {
        let (_, after) = head.split_once(&format!(" {name}=\""))?;
        after.split_once('"').map(|(value, _)| value)
    };
    let number = |name: &str| attribute(name)?.parse::<f32>().ok();
    let (x, y, size) = (number("x")?, number("y")?, number("font-size")?);
    let plain =
        content.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&");
    let scale = size / f32::from(face.units_per_em());
    let glyphs: Vec<GlyphId> = plain.chars().map(|c| face.glyph_index(c).unwrap_or(GlyphId(0))).collect();
    let advance = |glyph: &GlyphId| f32::from(face.glyph_hor_advance(*glyph).unwrap_or(0)) * scale;
    let width: f32 = glyphs.iter().map(advance).sum();
    let share = match attribute("text-anchor") {
        Some("middle") => 0.5,
        Some("end") => 1.0,
        _ => 0.0,
    };
    let mut pen = Pen { d: String::new(), x: x - share * width, y, scale };
    for glyph in &glyphs {
        face.outline_glyph(*glyph, &mut pen);
        pen.x += advance(glyph);
    }
    let fill = attribute("fill").unwrap_or("#000000");
    let turn = attribute("transform").map(|t| format!(" transform=\"{t}\"")).unwrap_or_default();
    // The font has one weight: bold is the same with a thin line around it.
    let bold = match attribute("font-weight") {
        Some("bold") => format!(" stroke=\"{fill}\" stroke-width=\"{:.2}\"", 0.045 * size),
        _ => String::new(),
    };
    let _ = write!(out, "<path d=\"{}\" fill=\"{fill}\"{bold}{turn}/>", pen.d);
    Some(())
}

/// Writes outlines as path data, y downwards.
struct Pen {
    d: String,
    x: f32,
    y: f32,
    scale: f32,
}

impl Pen {
    fn at(&self, x: f32, y: f32) -> String {
        format!("{:.2} {:.2}", self.x + x * self.scale, self.y - y * self.scale)
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let _ = write!(self.d, "M{}", self.at(x, y));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let _ = write!(self.d, "L{}", self.at(x, y));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let _ = write!(self.d, "Q{} {}", self.at(x1, y1), self.at(x, y));
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let _ = write!(self.d, "C{} {} {}", self.at(x1, y1), self.at(x2, y2), self.at(x, y));
    }

    fn close(&mut self) {
        self.d.push('Z');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Text is drawn, where it should be, and turned.
    #[test]
    fn text_becomes_ink() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"60\" height=\"20\">\n\
                   <text x=\"50\" y=\"15\" font-size=\"14\" fill=\"#000000\" text-anchor=\"end\">a&lt;\u{2212}</text>\n</svg>";
        let face = Face::parse(FONT, 0).unwrap();
        assert!(!outlined(svg, &face).contains("<text"));
        let pixels = Pixmap::decode_png(&png(svg, 1.0).unwrap()).unwrap();
        let inked = |from: u32, to: u32| {
            (from..to).any(|x| (0..20).any(|y| pixels.pixel(x, y).is_some_and(|p| p.red() < 128)))
        };
        assert!(inked(15, 50) && !inked(51, 60) && !inked(0, 10));
        assert!(png(svg, 0.0).is_err());
    }

    /// A width that is no whole number of pixels leaves no dark or transparent edge.
    #[test]
    fn the_ground_is_white_to_the_last_pixel() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"30.56\" height=\"20.3\">\n\
                   <rect width=\"30.56\" height=\"20.3\" fill=\"#ffffff\"/>\n</svg>";
        let pixels = Pixmap::decode_png(&png(svg, 1.5).unwrap()).unwrap();
        assert!(pixels.pixels().iter().all(|p| p.alpha() == 255 && p.red() == 255));
    }
}

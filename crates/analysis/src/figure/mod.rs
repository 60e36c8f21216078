//! Figures as SVG: panels with axes in the machine's units, on a light background, in colours that colour-blind eyes tell apart.
//!
//! Fixed decimals and no dates: the same data give the same bytes.

mod bands;
pub mod curves;
pub mod planar;
#[cfg(feature = "png")]
pub mod png;
pub mod spatial;

use pkm_kins::Vec2;
use pkm_kins::maths::{floor, log, pow, round};
use std::fmt::Write as _;

/// Colours of lines and marks (Okabe and Ito).
pub(crate) mod ink {
    pub(crate) const TEXT: &str = "#222222";
    pub(crate) const GRID: &str = "#dddddd";
    pub(crate) const FRAME: &str = "#666666";
    pub(crate) const TYPE_1: &str = "#d55e00";
    pub(crate) const TYPE_2: &str = "#b0207c";
    pub(crate) const SERIES: [&str; 8] =
        ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c6d31"];
}

/// A picture being drawn; lengths in pixels.
#[derive(Debug)]
pub(crate) struct Figure {
    width: f64,
    height: f64,
    body: String,
    clips: usize,
}

/// A rectangle of the picture with a scale.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Panel {
    /// Left, top, width, height, px.
    frame: [f64; 4],
    low: Vec2,
    /// px per unit
    scale: Vec2,
    clip: usize,
}

/// How text stands to its place.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// Two decimals, without what is not needed.
fn px(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Text without characters that mean something in XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The step of 1, 2 or 5 times a power of ten that cuts `span` into at most about `count` parts.
pub(crate) fn nice_step(span: f64, count: f64) -> f64 {
    let raw = span / count;
    if !(raw > 0.0 && raw.is_finite()) {
        return 1.0;
    }
    let power = pow(10.0, floor(log(raw) / log(10.0) + 1e-9));
    let lead = raw / power;
    power
        * if lead <= 1.0 {
            1.0
        } else if lead <= 2.0 {
            2.0
        } else if lead <= 5.0 {
            5.0
        } else {
            10.0
        }
}

/// Multiples of `step` in a range.
fn ticks(low: f64, high: f64, step: f64) -> Vec<f64> {
    let (first, last) = (-floor(-low / step), floor(high / step));
    if !(last - first < 1000.0) {
        return Vec::new();
    }
    (0..=(last - first) as i64).map(|k| (first + k as f64) * step).collect()
}

/// A tick's number with as many decimals as its step has.
pub(crate) fn label(value: f64, step: f64) -> String {
    let mut decimals = 0;
    let mut scaled = step;
    while decimals < 9 && (scaled - round(scaled)).abs() > 1e-6 * scaled {
        scaled *= 10.0;
        decimals += 1;
    }
    let text = format!("{value:.decimals$}");
    let text = if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        text.replace('-', "")
    } else {
        text
    };
    text.replace('-', "\u{2212}")
}

impl Figure {
    pub(crate) fn new(width: f64, height: f64, title: &str, subtitle: &str) -> Self {
        let mut figure = Self { width, height, body: String::new(), clips: 0 };
        figure.text([24.0, 32.0], 18.0, Anchor::Start, title, " font-weight=\"bold\"");
        figure.text([24.0, 53.0], 12.0, Anchor::Start, subtitle, "");
        figure
    }

    /// The finished picture.
    pub(crate) fn finish(self) -> String {
        let (w, h) = (px(self.width), px(self.height));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             font-family=\"DejaVu Sans, Verdana, sans-serif\">\n\
             <defs><pattern id=\"hatch\" width=\"7\" height=\"7\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\">\
             <rect width=\"7\" height=\"7\" fill=\"#ffffff\" fill-opacity=\"0.55\"/>\
             <path d=\"M0 0V7\" stroke=\"#333333\" stroke-width=\"1.4\"/></pattern></defs>\n\
             <rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n{}</svg>\n",
            self.body
        )
    }

    pub(crate) fn text(&mut self, [x, y]: Vec2, size: f64, anchor: Anchor, text: &str, more: &str) {
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{}\" y=\"{}\" font-size=\"{}\" fill=\"{}\"{anchor}{more}>{}</text>",
            px(x),
            px(y),
            px(size),
            ink::TEXT,
            escaped(text)
        );
    }

    /// Opens a panel over `data` (low, high) with grid, ticks and axis titles. With `equal` both axes have one scale and the
    /// panel shrinks to what it needs.
    pub(crate) fn panel(
        &mut self,
        [left, top, width, height]: [f64; 4],
        [low, high]: [Vec2; 2],
        equal: bool,
        [x_title, y_title]: [&str; 2],
    ) -> Panel {
        let span = [(high[0] - low[0]).max(1e-9), (high[1] - low[1]).max(1e-9)];
        let mut scale = [width / span[0], height / span[1]];
        if equal {
            scale = [scale[0].min(scale[1]); 2];
        }
        let frame = [left, top, scale[0] * span[0], scale[1] * span[1]];
        self.clips += 1;
        let panel = Panel { frame, low, scale, clip: self.clips };
        let [left, top, width, height] = frame;
        let _ = writeln!(
            self.body,
            "<clipPath id=\"clip{}\"><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/></clipPath>",
            panel.clip,
            px(left),
            px(top),
            px(width),
            px(height)
        );
        let (x_step, y_step) = if equal {
            let step = nice_step(span[0].max(span[1]), 9.0)
                .min(nice_step(span[0].min(span[1]), 3.0).max(nice_step(span[0].max(span[1]), 14.0)));
            (step, step)
        } else {
            (nice_step(span[0], 9.0), nice_step(span[1], (height / 32.0).clamp(2.0, 8.0)))
        };
        let mut lines = String::new();
        for x in ticks(low[0], high[0], x_step) {
            let at = panel.place([x, low[1]]);
            let _ = write!(lines, "M{} {}V{}", px(at[0]), px(top), px(top + height));
            self.text([at[0], top + height + 16.0], 11.0, Anchor::Middle, &label(x, x_step), "");
        }
        for y in ticks(low[1], high[1], y_step) {
            let at = panel.place([low[0], y]);
            let _ = write!(lines, "M{} {}H{}", px(left), px(at[1]), px(left + width));
            self.text([left - 6.0, at[1] + 4.0], 11.0, Anchor::End, &label(y, y_step), "");
        }
        let _ = writeln!(
            self.body,
            "<path d=\"{lines}\" stroke=\"{}\" stroke-width=\"0.7\" fill=\"none\"/>",
            ink::GRID
        );
        self.text([left + width / 2.0, top + height + 34.0], 12.0, Anchor::Middle, x_title, "");
        let (x, y) = (left - 46.0, top + height / 2.0);
        let turn = format!(" transform=\"rotate(-90 {} {})\"", px(x), px(y));
        self.text([x, y], 12.0, Anchor::Middle, y_title, &turn);
        panel
    }

    /// The panel's frame, to be drawn last.
    pub(crate) fn frame(&mut self, panel: &Panel) {
        let [left, top, width, height] = panel.frame;
        let _ = writeln!(
            self.body,
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1\"/>",
            px(left),
            px(top),
            px(width),
            px(height),
            ink::FRAME
        );
    }

    /// A clip path of polygons, within the panel; returns its name.
    pub(crate) fn clip(&mut self, panel: &Panel, polygons: &[Vec<Vec2>]) -> String {
        self.clips += 1;
        let name = format!("clip{}", self.clips);
        let _ = writeln!(
            self.body,
            "<clipPath id=\"{name}\" clip-path=\"url(#clip{})\"><path clip-rule=\"evenodd\" d=\"{}\"/></clipPath>",
            panel.clip,
            path(panel, polygons, true)
        );
        name
    }

    /// Opens a group with a clip path; to be closed with [`Self::close`].
    pub(crate) fn open(&mut self, clip: &str) {
        let _ = writeln!(self.body, "<g clip-path=\"url(#{clip})\">");
    }

    pub(crate) fn close(&mut self) {
        self.body.push_str("</g>\n");
    }

    /// Closed polygons, even-odd, in one path.
    pub(crate) fn polygons(&mut self, panel: &Panel, polygons: &[Vec<Vec2>], style: &str) {
        let d = path(panel, polygons, true);
        if !d.is_empty() {
            let _ = writeln!(self.body, "<path d=\"{d}\" fill-rule=\"evenodd\" {style}/>");
        }
    }

    /// Open lines in one path, clipped to the panel.
    pub(crate) fn lines(&mut self, panel: &Panel, lines: &[Vec<Vec2>], style: &str) {
        let d = path(panel, lines, false);
        if !d.is_empty() {
            let _ = writeln!(
                self.body,
                "<path d=\"{d}\" fill=\"none\" clip-path=\"url(#clip{})\" {style}/>",
                panel.clip
            );
        }
    }

    pub(crate) fn disc(&mut self, panel: &Panel, at: Vec2, radius: f64, style: &str) {
        let [x, y] = panel.place(at);
        let _ =
            writeln!(self.body, "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {style}/>", px(x), px(y), px(radius));
    }

    pub(crate) fn square(&mut self, panel: &Panel, at: Vec2, half: f64, style: &str) {
        let [x, y] = panel.place(at);
        let (left, top, side) = (px(x - half), px(y - half), px(2.0 * half));
        let _ = writeln!(
            self.body,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{side}\" height=\"{side}\" {style}/>"
        );
    }

    /// A line of the legend: a swatch and its text; returns the y of the next line.
    pub(crate) fn legend(&mut self, [x, y]: Vec2, swatch: &Swatch<'_>, text: &str) -> f64 {
        match swatch {
            Swatch::Fill(fill) => {
                let _ = writeln!(
                    self.body,
                    "<rect x=\"{}\" y=\"{}\" width=\"24\" height=\"14\" fill=\"{fill}\" stroke=\"#888888\" stroke-width=\"0.6\"/>",
                    px(x),
                    px(y - 11.0)
                );
            }
            Swatch::Line(style) => {
                let _ =
                    writeln!(self.body, "<path d=\"M{} {}h24\" fill=\"none\" {style}/>", px(x), px(y - 4.0));
            }
            Swatch::None => {}
        }
        let indent = if matches!(swatch, Swatch::None) { 0.0 } else { 32.0 };
        self.text([x + indent, y], 11.5, Anchor::Start, text, "");
        y + 19.0
    }
}

/// What stands before a line of the legend.
pub(crate) enum Swatch<'a> {
    Fill(&'a str),
    Line(&'a str),
    None,
}

impl Panel {
    /// Data → px.
    pub(crate) fn place(&self, [x, y]: Vec2) -> Vec2 {
        let [left, top, _, height] = self.frame;
        [left + (x - self.low[0]) * self.scale[0], top + height - (y - self.low[1]) * self.scale[1]]
    }

    /// Units per px.
    pub(crate) fn pixel(&self) -> f64 {
        1.0 / self.scale[0].max(self.scale[1])
    }

    pub(crate) fn bottom(&self) -> f64 {
        self.frame[1] + self.frame[3]
    }
}

/// Path data of lines or closed polygons: absolute start, then relative steps in tenths of a pixel.
fn path(panel: &Panel, lines: &[Vec<Vec2>], closed: bool) -> String {
    let mut d = String::new();
    for line in lines {
        let mut pen: Option<[i64; 2]> = None;
        for point in line {
            let [x, y] = panel.place(*point);
            // Far outside the picture: kept where no viewer overflows.
            let at = [x, y].map(|v| (v.clamp(-1e5, 1e5) * 10.0).round() as i64);
            match pen {
                None => {
                    let _ = write!(d, "M{} {}l", tenth(at[0]), tenth(at[1]));
                }
                Some(pen) if pen == at => continue,
                Some(pen) => {
                    let _ = write!(d, "{} {} ", tenth(at[0] - pen[0]), tenth(at[1] - pen[1]));
                }
            }
            pen = Some(at);
        }
        if d.ends_with('l') {
            d.push_str("0 0");
        }
        let end = d.trim_end().len();
        d.truncate(end);
        if closed && pen.is_some() {
            d.push('z');
        }
    }
    d
}

/// Tenths as a decimal.
fn tenth(value: i64) -> String {
    let sign = if value < 0 { "-" } else { "" };
    let (whole, rest) = (value.abs() / 10, value.abs() % 10);
    match (whole, rest) {
        (_, 0) => format!("{sign}{whole}"),
        (0, _) => format!("{sign}.{rest}"),
        _ => format!("{sign}{whole}.{rest}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_axes() {
        assert_eq!(nice_step(700.0, 9.0), 100.0);
        assert_eq!(nice_step(0.9, 5.0), 0.2);
        assert_eq!(ticks(-21.0, 41.0, 20.0), [-20.0, 0.0, 20.0, 40.0]);
        assert!(ticks(1.0, 1.5, 10.0).is_empty());
        assert_eq!(label(-0.2, 0.2), "\u{2212}0.2");
        assert_eq!(label(-0.0, 20.0), "0");
        assert_eq!(label(0.25, 0.25), "0.25");
    }

    #[test]
    fn nothing_in_a_text_becomes_markup() {
        let mut figure = Figure::new(10.0, 10.0, "a<b & \"c\"", "");
        let panel = figure.panel([0.0, 0.0, 100.0, 100.0], [[0.0, 0.0], [1.0, 1.0]], true, ["x", "y"]);
        figure.lines(&panel, &[vec![[0.0, 0.0], [0.5, 0.25], [1.0, 1.0]]], "stroke=\"#000\"");
        let svg = figure.finish();
        assert!(svg.contains("a&lt;b &amp; &quot;c&quot;"));
        assert!(svg.contains("M0 100l50 -25 50 -75"), "{svg}");
    }
}

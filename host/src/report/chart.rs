//! Panels as SVG: axes, ticks and marks are kuva's; colours are the page's own variables, so that one drawing is
//! readable on light and on dark.

use kuva::backend::svg::SvgBackend;
use kuva::plot::{BandPlot, ColorMap, Heatmap, LinePlot, LineStyle, MarkerShape, ScatterPlot};
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::render_multiple;
use kuva::render::theme::Theme;
use std::sync::Arc;

/// Colours of Okabe and Ito (2008), told apart with any kind of colour vision, and the text's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ink {
    Text,
    Grey,
    Blue,
    Vermillion,
    Green,
    Orange,
    Purple,
}

/// What a line looks like without colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stroke {
    Solid,
    Dashed,
    Dotted,
    DashDot,
}

/// What a dot looks like without colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
}

/// How a series is drawn, in a panel and in its legend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mark {
    /// A line of this width, pixels.
    Line(Ink, Stroke, f64),
    /// The area between two lines, this opaque.
    Band(Ink, f64),
    /// Dots of this radius, pixels.
    Dots(Ink, Shape, f64),
}

/// One entry of a legend.
#[derive(Clone, Debug)]
pub(super) struct Key {
    pub(super) mark: Mark,
    pub(super) label: String,
}

/// One series of a panel.
#[derive(Clone, Debug)]
pub(super) struct Series {
    pub(super) mark: Mark,
    pub(super) points: Vec<(f64, f64)>,
    /// Upper line of a band, whose lower one `points` are.
    pub(super) high: Vec<f64>,
}

/// Axes and series. Labels carry the unit.
#[derive(Clone, Debug)]
pub(super) struct Panel {
    pub(super) title: String,
    pub(super) x: String,
    pub(super) y: String,
    /// Ends of the y axis where the data do not choose them.
    pub(super) y_range: Option<(f64, f64)>,
    /// Pixels.
    pub(super) size: (f64, f64),
    pub(super) series: Vec<Series>,
}

/// A chessboard of grey cells, white high.
#[derive(Clone, Debug)]
pub(super) struct Board {
    pub(super) title: String,
    pub(super) x: String,
    pub(super) y: String,
    /// What grey means, with its unit.
    pub(super) scale: String,
    /// Values of black and of white.
    pub(super) range: (f64, f64),
    /// `[row][column]`.
    pub(super) cells: Vec<Vec<f64>>,
    /// Names of the rows, the first on top; without names they are numbered from below.
    pub(super) rows: Vec<String>,
    /// Pixels.
    pub(super) size: (f64, f64),
}

/// Size of an ordinary panel, pixels.
pub(super) const PANEL: (f64, f64) = (370.0, 250.0);

impl Ink {
    pub(super) const fn css(self) -> &'static str {
        match self {
            Self::Text => "var(--ink)",
            Self::Grey => "var(--grey)",
            Self::Blue => "var(--blue)",
            Self::Vermillion => "var(--vermillion)",
            Self::Green => "var(--green)",
            Self::Orange => "var(--orange)",
            Self::Purple => "var(--purple)",
        }
    }
}

impl Stroke {
    /// SVG's `stroke-dasharray`.
    pub(super) const fn dashes(self) -> &'static str {
        match self {
            Self::Solid => "none",
            Self::Dashed => "7 4",
            Self::Dotted => "2 3",
            Self::DashDot => "8 3 2 3",
        }
    }

    fn style(self) -> LineStyle {
        match self {
            Self::Solid => LineStyle::Solid,
            other => LineStyle::Custom(other.dashes().to_owned()),
        }
    }
}

impl Shape {
    const fn marker(self) -> MarkerShape {
        match self {
            Self::Circle => MarkerShape::Circle,
            Self::Square => MarkerShape::Square,
            Self::Triangle => MarkerShape::Triangle,
            Self::Diamond => MarkerShape::Diamond,
            Self::Cross => MarkerShape::Cross,
        }
    }
}

/// Colour, stroke and shape of the class or case number `index`: different in each of them for the first four.
pub(super) const fn class(index: usize) -> (Ink, Stroke, Shape) {
    match index % 5 {
        0 => (Ink::Vermillion, Stroke::Solid, Shape::Circle),
        1 => (Ink::Blue, Stroke::Dashed, Shape::Square),
        2 => (Ink::Green, Stroke::DashDot, Shape::Triangle),
        3 => (Ink::Purple, Stroke::Dotted, Shape::Diamond),
        _ => (Ink::Orange, Stroke::Solid, Shape::Cross),
    }
}

impl Series {
    /// Points, or dots, in this order.
    pub(super) fn new(mark: Mark, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            mark,
            points: points.into_iter().collect(),
            high: Vec::new(),
        }
    }

    /// A line over two lists.
    pub(super) fn over(mark: Mark, x: &[f64], y: &[f64]) -> Self {
        Self::new(mark, x.iter().copied().zip(y.iter().copied()))
    }

    /// A band over three lists.
    pub(super) fn band(mark: Mark, x: &[f64], low: &[f64], high: &[f64]) -> Self {
        Self {
            high: high.to_vec(),
            ..Self::over(mark, x, low)
        }
    }

    fn finite(&self) -> bool {
        let points = self.points.iter().flat_map(|(x, y)| [x, y]);
        !self.points.is_empty() && points.chain(&self.high).all(|v| v.is_finite())
    }

    fn plot(&self) -> Plot {
        match self.mark {
            Mark::Line(ink, stroke, width) => {
                let line = LinePlot::new().with_data(self.points.iter().copied());
                let line = line.with_color(ink.css()).with_stroke_width(width);
                Plot::Line(line.with_line_style(stroke.style()))
            }
            Mark::Band(ink, opacity) => {
                let (x, low): (Vec<_>, Vec<_>) = self.points.iter().copied().unzip();
                let band = BandPlot::new(x, low, self.high.clone());
                Plot::Band(band.with_color(ink.css()).with_opacity(opacity))
            }
            Mark::Dots(ink, shape, size) => {
                let dots = ScatterPlot::new().with_data(self.points.iter().copied());
                let dots = dots.with_color(ink.css()).with_size(size);
                Plot::Scatter(dots.with_marker(shape.marker()))
            }
        }
    }
}

impl Panel {
    /// An ordinary panel.
    pub(super) fn new(title: &str, x: &str, y: &str, series: Vec<Series>) -> Self {
        Self {
            title: title.to_owned(),
            x: x.to_owned(),
            y: y.to_owned(),
            y_range: None,
            size: PANEL,
            series,
        }
    }

    /// SVG whose internal names begin with `name`; nothing without a finite point.
    pub(super) fn svg(&self, name: &str) -> Option<String> {
        let drawn = self.series.iter().filter(|series| series.finite());
        let plots: Vec<Plot> = drawn.map(Series::plot).collect();
        if plots.is_empty() {
            return None;
        }
        let mut layout = layout(&plots, &self.title, (&self.x, &self.y), self.size);
        if let Some((low, high)) = self.y_range {
            layout = layout.with_y_axis_min(low).with_y_axis_max(high);
        }
        Some(named(&render(plots, layout), name, &self.title))
    }
}

impl Board {
    /// SVG, as [`Panel::svg`].
    pub(super) fn svg(&self, name: &str) -> Option<String> {
        if self.cells.iter().flatten().any(|cell| !cell.is_finite()) || self.cells.is_empty() {
            return None;
        }
        let (low, high) = self.range;
        // kuva colours by the share between the least and the greatest cell.
        let (least, most) = (self.cells.iter().flatten())
            .fold((high, low), |(a, b), &v| (f64::min(a, v), f64::max(b, v)));
        let grey = move |share: f64| {
            let value = least + share * (most - least);
            let white = ((value - low) / (high - low)).clamp(0.0, 1.0);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0 to 255"
            )]
            let level = (white * 255.0).round() as u8;
            format!("#{level:02x}{level:02x}{level:02x}")
        };
        // kuva puts the first row at the bottom, and the middle of cell n at n.
        let mut cells = self.cells.clone();
        if !self.rows.is_empty() {
            cells.reverse();
        }
        let end = |count: usize| count as f64 + 0.5;
        let columns = cells.first().map_or(0, Vec::len);
        let ends = (end(columns), end(cells.len()));
        let board = Heatmap::new()
            .with_data(cells)
            .with_color_map(ColorMap::Custom(Arc::new(grey)));
        let plots = vec![Plot::Heatmap(board)];
        let title = format!("{}; grey: {}", self.title, self.scale);
        let mut layout = layout(&plots, &title, (&self.x, &self.y), self.size)
            .with_x_axis_min(0.5)
            .with_x_axis_max(ends.0)
            .with_y_axis_min(0.5)
            .with_y_axis_max(ends.1);
        if !self.rows.is_empty() {
            layout = layout.with_y_categories(self.rows.iter().rev().cloned().collect());
        }
        Some(named(&render(plots, layout), name, &title))
    }
}

fn layout(plots: &[Plot], title: &str, (x, y): (&str, &str), size: (f64, f64)) -> Layout {
    let theme = Theme {
        background: "none".to_owned(),
        axis_color: Ink::Text.css().to_owned(),
        grid_color: "var(--grid)".to_owned(),
        tick_color: Ink::Text.css().to_owned(),
        text_color: Ink::Text.css().to_owned(),
        legend_bg: "none".to_owned(),
        legend_border: "none".to_owned(),
        colorbar_border: Ink::Text.css().to_owned(),
        ..Theme::light()
    };
    Layout::auto_from_plots(plots)
        .with_title(title)
        .with_title_size(14)
        .with_label_size(12)
        .with_tick_size(11)
        .with_x_label(x)
        .with_y_label(y)
        .with_width(size.0)
        .with_height(size.1)
        .with_clamp_axis()
        .with_theme(theme)
}

fn render(plots: Vec<Plot>, layout: Layout) -> String {
    SvgBackend.render_scene(&render_multiple(plots, layout))
}

/// Gives the drawing a name for those who cannot see it, lets it shrink with the page, and makes its internal names
/// its own: many drawings share a page.
fn named(svg: &str, name: &str, title: &str) -> String {
    let size = |attribute: &str| -> Option<&str> {
        let rest = svg.split_once(&format!("{attribute}=\""))?.1;
        Some(rest.split_once('"')?.0)
    };
    let (width, height) = (size("width").unwrap_or("0"), size("height").unwrap_or("0"));
    let opening = format!(
        "<svg class=\"panel\" role=\"img\" aria-label=\"{}\" viewBox=\"0 0 {width} {height}\"",
        super::html::escaped(title)
    );
    svg.replacen("<svg", &opening, 1)
        .replace("kuva-", &format!("{name}-"))
}

//! Figures: panels arranged on a page.

use super::place::Rect;
use super::svg::{Lettering, Svg};

/// Points per millimeter.
const PER_MM: f64 = 72.0 / 25.4;
/// Distance between neighboring panels.
const GAP: f64 = 4.0;

/// Font sizes of axis labels and titles, and of tick labels and legends.
pub(super) const LABEL_SIZE: f64 = 7.5;
pub(super) const TICK_SIZE: f64 = 6.5;

/// Space around a drawing area for labels, ticks and legends.
#[derive(Debug, Clone, Copy, Default)]
pub struct Margins {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

impl Margins {
    fn at_least(self, other: Self) -> Self {
        Self {
            left: self.left.max(other.left),
            right: self.right.max(other.right),
            top: self.top.max(other.top),
            bottom: self.bottom.max(other.bottom),
        }
    }
}

pub trait Panel {
    /// Returns the space required around a drawing area of this width and height.
    fn margins(&self, width: f64, height: f64) -> Margins;

    /// Draws the panel into the area, and its labels around the area.
    fn draw(&self, svg: &mut Svg, area: Rect);

    /// Returns height / width of the drawing area, or `None` if the ratio is not fixed.
    fn aspect(&self) -> Option<f64> {
        None
    }
}

/// Panels arranged on a grid, row by row, with aligned drawing areas.
pub struct Figure {
    /// Title for screen readers.
    pub title: String,
    /// Page width in millimeters; a journal column is 85 mm wide.
    pub width_mm: f64,
    pub n_columns: usize,
    /// Height in millimeters of the drawing areas of panels whose aspect ratio is not fixed.
    pub panel_height_mm: f64,
    pub panels: Vec<Box<dyn Panel>>,
}

impl Figure {
    /// Creates a figure with a single panel, as wide as a journal column.
    pub fn of(title: impl Into<String>, panel: impl Panel + 'static) -> Self {
        Self::column(title, vec![Box::new(panel)])
    }

    /// Creates a figure with a column of panels, as wide as a journal column.
    pub fn column(title: impl Into<String>, panels: Vec<Box<dyn Panel>>) -> Self {
        Self { title: title.into(), width_mm: 85.0, n_columns: 1, panel_height_mm: 42.0, panels }
    }

    /// Renders the figure as an SVG document.
    pub fn render(&self) -> String {
        self.lettered(Lettering::Text)
    }

    /// Renders the figure as an SVG document in which labels are outlines instead of text, as required by
    /// [`pixels`](super::raster::pixels).
    pub fn outlined(&self) -> String {
        self.lettered(Lettering::Outlines)
    }

    fn lettered(&self, lettering: Lettering) -> String {
        // Margins depend on the size of the drawing area (through wrapped legends and the number of ticks), and vice
        // versa. A second pass takes this into account.
        let rough = self.layout(&vec![Margins::default(); self.panels.len()]);
        let layout = self.layout(&self.margins(&rough.areas));
        let layout = self.layout(&self.margins(&layout.areas));
        let mut svg = Svg::new(self.width_mm * PER_MM, layout.height, lettering);
        for (panel, area) in self.panels.iter().zip(layout.areas) {
            panel.draw(&mut svg, area);
        }
        svg.finish(&self.title)
    }

    fn margins(&self, areas: &[Rect]) -> Vec<Margins> {
        self.panels.iter().zip(areas).map(|(p, area)| p.margins(area.width, area.height)).collect()
    }

    fn layout(&self, margins: &[Margins]) -> Layout {
        let n = self.n_columns;
        let largest = |of: &mut dyn Iterator<Item = &Margins>| {
            of.fold(Margins::default(), |a, b| a.at_least(*b))
        };
        let columns: Vec<Margins> =
            (0..n).map(|j| largest(&mut margins.iter().skip(j).step_by(n))).collect();
        let taken: f64 = columns.iter().map(|m| m.left + m.right).sum();
        let gaps = GAP * (n - 1) as f64;
        let width = (self.width_mm * PER_MM - taken - gaps) / n as f64;

        let mut areas = Vec::with_capacity(self.panels.len());
        let mut y = 0.0;
        for (panels, margins) in self.panels.chunks(n).zip(margins.chunks(n)) {
            let row = largest(&mut margins.iter());
            let heights: Vec<f64> =
                panels.iter().map(|panel| self.height(&**panel, width)).collect();
            let height = heights.iter().copied().fold(0.0, f64::max);
            y += if areas.is_empty() { row.top } else { row.top + GAP };
            let mut x = 0.0;
            for (column, own) in columns.iter().zip(heights) {
                x += column.left;
                areas.push(Rect { x, y: y + (height - own) / 2.0, width, height: own });
                x += width + column.right + GAP;
            }
            y += height + row.bottom;
        }
        Layout { areas, height: y }
    }

    fn height(&self, panel: &dyn Panel, width: f64) -> f64 {
        panel.aspect().map_or(self.panel_height_mm * PER_MM, |aspect| aspect * width)
    }
}

struct Layout {
    areas: Vec<Rect>,
    height: f64,
}

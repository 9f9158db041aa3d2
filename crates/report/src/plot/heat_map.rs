//! Grids of cells, each with a category and a text.

use super::color::Color;
use super::figure::{LABEL_SIZE, Margins, Panel, TICK_SIZE};
use super::legend::{self, Entry, Key};
use super::place::Rect;
use super::svg::{Anchor, Stroke, Svg, Type};
use super::text;

#[derive(Debug, Clone, Default)]
pub struct Cell {
    /// Index of the category; `None` for an empty cell.
    pub category: Option<usize>,
    /// Text that is shown only if it fits into the cell.
    pub text: String,
}

#[derive(Debug, Clone, Default)]
pub struct HeatMap {
    /// Title above the plot; may be empty.
    pub title: String,
    pub column_label: String,
    pub columns: Vec<String>,
    pub row_label: String,
    /// Names of the rows, from top to bottom.
    pub rows: Vec<String>,
    /// Cells, row by row.
    pub cells: Vec<Cell>,
    pub categories: Vec<(String, Color)>,
}

const GAP: f64 = 3.0;

impl HeatMap {
    fn entries(&self) -> Vec<Entry<'_>> {
        let categories = self.categories.iter();
        categories.map(|(name, color)| Entry { name, key: Key::Square(*color) }).collect()
    }

    fn row_names_width(&self) -> f64 {
        self.rows.iter().map(|name| text::width(name, TICK_SIZE)).fold(0.0, f64::max)
    }

    fn draw_cell(&self, svg: &mut Svg, rect: Rect, cell: &Cell) {
        let color = cell.category.map(|category| self.categories[category].1);
        svg.rect(rect, Some(color.unwrap_or(Color::PALE)), None);
        svg.rect(rect, None, Some(Stroke::solid(Color::WHITE, 0.6)));
        let fits = text::width(&cell.text, TICK_SIZE) < rect.width && TICK_SIZE < rect.height;
        if fits && !cell.text.is_empty() {
            let ink = color.map_or(Color::BLACK, Color::text_on);
            let style = Type { color: ink, ..Type::of(TICK_SIZE).anchored(Anchor::Middle) };
            let middle = [rect.x + rect.width / 2.0, rect.y + rect.height / 2.0];
            svg.text([middle[0], middle[1] + 0.36 * TICK_SIZE], &cell.text, style);
        }
    }
}

impl Panel for HeatMap {
    fn margins(&self, width: f64, _height: f64) -> Margins {
        Margins {
            left: 1.3 * LABEL_SIZE + GAP + self.row_names_width() + GAP,
            right: GAP,
            top: legend::height(&self.title, &self.entries(), width).max(GAP),
            bottom: GAP + TICK_SIZE + GAP + 1.3 * LABEL_SIZE,
        }
    }

    fn draw(&self, svg: &mut Svg, area: Rect) {
        let width = area.width / self.columns.len() as f64;
        let height = area.height / self.rows.len() as f64;
        for (i, row) in self.cells.chunks(self.columns.len()).enumerate() {
            for (j, cell) in row.iter().enumerate() {
                let (x, y) = (area.x + j as f64 * width, area.y + i as f64 * height);
                self.draw_cell(svg, Rect { x, y, width, height }, cell);
            }
        }
        let style = Type::of(TICK_SIZE);
        for (i, name) in self.rows.iter().enumerate() {
            let y = area.y + (i as f64 + 0.5) * height + 0.36 * TICK_SIZE;
            svg.text([area.x - GAP, y], name, style.anchored(Anchor::End));
        }
        let base = area.bottom() + GAP + 0.75 * TICK_SIZE;
        for j in visible_names(&self.columns, width) {
            let x = area.x + (j as f64 + 0.5) * width;
            svg.text([x, base], &self.columns[j], style.anchored(Anchor::Middle));
        }
        let style = Type::of(LABEL_SIZE).anchored(Anchor::Middle);
        let middle = [area.x + area.width / 2.0, area.y + area.height / 2.0];
        svg.text([middle[0], base + GAP + LABEL_SIZE], &self.column_label, style);
        let x = area.x - GAP - self.row_names_width() - GAP - 0.3 * LABEL_SIZE;
        svg.text([x, middle[1]], &self.row_label, Type { upward: true, ..style });
        legend::draw(svg, area, &self.title, &self.entries());
    }
}

/// Selects every k-th column name, so that the names do not overlap.
fn visible_names(names: &[String], width: f64) -> impl Iterator<Item = usize> {
    let widest = names.iter().map(|name| text::width(name, TICK_SIZE)).fold(0.0, f64::max);
    let stride = ((widest + GAP) / width).ceil().max(1.0);
    (0..names.len()).step_by(stride as usize)
}

//! Grids of cells, each of one category and with a text of its own.

use super::colour::Colour;
use super::figure::{LABEL_SIZE, Margins, Panel, TICK_SIZE};
use super::legend::{self, Entry, Key};
use super::place::Rect;
use super::svg::{Anchor, Stroke, Svg, Type};
use super::text;

/// What one cell says.
#[derive(Debug, Clone, Default)]
pub struct Cell {
    /// Index into the categories; an empty cell if `None`.
    pub category: Option<usize>,
    /// Written in it, where it fits.
    pub text: String,
}

/// A grid of cells with named rows and columns.
#[derive(Debug, Clone, Default)]
pub struct HeatMap {
    /// Above the plot; none if empty.
    pub title: String,
    /// What the columns vary, below the grid.
    pub column_label: String,
    /// One name per column.
    pub columns: Vec<String>,
    /// What the rows vary, beside the grid.
    pub row_label: String,
    /// One name per row, from the top.
    pub rows: Vec<String>,
    /// The cells, row by row.
    pub cells: Vec<Cell>,
    /// Names and colours of the categories.
    pub categories: Vec<(String, Colour)>,
}

const GAP: f64 = 3.0;

impl HeatMap {
    fn entries(&self) -> Vec<Entry<'_>> {
        let categories = self.categories.iter();
        categories
            .map(|(name, colour)| Entry {
                name,
                key: Key::Square(*colour),
            })
            .collect()
    }

    fn row_names_width(&self) -> f64 {
        self.rows
            .iter()
            .map(|name| text::width(name, TICK_SIZE))
            .fold(0.0, f64::max)
    }

    fn draw_cell(&self, svg: &mut Svg, rect: Rect, cell: &Cell) {
        let colour = cell.category.map(|category| self.categories[category].1);
        svg.rect(rect, Some(colour.unwrap_or(Colour::PALE)), None);
        svg.rect(rect, None, Some(Stroke::solid(Colour::WHITE, 0.6)));
        let fits = text::width(&cell.text, TICK_SIZE) < rect.width && TICK_SIZE < rect.height;
        if fits && !cell.text.is_empty() {
            let ink = colour.map_or(Colour::BLACK, Colour::text_on);
            let style = Type {
                colour: ink,
                ..Type::of(TICK_SIZE).anchored(Anchor::Middle)
            };
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
                self.draw_cell(
                    svg,
                    Rect {
                        x,
                        y,
                        width,
                        height,
                    },
                    cell,
                );
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
        svg.text(
            [middle[0], base + GAP + LABEL_SIZE],
            &self.column_label,
            style,
        );
        let x = area.x - GAP - self.row_names_width() - GAP - 0.3 * LABEL_SIZE;
        svg.text(
            [x, middle[1]],
            &self.row_label,
            Type {
                upwards: true,
                ..style
            },
        );
        legend::draw(svg, area, &self.title, &self.entries());
    }
}

/// Every k-th column, so that names do not touch.
fn visible_names(names: &[String], width: f64) -> impl Iterator<Item = usize> {
    let widest = names
        .iter()
        .map(|name| text::width(name, TICK_SIZE))
        .fold(0.0, f64::max);
    let stride = ((widest + GAP) / width).ceil().max(1.0);
    (0..names.len()).step_by(stride as usize)
}

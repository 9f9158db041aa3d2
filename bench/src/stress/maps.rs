//! Heat maps: a page for each pair of factors, a panel for each formulation.

use std::path::Path;

use super::Row;
use super::cell::Cell;
use super::plan::{Factor, homes};
use super::verdict::Verdict;
use myovib_report::plot::heat_map::Cell as MapCell;
use myovib_report::plot::{Colour, Figure, HeatMap, Panel};
use myovib_scene::atomic_file;

fn colour(verdict: Verdict) -> Colour {
    match verdict {
        Verdict::Ok => Colour::GREEN,
        Verdict::Wrong => Colour::BLACK,
        Verdict::Unverified => Colour::YELLOW,
        Verdict::Stopped => Colour::VERMILION,
    }
}

/// Writes `map-<rows>-<columns>.svg` for each plane of which at least four cells were computed.
pub(super) fn write_all(rows: &[Row], folder: &Path) -> anyhow::Result<()> {
    for (i, first) in Factor::ALL.into_iter().enumerate() {
        for &second in &Factor::ALL[i + 1..] {
            let panels: Vec<Box<dyn Panel>> = homes()
                .iter()
                .filter_map(|home| panel(home, first, second, rows))
                .map(|panel| Box::new(panel) as Box<dyn Panel>)
                .collect();
            if panels.is_empty() {
                continue;
            }
            let figure = Figure {
                width_mm: 170.0,
                n_columns: 2,
                panel_height_mm: 40.0,
                ..Figure::column(
                    format!("Stress matrix: {} and {}", first.name(), second.name()),
                    panels,
                )
            };
            let path = folder.join(format!("map-{}-{}.svg", first.name(), second.name()));
            let svg = figure.render();
            atomic_file::save(&path, svg)?;
        }
    }
    Ok(())
}

/// The plane through `home`, if at least two rows and two columns have cells.
fn panel(home: &Cell, down: Factor, across: Factor, rows: &[Row]) -> Option<HeatMap> {
    let computed = |cell: &Cell| rows.iter().find(|row| row.cell == *cell);
    let lines: Vec<Vec<Cell>> = down
        .variants(home)
        .iter()
        .map(|variant| across.variants(variant))
        .filter(|line| line.iter().any(|cell| computed(cell).is_some()))
        .collect();
    let columns: Vec<Cell> = across
        .variants(home)
        .into_iter()
        .filter(|column| {
            let value = across.value(column);
            let of_column = lines.iter().flatten().filter(|c| across.value(c) == value);
            of_column.into_iter().any(|cell| computed(cell).is_some())
        })
        .collect();
    if lines.len() < 2 || columns.len() < 2 {
        return None;
    }
    let at = |line: &Vec<Cell>, column: &Cell| {
        let value = across.value(column);
        let cell = line.iter().find(|cell| across.value(cell) == value);
        cell.and_then(computed).map_or_else(MapCell::default, shown)
    };
    Some(HeatMap {
        title: home.formulation.name().to_owned(),
        column_label: across.name().to_owned(),
        columns: columns.iter().map(|cell| across.value(cell)).collect(),
        row_label: down.name().to_owned(),
        rows: lines.iter().map(|line| down.value(&line[0])).collect(),
        cells: lines
            .iter()
            .flat_map(|line| columns.iter().map(move |column| at(line, column)))
            .collect(),
        categories: Verdict::ALL
            .map(|verdict| (verdict.name().to_owned(), colour(verdict)))
            .into(),
    })
}

/// Decimal digits of u_y where they are known, else the time reached.
fn shown(row: &Row) -> MapCell {
    let text = match (row.verdict, row.errors.error_u_y) {
        (Verdict::Ok | Verdict::Wrong, Some(error)) => format!("{:.1}", -error.log10()),
        (Verdict::Stopped, _) => format!("t={:.1}", row.measured.t_reached),
        _ => String::new(),
    };
    MapCell {
        category: Verdict::ALL.iter().position(|v| *v == row.verdict),
        text,
    }
}

//! Text tables with aligned columns. They are colored on terminals that support it.

use std::env;
use std::io::{self, IsTerminal};

use myovib_scene::{escape, plain};

/// Color of a cell on a terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    Plain,
    /// Tone for headings.
    Strong,
    /// Tone for expected results.
    Good,
    /// Tone for unexpected results.
    Bad,
}

impl Tone {
    fn escape(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Strong => "\x1b[1m",
            Self::Good => "\x1b[32m",
            Self::Bad => "\x1b[31m",
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    text: String,
    tone: Tone,
}

impl Cell {
    /// Creates a cell. Control characters are escaped.
    pub fn new(text: impl Into<String>, tone: Tone) -> Self {
        Self { text: plain(&text.into()), tone }
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self::new(text, Tone::Plain)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// Alignment of words.
    Left,
    Right,
}

/// A text table with headings.
///
/// # Examples
/// ```
/// use myovib_report::table::{Align, Table};
/// let mut table = Table::new(&[("row", Align::Left), ("steps", Align::Right)]);
/// table.row(["1".into(), "3275".into()]);
/// assert_eq!(table.render(false), "row  steps\n───  ─────\n1     3275\n");
/// ```
#[derive(Debug, Clone)]
pub struct Table {
    columns: Vec<(String, Align)>,
    rows: Vec<Vec<Cell>>,
}

impl Table {
    /// Creates a table without rows.
    pub fn new(columns: &[(&str, Align)]) -> Self {
        let columns = columns.iter().map(|&(name, align)| (name.to_owned(), align)).collect();
        Self { columns, rows: Vec::new() }
    }

    /// Adds a row.
    ///
    /// # Panics
    /// Panics if the number of cells differs from the number of columns.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        let cells: Vec<Cell> = cells.into_iter().collect();
        assert_eq!(cells.len(), self.columns.len(), "one cell per column");
        self.rows.push(cells);
    }

    /// Renders the table as text, with terminal colors if `colored` is true.
    pub fn render(&self, colored: bool) -> String {
        let widths: Vec<usize> = self
            .columns
            .iter()
            .enumerate()
            .map(|(j, (name, _))| {
                let widest = self.rows.iter().map(|row| width(&row[j].text)).max();
                width(name).max(widest.unwrap_or(0))
            })
            .collect();
        let heading = self.columns.iter().map(|(name, _)| Cell::new(name.clone(), Tone::Strong));
        let rule = widths.iter().map(|&w| Cell::from("─".repeat(w)));
        let mut text = self.line(&heading.collect::<Vec<_>>(), &widths, colored);
        text += &self.line(&rule.collect::<Vec<_>>(), &widths, colored);
        for row in &self.rows {
            text += &self.line(row, &widths, colored);
        }
        text
    }

    pub fn html(&self) -> String {
        let class = |align: Align| match align {
            Align::Left => "",
            Align::Right => " class=\"n\"",
        };
        let row = |tag: &str, texts: &mut dyn Iterator<Item = &str>| {
            let cells = texts.zip(&self.columns).map(|(text, (_, align))| {
                format!("<{tag}{}>{}</{tag}>", class(*align), escape(text))
            });
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        let heading = row("th", &mut self.columns.iter().map(|(name, _)| name.as_str()));
        let rows = self.rows.iter();
        let rows = rows.map(|cells| row("td", &mut cells.iter().map(|cell| cell.text.as_str())));
        format!("<table>\n{heading}{}</table>\n", rows.collect::<String>())
    }

    fn line(&self, cells: &[Cell], widths: &[usize], colored: bool) -> String {
        let padded = cells.iter().zip(widths).zip(&self.columns).map(|((cell, &w), (_, align))| {
            let space = " ".repeat(w - width(&cell.text));
            let text = paint(&cell.text, cell.tone, colored);
            match align {
                Align::Left => text + &space,
                Align::Right => space + &text,
            }
        });
        let line = padded.collect::<Vec<_>>().join("  ");
        format!("{}\n", line.trim_end())
    }
}

/// Colors the text by its tone if `colored` is true.
pub fn paint(text: &str, tone: Tone, colored: bool) -> String {
    if colored && tone != Tone::Plain {
        format!("{}{text}\x1b[0m", tone.escape())
    } else {
        text.to_owned()
    }
}

/// Returns three cells: a published count, our count, and their ratio.
///
/// The ratio is `–` if the published count is missing or zero.
pub fn compared(paper: Option<u64>, ours: u64) -> [Cell; 3] {
    let dash = || "–".to_owned();
    let ratio = match paper {
        Some(count) if count > 0 => format!("{:.2}", ours as f64 / count as f64),
        _ => dash(),
    };
    [
        paper.map_or_else(dash, |count| count.to_string()).into(),
        ours.to_string().into(),
        ratio.into(),
    ]
}

/// Formats a bulk modulus.
pub fn kappa(value: f64) -> String {
    if value.is_infinite() { "∞".into() } else { exponent(value) }
}

/// Formats a parameter in scientific notation; zero is formatted as 0.
pub fn exponent(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:e}") }
}

/// Returns whether standard output is colored. This requires a terminal, and `NO_COLOR` must be unset or empty.
pub fn colored_stdout() -> bool {
    io::stdout().is_terminal() && env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// Returns the number of columns that a text occupies on a terminal. The text must not contain combining or wide
/// characters.
fn width(text: &str) -> usize {
    text.chars().count()
}

/// Formats a number with the singular or plural of a noun: `1 run`, `2 runs`.
pub fn counted(number: impl std::fmt::Display, what: &str) -> String {
    match number.to_string().as_str() {
        "1" => format!("1 {what}"),
        number => format!("{number} {what}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_align_by_characters_not_bytes() {
        let mut table = Table::new(&[("κ", Align::Left), ("n", Align::Right)]);
        table.row(["∞".into(), "1".into()]);
        table.row(["1e5".into(), "12".into()]);
        assert_eq!(table.render(false), "κ     n\n───  ──\n∞     1\n1e5  12\n");
    }

    #[test]
    fn names_are_escaped_in_html() {
        let mut table = Table::new(&[("a<b", Align::Left), ("n", Align::Right)]);
        table.row(["<i>".into(), "1".into()]);
        let rows = "<tr><th>a&lt;b</th><th class=\"n\">n</th></tr>\n<tr><td>&lt;i&gt;</td><td class=\"n\">1</td></tr>\n";
        assert_eq!(table.html(), format!("<table>\n{rows}</table>\n"));
    }

    #[test]
    fn colors_do_not_count_as_width() {
        let mut table = Table::new(&[("outcome", Align::Right)]);
        table.row([Cell::new("ok", Tone::Good)]);
        assert!(table.render(true).ends_with("     \x1b[32mok\x1b[0m\n"));
        assert!(!table.render(false).contains('\x1b'));
    }

    #[test]
    fn ratios_require_a_positive_count() {
        let texts = |cells: [Cell; 3]| cells.map(|cell| cell.text);
        assert_eq!(texts(compared(Some(400), 500)), ["400", "500", "1.25"]);
        assert_eq!(texts(compared(Some(0), 3)), ["0", "3", "–"]);
        assert_eq!(texts(compared(None, 3)), ["–", "3", "–"]);
    }

    #[test]
    fn counts_have_singular_and_plural() {
        assert_eq!([counted(1, "run"), counted(0, "run")], ["1 run", "0 runs"]);
    }
}

//! Fills the tables of the guide from records of measurements.
//!
//! A comment in a page defines the source of a table:
//!
//! ```text
//! <!-- record 2026-11-21/rows.json /runs
//! row = row
//! CPU s = cpu_seconds .2
//! only = linear_solver condensed
//! -->
//! | row | CPU s |
//! …
//! <!-- end -->
//! ```
//!
//! The first line contains the file of a record and the path to a list in this file. Each further line defines a column
//! by its heading, a key of the entries (with `/` for nested objects), and a format. `.2` prints two decimals, `e1`
//! prints scientific notation with one decimal, and `%1` prints a percentage with one decimal. Without a format, values
//! are printed unchanged, and the items of a list are separated by commas. `only` selects the entries that have the
//! given value, and may be repeated.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use myovib_cli::exit::Exit;
use serde_json::Value;

/// Fill the tables of the guide from records, or check them
#[derive(Debug, Args)]
pub(crate) struct PagesArgs {
    /// Folder of the records
    #[arg(long, default_value = "data/bench", value_name = "DIR")]
    record: PathBuf,
    /// Folder of the pages
    #[arg(long, default_value = "docs/src", value_name = "DIR")]
    pages: PathBuf,
    /// Only check; fail if a page differs from its record
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(args: &PagesArgs) -> anyhow::Result<Exit> {
    let mut differ = false;
    for entry in fs::read_dir(&args.pages)? {
        let path = entry?.path();
        if path.extension().is_none_or(|extension| extension != "md") {
            continue;
        }
        let old = fs::read_to_string(&path)?;
        let new = filled(&old, &args.record).with_context(|| path.display().to_string())?;
        if new != old {
            differ = true;
            if args.check {
                eprintln!("{}: the tables differ from the record", path.display());
            } else {
                fs::write(&path, new)?;
                println!("{}", path.display());
            }
        }
    }
    Ok(if differ && args.check { Exit::Differs } else { Exit::Done })
}

/// Fills the tables of a page.
fn filled(page: &str, record: &Path) -> anyhow::Result<String> {
    const OPEN: &str = "<!-- record ";
    const CLOSE: &str = "<!-- end -->";
    let (mut out, mut rest) = (String::new(), page);
    while let Some(start) = rest.find(OPEN) {
        let (before, from) = rest.split_at(start);
        let (order, _) = from.split_once("-->").context("a comment has no end")?;
        let end = from.find(CLOSE).context("a table has no <!-- end -->")?;
        let table = Table::parse(&order[OPEN.len()..])?.text(record)?;
        write!(out, "{before}{order}-->\n{table}{CLOSE}")?;
        rest = &from[end + CLOSE.len()..];
    }
    Ok(out + rest)
}

struct Table<'a> {
    file: &'a str,
    list: &'a str,
    columns: Vec<Column<'a>>,
    /// Keys and the values that selected entries must have.
    only: Vec<(&'a str, &'a str)>,
}

struct Column<'a> {
    head: &'a str,
    key: &'a str,
    format: &'a str,
}

impl<'a> Table<'a> {
    fn parse(order: &'a str) -> anyhow::Result<Self> {
        let mut lines = order.lines();
        let first = lines.next().unwrap_or_default();
        let (file, list) = first.trim().split_once(' ').context("file and list are missing")?;
        let (mut columns, mut only) = (Vec::new(), Vec::new());
        for line in lines.filter(|line| !line.trim().is_empty()) {
            let (head, source) =
                line.split_once(" = ").with_context(|| format!("invalid column: {line}"))?;
            let (key, format) = source.trim().split_once(' ').unwrap_or((source.trim(), ""));
            match head {
                "only" => only.push((key, format)),
                _ => columns.push(Column { head, key, format }),
            }
        }
        Ok(Self { file, list, columns, only })
    }

    fn text(&self, record: &Path) -> anyhow::Result<String> {
        let path = record.join(self.file);
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let document: Value = serde_json::from_str(&text)?;
        let entries = document
            .pointer(self.list.trim_end_matches('/'))
            .and_then(Value::as_array)
            .with_context(|| format!("{} has no list {}", self.file, self.list))?;
        let mut out = String::new();
        let heads: Vec<_> = self.columns.iter().map(|column| column.head).collect();
        writeln!(out, "| {} |", heads.join(" | "))?;
        writeln!(out, "|{}", "---|".repeat(heads.len()))?;
        for entry in entries.iter().filter(|entry| self.keeps(entry)) {
            let cells: anyhow::Result<Vec<_>> =
                self.columns.iter().map(|column| column.cell(entry)).collect();
            writeln!(out, "| {} |", cells?.join(" | "))?;
        }
        Ok(out)
    }

    fn keeps(&self, entry: &Value) -> bool {
        let has = |(key, value): &(&str, &str)| plain(at(entry, key)) == *value;
        self.only.iter().all(has)
    }
}

impl Column<'_> {
    fn cell(&self, entry: &Value) -> anyhow::Result<String> {
        let value = at(entry, self.key);
        let Some(number) = value.as_f64().filter(|_| !self.format.is_empty()) else {
            return Ok(plain(value));
        };
        let (kind, digits) = self.format.split_at(1);
        let digits: usize = digits.parse().with_context(|| format!("format {}", self.format))?;
        Ok(match kind {
            "." => format!("{number:.digits$}"),
            "e" => format!("{number:.digits$e}"),
            "%" => format!("{:+.digits$} %", 100.0 * number),
            _ => bail!("format {}: must be .N, eN or %N", self.format),
        })
    }
}

fn at<'v>(entry: &'v Value, key: &str) -> &'v Value {
    entry.pointer(&format!("/{key}")).unwrap_or(&Value::Null)
}

fn plain(value: &Value) -> String {
    match value {
        Value::Null => "–".into(),
        Value::String(text) => text.clone(),
        Value::Array(entries) => entries.iter().map(plain).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "before\n<!-- record 2026/r.json /runs\nrow = row\nCPU s = cpu .1\nmore = more %0\nonly = kind a\n-->\nold\n<!-- end -->\nafter\n";

    #[test]
    fn filling_a_table_is_idempotent() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("2026")).unwrap();
        let record = r#"{"runs":[{"row":["1","m"],"cpu":0.25,"more":0.014,"kind":"a"},{"row":"2","kind":"b"}]}"#;
        fs::write(folder.path().join("2026/r.json"), record).unwrap();
        let page = filled(PAGE, folder.path()).unwrap();
        assert!(page.contains(
            "| row | CPU s | more |\n|---|---|---|\n| 1, m | 0.2 | +1 % |\n<!-- end -->\nafter"
        ));
        assert!(!page.contains("old") && page.starts_with("before"));
        assert_eq!(filled(&page, folder.path()).unwrap(), page);
    }

    fn root() -> &'static Path {
        Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
    }

    /// Returns the anchors of the headings on a page, as GitHub and mdbook generate them.
    fn anchors(page: &str) -> Vec<String> {
        let headings = page.lines().filter(|line| line.starts_with('#'));
        let anchor = |line: &str| {
            let words = line.trim_start_matches('#').trim().to_lowercase();
            let kept = words.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            kept.collect::<String>().replace(' ', "-")
        };
        headings.map(anchor).collect()
    }

    /// Checks that links in the guide and the README refer to existing files and headings.
    #[test]
    fn links_have_targets() {
        let guide = fs::read_dir(root().join("docs/src")).unwrap();
        let mut pages: Vec<_> = guide.map(|entry| entry.unwrap().path()).collect();
        pages.retain(|page| page.extension().is_some_and(|extension| extension == "md"));
        pages.push(root().join("README.md"));
        let mut links = 0;
        for page in pages {
            let text = fs::read_to_string(&page).unwrap();
            for from in text.split("](").skip(1) {
                let link = from.split_once(')').unwrap().0;
                if link.starts_with("http") {
                    continue;
                }
                let (file, heading) = link.split_once('#').unwrap_or((link, ""));
                let target = match file {
                    "" => page.clone(),
                    file => page.with_file_name(file),
                };
                assert!(target.exists(), "{}: {link}", page.display());
                if !heading.is_empty() {
                    let there = anchors(&fs::read_to_string(&target).unwrap());
                    assert!(there.iter().any(|a| a == heading), "{}: {link}", page.display());
                }
                links += 1;
            }
        }
        assert!(links > 100, "{links} links");
    }

    /// Checks that the tables of the guide match the records that the repository contains.
    #[test]
    fn the_tables_of_the_guide_match_the_records() {
        let root = root();
        let args = PagesArgs {
            record: root.join("data/bench"),
            pages: root.join("docs/src"),
            check: true,
        };
        assert_eq!(run(&args).unwrap(), Exit::Done, "run `myovib-bench pages` to update the guide");
    }
}

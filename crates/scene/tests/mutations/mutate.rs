//! Mutations of texts, by lines, numbers and bytes.

use rand::Rng;

/// Numbers that often break readers: ends of ranges, non-finite values, invalid numbers, huge
/// counts.
const NASTY: [&str; 14] = [
    "0",
    "-0",
    "-1",
    "1e308",
    "1e-320",
    "1e999",
    "nan",
    "inf",
    "18446744073709551615",
    "-9223372036854775808",
    "4294967296",
    "0x",
    "1.5",
    "",
];

/// Returns a text of the corpus after one to eight mutations.
pub(crate) fn mutate(corpus: &[&str], random: &mut impl Rng) -> String {
    let pick = |random: &mut dyn rand::RngCore| corpus[random.random_range(0..corpus.len())];
    let mut text = pick(random).to_owned();
    for _ in 0..random.random_range(1..=8) {
        text = match random.random_range(0..7) {
            0 => drop_line(&text, random),
            1 => repeat_line(&text, random),
            2 => swap_lines(&text, random),
            3 | 4 => change_number(&text, random),
            5 => change_byte(&text, random),
            _ => splice(&text, pick(random), random),
        };
    }
    text
}

fn lines(text: &str) -> Vec<&str> {
    text.lines().collect()
}

fn drop_line(text: &str, random: &mut impl Rng) -> String {
    let mut lines = lines(text);
    if !lines.is_empty() {
        lines.remove(random.random_range(0..lines.len()));
    }
    lines.join("\n")
}

fn repeat_line(text: &str, random: &mut impl Rng) -> String {
    let mut lines = lines(text);
    if !lines.is_empty() {
        let line = lines[random.random_range(0..lines.len())];
        lines.insert(random.random_range(0..=lines.len()), line);
    }
    lines.join("\n")
}

fn swap_lines(text: &str, random: &mut impl Rng) -> String {
    let mut lines = lines(text);
    if !lines.is_empty() {
        let (a, b) = (random.random_range(0..lines.len()), random.random_range(0..lines.len()));
        lines.swap(a, b);
    }
    lines.join("\n")
}

/// Replaces a number in the text by one of [`NASTY`].
fn change_number(text: &str, random: &mut impl Rng) -> String {
    let starts: Vec<usize> = text
        .char_indices()
        .filter(|(i, c)| {
            let before = text[..*i].chars().next_back();
            c.is_ascii_digit() && !before.is_some_and(|b| b.is_ascii_alphanumeric() || b == '.')
        })
        .map(|(i, _)| i)
        .collect();
    if starts.is_empty() {
        return text.to_owned();
    }
    let start = starts[random.random_range(0..starts.len())];
    let is_part = |c: char| c.is_ascii_alphanumeric() || ".+-".contains(c);
    let length = text[start..].find(|c| !is_part(c)).unwrap_or(text.len() - start);
    let nasty = NASTY[random.random_range(0..NASTY.len())];
    format!("{}{nasty}{}", &text[..start], &text[start + length..])
}

/// Writes an arbitrary byte. As in the readers, invalid UTF-8 is replaced.
fn change_byte(text: &str, random: &mut impl Rng) -> String {
    let mut bytes = text.as_bytes().to_vec();
    if !bytes.is_empty() {
        let at = random.random_range(0..bytes.len());
        bytes[at] = random.random();
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Joins the beginning of one text with the end of another.
fn splice(text: &str, other: &str, random: &mut impl Rng) -> String {
    let (head, tail) = (lines(text), lines(other));
    let head = &head[..random.random_range(0..=head.len())];
    let tail = &tail[random.random_range(0..=tail.len())..];
    [head, tail].concat().join("\n")
}

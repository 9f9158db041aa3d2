//! Escaping of names and messages from scenes.

/// Escapes control characters and invisible characters, except for line breaks and tabs. Otherwise, text quoted from a
/// file could control a terminal or hide its content.
pub fn plain(text: &str) -> String {
    let spelled = |c: char| match c {
        '\n' | '\t' => vec![c],
        c if is_hidden(c) => c.escape_unicode().collect(),
        c => vec![c],
    };
    text.chars().flat_map(spelled).collect()
}

/// Escapes the characters of a JSON text that [`plain`] would escape. The values of the JSON strings do not change.
pub(crate) fn plain_json(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c == '\n' || !is_hidden(c) {
            true => escaped.push(c),
            false => {
                for unit in c.encode_utf16(&mut [0; 2]) {
                    escaped += &format!("\\u{unit:04x}");
                }
            }
        }
    }
    escaped
}

/// Decodes UTF-8.
///
/// # Errors
/// Returns the one-based number of the first line with invalid UTF-8.
pub(crate) fn utf8(bytes: Vec<u8>) -> Result<String, u64> {
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        1 + valid.iter().filter(|byte| **byte == b'\n').count() as u64
    })
}

fn is_hidden(c: char) -> bool {
    c.is_control() || is_invisible(c)
}

/// Returns whether a character changes the text direction or has no width. The joiners U+200C and U+200D are excluded
/// because several scripts require them.
fn is_invisible(c: char) -> bool {
    matches!(
        c,
        '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}'
    )
}

/// Escapes control characters and the reserved characters of XML and HTML.
pub fn escape(text: &str) -> String {
    plain(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: U+202E in a name reversed the rest of a message.
    #[test]
    fn characters_that_command_or_hide_are_escaped() {
        for (c, escaped) in [
            ('\u{1b}', "\\u{1b}"),
            ('\u{9b}', "\\u{9b}"),
            ('\u{202e}', "\\u{202e}"),
            ('\u{2066}', "\\u{2066}"),
            ('\u{200b}', "\\u{200b}"),
            ('\u{feff}', "\\u{feff}"),
            ('\u{e0041}', "\\u{e0041}"),
        ] {
            assert_eq!(plain(&format!("a{c}b")), format!("a{escaped}b"));
            assert_eq!(escape(&format!("{c}<")), format!("{escaped}&lt;"));
            let json = serde_json::to_string_pretty(&[c]).unwrap();
            assert!(!plain_json(&json).contains(c), "{escaped}");
            let read: [char; 1] = serde_json::from_str(&plain_json(&json)).unwrap();
            assert_eq!(read, [c]);
        }
        assert_eq!(plain("µ é 水 a\n\tb"), "µ é 水 a\n\tb");
    }
}

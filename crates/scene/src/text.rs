//! Escaping of names and messages from scenes.

/// The text with its control characters spelled out, but for line breaks: what a file quotes must
/// not command a terminal.
pub fn plain(text: &str) -> String {
    let spelled = |c: char| match c {
        '\n' => vec![c],
        c if c.is_control() => c.escape_default().collect(),
        c => vec![c],
    };
    text.chars().flat_map(spelled).collect()
}

/// Escapes the reserved characters of XML and HTML and control characters.
pub fn escape(text: &str) -> String {
    plain(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

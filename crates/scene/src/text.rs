//! Names and messages from scenes, made safe for where they are shown.

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

/// The text with the characters replaced that XML and HTML reserve, and those that command terminals.
pub fn escape(text: &str) -> String {
    plain(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

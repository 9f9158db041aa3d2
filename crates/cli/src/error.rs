//! Formatting of errors.

use myovib_scene::plain;

/// Formats an error as `error: …`, followed by its causes, one per line. Omits a cause if the previous message already
/// ends with it.
pub fn render(failure: &anyhow::Error) -> String {
    let mut reported = plain(&failure.to_string());
    let mut text = format!("error: {reported}\n");
    for cause in failure.chain().skip(1).map(|cause| plain(&cause.to_string())) {
        if !reported.ends_with(&cause) {
            text.push_str(&format!("{:>8}: {cause}\n", "cause"));
        }
        reported = cause;
    }
    text
}

#[cfg(test)]
mod tests {
    use std::io;

    use anyhow::Context;

    use super::*;

    #[test]
    fn causes_follow_the_message() {
        let failure = Err::<(), _>(io::Error::other("disk on fire"))
            .context("cannot write `a.csv`")
            .unwrap_err();
        assert_eq!(render(&failure), "error: cannot write `a.csv`\n   cause: disk on fire\n");
    }

    #[test]
    fn causes_contained_in_a_message_are_not_repeated() {
        let failure = Err::<(), _>(io::Error::other("disk on fire"))
            .context("cannot write `a.csv`: disk on fire")
            .unwrap_err();
        assert_eq!(render(&failure), "error: cannot write `a.csv`: disk on fire\n");
    }
}

//! How a failure is printed.

use std::io;

use myovib_scene::plain;

/// The failure as it is printed: `error: …`, then its causes, one a line, but for those that the
/// line before has told already.
pub fn render(failure: &anyhow::Error) -> String {
    let mut told = plain(&failure.to_string());
    let mut text = format!("error: {told}\n");
    for cause in failure
        .chain()
        .skip(1)
        .map(|cause| plain(&cause.to_string()))
    {
        if !told.ends_with(&cause) {
            text.push_str(&format!("{:>8}: {cause}\n", "cause"));
        }
        told = cause;
    }
    text
}

/// Whether the reader of our standard output has gone, as `myovib … | head` does: no failure.
pub fn is_broken_pipe(failure: &anyhow::Error) -> bool {
    failure
        .downcast_ref::<io::Error>()
        .is_some_and(|e| e.kind() == io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use anyhow::Context;

    use super::*;

    #[test]
    fn causes_follow_the_message() {
        let failure = Err::<(), _>(io::Error::other("disk on fire"))
            .context("cannot write `a.csv`")
            .unwrap_err();
        assert_eq!(
            render(&failure),
            "error: cannot write `a.csv`\n   cause: disk on fire\n"
        );
    }

    #[test]
    fn what_a_message_tells_is_not_told_again() {
        let failure = Err::<(), _>(io::Error::other("disk on fire"))
            .context("cannot write `a.csv`: disk on fire")
            .unwrap_err();
        assert_eq!(
            render(&failure),
            "error: cannot write `a.csv`: disk on fire\n"
        );
    }

    #[test]
    fn only_a_broken_pipe_is_silent() {
        let broken = anyhow::Error::from(io::Error::from(io::ErrorKind::BrokenPipe));
        let denied = anyhow::Error::from(io::Error::from(io::ErrorKind::PermissionDenied));
        assert!(is_broken_pipe(&broken) && !is_broken_pipe(&denied));
    }
}

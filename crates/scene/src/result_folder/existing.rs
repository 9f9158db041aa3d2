//! Treatment of a folder that contains earlier results.

/// Treatment of earlier results in the folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Keep the earlier results and refuse to write.
    Refuse,
    /// Remove the files that the earlier command created.
    Overwrite,
    /// Continue the earlier command.
    Resume,
    /// Add files to the earlier results. A file of the same name is replaced if the same command created it.
    Add,
}

impl Existing {
    /// Returns the treatment for the options `--resume` and `--overwrite`, which are mutually exclusive.
    pub fn of(resume: bool, overwrite: bool) -> Self {
        match (resume, overwrite) {
            (true, _) => Self::Resume,
            (_, true) => Self::Overwrite,
            _ => Self::Refuse,
        }
    }
}

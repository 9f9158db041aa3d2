//! How the update of a front is kept: what its rows and columns beyond the pivots add to the parent.

use crate::Kind;

/// Columns that are kept together: wide enough for full speed of products, narrow enough to waste little
/// above the diagonal of a symmetric front.
pub(super) const CHUNK: usize = 128;

/// Columns that are computed and shared among threads together: of matrices that are not symmetric
/// more, as nothing is wasted and the rows of L are read less often.
pub(super) fn chunk_width(kind: Kind) -> usize {
    match kind {
        Kind::General => 2 * CHUNK,
        Kind::Symmetric => CHUNK,
    }
}

/// An update of `r` rows and columns, column-major; of a symmetric one, each chunk of columns begins
/// at its own diagonal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    pub(super) r: usize,
    pub(super) kind: Kind,
}

impl Layout {
    /// Entries kept.
    pub(super) fn n_entries(self) -> usize {
        self.start(self.r / CHUNK)
            + self.r % CHUNK * (self.r - self.first_row(self.r / CHUNK * CHUNK))
    }

    /// Where chunk number `i` begins.
    #[inline(always)]
    fn start(self, i: usize) -> usize {
        let above = match self.kind {
            Kind::General => 0,
            Kind::Symmetric => CHUNK * (i * i.saturating_sub(1) / 2),
        };
        CHUNK * (i * self.r - above)
    }

    /// The first row that is kept of the chunk from column `first` on.
    #[inline(always)]
    pub(super) fn first_row(self, first: usize) -> usize {
        match self.kind {
            Kind::General => 0,
            Kind::Symmetric => first,
        }
    }

    /// Column `j` of an update, and its first row.
    #[inline(always)]
    pub(super) fn column<T>(self, update: &[T], j: usize) -> (&[T], usize) {
        let row = self.first_row(j - j % CHUNK);
        let rows = self.r - row;
        (
            &update[self.start(j / CHUNK) + j % CHUNK * rows..][..rows],
            row,
        )
    }

    /// The chunks of an update, each with its first column.
    #[inline(always)]
    pub(super) fn chunks<T>(self, update: &mut [T]) -> impl Iterator<Item = (usize, &mut [T])> {
        let mut rest = update;
        let wide = chunk_width(self.kind);
        (0..self.r).step_by(wide).map(move |first| {
            let width = wide.min(self.r - first);
            let (chunk, beyond) =
                std::mem::take(&mut rest).split_at_mut(width * (self.r - self.first_row(first)));
            rest = beyond;
            (first, chunk)
        })
    }
}

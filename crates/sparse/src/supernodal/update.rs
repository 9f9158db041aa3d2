//! Storage layout of the update of a front: the contribution of its rows and columns beyond the pivots to its parent.

use crate::Kind;

/// Number of columns stored together. It is large enough for fast products, and small enough to waste little
/// storage above the diagonal of a symmetric front.
pub(super) const CHUNK: usize = 128;

/// Returns the number of columns computed together and shared among threads. It is larger for unsymmetric
/// matrices, because they waste no storage, and the rows of L are then read less often.
pub(super) fn chunk_width(kind: Kind) -> usize {
    match kind {
        Kind::General => 2 * CHUNK,
        Kind::Symmetric => CHUNK,
    }
}

/// Update of `r` rows and columns in column-major order. For a symmetric matrix, each chunk of columns starts at its
/// diagonal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    pub(super) r: usize,
    pub(super) kind: Kind,
}

impl Layout {
    pub(super) fn n_entries(self) -> usize {
        self.start(self.r / CHUNK)
            + self.r % CHUNK * (self.r - self.first_row(self.r / CHUNK * CHUNK))
    }

    #[inline(always)]
    fn start(self, i: usize) -> usize {
        let above = match self.kind {
            Kind::General => 0,
            Kind::Symmetric => CHUNK * (i * i.saturating_sub(1) / 2),
        };
        CHUNK * (i * self.r - above)
    }

    /// Returns the first stored row of the chunk that starts at column `first`.
    #[inline(always)]
    pub(super) fn first_row(self, first: usize) -> usize {
        match self.kind {
            Kind::General => 0,
            Kind::Symmetric => first,
        }
    }

    /// Returns column `j` of an update, and its first stored row.
    #[inline(always)]
    pub(super) fn column<T>(self, update: &[T], j: usize) -> (&[T], usize) {
        let row = self.first_row(j - j % CHUNK);
        let rows = self.r - row;
        (&update[self.start(j / CHUNK) + j % CHUNK * rows..][..rows], row)
    }

    /// Returns the chunks of an update, each with its first column.
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

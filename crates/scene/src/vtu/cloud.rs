//! Values at positions other than nodes, as a series of files with one point per position.

use super::PLACES_LIST;
use super::data::{self, floats, integers};
use super::listing::Listing;
use crate::Error;
use crate::result_folder::ResultFolder;

/// VTK cell type of a single point.
const VERTEX: usize = 1;

/// Positions of several chains in the undeformed body, with one file for each output time.
#[derive(Debug)]
pub(crate) struct Cloud {
    pub(crate) listing: Listing,
    /// Zero-based chain index and coordinates of each position.
    places: Vec<(usize, [f64; 3])>,
}

impl Cloud {
    /// Creates a series. `done` contains the times of existing files.
    pub(crate) fn new(places: Vec<(usize, [f64; 3])>, done: &[f64]) -> Self {
        Self { listing: Listing::new(PLACES_LIST, done), places }
    }

    /// Writes the displacement and other named fields at all positions at time `t`.
    pub(crate) fn write(
        &mut self,
        folder: &ResultFolder,
        t: f64,
        displacement: impl Iterator<Item = [f64; 3]>,
        fields: Vec<(&str, Vec<f64>)>,
    ) -> Result<(), Error> {
        let n = self.places.len();
        let mut text = data::head(n, n);
        let points = self.places.iter().flat_map(|(_, point)| *point);
        text += &floats("points", &[], 3, points);
        text += "</Points>\n<Cells>\n";
        text += &integers("connectivity", 0..n);
        text += &integers("offsets", 1..=n);
        text += &integers("types", (0..n).map(|_| VERTEX));
        text += "</Cells>\n<PointData>\n";
        text += &integers("chain", self.places.iter().map(|(chain, _)| *chain));
        text += &floats("u", &["x", "y", "z"], 3, displacement.flatten());
        for (name, values) in fields {
            text += &floats(name, &[], 1, values.into_iter());
        }
        text += "</PointData>\n";
        self.listing.add(folder, t, &(text + data::END))
    }
}

//! Coherence of all places within a radius.

use std::collections::HashMap;

use crate::coherence::{Coherence, mean};
use crate::error::Error;

/// Relative tolerance for rounding errors of coordinates, so that a place exactly at the radius is included.
const SLACK: f64 = 1e-9;

/// The neighborhood of each place: all places within a radius.
///
/// The coherence of the neighborhood of place i is `|1/n Σ χ_j|`. The sum extends over the n places j within the
/// radius, including i itself. If all places have the same number of oscillators, this is |χ| of all oscillators
/// at the n places. With one oscillator per place, the coherence of each place is always 1, and only the coherence
/// of a neighborhood is meaningful.
///
/// # Units
/// The radius has the unit of the places.
///
/// # Examples
/// ```
/// use myovib_oscillators::{Neighborhood, coherence_at};
/// # fn main() -> Result<(), myovib_oscillators::Error> {
/// let places = [[0.0; 3], [1.0, 0.0, 0.0], [5.0, 0.0, 0.0]];
/// let near = Neighborhood::new(places.to_vec(), 1.5)?;
/// let single = coherence_at(3, &[50.0; 3], &[1.0, -2.0, 1.0], &[0.0; 3]);
/// assert_eq!(near.coherence(&single), [0.0, 0.0, 1.0]);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Neighborhood {
    places: Vec<[f64; 3]>,
    radius: f64,
    /// Indices of the places in each cube of a grid. The side length of the cubes is the radius.
    cubes: HashMap<[i64; 3], Vec<usize>>,
}

impl Neighborhood {
    /// Creates the neighborhoods of `places`.
    ///
    /// # Errors
    /// Returns [`Error::Radius`] unless the radius is positive and finite.
    pub fn new(places: Vec<[f64; 3]>, radius: f64) -> Result<Self, Error> {
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(Error::Radius { value: radius });
        }
        let radius = radius * (1.0 + SLACK);
        let mut cubes: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for (number, place) in places.iter().enumerate() {
            cubes.entry(cube(*place, radius)).or_default().push(number);
        }
        Ok(Self { places, radius, cubes })
    }

    /// Returns the coherence of each neighborhood. `of_places` holds Ψ and χ of each place.
    ///
    /// # Panics
    /// Panics if the number of values differs from the number of places.
    pub fn coherence(&self, of_places: &[Coherence]) -> Vec<f64> {
        assert_eq!(of_places.len(), self.places.len(), "a χ for each place");
        let own = |place: &[f64; 3]| mean(self.near(*place).map(|j| of_places[j].phase)).norm();
        self.places.iter().map(own).collect()
    }

    /// Returns the places within the radius of a point.
    fn near(&self, point: [f64; 3]) -> impl Iterator<Item = usize> {
        let [i, j, k] = cube(point, self.radius);
        let around = |i: i64| i.saturating_sub(1)..=i.saturating_add(1);
        let cubes = around(i)
            .flat_map(move |i| around(j).flat_map(move |j| around(k).map(move |k| [i, j, k])));
        let candidates = cubes.filter_map(|cube| self.cubes.get(&cube)).flatten();
        candidates.copied().filter(move |&other| {
            let both = point.iter().zip(self.places[other]);
            let squared: f64 = both.map(|(x, y)| (x - y).powi(2)).sum();
            squared <= self.radius.powi(2)
        })
    }
}

/// Returns the cube that contains a point.
fn cube(point: [f64; 3], side: f64) -> [i64; 3] {
    point.map(|x| (x / side).floor() as i64)
}

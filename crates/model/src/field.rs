//! Blocks of unknowns and their positions in the integrator's vector.

use std::fmt;
use std::ops::Range;

/// A block of unknowns of the muscle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Field {
    /// q: coefficients of the displacement at the free nodes, m.
    Displacement,
    /// v: coefficients of the velocity, m/s.
    Velocity,
    /// λ: coefficients of the pressure, Pa.
    Pressure,
    /// μ of (29): coefficients of the pressure's rate, Pa/s.
    PressureRate,
    /// μ of (33): the multiplier of Gear, Gupta and Leimkuhler, zero in the exact solution.
    GglMultiplier,
    /// T: active tensions governed by activation models, Pa.
    Tension,
    /// Q: internal stresses of Prony terms at the quadrature points, Pa.
    InternalStress,
}

impl Field {
    /// Returns whether the block has one coefficient per free displacement component.
    pub(crate) fn is_displacement_like(self) -> bool {
        matches!(self, Self::Displacement | Self::Velocity)
    }

    /// Returns the name in scenes, output and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "u",
            Self::Velocity => "v",
            Self::Pressure => "p",
            Self::PressureRate | Self::GglMultiplier => "p_rate",
            Self::Tension => "tension",
            Self::InternalStress => "internal_stress",
        }
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Order and position of the blocks in the integrator's vector.
#[derive(Debug, Clone)]
pub struct Layout {
    blocks: Vec<(Field, Range<usize>)>,
}

impl Layout {
    /// Lays out `fields` one after another; `length` returns the number of coefficients of a field.
    pub fn new(fields: impl IntoIterator<Item = Field>, length: impl Fn(Field) -> usize) -> Self {
        let mut end = 0;
        let blocks = fields
            .into_iter()
            .map(|field| {
                let start = end;
                end += length(field);
                (field, start..end)
            })
            .collect();
        Self { blocks }
    }

    /// Returns the number of unknowns.
    pub fn n_unknowns(&self) -> usize {
        self.blocks.last().map_or(0, |(_, range)| range.end)
    }

    /// Returns the blocks in order.
    pub fn blocks(&self) -> &[(Field, Range<usize>)] {
        &self.blocks
    }

    /// Returns the range of `field`, or `None` if the formulation does not contain this field.
    pub fn range(&self, field: Field) -> Option<Range<usize>> {
        self.blocks.iter().find(|(f, _)| *f == field).map(|(_, range)| range.clone())
    }

    /// Returns the rows of the momentum balance, which are the rows of v.
    ///
    /// # Panics
    /// Panics if the formulation has no velocity.
    pub(crate) fn momentum(&self) -> Range<usize> {
        self.range(Field::Velocity).expect("the momentum balance is in the rows of v")
    }

    /// Returns the block that contains component `i`, and the position of the component within the block.
    ///
    /// # Panics
    /// Panics if `i` is not less than [`n_unknowns`](Layout::n_unknowns).
    pub fn locate(&self, i: usize) -> (Field, usize) {
        let (field, range) =
            self.blocks.iter().find(|(_, range)| range.contains(&i)).expect("i < n_unknowns");
        (*field, i - range.start)
    }

    /// Returns a vector with `value(field)` in every component of the block of `field`.
    pub fn fill<T: Clone>(&self, value: impl Fn(Field) -> T) -> Vec<T> {
        self.blocks
            .iter()
            .flat_map(|(field, range)| std::iter::repeat_n(value(*field), range.len()))
            .collect()
    }
}

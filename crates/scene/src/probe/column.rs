//! Physical quantities in the columns of probes.

use myovib_model::Quantity;

use super::ProbeKind;

/// Physical quantity that one or more columns contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ColumnKind {
    /// Prefix of the column names, such as `R` in `R_x`.
    pub name: &'static str,
    /// Units in two dimensions (per unit depth) and in three dimensions.
    units: [&'static str; 2],
}

impl ColumnKind {
    /// Creates a quantity with the given units in two and three dimensions.
    pub(super) const fn new(name: &'static str, units: [&'static str; 2]) -> Self {
        Self { name, units }
    }

    /// Returns the quantity of a column, or `None` if its name is unknown.
    pub fn of(column: &str) -> Option<Self> {
        let quantities = Quantity::ALL.iter();
        let quantities = quantities.map(|of| Self::new(of.prefix(), [of.unit(); 2]));
        let all = quantities.chain(ProbeKind::columns());
        let own = all.filter(|kind| {
            let rest = column.strip_prefix(kind.name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
        });
        // `principal_strain_1` starts with both `principal` and `principal_strain`.
        own.max_by_key(|kind| kind.name.len())
    }

    /// Returns the unit, or an empty string for a ratio.
    pub fn unit(self, is_in_space: bool) -> &'static str {
        self.units[usize::from(is_in_space)]
    }

    /// Returns whether two columns contain the same quantity.
    pub(crate) fn is_shared(a: &str, b: &str) -> bool {
        match (Self::of(a), Self::of(b)) {
            (None, None) => a == b,
            (a, b) => a == b,
        }
    }

    /// Returns the column names of the components along the axes.
    pub(super) fn components(self, dimension: usize) -> impl Iterator<Item = String> {
        let axes = ["x", "y", "z"].into_iter().take(dimension);
        axes.map(move |axis| format!("{}_{axis}", self.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_the_unit_of_their_quantity() {
        for (column, units) in [
            ("u_x", ["m"; 2]),
            ("u_x_17", ["m"; 2]),
            ("principal_1", ["Pa"; 2]),
            ("principal_strain_1", [""; 2]),
            ("von_mises", ["Pa"; 2]),
            ("R_y", ["N/m", "N"]),
            ("M_z", ["N", "N·m"]),
            ("V", ["m²", "m³"]),
            ("work", ["J/m", "J"]),
            ("Psi_arg", ["rad"; 2]),
        ] {
            let kind = ColumnKind::of(column).unwrap();
            assert_eq!([false, true].map(|in_space| kind.unit(in_space)), units, "{column}");
        }
        assert_eq!(ColumnKind::of("unknown"), None);
    }

    #[test]
    fn stresses_and_strains_are_different_quantities() {
        assert!(ColumnKind::is_shared("principal_1", "principal_3"));
        assert!(!ColumnKind::is_shared("principal_1", "principal_strain_1"));
        assert!(!ColumnKind::is_shared("gain_a", "gain_b"));
    }
}

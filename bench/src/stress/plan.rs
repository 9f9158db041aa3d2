//! Which cells: a quick subset, or all two-factor planes through the paper's point.

use std::collections::{HashMap, HashSet};

use myovib_model::{Formulation, paper};

use super::cell::{Cell, Multipliers, T_END};

/// What a plane varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Factor {
    Kappa,
    Beta,
    Tolerance,
    Order,
    Multipliers,
    Load,
    Level,
}

impl Factor {
    /// All; those whose cells take longest come last.
    pub(super) const ALL: [Self; 7] = [
        Self::Kappa,
        Self::Beta,
        Self::Tolerance,
        Self::Order,
        Self::Multipliers,
        Self::Load,
        Self::Level,
    ];

    /// The name in file names and on axes.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Kappa => "kappa",
            Self::Beta => "beta",
            Self::Tolerance => "rtol",
            Self::Load => "load",
            Self::Level => "level",
            Self::Order => "order",
            Self::Multipliers => "multipliers",
        }
    }

    /// The cells that differ from `cell` in this factor alone, and `cell`, in order.
    pub(super) fn variants(self, cell: &Cell) -> Vec<Cell> {
        let with = |change: &dyn Fn(&mut Cell)| {
            let mut variant = *cell;
            change(&mut variant);
            variant
        };
        let decades = |range: std::ops::RangeInclusive<i32>| range.map(|k| 10_f64.powi(k));
        let all: Vec<Cell> = match self {
            Self::Kappa => decades(3..=12)
                .chain([f64::INFINITY])
                .map(|kappa| with(&|c| c.physics.kappa = kappa))
                .collect(),
            Self::Beta => [0.0]
                .into_iter()
                .chain(decades(-8..=-1))
                .map(|beta| with(&|c| c.physics.beta = beta))
                .collect(),
            Self::Tolerance => decades(-8..=-2)
                .map(|rtol| with(&|c| c.rtol = rtol))
                .rev()
                .collect(),
            Self::Load => [1.0, 10.0, 100.0]
                .map(|load| with(&|c| c.physics.load = load))
                .into(),
            Self::Level => [0, 1]
                .map(|level| with(&|c| c.physics.level = level))
                .into(),
            Self::Order => [2, 5].map(|order| with(&|c| c.max_order = order)).into(),
            Self::Multipliers => Multipliers::ALL
                .map(|multipliers| with(&|c| c.multipliers = multipliers))
                .into(),
        };
        all.into_iter().filter(Cell::is_allowed).collect()
    }

    /// The value of this factor, for names of rows and columns.
    pub(super) fn value(self, cell: &Cell) -> String {
        let physics = &cell.physics;
        match self {
            Self::Kappa if physics.kappa.is_infinite() => "∞".to_owned(),
            Self::Kappa => format!("{:.0e}", physics.kappa),
            Self::Beta if physics.beta == 0.0 => "0".to_owned(),
            Self::Beta => format!("{:.0e}", physics.beta),
            Self::Tolerance => format!("{:.0e}", cell.rtol),
            Self::Load => format!("×{}", physics.load),
            Self::Level => physics.level.to_string(),
            Self::Order => cell.max_order.to_string(),
            Self::Multipliers => cell.multipliers.name().to_owned(),
        }
    }
}

/// The points through which planes are laid: the paper's, for each formulation.
pub(super) fn homes() -> Vec<Cell> {
    Formulation::ALL
        .into_iter()
        .map(|formulation| {
            let kappa = match formulation {
                Formulation::Stabilized => f64::INFINITY,
                _ => paper::KAPPA,
            };
            Cell::home(formulation, kappa)
        })
        .collect()
}

/// The union of all two-factor planes through the paper's points: first the lines through the points,
/// then plane by plane for all formulations, so that an interrupted matrix has whole planes.
pub(super) fn full() -> Vec<Cell> {
    let lines = homes()
        .into_iter()
        .flat_map(|home| Factor::ALL.map(|factor| factor.variants(&home)))
        .flatten();
    let planes = Factor::ALL.iter().enumerate().flat_map(|(j, second)| {
        let firsts = &Factor::ALL[..j];
        firsts.iter().flat_map(move |first| {
            homes().into_iter().flat_map(move |home| {
                let rows = first.variants(&home);
                rows.into_iter().flat_map(|row| second.variants(&row))
            })
        })
    });
    with_row_1(lines.chain(planes))
}

/// A subset that has every kind of failure in it.
pub(super) fn quick() -> Vec<Cell> {
    let mut cells = Vec::new();
    for formulation in Formulation::ALL {
        for kappa in [paper::KAPPA, f64::INFINITY] {
            let home = Cell::home(formulation, kappa);
            let tolerances = [1e-3, 1e-5].map(|rtol| Cell { rtol, ..home });
            let loads = |cell: &Cell| Factor::Load.variants(cell).into_iter().take(2);
            cells.extend(tolerances.iter().flat_map(loads));
            cells.extend(Factor::Load.variants(&home));
            cells.extend(Factor::Order.variants(&home));
        }
    }
    for formulation in [Formulation::Position, Formulation::Rate] {
        let stiff = [1e8, 1e12].map(|kappa| Cell::home(formulation, kappa));
        cells.extend(stiff);
        for rtol in [1e-3, 1e-6] {
            let home = Cell::home(formulation, f64::INFINITY);
            cells.extend(Factor::Multipliers.variants(&Cell { rtol, ..home }));
        }
    }
    for beta in [1e-6, 1e-2] {
        let mut damped = Cell::home(Formulation::Rate, f64::INFINITY);
        damped.physics.beta = beta;
        cells.extend(Factor::Order.variants(&damped));
    }
    for kappa in [paper::KAPPA, f64::INFINITY] {
        cells.extend(Factor::Level.variants(&Cell::home(Formulation::Position, kappa)));
    }
    with_row_1(cells)
}

/// Puts the run of row 1 that a cell is measured by before it; drops what is not allowed or twice.
fn with_row_1(cells: impl IntoIterator<Item = Cell>) -> Vec<Cell> {
    let mut seen = HashSet::new();
    cells
        .into_iter()
        .flat_map(|cell| [cell.row_1(), cell])
        .filter(|cell| cell.is_allowed() && seen.insert(cell.to_string()))
        .collect()
}

/// CPU seconds that `cells` and their trusted solutions may take on a machine of 2026, from a run of the
/// full matrix: steps of BDF grow like tol^(−1/(k+1)), creep at order 5 without damping and at a
/// hundred times the load; their cost grows with the mesh.
pub(super) fn estimate(cells: &[Cell], cap: f64) -> f64 {
    const PER_STEP: f64 = 3e-4;
    const TRUSTED: f64 = 2.0;
    let growth = |level: u8| 8_f64.powi(i32::from(level));
    let seconds = |cell: &Cell| {
        let order = f64::from(cell.max_order);
        let strained = cell.physics.load >= 100.0;
        let steps = if strained || (cell.max_order > 2 && cell.physics.beta < 1e-5) {
            25_000.0 * T_END
        } else {
            250.0 * T_END * (1e-3 / cell.rtol).powf(1.0 / (order + 1.0))
        };
        (PER_STEP * steps * growth(cell.physics.level)).min(cap)
    };
    let bodies: HashMap<String, u8> = cells
        .iter()
        .map(|cell| (cell.physics.to_string(), cell.physics.level))
        .collect();
    let trusted = bodies
        .values()
        .map(|level| (TRUSTED * growth(*level)).min(cap));
    cells.iter().map(seconds).sum::<f64>() + trusted.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_plan_has_at_least_sixty_cells_and_the_full_one_at_most_1500() {
        let (quick, full) = (quick(), full());
        assert!((60..=120).contains(&quick.len()), "{}", quick.len());
        assert!((500..=1500).contains(&full.len()), "{}", full.len());
        for cell in quick.iter().chain(&full) {
            let row = cell.row_1().to_string();
            assert!(cell.is_allowed(), "{cell}");
            assert!(
                full.iter().chain(&quick).any(|c| c.to_string() == row),
                "{row}"
            );
        }
    }

    #[test]
    fn variants_keep_all_other_factors() {
        for factor in Factor::ALL {
            for home in homes() {
                let variants = factor.variants(&home);
                assert!(variants.contains(&home), "{home}");
                for other in Factor::ALL.into_iter().filter(|f| *f != factor) {
                    let values = variants.iter().map(|c| other.value(c));
                    assert!(values.clone().all(|value| value == other.value(&home)));
                }
            }
        }
    }
}

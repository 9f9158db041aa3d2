//! The quantities of a body that can be read off it: an entry each of [`quantities`].

use myovib_fem::material::three::Tensor3;
use myovib_fem::{Located, Pressure};
use nalgebra::Matrix3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::measure::Snapshot;

/// What the components of a quantity are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Components {
    /// A number.
    Scalar,
    /// Along the axes of the body.
    Vector,
    /// Principal values, the largest first.
    Principal,
    /// Of a symmetric tensor: xx, yy, xy, zz in the plane, in space xx, yy, zz, xy, yz, xz.
    Symmetric,
}

/// What is known of a quantity.
struct Description {
    /// Its name in field files.
    label: &'static str,
    components: Components,
    /// The names of the components, in the plane and in space.
    columns: [&'static [&'static str]; 2],
    /// Whether det F, a strain or a stress must be computed for it.
    needs_state: bool,
    /// The components at a place.
    at: fn(&Snapshot<'_>, &Located) -> Vec<f64>,
}

/// Makes [`Quantity`] of the list of quantities: what a scene says of each stands before it, its name
/// there behind it.
macro_rules! quantities {
    ($($(#[$about:meta])* $quantity:ident $name:literal $description:tt)*) => {
        /// A quantity of the deformed body.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
        pub enum Quantity {
            $($(#[$about])* #[serde(rename = $name)] $quantity,)*
        }

        impl Quantity {
            fn description(self) -> &'static Description {
                match self {
                    $(Self::$quantity => const { &Description $description },)*
                }
            }
        }
    };
}

macro_rules! scalar {
    ($name:literal) => {
        [&[$name], &[$name]]
    };
}

macro_rules! vector {
    ($name:literal) => {
        [
            &[concat!($name, "_x"), concat!($name, "_y")],
            &[
                concat!($name, "_x"),
                concat!($name, "_y"),
                concat!($name, "_z"),
            ],
        ]
    };
}

macro_rules! principal {
    ($name:literal) => {
        [&[
            concat!($name, "_1"),
            concat!($name, "_2"),
            concat!($name, "_3"),
        ]; 2]
    };
}

macro_rules! symmetric {
    ($name:literal) => {
        [
            &[
                concat!($name, "_xx"),
                concat!($name, "_yy"),
                concat!($name, "_xy"),
                concat!($name, "_zz"),
            ],
            &[
                concat!($name, "_xx"),
                concat!($name, "_yy"),
                concat!($name, "_zz"),
                concat!($name, "_xy"),
                concat!($name, "_yz"),
                concat!($name, "_xz"),
            ],
        ]
    };
}

quantities! {
    /// Displacement, m.
    Displacement "u" {
        label: "displacement",
        components: Components::Vector,
        columns: vector!("u"),
        needs_state: false,
        at: |snapshot, place| snapshot.vector_at(snapshot.displacement, place),
    }
    /// Velocity, m/s.
    Velocity "v" {
        label: "velocity",
        components: Components::Vector,
        columns: vector!("v"),
        needs_state: false,
        at: |snapshot, place| snapshot.vector_at(snapshot.velocity, place),
    }
    /// Pressure, Pa.
    Pressure "p" {
        label: "pressure",
        components: Components::Scalar,
        columns: scalar!("p"),
        needs_state: false,
        at: |snapshot, place| vec![match snapshot.pressure {
            Pressure::Nodal(p) => snapshot.solid.space().pressure_at(p, place),
            // −κ (J − 1) for the formulation without pressure.
            Pressure::Penalty { .. } => snapshot.state_at(place).pressure,
        }],
    }
    /// Volume ratio det F.
    VolumeRatio "J" {
        label: "J",
        components: Components::Scalar,
        columns: scalar!("J"),
        needs_state: true,
        at: |snapshot, place| vec![snapshot.state_at(place).jacobian],
    }
    /// Green's strain: components as for `stress`.
    Strain "strain" {
        label: "strain",
        components: Components::Symmetric,
        columns: symmetric!("strain"),
        needs_state: true,
        at: |snapshot, place| symmetric(snapshot, green(snapshot.state_at(place).gradient)),
    }
    /// Principal values of Green's strain, the largest first.
    PrincipalStrain "principal-strain" {
        label: "principal_strain",
        components: Components::Principal,
        columns: principal!("principal_strain"),
        needs_state: true,
        at: |snapshot, place| principal(green(snapshot.state_at(place).gradient)),
    }
    /// Cauchy stress, active and viscous stress included, Pa: xx, yy, xy, zz; in space xx, yy, zz,
    /// xy, yz, xz.
    Stress "stress" {
        label: "stress",
        components: Components::Symmetric,
        columns: symmetric!("stress"),
        needs_state: true,
        at: |snapshot, place| symmetric(snapshot, snapshot.state_at(place).cauchy),
    }
    /// Principal values of the Cauchy stress, Pa, the largest first.
    Principal "principal-stress" {
        label: "principal_stress",
        components: Components::Principal,
        columns: principal!("principal"),
        needs_state: true,
        at: |snapshot, place| principal(snapshot.state_at(place).cauchy),
    }
    /// Von Mises' equivalent of the Cauchy stress, Pa.
    VonMises "von-mises" {
        label: "von_mises",
        components: Components::Scalar,
        columns: scalar!("von_mises"),
        needs_state: true,
        at: |snapshot, place| vec![snapshot.state_at(place).von_mises()],
    }
    /// Tension T of the active stress, Pa; 0 in materials that have none.
    Tension "tension" {
        label: "tension",
        components: Components::Scalar,
        columns: scalar!("tension"),
        needs_state: false,
        at: |snapshot, place| {
            let own = snapshot.tensions.get(place.element);
            vec![own.copied().unwrap_or(0.0)]
        },
    }
}

impl Quantity {
    /// Its name in field files.
    pub fn label(self) -> &'static str {
        self.description().label
    }

    /// What its components are.
    pub fn components(self) -> Components {
        self.description().components
    }

    /// The names of its components in a body of so many dimensions.
    pub fn columns(self, dimension: usize) -> &'static [&'static str] {
        self.description().columns[dimension - 2]
    }

    /// Whether det F, a strain or a stress must be computed for it.
    pub fn needs_state(self) -> bool {
        self.description().needs_state
    }

    pub(super) fn at(self, snapshot: &Snapshot<'_>, place: &Located) -> Vec<f64> {
        (self.description().at)(snapshot, place)
    }
}

/// The components of a symmetric tensor: those in the plane first, for a plane body.
fn symmetric(
    snapshot: &Snapshot<'_>,
    [[xx, xy, xz], [_, yy, yz], [_, _, zz]]: Tensor3,
) -> Vec<f64> {
    match snapshot.solid.space().dimension() {
        2 => vec![xx, yy, xy, zz],
        _ => vec![xx, yy, zz, xy, yz, xz],
    }
}

/// (H + Hᵀ + Hᵀ H)/2 of H = ∇u.
fn green(h: Tensor3) -> Tensor3 {
    let product = |i: usize, j: usize| (0..3).map(|k| h[k][i] * h[k][j]).sum::<f64>();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| 0.5 * (h[i][j] + h[j][i] + product(i, j))))
}

/// The eigenvalues of a symmetric tensor, the largest first.
fn principal(tensor: Tensor3) -> Vec<f64> {
    let matrix = Matrix3::from_fn(|i, j| 0.5 * (tensor[i][j] + tensor[j][i]));
    let mut values: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

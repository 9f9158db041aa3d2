//! Quantities that can be measured on a body. Each has an entry in [`quantities`].

use myovib_fem::material::three::Tensor3;
use myovib_fem::output::PointState;
use myovib_fem::{ElementPoint, Pressure};
use nalgebra::Matrix3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::snapshot::Snapshot;

/// Kind of components of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Components {
    /// A single value.
    Scalar,
    /// Components along the coordinate axes.
    Vector,
    /// Principal values in descending order.
    Principal,
    /// Components of a symmetric tensor: xx, yy, xy, zz in 2D; xx, yy, zz, xy, yz, xz in 3D.
    Symmetric,
}

struct Description {
    /// Name in field files and prefix of column names.
    names: [&'static str; 2],
    /// SI unit of the values; empty for a ratio.
    unit: &'static str,
    components: Components,
    evaluation: Evaluation,
}

/// Function that computes the components. Components of symmetric tensors are in the 3D order.
enum Evaluation {
    /// Computed from the fields.
    Fields(fn(&Snapshot<'_>, &ElementPoint) -> Vec<f64>),
    /// Computed from the displacement gradient.
    Gradient(fn(Tensor3) -> Vec<f64>),
    /// Computed from det F.
    State(fn(&PointState) -> Vec<f64>),
    /// Computed from the stress.
    Stress(fn(&PointState) -> Vec<f64>),
}

/// Defines [`Quantity`] from a list of quantities. Each entry contains the documentation, the variant, the name in
/// scenes, and the description.
macro_rules! quantities {
    ($($(#[$about:meta])* $quantity:ident $name:literal $description:tt)*) => {
        /// A quantity of the deformed body.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
        pub enum Quantity {
            $($(#[$about])* #[serde(rename = $name)] $quantity,)*
        }

        impl Quantity {
            /// All quantities.
            pub const ALL: &[Self] = &[$(Self::$quantity),*];

            fn description(self) -> &'static Description {
                match self {
                    $(Self::$quantity => const { &Description $description },)*
                }
            }
        }
    };
}

quantities! {
    /// Displacement, m.
    Displacement "u" {
        names: ["u", "u"],
        unit: "m",
        components: Components::Vector,
        evaluation: Evaluation::Fields(|body, place| body.vector_at(body.displacement, place)),
    }
    /// Velocity, m/s.
    Velocity "v" {
        names: ["v", "v"],
        unit: "m/s",
        components: Components::Vector,
        evaluation: Evaluation::Fields(|body, place| body.vector_at(body.velocity, place)),
    }
    /// Acceleration, m/s²; zero in an equilibrium.
    Acceleration "a" {
        names: ["a", "a"],
        unit: "m/s²",
        components: Components::Vector,
        evaluation: Evaluation::Fields(|body, place| body.vector_at(body.acceleration, place)),
    }
    /// Pressure, Pa, positive in compression; -tr σ/3 for `st-venant-kirchhoff`.
    Pressure "p" {
        names: ["p", "p"],
        unit: "Pa",
        components: Components::Scalar,
        evaluation: Evaluation::Fields(|body, place| vec![match body.pressure {
            Pressure::Nodal(p) => body.solid.space().pressure_at(p, place),
            // The formulation without pressure uses −κ g(J).
            Pressure::Penalty { .. } => body.state_at(place).pressure,
        }]),
    }
    /// Volume ratio det F.
    VolumeRatio "J" {
        names: ["J", "J"],
        unit: "",
        components: Components::Scalar,
        evaluation: Evaluation::State(|state| vec![state.jacobian]),
    }
    /// Green–Lagrange strain; components as for `stress`.
    Strain "strain" {
        names: ["strain", "strain"],
        unit: "",
        components: Components::Symmetric,
        evaluation: Evaluation::Gradient(|gradient| symmetric(green(gradient))),
    }
    /// Principal values of the Green–Lagrange strain in descending order.
    PrincipalStrain "principal-strain" {
        names: ["principal_strain", "principal_strain"],
        unit: "",
        components: Components::Principal,
        evaluation: Evaluation::Gradient(|gradient| principal(green(gradient))),
    }
    /// Total Cauchy stress, Pa: xx, yy, xy, zz; in space xx, yy, zz, xy, yz, xz.
    Stress "stress" {
        names: ["stress", "stress"],
        unit: "Pa",
        components: Components::Symmetric,
        evaluation: Evaluation::Stress(|state| symmetric(state.cauchy)),
    }
    /// Principal values of the Cauchy stress in descending order, Pa.
    Principal "principal-stress" {
        names: ["principal_stress", "principal"],
        unit: "Pa",
        components: Components::Principal,
        evaluation: Evaluation::Stress(|state| principal(state.cauchy)),
    }
    /// Von Mises equivalent of the Cauchy stress, Pa.
    VonMises "von-mises" {
        names: ["von_mises", "von_mises"],
        unit: "Pa",
        components: Components::Scalar,
        evaluation: Evaluation::Stress(|state| vec![state.von_mises()]),
    }
    /// Tension T of the active stress, Pa.
    Tension "tension" {
        names: ["tension", "tension"],
        unit: "Pa",
        components: Components::Scalar,
        evaluation: Evaluation::Fields(|body, place| {
            let own = body.stress_context.tensions.get(place.element);
            vec![own.copied().unwrap_or(0.0)]
        }),
    }
}

/// Indices of the components of a 2D symmetric tensor in the 3D order.
const IN_THE_PLANE: [usize; 4] = [0, 1, 3, 2];

impl Quantity {
    /// Returns the name in field files.
    pub fn label(self) -> &'static str {
        self.description().names[0]
    }

    /// Returns the quantity with this name in field files.
    pub fn labeled(label: &str) -> Option<Self> {
        let mut all = Self::ALL.iter().copied();
        all.find(|quantity| quantity.label() == label)
    }

    /// Returns the prefix of the quantity's column names.
    pub fn prefix(self) -> &'static str {
        self.description().names[1]
    }

    /// Returns the SI unit of the quantity, which is empty for a ratio.
    pub fn unit(self) -> &'static str {
        self.description().unit
    }

    /// Returns the kind of the quantity's components.
    pub fn components(self) -> Components {
        self.description().components
    }

    /// Returns the column names of the quantity's components for a body of this dimension.
    pub fn columns(self, dimension: usize) -> Vec<String> {
        let six = ["xx", "yy", "zz", "xy", "yz", "xz"];
        let ends = match self.components() {
            Components::Scalar => return vec![self.prefix().to_owned()],
            Components::Vector => ["x", "y", "z"][..dimension].to_vec(),
            Components::Principal => vec!["1", "2", "3"],
            Components::Symmetric if dimension == 2 => IN_THE_PLANE.map(|i| six[i]).to_vec(),
            Components::Symmetric => six.to_vec(),
        };
        let name = self.prefix();
        ends.iter().map(|end| format!("{name}_{end}")).collect()
    }

    /// Returns whether the quantity is derived from the stress.
    pub fn is_of_stress(self) -> bool {
        matches!(self.description().evaluation, Evaluation::Stress(_))
    }

    /// Returns whether the quantity is not differentiable at a state without strain and stress.
    pub fn has_kink_at_rest(self) -> bool {
        matches!(self, Self::PrincipalStrain | Self::Principal | Self::VonMises)
    }

    /// Returns whether the quantity requires det F, a strain or a stress.
    pub fn needs_state(self) -> bool {
        !matches!(self.description().evaluation, Evaluation::Fields(_))
    }
}

impl Snapshot<'_> {
    /// Returns whether a quantity is continuous: at a point shared by several elements (of one region), all these
    /// elements have the same value.
    pub fn is_continuous(&self, quantity: Quantity) -> bool {
        match quantity {
            Quantity::Pressure => matches!(self.pressure, Pressure::Nodal(_)),
            _ => !quantity.needs_state(),
        }
    }

    /// Returns the components of a quantity at a point.
    pub fn at(&self, place: &ElementPoint, quantity: Quantity) -> Vec<f64> {
        let values = match quantity.description().evaluation {
            Evaluation::Fields(read) => read(self, place),
            Evaluation::Gradient(read) => {
                read(self.solid.spatial_gradient_at(self.displacement, place))
            }
            Evaluation::State(read) => read(&self.state_at(place)),
            Evaluation::Stress(read) => read(&self.dynamic_state_at(place)),
        };
        match (quantity.components(), self.solid.space().dimension()) {
            (Components::Symmetric, 2) => IN_THE_PLANE.map(|i| values[i]).to_vec(),
            _ => values,
        }
    }
}

fn symmetric([[xx, xy, xz], [_, yy, yz], [_, _, zz]]: Tensor3) -> Vec<f64> {
    vec![xx, yy, zz, xy, yz, xz]
}

/// Returns the Green–Lagrange strain (H + Hᵀ + Hᵀ H)/2 for H = ∇u.
fn green(h: Tensor3) -> Tensor3 {
    let product = |i: usize, j: usize| (0..3).map(|k| h[k][i] * h[k][j]).sum::<f64>();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| 0.5 * (h[i][j] + h[j][i] + product(i, j))))
}

/// Returns the eigenvalues of a symmetric tensor in descending order.
fn principal(tensor: Tensor3) -> Vec<f64> {
    let matrix = Matrix3::from_fn(|i, j| 0.5 * (tensor[i][j] + tensor[j][i]));
    let mut values: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

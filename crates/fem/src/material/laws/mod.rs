//! List of laws. Each file has the energy, the constants and the tests of its laws.

use super::three::CustomLaw;
use super::{Described, Description};

/// Declares the modules, [`Law`], and the functions that distinguish between the laws. In plane strain, isotropic
/// laws have a potential of two invariants. Other laws, and isotropic laws whose code is too long to be compiled
/// into each plane kernel, are evaluated in 3D.
macro_rules! laws {
    (
        isotropic { $($plane_file:ident { $($plane:ident { $($plane_field:ident),* })* })* }
        others { $($other_file:ident { $($other:ident { $($other_field:ident),* })* })* }
        $d:tt
    ) => {
        $(mod $plane_file; $(pub use $plane_file::$plane;)*)*
        $(mod $other_file; $(pub use $other_file::$other;)*)*

        /// Material law: the energy without the pressure term.
        ///
        /// The pressure adds `−p (J − 1)` to the energy and `−p cof F` to the stress (`−p div u` and `−p I` for
        /// small strains). Paper, eqs. (20) and (26); the exponent of Ī1 in the paper is a misprint. The fields of
        /// each variant are the constants of the type with the same name.
        ///
        /// # Units
        /// Moduli, energies and stresses are in Pa.
        ///
        /// # Examples
        /// ```
        /// use myovib_fem::material::Law;
        /// let law = Law::MooneyRivlin { c10: 1e4, c01: 2e2 };
        /// let shear = [[0.0, 0.3], [0.0, 0.0]];
        /// // Simple shear: P01 = 2 (c10 + c01) γ for any pressure.
        /// assert!((law.stress(shear, 0.0)[0][1] - 6120.0).abs() < 1e-9);
        /// ```
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[allow(missing_docs)] // the types of the same name have them
        pub enum Law {
            $($(#[doc = concat!("See [`", stringify!($plane), "`].")]
            $plane { $($plane_field: f64),* },)*)*
            $($(#[doc = concat!("See [`", stringify!($other), "`].")]
            $other { $($other_field: f64),* },)*)*
            /// User-defined law: see [`Law::custom`].
            Custom(CustomLaw),
        }

        impl Law {
            /// Descriptions of all built-in laws.
            pub const CATALOG: &[Description] = &[
                $($($plane::DESCRIPTION,)*)*
                $($($other::DESCRIPTION,)*)*
            ];

            /// Returns the description of the law.
            pub fn description(self) -> Description {
                match self {
                    $($(Law::$plane { .. } => $plane::DESCRIPTION,)*)*
                    $($(Law::$other { .. } => $other::DESCRIPTION,)*)*
                    Law::Custom(custom) => custom.description(),
                }
            }

            /// Returns the constants in the order of the description.
            pub fn values(self) -> Vec<f64> {
                match self {
                    $($(Law::$plane { $($plane_field),* } => vec![$($plane_field),*],)*)*
                    $($(Law::$other { $($other_field),* } => vec![$($other_field),*],)*)*
                    Law::Custom(_) => Vec::new(),
                }
            }

            /// Returns the law with the given name. `values` has one entry per constant.
            pub(super) fn from_values(name: &str, values: &[f64]) -> Self {
                let mut values = values.iter().copied();
                let mut next = || values.next().expect("a value for each constant");
                $($(if name == $plane::DESCRIPTION.name {
                    return Law::$plane { $($plane_field: next()),* };
                })*)*
                $($(if name == $other::DESCRIPTION.name {
                    return Law::$other { $($other_field: next()),* };
                })*)*
                unreachable!("the name is from the list of laws")
            }
        }

        /// Evaluates an expression with `$w` bound to the law if it is a built-in law, a
        /// [`Law3`](super::three::Law3). Otherwise, evaluates another expression with `$own` bound to the
        /// [`CustomLaw`](super::three::CustomLaw).
        macro_rules! with_law {
            ($d law:expr, $d w:ident => $d body:expr, $d custom:ident => $d other:expr) => {
                match $d law {
                    $($($crate::material::Law::$plane { $($plane_field),* } => {
                        let $d w = $crate::material::$plane { $($plane_field),* };
                        $d body
                    })*)*
                    $($($crate::material::Law::$other { $($other_field),* } => {
                        let $d w = $crate::material::$other { $($other_field),* };
                        $d body
                    })*)*
                    $crate::material::Law::Custom($d custom) => $d other,
                }
            };
        }

        /// Evaluates an expression with `$w` bound to the [`Potential`](super::Potential) of the law, or another
        /// expression if the law has no potential.
        macro_rules! with_potential {
            ($d law:expr, $d w:ident => $d body:expr, else => $d other:expr) => {
                match $d law {
                    $($($crate::material::Law::$plane { $($plane_field),* } => {
                        let $d w = $crate::material::$plane { $($plane_field),* };
                        $d body
                    })*)*
                    _ => $d other,
                }
            };
        }
    };
}

laws! {
    isotropic {
        mooney_rivlin { MooneyRivlin { c10, c01 } }
        small_strain { SmallStrain { shear_modulus } }
        st_venant_kirchhoff {
            DeviatoricStVenantKirchhoff { shear_modulus }
            StVenantKirchhoff { lambda, shear_modulus }
        }
        gent { Gent { shear_modulus, limit } }
        veronda_westmann { VerondaWestmann { c1, c2 } }
        yeoh { Yeoh { c10, c20, c30 } }
    }
    others {
        fung { Fung { c, b_1, b_2, b_3, b_4, b_5, b_6, b_7, b_8, b_9 } }
        guccione {
            Guccione { c, b_f, b_t, b_fs }
            IsochoricGuccione { c, b_f, b_t, b_fs }
        }
        holzapfel_ogden {
            HolzapfelOgden {
                a, b, a_f, b_f, a_s, b_s, a_fs, b_fs, k, dispersion_f, dispersion_s
            }
        }
        ogden {
            Ogden {
                mu_1, alpha_1, mu_2, alpha_2, mu_3, alpha_3, mu_4, alpha_4, mu_5, alpha_5, mu_6, alpha_6
            }
        }
        transverse_mooney_rivlin {
            TransverseMooneyRivlin { c10, c01, c3, c4, c5, stretch_max }
        }
    }
    $
}
pub(crate) use {with_law, with_potential};

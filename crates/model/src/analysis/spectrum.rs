//! Eigenfrequencies and modes of the muscle linearized about an equilibrium.

use std::f64::consts::TAU;

use myovib_fem::{AddedMotion, AddedTangents, Fields, Pressure, Vectors};
pub use myovib_structure::Mode;
use myovib_structure::{Constraint, Vibration, modes, modes_below};
use nalgebra::{DMatrix, DVector};
use nalgebra_sparse::CscMatrix;

use crate::analysis::support::free_parts;
use crate::error::ModelError;
pub use crate::integration::typical::mass;
use crate::muscle::Muscle;
use crate::operators;
use crate::start::saddle::Saddle;
use crate::statics::Equilibrium;

/// Maximum number of Lanczos steps for the fastest mode.
const MAX_STEPS: usize = 60;
/// Relative change of ω² per Lanczos step below which the iteration ends. The computed frequency increases from step
/// to step and is then accurate to two digits.
const SETTLED: f64 = 2e-3;

/// Distance of the shift below ω² = 0 for an unsupported body, as a fraction of the Rayleigh quotient of a
/// [`stretching`]. The distance is small enough to separate the lowest modes, and large enough for a stable
/// factorization.
const BELOW_REST: f64 = 1e-2;
/// Fraction of the shift below which ω² counts as zero (a rigid motion).
const ROUNDING: f64 = 1e-6;
/// Largest unsymmetric part, relative to the largest entry, for which a stiffness counts as symmetric.
const SYMMETRIC: f64 = 1e-10;

/// Builds the problem of small undamped vibrations about an equilibrium for a formulation with pressures:
/// M ü + K u - Bᵀ p = 0, M_p p/κ + B u = 0. All matrices are evaluated at the equilibrium. K contains the
/// contributions of the law and of elastic foundations and, under loads, of tensions (which are constant), follower
/// pressures and contacts. Viscoelastic (Prony) stress is relaxed.
///
/// # Errors
/// Returns [`ModelError::Inverted`] if an element is inverted, and [`ModelError::NoEnergy`] if follower pressures act
/// on a surface whose edge moves.
///
/// # Panics
/// Panics if an array has the wrong length.
pub fn vibration(muscle: &Muscle, at: &Equilibrium) -> Result<Vibration, ModelError> {
    let solid = &muscle.solid;
    let u = &at.nodal_displacement(muscle)[..];
    let mut stiffness = bedded(muscle, operators::stiffness(solid, u, &at.pressure)?);
    if let Some(t) = at.preload_time {
        if !solid.added_stresses().is_empty() {
            let [by_displacement, _] = added(muscle, at, u);
            stiffness = stiffness + by_displacement;
        }
        if muscle.has_boundary_forces() {
            stiffness = stiffness - following(muscle, t, u)?;
        }
    }
    let compliance = operators::compliance(solid) * muscle.parameters.inv_kappa;
    Ok(Vibration::new(
        operators::mass(solid),
        stiffness,
        Some(Constraint { operator: operators::divergence(solid, u)?, compliance }),
    )?)
}

/// Returns ∂/∂u and ∂/∂v of the force of active and viscous stresses under the tensions of an
/// equilibrium.
fn added(muscle: &Muscle, at: &Equilibrium, u: &[f64]) -> [CscMatrix<f64>; 2] {
    let solid = &muscle.solid;
    let without = || vec![0.0; solid.n_tensions()];
    let tensions = &at.preload_time.map_or_else(without, |t| muscle.tensions_at_rest(t))[..];
    let v = &operators::rest(solid)[..];
    let mut values = [(); 2].map(|()| vec![0.0; solid.displacement_pattern().nnz()]);
    let [by_displacement, by_velocity] = values.each_mut().map(|values| Some(&mut values[..]));
    solid.added_tangents(
        &AddedMotion { u, v, tensions },
        AddedTangents { by_displacement, by_velocity },
    );
    values.map(|values| operators::matrix(solid.displacement_pattern(), values))
}

/// Returns ∂/∂u of the forces of follower pressures and contacts at time `t`.
fn following(muscle: &Muscle, t: f64, u: &[f64]) -> Result<CscMatrix<f64>, ModelError> {
    let pattern = muscle.solid.displacement_pattern();
    let mut values = vec![0.0; pattern.nnz()];
    for load in muscle.boundary_forces() {
        load.add_stiffness(t, 1.0, u, &mut values);
    }
    let stiffness = operators::matrix(pattern, values);
    let largest = |of: &CscMatrix<f64>| of.values().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest(&(&stiffness - stiffness.transpose())) > SYMMETRIC * largest(&stiffness) {
        return Err(ModelError::NoEnergy);
    }
    Ok(stiffness)
}

/// Computes the `count` lowest modes about an equilibrium, in ascending order of ω². Rigid motions of
/// an unsupported body ([`free_parts`]) have ω² = 0 at rest.
///
/// # Errors
/// Returns the errors of [`vibration`], and [`ModelError::Structure`] if there are pressures that no displacement
/// controls.
pub fn lowest(muscle: &Muscle, at: &Equilibrium, count: usize) -> Result<Vec<Mode>, ModelError> {
    let vibration = vibration(muscle, at)?;
    if free_parts(muscle).is_none() {
        return Ok(modes(&vibration, count, 0.0)?);
    }
    let shift = -BELOW_REST * vibration.quotient(&stretching(muscle));
    let mut found = modes(&vibration, count, shift)?;
    for mode in &mut found {
        if mode.omega_squared.abs() < ROUNDING * shift.abs() {
            mode.omega_squared = 0.0;
        }
    }
    Ok(found)
}

/// Computes all modes up to `frequency` (Hz) and the next higher mode. If there are more than `most` such modes, or if
/// the body is not supported, computes the `most` lowest modes.
///
/// # Errors
/// Returns the same errors as [`lowest`].
pub fn up_to(
    muscle: &Muscle,
    at: &Equilibrium,
    frequency: f64,
    most: usize,
) -> Result<Vec<Mode>, ModelError> {
    if free_parts(muscle).is_none() {
        let limit = (TAU * frequency).powi(2);
        // This fails if `frequency` is an eigenfrequency.
        if let Ok(Some(found)) = modes_below(&vibration(muscle, at)?, limit, most) {
            return Ok(found);
        }
    }
    lowest(muscle, at, most)
}

/// Returns the damping ratio of a `mode` about an equilibrium, vᵀ D v / (2 ω vᵀ M v). D contains all forces that are
/// proportional to velocities: Rayleigh damping, Kelvin–Voigt damping and foundations. For uniform α and β, the ratio
/// is (α/ω + βω)/2. Prony terms are not included. Returns `None` if the mode does not oscillate.
///
/// # Errors
/// Returns [`ModelError::Inverted`] if an element is inverted.
pub fn damping_ratio(
    muscle: &Muscle,
    at: &Equilibrium,
    mode: &Mode,
) -> Result<Option<f64>, ModelError> {
    let Some(omega) = mode.angular_frequency().filter(|&omega| omega > 0.0) else {
        return Ok(None);
    };
    let Muscle { solid, parameters, .. } = muscle;
    let u = at.nodal_displacement(muscle);
    let mut v = vec![0.0; u.len()];
    solid.dofs().expand(&mode.shape, &mut v);
    let mut force = vec![0.0; u.len()];
    let power = |force: &[f64]| force.iter().zip(&v).map(|(f, v)| f * v).sum::<f64>();
    solid.apply_damping_mass(&v, &mut force);
    let mut lost = parameters.alpha * power(&force);
    if parameters.is_damped() {
        let fields = Fields {
            v: Some(&v),
            p_rate: Some(&mode.multipliers),
            ..Fields::new(&u, Pressure::Nodal(&at.pressure))
        };
        let mut wanted = Vectors { force_rate: Some(&mut force), ..Vectors::default() };
        solid.evaluate(&fields, &mut wanted)?;
        lost += parameters.beta * power(&force);
    }
    if !solid.added_stresses().is_empty() {
        let [_, by_velocity] = added(muscle, at, &u);
        let shape = DVector::from_column_slice(&mode.shape);
        lost += shape.dot(&(by_velocity * &shape));
    }
    lost += muscle.foundations.iter().map(|foundation| foundation.dissipation(&v)).sum::<f64>();
    // vᵀ M v = 1.
    Ok(Some(lost / (2.0 * omega)))
}

/// Returns the participation factors φᵀ M r of a `mode` for unit translations r of all nodes, including supports,
/// along the axes. Their unit is √kg (√(kg/m) in 2D), and their squares are the effective masses.
pub fn participation(muscle: &Muscle, mode: &Mode) -> Vec<f64> {
    let solid = &muscle.solid;
    let dimension = solid.space().dimension();
    let [mut shape, mut inertia] = [(); 2].map(|()| operators::rest(solid));
    solid.dofs().expand(&mode.shape, &mut shape);
    solid.apply_mass(&shape, &mut inertia);
    (0..dimension).map(|axis| inertia.iter().skip(axis).step_by(dimension).sum()).collect()
}

/// Returns M φ of a `mode` as a nodal array with zeros at the supports. Its product with an amplitude û is the
/// coordinate of the mode in û, because modes are orthonormal in the inner product of M.
pub fn inertia(muscle: &Muscle, mode: &Mode) -> Vec<f64> {
    let dofs = muscle.solid.dofs();
    let [mut shape, mut inertia, mut at_free] = [(); 3].map(|()| operators::rest(&muscle.solid));
    dofs.expand(&mode.shape, &mut shape);
    muscle.solid.apply_mass(&shape, &mut inertia);
    dofs.free_to_full().iter().for_each(|&i| at_free[i] = inertia[i]);
    at_free
}

/// Returns the frequency (Hz) of a stretch along the first axis. It has the same order of magnitude as the modes that
/// strain the body, and is an upper bound for the lowest eigenfrequency of the body without pressures. The computation
/// needs one element pass.
///
/// # Errors
/// Returns [`ModelError::Inverted`] if an element is inverted.
pub(crate) fn stretching_frequency(muscle: &Muscle) -> Result<f64, ModelError> {
    let solid = &muscle.solid;
    let no_pressure = operators::no_pressure(solid);
    let stiffness = operators::stiffness(solid, &operators::rest(solid), &no_pressure)?;
    let vibration = Vibration::new(operators::mass(solid), bedded(muscle, stiffness), None)?;
    Ok(vibration.quotient(&stretching(muscle)).max(0.0).sqrt() / TAU)
}

/// Returns the free components of a volume-preserving stretch along the first axis. Its Rayleigh quotient approximates
/// ω² of the lowest mode that stretches the body along this axis.
fn stretching(muscle: &Muscle) -> Vec<f64> {
    let solid = &muscle.solid;
    let space = solid.space();
    let dimension = space.dimension();
    let mean = |axis: usize| {
        let along = space.coordinates().iter().skip(axis).step_by(dimension);
        along.sum::<f64>() / space.n_nodes() as f64
    };
    let means: Vec<f64> = (0..dimension).map(mean).collect();
    let stretched = |&component: &usize| {
        let axis = component % dimension;
        let factor = if axis == 0 { 1 - dimension as i32 } else { 1 };
        f64::from(factor) * (space.coordinates()[component] - means[axis])
    };
    solid.dofs().free_to_full().iter().map(stretched).collect()
}

/// Returns a lower bound for the angular frequency of the fastest mode about rest, rad/s, accurate to about two digits.
///
/// The frequency depends on the mesh rather than the muscle, because it belongs to a wave across the smallest element.
///
/// # Errors
/// Returns [`ModelError::Factorization`] if some pressure is not controlled by any displacement.
pub fn fastest(muscle: &Muscle) -> Result<f64, ModelError> {
    let solid = &muscle.solid;
    let rest = operators::rest(solid);
    let b = operators::divergence(solid, &rest)?;
    let transposed = b.transpose();
    let mass = operators::mass(solid);
    let no_pressure = operators::no_pressure(solid);
    let stiffness = operators::stiffness(solid, &rest, &no_pressure)?;
    let stiffness = bedded(muscle, stiffness);

    // Incompressible: the pressure is the reaction that enforces B ü = 0. Otherwise p = -κ M_p⁻¹ B
    // u.
    let incompressible = muscle.parameters.is_incompressible();
    let none = CscMatrix::zeros(0, mass.nrows());
    let mut inertia = Saddle::factor(&mass, if incompressible { &b } else { &none })?;
    let no_constraint = CscMatrix::zeros(0, b.nrows());
    let mut compliance = Saddle::factor(&operators::compliance(solid), &no_constraint)?;
    let no_flux = vec![0.0; if incompressible { b.nrows() } else { 0 }];
    let mut image = |u: &DVector<f64>| -> Result<DVector<f64>, ModelError> {
        let mut force = &stiffness * u;
        if !incompressible {
            let flux = &b * u;
            let (pressure, _) = compliance.solve(flux.as_slice(), &[])?;
            let pressure = DVector::from_vec(pressure) * muscle.parameters.kappa();
            force += &transposed * pressure;
        }
        Ok(DVector::from_vec(inertia.solve(force.as_slice(), &no_flux)?.0))
    };
    // Lanczos' method in the mass inner product, in which the map is symmetric. The first image
    // satisfies the constraint.
    let start = DVector::from_fn(mass.nrows(), |i, _| ((i * i + 1) as f64).sin());
    let mut next = image(&start)?;
    let mut last = DVector::zeros(mass.nrows());
    let (mut diagonal, mut off_diagonal, mut omega_squared) = (Vec::new(), Vec::new(), 0.0);
    for _ in 0..MAX_STEPS {
        let size = next.dot(&(&mass * &next)).sqrt();
        if size == 0.0 {
            break;
        }
        let u = next / size;
        let weighed = &mass * &u;
        next = image(&u)?;
        if !diagonal.is_empty() {
            next -= &last * size;
            off_diagonal.push(size);
        }
        let own = weighed.dot(&next);
        next -= &u * own;
        diagonal.push(own);
        last = u;
        let before = std::mem::replace(&mut omega_squared, largest_of(&diagonal, &off_diagonal));
        if omega_squared - before <= SETTLED * omega_squared {
            break;
        }
    }
    Ok(f64::max(omega_squared, 0.0).sqrt())
}

/// Returns the largest eigenvalue of a symmetric tridiagonal matrix.
fn largest_of(diagonal: &[f64], off_diagonal: &[f64]) -> f64 {
    let n = diagonal.len();
    let matrix = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => diagonal[i],
        1 => off_diagonal[i.min(j)],
        _ => 0.0,
    });
    matrix.symmetric_eigenvalues().max()
}

/// Adds the stiffness of the foundations to `stiffness`.
fn bedded(muscle: &Muscle, mut stiffness: CscMatrix<f64>) -> CscMatrix<f64> {
    for foundation in &muscle.foundations {
        let values = stiffness.values_mut();
        foundation.operator().add_values(foundation.stiffness(), &muscle.solid, values);
    }
    stiffness
}

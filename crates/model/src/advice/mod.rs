//! Advice on the index of a DAE and the settings of its integration. It is used by `check` before a run, and in the
//! message of a run that stops.
//!
//! [`Advice`] combines a formulation, its indices and [`Settings`]. A [`Finding`] is a problem with
//! the [`Remedy`]s that together fix it. [`Advised`] is an integrator that adds the advice to its
//! message when it stops.
//!
//! Reference: K. E. Brenan, S. L. Campbell, L. R. Petzold, *Numerical Solution of Initial-Value
//! Problems in Differential-Algebraic Equations*, SIAM 1996, section 5.4 (error estimates and
//! the iteration matrix for higher index).

mod advised;
mod remedy;

use std::f64::consts::TAU;

use myovib_fem::Inverted;

use crate::field::Field;
use crate::formulation::Formulation;
use crate::integration::settings::{IntegratorKind, MultiplierWeights, Settings};
use crate::muscle::Muscle;
use crate::muscle::parameters::Parameters;
use crate::statics::{self, COLLAPSE};

pub use advised::{Advised, WithMuscle};
use remedy::symbols;
pub use remedy::{Finding, Remedy};

/// Angle α (degrees) of the A(α)-stability of BDF for orders 5, 4 and 3 (order 2 is A-stable). Reference: E. Hairer,
/// G. Wanner, *Solving Ordinary Differential Equations II*, section V.2.
const SECTORS: [(u8, f64); 3] = [(5, 51.84), (4, 73.35), (3, 86.03)];
/// Ratio of a mode's frequency to the driving frequency above which steps that resolve the drive do not resolve the
/// mode.
const UNRESOLVED: f64 = 10.0;

/// Threshold for det F. If no step succeeds from a state with an element whose det F is below this value, the
/// deformation is a more likely cause than the index. The value is based on only a few observed stops: det F was near
/// 0.1 at a hundred times the paper's load, and above 0.95 when the index was the cause.
const FLAT: f64 = 0.2;
/// Suggested change if elements are excessively strained.
const EASE: &str = "apply the load more slowly, reduce it, or refine the mesh there";

/// A formulation with its indices and the settings of its integration.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    formulation: Formulation,
    parameters: Parameters,
    settings: Settings,
    /// [`Muscle::forcing_frequency`].
    drive: Option<f64>,
    /// Whether the elements [collapse](statics::collapses) because of their law.
    collapses: bool,
    /// Whether a contact has friction.
    has_friction: bool,
}

impl Advice {
    /// Creates the advice for the formulation and settings of a muscle's run.
    pub fn new(muscle: &Muscle, formulation: Formulation, settings: &Settings) -> Self {
        Self {
            formulation,
            parameters: muscle.parameters,
            settings: settings.clone(),
            drive: muscle.forcing_frequency(),
            collapses: statics::collapses(muscle, formulation),
            has_friction: muscle.contacts.iter().any(|contact| contact.friction().is_some()),
        }
    }

    /// Returns the index of the DAE.
    pub fn index(&self) -> u8 {
        self.formulation.index(&self.parameters)
    }

    /// Returns the blocks with their perturbation indices.
    pub fn blocks(&self) -> Vec<(Field, u8)> {
        let rows = self.formulation.rows().iter();
        rows.map(|(f, _)| (*f, self.formulation.variable_index(*f, &self.parameters))).collect()
    }

    /// Returns the multipliers of index 2 and higher, which should be excluded from the error test of BDF. Empty for
    /// Radau IIA, which scales the errors of multipliers by powers of the step.
    pub fn to_exclude(&self) -> Vec<Field> {
        if !self.is_bdf() {
            return Vec::new();
        }
        let blocks = self.blocks().into_iter();
        blocks
            .filter(|(field, index)| *index >= 2 && !field.is_displacement_like())
            .map(|(field, _)| field)
            .collect()
    }

    fn is_bdf(&self) -> bool {
        self.settings.integrator == IntegratorKind::Bdf
    }

    /// Returns the highest BDF order whose sector of stability contains all modes that the steps do not resolve. With
    /// Rayleigh damping, a mode of angular frequency ω has the damping ratio (α/ω + βω)/2. This is the cosine of the
    /// angle between its eigenvalue and the negative real axis.
    pub fn max_order(&self) -> u8 {
        let least = self.least_damping();
        SECTORS
            .into_iter()
            .find(|(_, degrees)| least >= degrees.to_radians().cos())
            .map_or(2, |(order, _)| order)
    }

    /// Returns the damping ratio of the least damped unresolved mode.
    fn least_damping(&self) -> f64 {
        let Parameters { alpha, beta, .. } = self.parameters;
        let resolved = UNRESOLVED * TAU * self.drive.unwrap_or(0.0);
        let ratio = |omega: f64| 0.5 * (alpha / omega + beta * omega);
        // Without β, the fastest modes are undamped.
        if beta > 0.0 {
            let slowest = resolved.max((alpha / beta).sqrt());
            if slowest > 0.0 { ratio(slowest) } else { 0.0 }
        } else {
            0.0
        }
    }

    /// Returns an explanation of [`max_order`](Self::max_order).
    pub fn max_order_reason(&self) -> String {
        let (order, least) = (self.max_order(), self.least_damping());
        let angle = least.min(1.0).acos().to_degrees();
        let bound = match SECTORS.into_iter().find(|(o, _)| *o == order) {
            Some((_, degrees)) => format!("within the {degrees}° sector of order {order}"),
            None => format!("outside the {}° sector of order 3", SECTORS[2].1),
        };
        format!(
            "order {order}: the least damped mode that the steps do not resolve has a damping ratio of {least:.3}, so \
             it is {angle:.1}° off the negative real axis, {bound}"
        )
    }

    /// Describes the formulation with its index and the index of each block.
    fn subject(&self) -> String {
        let blocks: Vec<_> =
            self.blocks().iter().map(|(field, index)| format!("{field} {index}")).collect();
        format!(
            "`{}` with κ = {}, β = {} has index {} ({})",
            self.formulation,
            self.parameters.kappa(),
            self.parameters.beta,
            self.index(),
            blocks.join(", ")
        )
    }

    /// Returns a formulation of the same physics with a lower index.
    fn lower(&self) -> Option<Remedy> {
        let incompressible = self.parameters.is_incompressible();
        let other = match (self.formulation, incompressible) {
            (Formulation::Position, true) => Formulation::Stabilized,
            (Formulation::Position, false) => Formulation::Velocity,
            (Formulation::Rate, _) if self.parameters.is_damped() => Formulation::ImplicitRate,
            _ => return None,
        };
        Some(Remedy::Reformulate(other, other.index(&self.parameters)))
    }

    /// Returns the likely causes of failure, before the run starts.
    pub fn findings(&self) -> Vec<Finding> {
        let of_multipliers = self.error_test().or_else(|| self.newton());
        of_multipliers.into_iter().chain(self.order()).collect()
    }

    /// Reports multipliers of index 3 if the tolerance is tight. Newton's convergence test includes these multipliers
    /// even if the error test does not.
    fn newton(&self) -> Option<Finding> {
        let index = self.index();
        let weighed = index > 2 && self.is_tighter_than_usual();
        (weighed && self.weighs_plainly()).then(|| {
            let remedies = vec![Remedy::WeighByStep];
            self.of_highest_index(
                format!(
                    "{}; excluding multipliers from the error test does not change this",
                    self.small_steps()
                ),
                remedies,
            )
        })
    }

    /// Returns whether the error weights of multipliers could be scaled by the step but are not.
    fn weighs_plainly(&self) -> bool {
        self.is_bdf() && self.settings.multiplier_weights == MultiplierWeights::Plain
    }

    /// Returns whether the relative tolerance is below the one that the paper uses.
    fn is_tighter_than_usual(&self) -> bool {
        self.settings.relative_tolerance < self.usual_tolerance()
    }

    fn usual_tolerance(&self) -> f64 {
        Settings::paper(self.formulation).relative_tolerance
    }

    /// Returns the blocks of the highest index.
    fn highest(&self) -> Vec<Field> {
        let index = self.index();
        let blocks = self.blocks().into_iter();
        blocks.filter(|(_, i)| *i == index).map(|(field, _)| field).collect()
    }

    /// Describes the effect of multipliers of the highest index on Newton's method.
    fn magnified(&self) -> String {
        let index = self.index();
        format!(
            "index {index} of {} amplifies the residual of Newton's method by 1/h^{}",
            symbols(&self.highest()),
            index - 1
        )
    }

    /// Describes the effect of multipliers of the highest index at a tight tolerance.
    fn small_steps(&self) -> String {
        format!(
            "a relative tolerance of {:e} requires small steps h, and {}",
            self.settings.relative_tolerance,
            self.magnified()
        )
    }

    fn of_highest_index(&self, problem: String, remedies: Vec<Remedy>) -> Finding {
        Finding { fields: self.highest(), problem, remedies }
    }

    /// Reports multipliers of higher index included in the error test.
    fn error_test(&self) -> Option<Finding> {
        if self.settings.multiplier_weights == MultiplierWeights::StepScaled {
            return None;
        }
        let tested: Vec<Field> = self
            .to_exclude()
            .into_iter()
            .filter(|field| !self.settings.suppressed.contains(field))
            .collect();
        if tested.is_empty() {
            return None;
        }
        let named: Vec<_> = tested
            .iter()
            .map(|field| {
                let index = self.formulation.variable_index(*field, &self.parameters);
                format!("{field} (index {index})")
            })
            .collect();
        let mut remedies = vec![Remedy::Exclude(tested.clone())];
        remedies.extend(self.order_bound());
        Some(Finding {
            problem: format!(
                "the error test includes {}, whose estimated error decreases more slowly than the step size, or not \
                at all",
                named.join(", ")
            ),
            fields: tested,
            remedies,
        })
    }

    /// Reports a BDF order whose sector of stability does not contain all unresolved modes.
    fn order(&self) -> Option<Finding> {
        let bound = self.order_bound()?;
        Some(Finding {
            fields: Vec::new(),
            problem: format!(
                "orders up to {} are allowed, but modes that the steps do not resolve are not damped sufficiently at \
                 orders above {}: they grow",
                self.settings.max_order,
                self.max_order()
            ),
            remedies: vec![bound],
        })
    }

    fn order_bound(&self) -> Option<Remedy> {
        let bound = self.max_order();
        (self.is_bdf() && self.settings.max_order > bound).then_some(Remedy::MaxOrder(bound))
    }

    /// Returns the possible causes of a stop, most likely first. The remedies of each finding are expected to suffice
    /// without those of the other findings.
    pub fn causes(&self) -> Vec<Finding> {
        let settings = self.error_test().or_else(|| self.order());
        let mut causes: Vec<Finding> = settings.into_iter().chain(self.slip()).collect();
        let index = self.index();
        if index < 2 {
            return causes;
        }
        // None of these remedies damps the modes that limit the order.
        let finding = |problem: String, remedy: Remedy| {
            let remedies = std::iter::once(remedy).chain(self.order_bound());
            self.of_highest_index(problem, remedies.collect())
        };
        let multipliers = !self.to_exclude().is_empty();
        if multipliers && self.weighs_plainly() {
            causes.push(finding(self.magnified(), Remedy::WeighByStep));
        }
        if self.is_tighter_than_usual() {
            let usual = self.usual_tolerance();
            causes.push(finding(self.small_steps(), Remedy::Loosen(usual)));
        }
        if let Some(remedy) = self.lower() {
            causes.push(finding(self.magnified(), remedy));
        }
        if self.is_bdf() {
            // Radau IIA damps all modes and has no maximum order.
            let remedies = vec![Remedy::Method(IntegratorKind::Radau9)];
            causes.push(self.of_highest_index(self.magnified(), remedies));
        }
        if causes.is_empty() {
            let change = "use a finite `bulk_modulus`, which lowers the index";
            causes.push(finding(self.magnified(), Remedy::Scene(change)));
        }
        causes
    }

    /// Returns a finding if a contact has friction.
    fn slip(&self) -> Option<Finding> {
        self.has_friction.then(|| Finding {
            fields: Vec::new(),
            problem: "friction below the slip velocity is steep, so slip begins suddenly"
                .to_owned(),
            remedies: vec![Remedy::Scene(
                "use a larger `slip_velocity` of [[contact]], such as ten times the value",
            )],
        })
    }

    /// Returns a finding if `ratio`, the smallest det F at a stop, is small. This value occurs in `element`. As det F
    /// approaches 0, the stress of the law grows without bound, so time steps and Newton's method fail.
    pub(crate) fn flatness(&self, ratio: f64, element: usize) -> Option<Finding> {
        (ratio < FLAT).then(|| Finding {
            fields: Vec::new(),
            problem: format!("element {element} is compressed to det F = {ratio:.3}"),
            remedies: vec![Remedy::Scene(self.ease())],
        })
    }

    /// Returns the possible causes of a stop at an inverted element, most likely first. These causes are unrelated to
    /// the index.
    pub fn causes_of_inversion(&self, at: Inverted) -> Vec<Finding> {
        let finding = |why: &str, remedy| Finding {
            fields: Vec::new(),
            problem: format!(
                "element {} is inverted even with the smallest steps{why}",
                at.element
            ),
            remedies: vec![remedy],
        };
        let usual = self.usual_tolerance();
        let loose = (self.settings.relative_tolerance > usual).then(|| {
            let why = ", starting from a state that may be inaccurate because of loose tolerances";
            finding(why, Remedy::Tighten(usual))
        });
        let strained = finding("", Remedy::Scene(self.ease()));
        loose.into_iter().chain([strained]).collect()
    }

    /// Returns the remedy for excessively strained elements.
    fn ease(&self) -> &'static str {
        if self.collapses { COLLAPSE } else { EASE }
    }
}

/// Formats the causes as a list for the end of a message.
fn listed(causes: &[Finding]) -> String {
    let mut words = String::new();
    for (n, cause) in causes.iter().enumerate() {
        let is_said = causes[..n].iter().any(|printed| printed.problem == cause.problem);
        words += &match n {
            0 => format!(". Likely cause: {cause}"),
            _ if is_said => format!(". Alternative remedy: {}", cause.remedy()),
            _ => format!(". Or: {cause}"),
        };
    }
    words
}

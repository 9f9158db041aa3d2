//! What the index of a DAE and the settings of its integration have to do with each other: the words
//! of `check` before a run, and of the message of a run that stops.
//!
//! Cast: [`Advice`] puts together a formulation, its indices and [`Settings`]; a [`Finding`] is what
//! is wrong with them and the [`Remedy`]s that together mend it; [`Advised`] is an integrator that
//! says all this when it stops.
//!
//! Reference: K. E. Brenan, S. L. Campbell, L. R. Petzold, *Numerical Solution of Initial-Value
//! Problems in Differential-Algebraic Equations*, SIAM 1996, section 5.4 (error estimates and
//! Newton's matrix for higher index).

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

/// Half the opening angle of the sector of stability of BDF, degrees, for orders 3, 4, 5 (order 2 is
/// stable in the whole half-plane). E. Hairer, G. Wanner, *Solving Ordinary Differential Equations
/// II*, section V.2.
const SECTORS: [(u8, f64); 3] = [(5, 51.84), (4, 73.35), (3, 86.03)];
/// Modes faster than the drive by this factor are not resolved by steps that resolve the drive.
const UNRESOLVED: f64 = 10.0;

/// An element with det F below this, in a state from which no step is found, is likelier at fault than
/// the index. A choice between what few stops have shown: near 0.1 at a hundred times the paper's load,
/// above 0.95 where the index was to blame.
const FLAT: f64 = 0.2;
/// What to change where elements are strained too far.
const EASE: &str = "let the load rise more slowly or less far, or refine the mesh there";

/// A formulation with its indices, and the settings of its integration.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    formulation: Formulation,
    parameters: Parameters,
    settings: Settings,
    /// [`Muscle::drive`].
    drive: Option<f64>,
    /// Whether its elements [collapse](statics::collapses) by their law.
    collapses: bool,
}

impl Advice {
    /// Looks at the formulation and the settings of a muscle's run.
    pub fn new(muscle: &Muscle, formulation: Formulation, settings: &Settings) -> Self {
        Self {
            formulation,
            parameters: muscle.parameters,
            settings: settings.clone(),
            drive: muscle.drive(),
            collapses: statics::collapses(muscle, formulation),
        }
    }

    /// The index of the DAE.
    pub fn index(&self) -> u8 {
        self.formulation.index(&self.parameters)
    }

    /// The blocks with the perturbation index of each.
    pub fn blocks(&self) -> Vec<(Field, u8)> {
        let rows = self.formulation.rows().iter();
        rows.map(|(f, _)| (*f, self.formulation.variable_index(*f, &self.parameters)))
            .collect()
    }

    /// The multipliers of index 2 and more: those to leave out of the error test of BDF. Radau IIA
    /// counts their errors by powers of the step.
    pub fn to_leave_out(&self) -> Vec<Field> {
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
        self.settings.integrator == IntegratorKind::Ida
    }

    /// The highest BDF order whose sector of stability holds all modes that the steps do not
    /// resolve. Under Rayleigh damping the mode of angular frequency ω has the damping ratio
    /// (α/ω + βω)/2, the cosine of its angle to the negative real axis.
    pub fn max_order(&self) -> u8 {
        let least = self.least_damping();
        SECTORS
            .into_iter()
            .find(|(_, degrees)| least >= degrees.to_radians().cos())
            .map_or(2, |(order, _)| order)
    }

    /// The damping ratio of the least damped mode that the steps do not resolve.
    fn least_damping(&self) -> f64 {
        let Parameters { alpha, beta, .. } = self.parameters;
        let resolved = UNRESOLVED * TAU * self.drive.unwrap_or(0.0);
        let ratio = |omega: f64| 0.5 * (alpha / omega + beta * omega);
        // Without β the fastest are not damped at all.
        if beta > 0.0 {
            let slowest = resolved.max((alpha / beta).sqrt());
            if slowest > 0.0 { ratio(slowest) } else { 0.0 }
        } else {
            0.0
        }
    }

    /// Why [`max_order`](Self::max_order) is what it is, in words.
    pub fn max_order_reason(&self) -> String {
        let (order, least) = (self.max_order(), self.least_damping());
        let angle = least.min(1.0).acos().to_degrees();
        let bound = match SECTORS.into_iter().find(|(o, _)| *o == order) {
            Some((_, degrees)) => format!("within {degrees}°, the sector of order {order}"),
            None => format!("beyond {}°, the sector of order 3", SECTORS[2].1),
        };
        format!(
            "order {order}: the least damped mode that the steps do not resolve has a damping ratio of \
             {least:.3}, {angle:.1}° off the negative real axis and {bound}"
        )
    }

    /// The formulation with its index and that of each block, in words.
    fn subject(&self) -> String {
        let blocks: Vec<_> = self
            .blocks()
            .iter()
            .map(|(field, index)| format!("{field} {index}"))
            .collect();
        format!(
            "`{}` with kappa = {}, beta = {} has index {} ({})",
            self.formulation,
            self.parameters.kappa(),
            self.parameters.beta,
            self.index(),
            blocks.join(", ")
        )
    }

    /// A formulation of the same physics with a lower index.
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

    /// What is expected to make the run fail, before it is tried.
    pub fn findings(&self) -> Vec<Finding> {
        let of_multipliers = self.error_test().or_else(|| self.newton());
        of_multipliers.into_iter().chain(self.order()).collect()
    }

    /// Multipliers of index 3, left out of the error test, that Newton's method is still measured by.
    fn newton(&self) -> Option<Finding> {
        let index = self.index();
        let weighed = index > 2 && self.is_tighter_than_usual();
        (weighed && self.weighs_plainly()).then(|| {
            let remedies = vec![Remedy::WeighByStep];
            self.of_highest_index(
                format!(
                    "{}, also where the error test leaves it out",
                    self.small_steps()
                ),
                remedies,
            )
        })
    }

    /// Whether the error weights of multipliers could follow the step, but do not.
    fn weighs_plainly(&self) -> bool {
        self.is_bdf() && self.settings.multiplier_weights == MultiplierWeights::Plain
    }

    /// Whether the relative tolerance is below the paper's.
    fn is_tighter_than_usual(&self) -> bool {
        self.settings.relative_tolerance < self.usual_tolerance()
    }

    fn usual_tolerance(&self) -> f64 {
        Settings::paper(self.formulation).relative_tolerance
    }

    /// The blocks of the highest index.
    fn highest(&self) -> Vec<Field> {
        let index = self.index();
        let blocks = self.blocks().into_iter();
        blocks
            .filter(|(_, i)| *i == index)
            .map(|(field, _)| field)
            .collect()
    }

    /// What they do to Newton's method.
    fn magnified(&self) -> String {
        let index = self.index();
        format!(
            "{}, of index {index}, magnifies what Newton's method leaves by 1/h^{}",
            symbols(&self.highest()),
            index - 1
        )
    }

    /// The same at a tight tolerance.
    fn small_steps(&self) -> String {
        format!(
            "a relative tolerance of {:e} asks for small steps h, and {}",
            self.settings.relative_tolerance,
            self.magnified()
        )
    }

    fn of_highest_index(&self, problem: String, remedies: Vec<Remedy>) -> Finding {
        Finding {
            fields: self.highest(),
            problem,
            remedies,
        }
    }

    /// Multipliers of higher index in the error test.
    fn error_test(&self) -> Option<Finding> {
        if self.settings.multiplier_weights == MultiplierWeights::StepScaled {
            return None;
        }
        let tested: Vec<Field> = self
            .to_leave_out()
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
        let mut remedies = vec![Remedy::LeaveOut(tested.clone())];
        remedies.extend(self.order_bound());
        Some(Finding {
            problem: format!(
                "in the error test: {}, whose estimated error does not fall as fast as the step, \
                 or not at all",
                named.join(", ")
            ),
            fields: tested,
            remedies,
        })
    }

    /// An order whose sector of stability leaves modes out.
    fn order(&self) -> Option<Finding> {
        let bound = self.order_bound()?;
        Some(Finding {
            fields: Vec::new(),
            problem: format!(
                "orders up to {} are allowed, but modes that the steps do not resolve are too \
                 little damped for orders above {}: they grow",
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

    /// What made a run stop, the likeliest first; each finding's remedies alone are to mend it.
    pub fn causes(&self) -> Vec<Finding> {
        let settings = self.error_test().or_else(|| self.order());
        let mut causes: Vec<Finding> = settings.into_iter().collect();
        let index = self.index();
        if index < 2 {
            return causes;
        }
        // None of these damps the modes that the order is bounded for.
        let finding = |problem: String, remedy: Remedy| {
            let remedies = std::iter::once(remedy).chain(self.order_bound());
            self.of_highest_index(problem, remedies.collect())
        };
        let multipliers = !self.to_leave_out().is_empty();
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
        if causes.is_empty() {
            let change = "take a finite kappa, which lowers the index";
            causes.push(finding(self.magnified(), Remedy::Scene(change)));
        }
        causes
    }

    /// What made a run stop in a state where det F is `ratio` at least, in `element`, if that is
    /// little: the law resists without bound, and time steps and Newton's method shrink with it.
    pub fn flatness(&self, ratio: f64, element: usize) -> Option<Finding> {
        (ratio < FLAT).then(|| Finding {
            fields: Vec::new(),
            problem: format!("element {element} is squeezed flat, to det F = {ratio:.3}"),
            remedies: vec![Remedy::Scene(self.ease())],
        })
    }

    /// What made a run stop at an element turned inside out, the likeliest first: that is no matter
    /// of the index.
    pub fn causes_of_inversion(&self, at: Inverted) -> Vec<Finding> {
        let finding = |why: &str, remedy| Finding {
            fields: Vec::new(),
            problem: format!(
                "element {} is turned inside out however small the step{why}",
                at.element
            ),
            remedies: vec![remedy],
        };
        let usual = self.usual_tolerance();
        let loose = (self.settings.relative_tolerance > usual).then(|| {
            let why = ", from a state so loosely integrated that it may be far off";
            finding(why, Remedy::Tighten(usual))
        });
        let strained = finding("", Remedy::Scene(self.ease()));
        loose.into_iter().chain([strained]).collect()
    }

    /// What helps against elements that are strained too far.
    fn ease(&self) -> &'static str {
        if self.collapses { COLLAPSE } else { EASE }
    }
}

/// The causes in a row, for the end of a message.
fn listed(causes: &[Finding]) -> String {
    let mut words = String::new();
    for (n, cause) in causes.iter().enumerate() {
        let is_said = causes[..n].iter().any(|said| said.problem == cause.problem);
        words += &match n {
            0 => format!(". At fault: {cause}"),
            _ if is_said => format!(". Or, for the same: {}", cause.remedy()),
            _ => format!(". Or: {cause}"),
        };
    }
    words
}

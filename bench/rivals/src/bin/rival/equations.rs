//! The muscle as an implementation of diffsol's `OdeEquations`.

use std::cell::RefCell;

use diffsol::{
    ConstantOp, FaerContext, FaerSparseMat, FaerVec, LinearOp, Matrix, NonLinearOp,
    NonLinearOpJacobian, OdeEquations, OdeEquationsRef, Op, ParameterisedOp, UnitCallable, Vector,
};
use diffsol_la::MatrixSparsity;
use myovib_dae::Problem;
use myovib_model::MuscleDae;

type M = FaerSparseMat<f64>;
type V = FaerVec<f64>;
type Sparsity = <M as Matrix>::Sparsity;

/// Equations M ẏ = −F(t, y, 0), which start at rest at t = 0.
pub struct Equations {
    pub dae: RefCell<MuscleDae>,
    zero: Vec<f64>,
    context: FaerContext,
    jacobian: Sparsity,
    mass: M,
}

impl Equations {
    /// Creates the equations from a DAE whose matrix ∂F/∂ẏ is constant.
    pub fn new(mut dae: MuscleDae) -> anyhow::Result<Self> {
        let n = dae.n_unknowns();
        let zero = vec![0.0; n];
        let pattern = dae.jacobian_pattern();
        let sparsity = |places: Vec<(usize, usize)>| {
            <Sparsity as MatrixSparsity<M>>::try_from_indices(n, n, places)
                .map_err(|error| anyhow::anyhow!("{error}"))
        };
        let places = pattern.entries().map(|(column, row)| (row, column));
        let jacobian = sparsity(places.clone().collect())?;
        let mut values = vec![0.0; pattern.nnz()];
        dae.jacobian(0.0, &zero, &zero, 0.0, 1.0, &mut values)?;
        let entries = places.zip(values).filter(|(_, value)| *value != 0.0);
        let (places, values): (Vec<_>, Vec<_>) = entries.unzip();
        let context = FaerContext::default();
        let mut mass = M::new_from_sparsity(n, n, Some(sparsity(places)?), context);
        mass.inner_mut()[0].val_mut().copy_from_slice(&values);
        Ok(Self { dae: RefCell::new(dae), zero, context, jacobian, mass })
    }
}

/// Operator of the equations, for which diffsol requires a separate type.
pub struct Part<'a>(&'a Equations);

macro_rules! square {
    ($($name:ty),+) => {$(
        impl Op for $name {
            type T = f64;
            type V = V;
            type M = M;
            type C = FaerContext;

            fn context(&self) -> &FaerContext {
                &self.equations().context
            }

            fn nstates(&self) -> usize {
                self.equations().zero.len()
            }

            fn nout(&self) -> usize {
                self.nstates()
            }

            fn nparams(&self) -> usize {
                0
            }
        }
    )+};
}

square!(Part<'_>, Equations);

impl Part<'_> {
    fn equations(&self) -> &Equations {
        self.0
    }
}

impl Equations {
    fn equations(&self) -> &Self {
        self
    }
}

impl ConstantOp for Part<'_> {
    fn call_inplace(&self, _: f64, y: &mut V) {
        y.fill(0.0);
    }
}

impl NonLinearOp for Part<'_> {
    fn call_inplace(&self, x: &V, t: f64, y: &mut V) {
        let Equations { dae, zero, .. } = self.0;
        y.for_each_batch_host([x], |out, [y], _| {
            match dae.borrow_mut().residual(t, y, zero, out) {
                Ok(()) => out.iter_mut().for_each(|value| *value = -*value),
                // An error cannot be returned here. If diffsol receives a NaN, it reduces its step size.
                Err(_) => out.fill(f64::NAN),
            }
        });
    }
}

impl NonLinearOpJacobian for Part<'_> {
    fn jac_mul_inplace(&self, x: &V, t: f64, v: &V, y: &mut V) {
        self.jacobian(x, t).gemv(1.0, v, 0.0, y);
    }

    fn jacobian_inplace(&self, x: &V, t: f64, y: &mut M) {
        let Equations { dae, zero, .. } = self.0;
        let mut state = zero.clone();
        let mut copy = V::zeros(zero.len(), *x.context());
        copy.for_each_batch_host([x], |_, [x], _| state.copy_from_slice(x));
        let values = y.inner_mut()[0].val_mut();
        let evaluated = dae.borrow_mut().jacobian(t, &state, zero, -1.0, 0.0, values);
        if evaluated.is_err() {
            values.fill(f64::NAN);
        }
    }

    fn jacobian_sparsity(&self) -> Option<Sparsity> {
        Some(self.0.jacobian.clone())
    }
}

impl LinearOp for Part<'_> {
    fn gemv_inplace(&self, x: &V, _: f64, beta: f64, y: &mut V) {
        self.0.mass.gemv(1.0, x, beta, y);
    }

    fn matrix_inplace(&self, _: f64, y: &mut M) {
        y.copy_from(&self.0.mass);
    }

    fn sparsity(&self) -> Option<Sparsity> {
        self.0.mass.sparsity().map(|sparsity| sparsity.to_owned().expect("a sparsity in memory"))
    }
}

impl<'a> OdeEquationsRef<'a> for Equations {
    type Mass = Part<'a>;
    type Rhs = Part<'a>;
    type Root = ParameterisedOp<'a, UnitCallable<M>>;
    type Init = Part<'a>;
    type Out = ParameterisedOp<'a, UnitCallable<M>>;
    type Reset = ParameterisedOp<'a, UnitCallable<M>>;
}

impl OdeEquations for Equations {
    fn rhs(&self) -> Part<'_> {
        Part(self)
    }

    fn mass(&self) -> Option<Part<'_>> {
        Some(Part(self))
    }

    fn init(&self) -> Part<'_> {
        Part(self)
    }

    fn set_params(&mut self, _: &V) {}

    fn get_params(&self, _: &mut V) {}
}

impl Equations {
    /// Returns the number of residual evaluations.
    pub fn residual_evaluations(&self) -> u64 {
        self.dae.borrow().counters().residual_passes
    }
}

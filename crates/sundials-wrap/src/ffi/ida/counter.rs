//! Counters of IDAS and the functions that read them.

use std::os::raw::{c_int, c_long, c_void};

use sundials_sys as sys;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Counter {
    Steps,
    ResidualEvaluations,
    LinearSetups,
    ErrorTestFailures,
    Backtracks,
    NewtonIterations,
    NewtonFailures,
    StepSolveFailures,
    JacobianEvaluations,
    RootEvaluations,
    QuadratureEvaluations,
    QuadratureErrorTestFailures,
    SensitivityEvaluations,
    SensitivityErrorTestFailures,
    SensitivityNewtonIterations,
    SensitivityLinearSetups,
}

impl Counter {
    /// Returns the function that reads this counter from a memory block.
    pub(super) fn function(self) -> unsafe extern "C" fn(*mut c_void, *mut c_long) -> c_int {
        match self {
            Self::Steps => sys::IDAGetNumSteps,
            Self::ResidualEvaluations => sys::IDAGetNumResEvals,
            Self::LinearSetups => sys::IDAGetNumLinSolvSetups,
            Self::ErrorTestFailures => sys::IDAGetNumErrTestFails,
            Self::Backtracks => sys::IDAGetNumBacktrackOps,
            Self::NewtonIterations => sys::IDAGetNumNonlinSolvIters,
            Self::NewtonFailures => sys::IDAGetNumNonlinSolvConvFails,
            Self::StepSolveFailures => sys::IDAGetNumStepSolveFails,
            Self::JacobianEvaluations => sys::IDAGetNumJacEvals,
            Self::RootEvaluations => sys::IDAGetNumGEvals,
            Self::QuadratureEvaluations => sys::IDAGetQuadNumRhsEvals,
            Self::QuadratureErrorTestFailures => sys::IDAGetQuadNumErrTestFails,
            Self::SensitivityEvaluations => sys::IDAGetSensNumResEvals,
            Self::SensitivityErrorTestFailures => sys::IDAGetSensNumErrTestFails,
            Self::SensitivityNewtonIterations => sys::IDAGetSensNumNonlinSolvIters,
            Self::SensitivityLinearSetups => sys::IDAGetSensNumLinSolvSetups,
        }
    }
}

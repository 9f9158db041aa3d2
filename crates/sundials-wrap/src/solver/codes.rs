//! Return codes of IDAS: their names and the corresponding outcomes.

use sundials_sys as sys;

use myovib_dae::StopReason;

/// Defines a function that returns the name of a return code.
macro_rules! names {
    ($($name:ident)+) => {
        /// Returns the name of a return code in IDAS.
        pub(super) fn name(code: i32) -> &'static str {
            match code {
                $(sys::$name => stringify!($name),)+
                _ => "unknown code of IDAS",
            }
        }
    };
}

names! {
    IDA_SUCCESS IDA_TSTOP_RETURN IDA_ROOT_RETURN IDA_TOO_MUCH_WORK IDA_TOO_MUCH_ACC IDA_ERR_FAIL IDA_CONV_FAIL
    IDA_LINIT_FAIL IDA_LSETUP_FAIL IDA_LSOLVE_FAIL IDA_RES_FAIL IDA_REP_RES_ERR IDA_RTFUNC_FAIL IDA_CONSTR_FAIL
    IDA_FIRST_RES_FAIL IDA_LINESEARCH_FAIL IDA_NO_RECOVERY IDA_NLS_SETUP_FAIL IDA_NLS_FAIL IDA_MEM_NULL
    IDA_MEM_FAIL IDA_ILL_INPUT IDA_BAD_EWT IDA_BAD_K IDA_BAD_T IDA_BAD_DKY IDA_QRHS_FAIL IDA_FIRST_QRHS_ERR
    IDA_REP_QRHS_ERR IDA_NO_ADJ IDA_NO_FWD IDA_NO_BCK IDA_BAD_TB0 IDA_REIFWD_FAIL IDA_FWD_FAIL IDA_GETY_BADT
}

/// Returns the reason why a solve call failed, or `None` if the call was rejected.
pub(super) fn stop_reason(code: i32) -> Option<StopReason> {
    match code {
        sys::IDA_TOO_MUCH_WORK => Some(StopReason::MaxSteps),
        sys::IDA_TOO_MUCH_ACC => Some(StopReason::ToleranceTooTight),
        sys::IDA_ERR_FAIL => Some(StopReason::ErrorTestFailures),
        sys::IDA_CONV_FAIL | sys::IDA_NLS_FAIL => Some(StopReason::ConvergenceFailures),
        sys::IDA_LSETUP_FAIL | sys::IDA_NLS_SETUP_FAIL => Some(StopReason::LinearSetupFailed),
        sys::IDA_LSOLVE_FAIL => Some(StopReason::LinearSolveFailed),
        sys::IDA_RES_FAIL | sys::IDA_REP_RES_ERR | sys::IDA_FIRST_RES_FAIL => {
            Some(StopReason::ResidualFailed)
        }
        sys::IDA_RTFUNC_FAIL => Some(StopReason::RootFunctionFailed),
        sys::IDA_CONSTR_FAIL => Some(StopReason::ConstraintsViolated),
        sys::IDA_QRHS_FAIL | sys::IDA_FIRST_QRHS_ERR | sys::IDA_REP_QRHS_ERR => {
            Some(StopReason::QuadratureFailed)
        }
        sys::IDA_BAD_EWT => Some(StopReason::ErrorWeightsFailed),
        sys::IDA_ILL_INPUT | sys::IDA_MEM_NULL | sys::IDA_MEM_FAIL | sys::IDA_LINIT_FAIL => None,
        _ => Some(StopReason::Other),
    }
}

#[cfg(test)]
mod tests {
    use super::{name, stop_reason};
    use myovib_dae::StopReason::{self, *};

    /// Codes listed in the user guide of IDAS 6.4, with the corresponding outcomes.
    const CODES: [(i32, &str, Option<StopReason>); 26] = [
        (-1, "IDA_TOO_MUCH_WORK", Some(MaxSteps)),
        (-2, "IDA_TOO_MUCH_ACC", Some(ToleranceTooTight)),
        (-3, "IDA_ERR_FAIL", Some(ErrorTestFailures)),
        (-4, "IDA_CONV_FAIL", Some(ConvergenceFailures)),
        (-5, "IDA_LINIT_FAIL", None),
        (-6, "IDA_LSETUP_FAIL", Some(LinearSetupFailed)),
        (-7, "IDA_LSOLVE_FAIL", Some(LinearSolveFailed)),
        (-8, "IDA_RES_FAIL", Some(ResidualFailed)),
        (-9, "IDA_REP_RES_ERR", Some(ResidualFailed)),
        (-10, "IDA_RTFUNC_FAIL", Some(RootFunctionFailed)),
        (-11, "IDA_CONSTR_FAIL", Some(ConstraintsViolated)),
        (-12, "IDA_FIRST_RES_FAIL", Some(ResidualFailed)),
        (-13, "IDA_LINESEARCH_FAIL", Some(Other)),
        (-14, "IDA_NO_RECOVERY", Some(Other)),
        (-16, "IDA_NLS_SETUP_FAIL", Some(LinearSetupFailed)),
        (-17, "IDA_NLS_FAIL", Some(ConvergenceFailures)),
        (-20, "IDA_MEM_NULL", None),
        (-21, "IDA_MEM_FAIL", None),
        (-22, "IDA_ILL_INPUT", None),
        (-24, "IDA_BAD_EWT", Some(ErrorWeightsFailed)),
        (-25, "IDA_BAD_K", Some(Other)),
        (-26, "IDA_BAD_T", Some(Other)),
        (-27, "IDA_BAD_DKY", Some(Other)),
        (-31, "IDA_QRHS_FAIL", Some(QuadratureFailed)),
        (-32, "IDA_FIRST_QRHS_ERR", Some(QuadratureFailed)),
        (-33, "IDA_REP_QRHS_ERR", Some(QuadratureFailed)),
    ];

    #[test]
    fn codes_have_the_names_and_meanings_of_the_guide() {
        for (code, expected, meaning) in CODES {
            assert_eq!((name(code), stop_reason(code)), (expected, meaning));
        }
        for (code, expected) in [
            (0, "IDA_SUCCESS"),
            (1, "IDA_TSTOP_RETURN"),
            (2, "IDA_ROOT_RETURN"),
            (-999, "unknown code of IDAS"),
        ] {
            assert_eq!(name(code), expected);
        }
    }
}

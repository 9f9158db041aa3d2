//! Accuracy of sensitivities.

use myovib_scene::sensitivity::{Parameterized, Precision, Sample, compute};
use myovib_scene::watch::Watcher;

use crate::derivatives::{CASES, case};
use crate::scene;

/// Checks the derivatives with respect to a density, relative to the largest value: their errors are within the
/// tolerance if the error test includes them. Otherwise, fewer steps are taken and the errors exceed the tolerance.
#[test]
fn derivatives_in_the_error_test_are_within_its_tolerance() {
    const RTOL: f64 = 1e-4;
    let folder = tempfile::tempdir().unwrap();
    let path = scene(folder.path(), &["material[0].density"], "");
    let curve = |rtol: f64, precision: Precision| {
        let own = [
            "traction[0].y.shift=1".to_owned(),
            "time.end=0.5".to_owned(),
            format!("integrator.rtol={rtol:e}"),
            format!(
                "integrator.atol={{ u = {u:e}, v = {u:e}, p = {p:e}, p_rate = {rate:e} }}",
                u = 1e-2 * rtol,
                p = 1e2 * rtol,
                rate = 5e3 * rtol,
            ),
        ];
        let it = Parameterized::load(&path, &[case(CASES[5]), own.into()].concat()).unwrap();
        let curves = compute(&it, precision, Watcher::NOBODY).unwrap();
        let of = |sample: &Sample| sample.derivatives[0][1];
        let values: Vec<f64> = curves.samples.iter().map(of).collect();
        (values, curves.cost.steps)
    };
    let (exact, _) = curve(1e-3 * RTOL, Precision::OfMotion);
    let largest = exact.iter().fold(0.0_f64, |max, x| max.max(x.abs()));
    let error = |precision: Precision| {
        let (values, steps) = curve(RTOL, precision);
        let both = values.iter().zip(&exact);
        let error = both.fold(0.0_f64, |max, (x, exact)| max.max((x - exact).abs()));
        (error / largest, steps)
    };
    let [(tested, n_tested), (plain, n_plain)] =
        [Precision::Tested, Precision::OfMotion].map(error);
    assert!(tested <= RTOL && RTOL < plain, "{tested:e} {plain:e}");
    assert!(n_tested > n_plain, "{n_tested} {n_plain}");
}

/// Checks that samples have the smallest interval of the observed probes, and include the end of the run in spite of
/// rounding errors.
#[test]
fn samples_have_the_interval_of_the_probes() {
    let folder = tempfile::tempdir().unwrap();
    let finer = "[[probe]]\nname = \"finer\"\ntype = \"point\"\nat = [0.05, 0.0]\ninterval = 0.01\n\
                 [[output]]\nname = \"tip\"\nprobe = \"origin\"\ncolumn = \"u_y\"\n";
    let path = scene(folder.path(), &["material[0].c10"], finer);
    let own = ["probe[0].interval=0.05", "time.end=0.3"].map(str::to_owned);
    let it = Parameterized::load(&path, &[case(CASES[1]), own.into()].concat()).unwrap();
    let curves = compute(&it, Precision::OfMotion, Watcher::NOBODY).unwrap();
    let times: Vec<f64> = curves.samples.iter().map(|sample| sample.t).collect();
    assert_eq!(times.len(), 7, "{times:?}");
    assert_eq!(times[6], 0.3);
}

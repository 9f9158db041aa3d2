//! Models as stated in the files; the parameters b1, b2, … are b[0], b[1], ….

use std::f64::consts::PI;

use crate::dual::Dual;

pub(crate) type Formula = fn(&[Dual], &[f64]) -> Dual;

fn c(value: f64) -> Dual {
    Dual::constant(value)
}

fn misra1a(b: &[Dual], x: &[f64]) -> Dual {
    b[0] * (c(1.0) - (-b[1] * x[0]).exp())
}

fn misra1b(b: &[Dual], x: &[f64]) -> Dual {
    b[0] * (c(1.0) - c(1.0) / (b[1] * x[0] / 2.0 + 1.0).square())
}

fn misra1c(b: &[Dual], x: &[f64]) -> Dual {
    b[0] * (c(1.0) - (b[1] * (2.0 * x[0]) + 1.0).pow(-0.5))
}

fn misra1d(b: &[Dual], x: &[f64]) -> Dual {
    b[0] * b[1] * x[0] / (b[1] * x[0] + 1.0)
}

fn chwirut(b: &[Dual], x: &[f64]) -> Dual {
    (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])
}

fn lanczos(b: &[Dual], x: &[f64]) -> Dual {
    b[0] * (-b[1] * x[0]).exp() + b[2] * (-b[3] * x[0]).exp() + b[4] * (-b[5] * x[0]).exp()
}

fn gauss(b: &[Dual], x: &[f64]) -> Dual {
    let peak =
        |height: Dual, at: Dual, width: Dual| height * (-((c(x[0]) - at) / width).square()).exp();
    b[0] * (-b[1] * x[0]).exp() + peak(b[2], b[3], b[4]) + peak(b[5], b[6], b[7])
}

fn danwood(b: &[Dual], x: &[f64]) -> Dual {
    b[0] * c(x[0]).pow(b[1])
}

fn kirby2(b: &[Dual], x: &[f64]) -> Dual {
    let x = x[0];
    (b[0] + b[1] * x + b[2] * (x * x)) / (b[3] * x + b[4] * (x * x) + 1.0)
}

fn cubic(b: &[Dual], x: &[f64]) -> Dual {
    let [x, x2, x3] = [x[0], x[0] * x[0], x[0].powi(3)];
    (b[0] + b[1] * x + b[2] * x2 + b[3] * x3) / (b[4] * x + b[5] * x2 + b[6] * x3 + 1.0)
}

fn nelson(b: &[Dual], x: &[f64]) -> Dual {
    b[0] - b[1] * x[0] * (-b[2] * x[1]).exp()
}

fn mgh09(b: &[Dual], x: &[f64]) -> Dual {
    let x = x[0];
    b[0] * (b[1] * x + x * x) / (b[2] * x + b[3] + x * x)
}

fn mgh10(b: &[Dual], x: &[f64]) -> Dual {
    b[0] * (b[1] / (b[2] + x[0])).exp()
}

fn mgh17(b: &[Dual], x: &[f64]) -> Dual {
    b[0] + b[1] * (-b[3] * x[0]).exp() + b[2] * (-b[4] * x[0]).exp()
}

fn roszman1(b: &[Dual], x: &[f64]) -> Dual {
    b[0] - b[1] * x[0] - (b[2] / (c(x[0]) - b[3])).atan() / PI
}

fn enso(b: &[Dual], x: &[f64]) -> Dual {
    let wave = |period: Dual, cos: Dual, sin: Dual| {
        let phase = c(2.0 * PI * x[0]) / period;
        cos * phase.cos() + sin * phase.sin()
    };
    b[0] + wave(c(12.0), b[1], b[2]) + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8])
}

fn rat42(b: &[Dual], x: &[f64]) -> Dual {
    b[0] / ((b[1] - b[2] * x[0]).exp() + 1.0)
}

fn rat43(b: &[Dual], x: &[f64]) -> Dual {
    b[0] / ((b[1] - b[2] * x[0]).exp() + 1.0).pow(c(1.0) / b[3])
}

fn eckerle4(b: &[Dual], x: &[f64]) -> Dual {
    b[0] / b[1] * (((c(x[0]) - b[2]) / b[1]).square() * -0.5).exp()
}

fn bennett5(b: &[Dual], x: &[f64]) -> Dual {
    b[0] * (b[1] + x[0]).pow(c(-1.0) / b[2])
}

/// Name and model of each data set.
pub(crate) const SETS: [(&str, Formula); 27] = [
    ("Misra1a", misra1a),
    ("Chwirut2", chwirut),
    ("Chwirut1", chwirut),
    ("Lanczos3", lanczos),
    ("Gauss1", gauss),
    ("Gauss2", gauss),
    ("DanWood", danwood),
    ("Misra1b", misra1b),
    ("Kirby2", kirby2),
    ("Hahn1", cubic),
    ("Nelson", nelson),
    ("MGH17", mgh17),
    ("Lanczos1", lanczos),
    ("Lanczos2", lanczos),
    ("Gauss3", gauss),
    ("Misra1c", misra1c),
    ("Misra1d", misra1d),
    ("Roszman1", roszman1),
    ("ENSO", enso),
    ("MGH09", mgh09),
    ("Thurber", cubic),
    ("BoxBOD", misra1a),
    ("Rat42", rat42),
    ("MGH10", mgh10),
    ("Eckerle4", eckerle4),
    ("Rat43", rat43),
    ("Bennett5", bennett5),
];

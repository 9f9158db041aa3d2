//! Axes with limits and ticks.

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    #[default]
    Linear,
    /// Logarithmic scale; only positive values are shown.
    Logarithmic,
}

#[derive(Debug, Clone, Default)]
pub struct Axis {
    /// Quantity in the label, for example `*u*_{*y*}(0, 0)`.
    pub quantity: String,
    /// Unit; may be empty.
    pub unit: String,
    pub scale: Scale,
    /// Limits; if `None`, the limits are computed from the data.
    pub limits: Option<[f64; 2]>,
}

impl Axis {
    /// Creates a linear axis whose limits are computed from the data.
    pub fn new(quantity: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { quantity: quantity.into(), unit: unit.into(), ..Self::default() }
    }

    pub fn logarithmic(self) -> Self {
        Self { scale: Scale::Logarithmic, ..self }
    }

    /// Sets the limits.
    pub fn between(self, low: f64, high: f64) -> Self {
        Self { limits: Some([low, high]), ..self }
    }

    /// Computes limits and about `n_ticks` ticks for the given values.
    pub(super) fn divide(&self, values: impl Iterator<Item = f64>, n_ticks: usize) -> Division {
        match self.scale {
            Scale::Linear => linear(self.limits.unwrap_or_else(|| padded(range(values))), n_ticks),
            Scale::Logarithmic => {
                let positive = values.filter(|&value| value > SMALLEST);
                logarithmic(self.limits.unwrap_or_else(|| range(positive)), n_ticks)
            }
        }
    }

    /// Returns the label of the axis: the quantity, the unit, and the power of ten that the tick labels omit.
    pub(super) fn label(&self, exponent: i32) -> String {
        let power =
            if exponent == 0 { String::new() } else { format!("10^{{{}}}", signed(exponent)) };
        match (power.is_empty(), self.unit.is_empty()) {
            (true, true) => self.quantity.clone(),
            (true, false) => format!("{} ({})", self.quantity, self.unit),
            (false, true) => format!("{} ({power})", self.quantity),
            (false, false) => format!("{} ({power} {})", self.quantity, self.unit),
        }
    }
}

/// Axis with fixed limits and ticks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Division {
    pub(super) scale: Scale,
    pub(super) limits: [f64; 2],
    /// Values with their labels.
    pub(super) ticks: Vec<(f64, String)>,
    pub(super) minor: Vec<f64>,
    /// Power of ten that the tick labels omit.
    pub(super) exponent: i32,
}

impl Division {
    /// Returns the position of a value as a fraction of the distance between the limits. On a logarithmic axis, it is
    /// −∞ for 0 and NaN for negative values.
    pub(super) fn fraction(&self, value: f64) -> f64 {
        let [low, high] = self.limits;
        match self.scale {
            Scale::Linear => (value - low) / (high - low),
            Scale::Logarithmic => (value / low).ln() / (high / low).ln(),
        }
    }
}

/// Smallest magnitude distinguished from zero.
const SMALLEST: f64 = 1e-290;
/// Largest magnitude; larger values are clamped.
const LARGEST: f64 = 1e290;

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = values
        .filter(|value| value.is_finite())
        // Beyond these limits, steps and their inverses would not be finite.
        .map(|value| if value.abs() < SMALLEST { 0.0 } else { value.clamp(-LARGEST, LARGEST) })
        .fold(none, |[low, high], value| [low.min(value), high.max(value)]);
    if low <= high { [low, high] } else { [1.0, 1.0] }
}

/// Adds a margin around the data. If the data are constant, the range is enlarged so that they appear constant.
fn padded([low, high]: [f64; 2]) -> [f64; 2] {
    let extent = high - low;
    let air = match low.abs() {
        _ if extent > 0.0 => 0.04 * extent,
        // A curve of zeros needs no power of ten.
        0.0 => 1.0,
        constant => (0.1 * constant).max(1e-300),
    };
    [low - air, high + air]
}

/// Returns a step that divides the range between the limits into at most `n` parts. The step is 1, 2, 2.5 or 5 times a
/// power of ten.
fn round_step([low, high]: [f64; 2], n: usize) -> f64 {
    let rough = (high - low) / n as f64;
    let power = 10_f64.powf(rough.log10().floor());
    let steps = [1.0, 2.0, 2.5, 5.0].map(|multiple| multiple * power);
    // The term 1e-9 compensates for rounding errors of a round step.
    steps.into_iter().find(|step| *step >= rough * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// Returns round values in about `n` steps. They enclose the given limits or, if these are `None`, the range of the
/// values.
pub(super) fn steps(limits: Option<[f64; 2]>, values: &[f64], n: usize) -> Vec<f64> {
    let data = range(values.iter().copied());
    let [low, high] = limits.unwrap_or(if data[0] < data[1] { data } else { padded(data) });
    let step = round_step([low, high], n);
    let (first, last) = ((low / step).floor() as i64, (high / step).ceil() as i64);
    (first..=last).map(|i| i as f64 * step).collect()
}

fn linear(limits: [f64; 2], n_ticks: usize) -> Division {
    let [low, high] = limits;
    let step = round_step(limits, n_ticks);
    let exponent = common_exponent(low.abs().max(high.abs()));
    let unit = 10_f64.powi(exponent);
    let n_decimals = decimals(step / unit);
    // The sum has a rounding error of a few units in the last place. This error must not exclude a tick at a limit.
    let slack = 1e-9 * step;
    let (first, last) =
        (((low - slack) / step).ceil() as i64, ((high + slack) / step).floor() as i64);
    let ticks = (first..=last).map(|i| {
        let value = i as f64 * step;
        (value, minus(format!("{:.n_decimals$}", value / unit)))
    });
    Division { scale: Scale::Linear, limits, ticks: ticks.collect(), minor: vec![], exponent }
}

/// Returns the power of ten factored out of the tick labels, or zero if the numbers are printed in full.
fn common_exponent(largest: f64) -> i32 {
    let exponent = largest.log10().floor();
    if !exponent.is_finite() || (-2.0..4.0).contains(&exponent) { 0 } else { exponent as i32 }
}

/// Returns the number of decimals with which multiples of `step` are printed.
fn decimals(step: f64) -> usize {
    let is_whole = |x: f64| (x - x.round()).abs() < 1e-6 * x.abs();
    (0..12).find(|&n| is_whole(step * 10_f64.powi(n as i32))).unwrap_or(12)
}

/// Divides the axis at whole decades that enclose the data. All decades are labeled if `n_ticks` allows it.
fn logarithmic([low, high]: [f64; 2], n_ticks: usize) -> Division {
    // The term 1e-9 compensates for rounding errors of a power of ten.
    let first = (low.log10() + 1e-9).floor() as i32;
    let last = ((high.log10() - 1e-9).ceil() as i32).max(first + 1);
    let stride = (last - first).unsigned_abs().div_ceil(n_ticks as u32).max(1);
    let ticks = (first..=last)
        .step_by(stride as usize)
        .map(|k| (10_f64.powi(k), format!("10^{{{}}}", signed(k))));
    let minor = if stride == 1 {
        (first..last).flat_map(|k| (2..10).map(move |m| f64::from(m) * 10_f64.powi(k))).collect()
    } else {
        (first..=last).map(|k| 10_f64.powi(k)).collect()
    };
    let limits = [10_f64.powi(first), 10_f64.powi(last)];
    Division { scale: Scale::Logarithmic, limits, ticks: ticks.collect(), minor, exponent: 0 }
}

fn signed(exponent: i32) -> String {
    minus(exponent.to_string())
}

/// Replaces hyphens with minus signs.
fn minus(number: String) -> String {
    number.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(division: &Division) -> Vec<&str> {
        division.ticks.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_within_limits() {
        let division = Axis::default().between(-0.7, 1.3).divide([].into_iter(), 5);
        assert_eq!(labels(&division), ["−0.5", "0.0", "0.5", "1.0"]);
        let division = Axis::default().between(0.0, 10.0).divide([].into_iter(), 5);
        assert_eq!(labels(&division), ["0", "2", "4", "6", "8", "10"]);
    }

    #[test]
    fn small_numbers_share_a_power_of_ten() {
        let axis = Axis::new("*u*", "m").between(0.0, 6.5e-4);
        let division = axis.divide([].into_iter(), 5);
        assert_eq!((labels(&division), division.exponent), (vec!["0", "2", "4", "6"], -4));
        assert_eq!(axis.label(division.exponent), "*u* (10^{−4} m)");
    }

    #[test]
    fn decades_enclose_the_data() {
        let axis = Axis::default().logarithmic();
        let division = axis.divide([0.0, 3e-4, 2e-2].into_iter(), 5);
        assert_eq!(labels(&division), ["10^{−4}", "10^{−3}", "10^{−2}", "10^{−1}"]);
        assert!((division.fraction(1e-3) - 1.0 / 3.0).abs() < 1e-12);
        // Limits are not enlarged if they are whole decades.
        assert_eq!(axis.divide([1e-3, 1e3].into_iter(), 10).limits, [1e-3, 1e3]);
    }

    /// Regression: 5e-324 resulted in an infinite number of ticks, and limits of ±1e308 in an infinite step.
    #[test]
    fn tiny_and_huge_values_have_few_ticks() {
        for values in [[0.0, 5e-324], [5e-324, 5e-324], [-1e308, 1e308], [5e-324, 1e308]] {
            for axis in [Axis::default(), Axis::default().logarithmic()] {
                let division = axis.divide(values.into_iter(), 5);
                let [low, high] = division.limits;
                assert!(low < high && high - low < f64::INFINITY, "{values:?}");
                assert!(division.ticks.len() < 1000, "{values:?}");
                assert!(division.ticks.iter().all(|(tick, _)| tick.is_finite()));
            }
        }
    }

    #[test]
    fn empty_and_constant_data_have_an_axis() {
        for values in [vec![], vec![0.0], vec![5.0, 5.0], vec![f64::NAN]] {
            for axis in [Axis::default(), Axis::default().logarithmic()] {
                let [low, high] = axis.divide(values.iter().copied(), 5).limits;
                assert!(low < high, "{values:?} {low} {high}");
            }
        }
        assert_eq!(Axis::default().divide([0.0].into_iter(), 5).exponent, 0);
    }
}

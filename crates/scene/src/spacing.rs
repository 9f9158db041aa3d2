//! Ranges of numbers written as `lo..hi:n` or `lo..hi:n:log`, and times at which signals are sampled.

/// Maximum number of values in a range.
const MAX_VALUES: usize = 100_000;

pub(crate) struct Range<'a> {
    low: &'a str,
    high: &'a str,
    n: Option<&'a str>,
}

impl<'a> Range<'a> {
    /// Splits the text into the parts of a range, or returns `None` if it is not a range. Other texts, such as paths,
    /// may also contain `..`.
    pub(crate) fn read(text: &'a str) -> Option<Self> {
        let (low, rest) = text.split_once("..")?;
        let (high, n) = match rest.split_once(':') {
            Some((high, n)) => (high, Some(n)),
            None => (rest, None),
        };
        let is_number = |word: &str| word.trim().parse::<f64>().is_ok();
        (is_number(low) || is_number(high)).then_some(Self { low, high, n })
    }

    /// Returns whether both ends are whole numbers.
    pub(crate) fn has_whole_ends(&self) -> bool {
        let is_whole = |word: &str| word.trim().parse::<i64>().is_ok();
        is_whole(self.low) && is_whole(self.high)
    }

    /// Returns the part after the ends, such as `120:log`.
    pub(crate) fn spacing(&self) -> Option<&'a str> {
        self.n
    }

    /// Returns the ends, or the reason why they are invalid.
    pub(crate) fn ends(&self) -> Result<[f64; 2], &'static str> {
        let finite = |number: &f64| number.is_finite();
        let number = |word: &str| word.trim().parse::<f64>().ok().filter(finite);
        match (number(self.low), number(self.high)) {
            (Some(low), Some(high)) => Ok([low, high]),
            _ => Err("a range requires finite numbers"),
        }
    }

    /// Returns the values, or the reason why the range is invalid.
    pub(crate) fn values(&self) -> Result<Vec<f64>, &'static str> {
        let [low, high] = self.ends()?;
        let n = self.n.ok_or("`:n` is missing")?;
        let (n, is_log) = match n.trim().strip_suffix(":log") {
            Some(n) => (n, true),
            None => (n, false),
        };
        if is_log && !(low > 0.0 && high > 0.0) {
            return Err("a logarithmic range must have positive ends");
        }
        let n: usize = n.trim().parse().map_err(|_| "n must be a whole number")?;
        if !(2..=MAX_VALUES).contains(&n) {
            return Err("n must be from 2 to 100000");
        }
        let value = |i: usize| {
            let s = i as f64 / (n - 1) as f64;
            match is_log {
                // The ends of the range are exact.
                _ if i == 0 => low,
                _ if i == n - 1 => high,
                true => low * (high / low).powf(s),
                false => (1.0 - s) * low + s * high,
            }
        };
        Ok((0..n).map(value).collect())
    }
}

/// Returns times between `from` and `to`, including both, at which signals are sampled to find their extreme values. The
/// number `n` of intervals should be prime: if it were a round number, a signal with a round number of periods could
/// vanish at all of these times.
pub(crate) fn times(from: f64, to: f64, n: u32) -> impl Iterator<Item = f64> {
    (0..=n).map(move |i| from + (to - from) * f64::from(i) / f64::from(n))
}

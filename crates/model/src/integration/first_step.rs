//! How far the first step looks ahead, whatever the length of the run.
//!
//! Without an initial step of the user both integrators begin with
//! `min(0.001 · (t_out − t), 0.5/‖ẏ‖)`. From rest ẏ is zero and tells nothing, so the first term
//! decides; with the end of the run as t_out a long run would begin with a step over many periods
//! of what drives it. We hand them a t_out that belongs to the drive instead.

/// How many of the system's shortest times t_out lies ahead: the first step is 0.001 of it, 0.08 of
/// the time, half a radian of a sine. For the paper's 8 Hz this is 10 s, the run of Table 2.
const AHEAD: f64 = 80.0;

/// The t_out of the first step at time `t` for a system that changes within `time_scale` (s); the
/// end of the run for one that has no time of its own.
pub(crate) fn look_ahead(t: f64, t_end: f64, time_scale: Option<f64>) -> f64 {
    time_scale.map_or(t_end, |time| t + AHEAD * time)
}

/// The shortest of these times, if one of them is positive and finite.
pub(crate) fn shortest(times: impl IntoIterator<Item = f64>) -> Option<f64> {
    let meaningful = |time: &f64| *time > 0.0 && time.is_finite();
    times.into_iter().filter(meaningful).reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Signal;

    #[test]
    fn the_papers_run_keeps_its_first_step() {
        let time = Signal::paper(100.0).time_scale();
        assert_eq!(look_ahead(0.0, 10.0, time), 10.0);
        assert_eq!(look_ahead(0.0, 2000.0, time), 10.0);
        assert_eq!(look_ahead(1.0, 7.0, None), 7.0);
    }
}

//! What loads have done and damping has taken: powers over time, by Simpson's rule.

use myovib_model::Energies;

/// Work and dissipation since the start, J per metre of depth.
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
pub struct Exchanged {
    /// By loads, moved supports and active stresses.
    pub work: f64,
    /// By damping.
    pub dissipated: f64,
}

impl Exchanged {
    /// Adds what an interval of `h` seconds brings, by the powers at its start, middle and end.
    pub fn add(&mut self, h: f64, [start, middle, end]: [&Energies; 3]) {
        let simpson = |power: fn(&Energies) -> f64| {
            h / 6.0 * (power(start) + 4.0 * power(middle) + power(end))
        };
        self.work += simpson(|e| e.load + e.support + e.active);
        self.dissipated += simpson(|e| e.dissipation);
    }

    /// kinetic + elastic + dissipated − work, zero for the exact motion.
    pub fn imbalance(&self, now: &Energies) -> f64 {
        now.kinetic + now.elastic + self.dissipated - self.work
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Powers ∝ t³, which the rule integrates exactly: over [0, 6] to 6⁴/4 = 324 times the factor,
    /// all numbers without rounding.
    #[test]
    fn cubic_powers_are_integrated_exactly() {
        let at = |t: f64| Energies {
            kinetic: 50.0,
            elastic: 10.0,
            load: 2.0 * t.powi(3),
            support: 0.5 * t.powi(3),
            active: 0.5 * t.powi(3),
            dissipation: 0.5 * t.powi(3),
        };
        let mut exchanged = Exchanged::default();
        exchanged.add(6.0, [&at(0.0), &at(3.0), &at(6.0)]);
        assert_eq!((exchanged.work, exchanged.dissipated), (972.0, 162.0));
        assert_eq!(exchanged.imbalance(&at(6.0)), 60.0 + 162.0 - 972.0);
    }
}

//! Chains of Van der Pol and Duffing oscillators.
#![forbid(unsafe_code)]

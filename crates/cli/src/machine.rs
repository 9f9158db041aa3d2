//! Properties of the machine that affect measured times.

use std::fs;
use std::num::NonZeroUsize;
use std::thread;

use serde::Serialize;

/// Processor, system and cores.
#[derive(Debug, Clone, Serialize)]
pub struct Machine {
    /// Name of the processor, if the system reports it.
    pub processor: Option<String>,
    /// Architecture and operating system.
    pub target: String,
    /// Number of cores available to this process.
    pub cores: NonZeroUsize,
    /// Widest vector instruction set of the processor.
    pub simd: &'static str,
}

impl Machine {
    /// Detects the properties of this machine.
    pub fn found() -> Self {
        Self {
            processor: processor(),
            target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            cores: n_cores(),
            simd: simd(),
        }
    }
}

/// Returns the number of cores available to this process, or one if the system does not report it.
pub fn n_cores() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

#[cfg(target_arch = "x86_64")]
fn simd() -> &'static str {
    if is_x86_feature_detected!("avx512f") {
        "AVX-512"
    } else if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        "AVX2 with FMA"
    } else if is_x86_feature_detected!("avx") {
        "AVX"
    } else {
        "SSE2"
    }
}

#[cfg(target_arch = "aarch64")]
fn simd() -> &'static str {
    "NEON"
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn simd() -> &'static str {
    "unknown"
}

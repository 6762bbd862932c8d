//! The machine that a time was measured on.

use serde::{Deserialize, Serialize};

/// What a measured time depends on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Name of the processor, as the system gives it; otherwise its architecture.
    pub processor: String,
    /// Threads that can run at once.
    pub threads: usize,
    /// Operating system.
    pub system: String,
}

impl Machine {
    /// The machine that the program runs on.
    pub fn this() -> Self {
        let named = modiste_io::read_text("/proc/cpuinfo").ok().and_then(|text| processor_name(&text));
        Self {
            processor: named.unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            threads: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            system: std::env::consts::OS.to_owned(),
        }
    }
}

/// Memory of this process (MB).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// What it has now.
    pub resident_mb: f64,
    /// The most that it had.
    pub peak_mb: f64,
}

impl Memory {
    /// What the system says; `None` where it does not.
    pub fn now() -> Option<Self> {
        parse_memory(&modiste_io::read_text("/proc/self/status").ok()?)
    }
}

/// From Linux's description of a process.
fn parse_memory(status: &str) -> Option<Memory> {
    let megabytes = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
        Some(kibibytes * 1024.0 / 1e6)
    };
    Some(Memory { resident_mb: megabytes("VmRSS:")?, peak_mb: megabytes("VmHWM:")? })
}

/// Lets the peak of [`Memory`] begin anew, where the system can.
pub fn reset_peak_memory() {
    let _only_a_measurement = modiste_io::write_in_place("/proc/self/clear_refs", b"5");
}

/// The first model name in Linux's list of processors.
fn processor_name(cpuinfo: &str) -> Option<String> {
    let line = cpuinfo.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::{Machine, parse_memory, processor_name};

    #[test]
    fn memory_is_read() {
        let memory = parse_memory("Name:\tx\nVmHWM:\t  2000 kB\nVmRSS:\t  1000 kB\n").unwrap();
        assert!((memory.peak_mb - 2.048).abs() < 1e-12 && (memory.resident_mb - 1.024).abs() < 1e-12);
        assert_eq!(parse_memory("VmRSS: many kB"), None);
    }

    #[test]
    fn the_processor_is_named() {
        let list = "processor\t: 0\nmodel name\t: Some CPU @ 2.0 GHz\nflags\t: a b\n";
        assert_eq!(processor_name(list).as_deref(), Some("Some CPU @ 2.0 GHz"));
        assert_eq!(processor_name("flags : a"), None);
        let machine = Machine::this();
        assert!(!machine.processor.is_empty() && machine.threads > 0);
    }
}

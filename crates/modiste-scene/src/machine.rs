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

/// The largest memory that the program has had since [`reset_peak_memory`] (bytes); `None` where the system does not tell.
pub fn peak_memory() -> Option<u64> {
    memory("VmHWM:")
}

/// The memory that the program has now (bytes); `None` where the system does not tell.
pub fn resident_memory() -> Option<u64> {
    memory("VmRSS:")
}

fn memory(name: &str) -> Option<u64> {
    parse_memory(&modiste_io::read_text("/proc/self/status").ok()?, name)
}

/// From Linux's description of a process (bytes).
fn parse_memory(status: &str, name: &str) -> Option<u64> {
    let line = status.lines().find(|line| line.starts_with(name))?;
    let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kilobytes)
}

/// Lets [`peak_memory`] begin anew, where the system can.
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
        let status = "Name:\tx\nVmHWM:\t  2000 kB\nVmRSS:\t  1000 kB\n";
        assert_eq!(parse_memory(status, "VmHWM:"), Some(2_048_000));
        assert_eq!(parse_memory(status, "VmRSS:"), Some(1_024_000));
        assert_eq!(parse_memory("VmRSS: many kB", "VmRSS:"), None);
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

//! This process's memory, descriptors and processor time, for operators. They are read only on Linux.

use std::fs;

/// Clock ticks per second in processor times; Linux reports the same value on all machines.
const CLOCK_TICKS_PER_SECOND: f64 = 100.0;

/// Physical memory in use, in bytes.
pub fn resident_bytes() -> Option<u64> {
    resident(&fs::read_to_string("/proc/self/status").ok()?)
}

pub fn open_descriptors() -> Option<u64> {
    // The directory itself is open while it is being read.
    Some(fs::read_dir("/proc/self/fd").ok()?.count().saturating_sub(1) as u64)
}

/// Processor time that all threads have used in user and system mode, in seconds.
pub fn cpu_seconds() -> Option<f64> {
    cpu(&fs::read_to_string("/proc/self/stat").ok()?)
}

fn resident(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes << 10)
}

/// Parses fields 14 and 15. The second field is a name in brackets that may contain anything.
fn cpu(stat: &str) -> Option<f64> {
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<u64>().ok();
    Some((ticks()? + ticks()?) as f64 / CLOCK_TICKS_PER_SECOND)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fields_are_found() {
        assert_eq!(resident("Name:\tx\nVmRSS:\t    1960 kB\n"), Some(1960 << 10));
        assert_eq!(resident("VmRSS: many"), None);
        let stat = "7 (a (b) c) S 1 2 3 4 5 6 7 8 9 10 150 50 0 0";
        assert_eq!(cpu(stat), Some(2.0));
        assert_eq!(cpu("7 (a) S"), None);
    }
}

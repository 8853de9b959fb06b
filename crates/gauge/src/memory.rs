//! Memory of a method that does not tell its own: by how much it makes this process's resident memory grow.

/// Resident memory at a moment, bytes; `None` where the system does not tell.
pub struct Resident(Option<u64>);

impl Resident {
    /// Now, after what was freed has gone back to the system, so that the next method does not grow into it unseen.
    pub fn now() -> Resident {
        #[cfg(all(target_os = "linux", target_env = "gnu"))]
        // SAFETY: gives free pages back; takes no pointer.
        unsafe {
            libc::malloc_trim(0);
        }
        Resident(resident_bytes())
    }

    /// MB more than then; 0 where it is not known.
    pub fn growth_mb(&self) -> f64 {
        match (self.0, Resident::now().0) {
            (Some(before), Some(after)) => after.saturating_sub(before) as f64 / 1e6,
            _ => 0.0,
        }
    }
}

/// Resident memory of this process, bytes; `None` where the system does not tell: only Linux does.
pub fn resident_bytes() -> Option<u64> {
    stated(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// The line `VmRSS:  123 kB` of /proc/self/status.
fn stated(status: &str) -> Option<u64> {
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kilobytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_is_found() {
        let status = "Name:\tupt\nVmHWM:\t  900 kB\nVmRSS:\t  812 kB\nThreads:\t1\n";
        assert_eq!(stated(status), Some(812 * 1024));
        assert_eq!(stated("Name:\tupt\n"), None);
    }

    /// The test that measures runs in a process of its own: what other tests of this program allocate would be counted too.
    #[cfg(target_os = "linux")]
    const ALONE: &str = "UPT_TEST_MEMORY_ALONE";

    #[cfg(target_os = "linux")]
    #[test]
    fn written_pages_are_counted_and_freed_ones_are_not() {
        if std::env::var_os(ALONE).is_none() {
            let name = "memory::tests::written_pages_are_counted_and_freed_ones_are_not";
            let program = std::env::current_exe().unwrap();
            let run = std::process::Command::new(program)
                .args(["--exact", name, "--test-threads=1"])
                .env(ALONE, "1")
                .output()
                .unwrap();
            let printed = String::from_utf8_lossy(&run.stdout);
            assert!(
                run.status.success() && printed.contains("1 passed"),
                "{printed}"
            );
            return;
        }
        let before = Resident::now();
        let table = vec![1u8; 64 << 20];
        let with = before.growth_mb();
        assert!((60.0..90.0).contains(&with), "{with} MB");
        drop(std::hint::black_box(table));
        let after = before.growth_mb();
        assert!(after < 30.0, "{after} MB");
    }
}

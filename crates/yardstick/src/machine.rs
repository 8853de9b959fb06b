//! The machine that a measurement was made on.

use serde::Serialize;

/// Enough to tell two machines apart, and nothing that identifies a person or a host.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    pub cpu: String,
    pub cores: usize,
    pub memory_gb: f64,
    pub os: String,
    pub architecture: String,
    pub features: Vec<&'static str>,
}

impl Machine {
    pub fn this() -> Self {
        Self {
            cpu: cpu_name(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            memory_gb: field_of("/proc/meminfo", "MemTotal")
                .and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok())
                .map_or(0.0, |kib| (kib / 1024.0 / 1024.0 * 10.0).round() / 10.0),
            os: field_of("/etc/os-release", "PRETTY_NAME").map_or_else(
                || std::env::consts::OS.to_owned(),
                |text| text.trim_matches('"').to_owned(),
            ),
            architecture: std::env::consts::ARCH.into(),
            features: cpu_features(),
        }
    }
}

/// What else the machine was doing: the mean number of running threads over the last minute; none where the system does not tell.
pub fn load() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().next()?.parse().ok()
}

/// The same for a line of text: `, load 1.9`, or nothing.
pub fn load_words() -> String {
    load().map_or(String::new(), |load| format!(", load {load:.1}"))
}

/// The value of a `name: value` or `name=value` line of a system file.
fn field_of(path: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    text.lines().find_map(|line| {
        let (key, value) = line.split_once([':', '='])?;
        (key.trim() == name).then(|| value.trim().to_owned())
    })
}

/// The processor's marketing name, or the architecture where the system does not tell.
pub fn cpu_name() -> String {
    field_of("/proc/cpuinfo", "model name").unwrap_or_else(|| std::env::consts::ARCH.into())
}

/// Vector features that the kernels look for.
pub fn cpu_features() -> Vec<&'static str> {
    #[cfg(target_arch = "x86_64")]
    {
        let found = [
            ("avx2", is_x86_feature_detected!("avx2")),
            ("fma", is_x86_feature_detected!("fma")),
            ("f16c", is_x86_feature_detected!("f16c")),
            ("avx512f", is_x86_feature_detected!("avx512f")),
            ("avx512vnni", is_x86_feature_detected!("avx512vnni")),
            ("avx512bf16", is_x86_feature_detected!("avx512bf16")),
        ];
        found
            .into_iter()
            .filter(|feature| feature.1)
            .map(|feature| feature.0)
            .collect()
    }
    #[cfg(target_arch = "aarch64")]
    {
        vec!["neon"]
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    {
        Vec::new()
    }
}

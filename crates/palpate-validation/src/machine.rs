use serde::{Deserialize, Serialize};
use std::fmt;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    pub cores: usize,
    /// Model, or else architecture.
    pub processor: String,
}

impl Machine {
    pub fn this() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let information = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = model(&information).unwrap_or(std::env::consts::ARCH);
        Self { cores, processor: model.to_owned() }
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} cores, {}", self.cores, self.processor)
    }
}

/// Model in the text of /proc/cpuinfo.
fn model(information: &str) -> Option<&str> {
    let line = information.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn model_is_read_from_the_first_processor() {
        let text =
            "processor\t: 0\nmodel name\t: Some CPU @ 2.5 GHz\n\nprocessor\t: 1\nmodel name\t: Other\n";
        assert_eq!(model(text), Some("Some CPU @ 2.5 GHz"));
        assert_eq!(model("processor : 0\n"), None);
    }
}

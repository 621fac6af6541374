//! The repository holds text: what can be made is made, and pictures are SVG.

use super::Finding;
use super::project::Project;

/// Bytes at the head of a file that tell whether it is text.
const HEAD: usize = 8192;

/// Files with a NUL byte near their head.
pub fn findings(project: &Project) -> Vec<Finding> {
    let binary = project.files.iter().filter(|file| file.bytes.iter().take(HEAD).any(|byte| *byte == 0));
    binary
        .map(|file| {
            Finding::new(&file.path, 1, "a binary file: make it when it is needed, or keep it as text")
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nul_byte_near_the_head_tells_a_binary_file() {
        assert_eq!(findings(&Project::from_files(&[("a.png", "x\0y")])).len(), 1);
        assert_eq!(
            findings(&Project::from_files(&[("a.svg", "<svg/>"), ("b", &("x".repeat(HEAD) + "\0"))])),
            []
        );
    }
}

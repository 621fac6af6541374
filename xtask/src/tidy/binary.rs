//! Rule: files are text; pictures are SVG, or in the manuals PNG or WebP of limited size.

use super::Finding;
use super::project::{File, Project};

/// Leading bytes that identify text.
const HEAD: usize = 8192;
const IMAGES: &str = "docs/images/";
const LARGEST_IMAGE: usize = 300_000;
const ALL_IMAGES: usize = 2_000_000;

pub fn findings(project: &Project) -> Vec<Finding> {
    let is_binary = |file: &&File| file.bytes.iter().take(HEAD).any(|byte| *byte == 0);
    let (images, others): (Vec<&File>, Vec<&File>) =
        project.files.iter().filter(is_binary).partition(|file| is_image(&file.path));
    let finding = |file: &File, what: String| Finding::new(&file.path, 1, what);
    let mut findings: Vec<Finding> = others
        .into_iter()
        .map(|file| finding(file, "a binary file: make it when it is needed, or keep it as text".to_owned()))
        .collect();
    let too_large = images.iter().filter(|file| file.bytes.len() > LARGEST_IMAGE);
    findings.extend(too_large.map(|file| {
        finding(
            file,
            format!("a picture of {} kB; at most {}", file.bytes.len() / 1000, LARGEST_IMAGE / 1000),
        )
    }));
    let total: usize = images.iter().map(|file| file.bytes.len()).sum();
    if let Some(last) = images.last().filter(|_| total > ALL_IMAGES) {
        findings.push(finding(
            last,
            format!("pictures of {} kB in all; at most {}", total / 1000, ALL_IMAGES / 1000),
        ));
    }
    findings
}

fn is_image(path: &str) -> bool {
    path.starts_with(IMAGES) && [".png", ".webp"].iter().any(|end| path.ends_with(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_binary_files() {
        assert_eq!(findings(&Project::from_files(&[("a.png", "x\0y")])).len(), 1);
        assert_eq!(
            findings(&Project::from_files(&[("a.svg", "<svg/>"), ("b", &("x".repeat(HEAD) + "\0"))])),
            []
        );
    }

    #[test]
    fn allows_pictures_of_the_manuals_up_to_a_size() {
        let image = |size: usize| "\0".repeat(size);
        let small = image(LARGEST_IMAGE);
        assert_eq!(findings(&Project::from_files(&[("docs/images/a.png", &small)])), []);
        let large = image(LARGEST_IMAGE + 1);
        assert_eq!(findings(&Project::from_files(&[("docs/images/a.webp", &large)])).len(), 1);
        let names: Vec<String> = (0..7).map(|i| format!("docs/images/{i}.png")).collect();
        let many: Vec<(&str, &str)> = names.iter().map(|name| (name.as_str(), small.as_str())).collect();
        assert_eq!(findings(&Project::from_files(&many)).len(), 1);
    }
}

//! The sender in C, compared with the encoder of the library.

use palpate_live::frame::encode_into;
use palpate_testing::skip::skip;
use std::path::Path;
use std::process::Command;

#[test]
fn frames_in_c_are_those_of_the_library() {
    if Command::new("cc").arg("--version").output().is_err() {
        return skip("a C compiler (cc)", "install Debian's gcc");
    }
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("example");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/firmware/example.c");
    let built = Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-o"])
        .args([&program, &source])
        .status();
    assert!(built.unwrap().success());
    for count in [0_u8, 1, 3, 8, 61, 62, 63, 64, 255] {
        let frames = 2000_u32;
        let sent = Command::new(&program).args([frames.to_string(), count.to_string()]).output().unwrap();
        let mut expected = Vec::new();
        for n in 0..frames {
            let values: Vec<f32> = (0..count).map(|i| n as f32 * 0.25 - f32::from(i)).collect();
            encode_into(&mut expected, n, n * 1000, &values);
        }
        assert!(sent.status.success() && sent.stdout == expected, "{count} values");
    }
}

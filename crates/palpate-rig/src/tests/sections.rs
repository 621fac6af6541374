use super::*;
use std::path::Path;

fn only(rig: &str, wanted: &[&str]) -> String {
    let mut kept = false;
    let lines = rig.lines().filter(|line| {
        if line.starts_with('[') {
            let name = line.trim_start_matches('[').split([']', '.']).next().unwrap();
            kept = wanted.contains(&name);
        }
        kept
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn examples() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .map(|path| std::fs::read_to_string(path).unwrap())
        .collect()
}

#[test]
fn separate_sections_build_the_same_rig() {
    let texts = examples();
    assert!(texts.len() >= 20, "{} examples", texts.len());
    for text in texts {
        let rig = Rig::from_toml(&text).unwrap();
        let read = |wanted: &[&str]| RigSections::from_toml(&only(&text, wanted)).unwrap();
        let bench = read(&["surface", "sensors", "contact", "recording", "imperfections"]);
        let setup = bench.setup().unwrap();
        assert_eq!(&setup, &rig.setup);
        assert_eq!(&read(&["surface"]).surface().unwrap(), rig.setup.surface());
        assert_eq!(read(&["training"]).training(&setup).unwrap(), rig.training);
        assert_eq!(read(&["estimator"]).estimator(&setup).unwrap().unwrap_or_default(), rig.estimator);
        assert_eq!(read(&["load"]).loads(setup.surface()).unwrap(), rig.loads);
        assert_eq!(read(&["surface", "motion"]).motion(&setup).unwrap(), rig.motion);
        assert_eq!(read(&["design"]).design(&setup).unwrap(), rig.design);

        let none = RigSections::from_toml("").unwrap();
        assert_eq!(none.training(&setup).unwrap(), None);
        assert_eq!(none.estimator(&setup).unwrap(), None);
        assert_eq!(none.motion(&setup).unwrap(), None);
        assert_eq!(none.design(&setup).unwrap(), None);
    }
}

#[test]
fn a_section_is_refused_with_a_caret_where_it_is_built() {
    let setup = Rig::from_toml(BENCH).unwrap().setup;
    let refused = |text: &str, build: &dyn Fn(&RigSections) -> RigError| {
        let error = build(&RigSections::from_toml(text).unwrap());
        let place = error.span.clone().map_or(String::new(), |span| text[span].to_owned());
        format!("{error} | {place}")
    };
    let shown = [
        refused("", &|sections| sections.surface().unwrap_err()),
        refused(&only(BENCH, &["sensors"]), &|sections| sections.setup().unwrap_err()),
        refused(&only(BENCH, &["surface"]), &|sections| sections.setup().unwrap_err()),
        refused("training = { positions = [\"20 mm\", \"401 mm\"] }", &|sections| {
            sections.training(&setup).unwrap_err()
        }),
        refused("estimator = { kind = \"network\", input_scale = \"5 N\" }", &|sections| {
            sections.estimator(&setup).unwrap_err()
        }),
        refused("load = [{ from = \"390 mm\", to = \"401 mm\", force = \"1 N\" }]", &|sections| {
            sections.loads(setup.surface()).unwrap_err()
        }),
        refused("design = { must_have = [{ at = \"401 mm\" }] }", &|sections| {
            sections.design(&setup).unwrap_err()
        }),
    ];
    insta::assert_snapshot!(shown.join("\n"));
    // An unknown key is refused before a section is built.
    let error = RigSections::from_toml("training = { cuont = 10 }").unwrap_err();
    assert_eq!(error.to_string(), "unknown key `cuont`, did you mean `count`?");
}

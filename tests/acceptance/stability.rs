//! Checks that failing runs report the location of the failure, and that results are reproducible bit by bit.

use std::fs;

use crate::harness::myovib_in;
use crate::results::read_json;

/// Block that is clamped at both ends and compressed fast. At a loose tolerance, Newton's method ends with inverted
/// elements.
const CRUSHED: &str = r#"
[time]
end = 0.5

[mesh]
type = "rectangle"
width = 1.0
height = 0.5
cells = [3, 2]

[solid]
bulk_modulus = 1e5
rayleigh_mass = 1.0
rayleigh_stiffness = 0.0
formulation = "position"
allow_inverted = true

[[material]]
law = "mooney-rivlin"
density = 1.1e3
c10 = 1e4
c01 = 2e2

[[fixed]]
group = "left"

[[prescribed_displacement]]
group = "right"
x = { type = "step", value = -0.95, rise = 0.02 }
y = 0.0

[integrator]
rtol = 0.1
atol = { u = 0.1, v = 0.1, p = 1e4, p_rate = 5.0 }
"#;

#[test]
fn an_inverted_element_is_named_in_the_message_and_in_the_document() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("crushed.toml"), CRUSHED).unwrap();
    myovib_in(folder.path(), &["run", "crushed.toml", "--quiet"]).with_code(3);
    let document = read_json(&folder.path().join("out/run.json"));
    let stop = &document["stop"];
    assert!(stop["J"].as_f64().unwrap() <= 0.0, "{stop}");
    assert_eq!(stop["barycentric"].as_array().unwrap().len(), 3);
    let named = format!("in element {} at barycentric", stop["element"]);
    let message = document["message"].as_str().unwrap();
    assert!(message.contains(&named), "`{named}` in: {message}");
    let blamed = format!("Likely cause: element {} is inverted", stop["element"]);
    assert!(message.contains(&blamed), "`{blamed}` in: {message}");
    assert!(document["work"]["inversions"].as_u64().unwrap() > 0);
}

#[test]
fn the_same_scene_gives_the_same_bits_whatever_the_threads() {
    let folder = tempfile::tempdir().unwrap();
    let probes = |out: &str, threads: &str| -> Vec<(String, Vec<u8>)> {
        let arguments = [
            "run",
            "figure6",
            "--set",
            "time.end=0.3",
            "--quiet",
            "--threads",
            threads,
            "--out",
            out,
        ];
        myovib_in(folder.path(), &arguments).with_code(0);
        let mut files: Vec<_> = fs::read_dir(folder.path().join(out))
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.extension().is_some_and(|e| e == "csv"))
            .collect();
        files.sort();
        let read = |path: &std::path::PathBuf| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, fs::read(path).unwrap())
        };
        files.iter().map(read).collect()
    };
    let (one, again, two) = (probes("one", "1"), probes("again", "1"), probes("two", "2"));
    assert!(!one.is_empty() && one.iter().all(|(_, bytes)| bytes.len() > 100));
    assert_eq!(one, again);
    assert_eq!(one, two);
}

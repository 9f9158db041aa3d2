//! Complex fields of a response as VTU files.

use std::path::Path;

use myovib_scene::Scene;
use myovib_scene::run::{RunOptions, compute};
use myovib_scene::vtu;
use num_complex::Complex64;

use crate::column;
use crate::ratios::slab;

#[test]
fn fields_have_the_amplitudes_of_probes() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let set = vec!["response.fields=[40.0, 12.5]".to_owned()];
    let text = slab(2).replace("[10.0, 40.0, 70.0]", "[12.5, 40.0]");
    let scene = Scene::build("scene.toml", &text, &set, Path::new("")).unwrap();
    let found = compute(&scene, &RunOptions::into_folder(&out));
    let found = found.unwrap().response.unwrap();
    let text = std::fs::read_to_string(out.join(vtu::AMPLITUDES_LIST)).unwrap();
    for (i, frequency) in [40.0, 12.5].into_iter().enumerate() {
        assert!(text.contains(&format!("timestep=\"{frequency}\"")));
        let (mesh, fields) = vtu::read(&out.join(format!("amplitudes_{i:05}.vtu"))).unwrap();
        let field = |name: &str| &fields.iter().find(|field| field.name == name).unwrap().values;
        let middle = mesh.points.iter().position(|point| point[..2] == [0.0, 0.015]).unwrap();
        let [re, im] = ["u_re", "u_im"].map(|name| field(name)[3 * middle]);
        let k = found.frequencies.iter().position(|f| *f == frequency).unwrap();
        let expected = column(&found, "middle", "u_x")[k];
        let error = (Complex64::new(re, im) - expected).norm() / expected.norm();
        // Probe values are difference quotients with a step of 1e-5, which have rounding errors of 1e-11.
        assert!(error < 1e-9, "{error:e}");
        assert_eq!(field("p_re").len(), mesh.points.len());
        assert_eq!(field("p_im").len(), mesh.points.len());
    }
}

/// Regression: a user's file with the name of a list of fields was found only after the computation, when tables had
/// already been written.
#[test]
fn a_list_of_the_user_is_found_before_anything_is_written() {
    let set = vec!["response.fields=[40.0]".to_owned()];
    let scene = Scene::build("scene.toml", &slab(2), &set, Path::new("")).unwrap();
    expect_kept(&scene, vtu::AMPLITUDES_LIST);
}

/// Checks that a run fails and writes nothing if its folder contains the file `name` of the user.
pub(crate) fn expect_kept(scene: &Scene, name: &str) {
    let out = tempfile::tempdir().unwrap();
    std::fs::write(out.path().join(name), "mine").unwrap();
    assert!(compute(scene, &RunOptions::into_folder(out.path())).is_err());
    let files = std::fs::read_dir(out.path()).unwrap().map(|entry| entry.unwrap().file_name());
    assert_eq!(files.collect::<Vec<_>>(), [name]);
}

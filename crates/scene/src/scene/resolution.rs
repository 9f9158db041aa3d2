//! Notes on meshes that are too coarse for obstacles or vibrations.

use myovib_model::slowest_element;

use super::Body;
use crate::scene_file::contact::Obstacle;
use crate::scene_file::{Analysis, SceneFile};

/// Number of elements per wavelength of a shear wave below which a note is added. For a shaken annulus (`ω R/c` up to
/// 12), one element per wavelength gave errors of 50 %, and two gave errors of 2 to 8 %.
const PER_WAVE: f64 = 2.0;

pub(super) fn notes(file: &SceneFile, body: &Body) -> Vec<String> {
    obstacles(file, body).into_iter().chain(waves(file, body)).collect()
}

/// Returns notes on obstacles whose curvature is not resolved by the facets of the body.
fn obstacles(file: &SceneFile, body: &Body) -> Vec<String> {
    let contacts = file.contact.iter().zip(&body.muscle.contacts).enumerate();
    let notes = contacts.filter_map(|(i, (contact, own))| {
        let (Obstacle::Sphere { radius, .. } | Obstacle::Cylinder { radius, .. }) = contact.obstacle
        else {
            return None;
        };
        let size = own.facet_size();
        (size > radius).then(|| {
            format!(
                "the facets of `{}` ({size:.2e} m) are larger than the radius of contact[{i}], {radius:.2e} m: refine the mesh",
                contact.group
            )
        })
    });
    notes.collect()
}

/// Returns a note if elements are long compared with the shear wavelength at the highest frequency.
fn waves(file: &SceneFile, body: &Body) -> Option<String> {
    let frequency = match (file.analysis, &file.response) {
        (Analysis::Response, Some(own)) => own.frequencies.grid().ok()?.ends()[1],
        (Analysis::Dynamic | Analysis::Periodic, _) => body.muscle.forcing_frequency()?,
        _ => return None,
    };
    let [edge, speed] = slowest_element(&body.muscle);
    let wave = speed / frequency;
    (PER_WAVE * edge > wave).then(|| {
        format!(
            "at {frequency:.4} Hz, shear waves are about {wave:.2e} m long, and elements up to {edge:.2e} m: refine the mesh to \
             about four elements per wavelength"
        )
    })
}

#[cfg(test)]
mod tests {
    use crate::scene::idle;

    /// Returns the number of notes. Shear waves have the speed √(μ/ρ) = √10 m/s. At √5 Hz, the wavelength is √2 m. This
    /// is twice the length of the longest edge, a diagonal of √2/2 m.
    fn notes(more: &str, set: &[&str]) -> usize {
        let notes = idle::tests::notes(more, set);
        assert!(notes.iter().all(|note| note.contains("shear waves")), "{notes:?}");
        notes.len()
    }

    #[test]
    fn elements_longer_than_half_a_wave_are_noted() {
        let response = "[response]\nfrequencies = \"1..2:5\"\n";
        let load = "traction=[{ group = \"right\", response = { y = 1.0 } }]";
        let to = |f: &str| format!("response.frequencies=\"1..{f}:adaptive\"");
        let of = |f: &str, more: &[&str]| {
            notes(response, &[&["analysis=response", load, &to(f)], more].concat())
        };
        assert_eq!(of("2.2", &[]), 0);
        assert_eq!(of("2.3", &[]), 1);
        assert_eq!(of("2.3", &["mesh.refine=1"]), 0);
        assert_eq!(of("2.3", &["material[0].density=900"]), 0);

        let shaken = |f: f64| {
            let load =
                format!("traction[0].y={{ type = \"sine\", amplitude = 1.0, frequency = {f} }}");
            notes("", &["analysis=dynamic", "time.end=1.0", &load])
        };
        assert_eq!(shaken(2.2), 0);
        assert_eq!(shaken(2.3), 1);
    }
}

//! Context for building a scene: its text, to which messages refer, and its folder, from which files are read.

use std::cell::RefCell;
use std::fmt::Display;
use std::path::Path;

use myovib_fem::FemError;
use myovib_model::ModelError;

use crate::InputError;
use crate::inputs::Inputs;
use crate::scene_file::check::{Problem, nearest, suggest};
use crate::scene_file::{SceneFile, Source};

/// Builder for the parts of a scene. Its errors include the location in the scene.
pub(super) struct Builder<'a> {
    pub(super) file: &'a SceneFile,
    pub(super) source: &'a Source,
    /// Files that are named in the scene.
    pub(super) inputs: &'a Inputs<'a>,
    pub(super) t_end: f64,
    /// Notes on allowed but unusual values.
    pub(super) notes: RefCell<Vec<String>>,
}

impl<'a> Builder<'a> {
    pub(super) fn new(file: &'a SceneFile, source: &'a Source, inputs: &'a Inputs<'a>) -> Self {
        let t_end = file.time.as_ref().map_or(0.0, |time| time.end);
        Self { file, source, inputs, t_end, notes: RefCell::default() }
    }

    /// Reads `file`, which the scene names at `path`. Returns its content, and its name for messages.
    pub(super) fn read(&self, file: &Path, path: &str) -> Result<(Vec<u8>, String), InputError> {
        let name = self.inputs.resolve(file).display().to_string();
        let content = self.inputs.read(file).map_err(|error| {
            let error = InputError::new(format!("cannot read {name}: {error}"));
            self.wrong(path, error)
        })?;
        Ok((content, name))
    }

    /// Reads a file like `read`, but returns text without a byte-order mark. Invalid UTF-8 is not rejected here, so
    /// that the parser of the file format can report it.
    pub(super) fn read_text(
        &self,
        file: &Path,
        path: &str,
    ) -> Result<(String, String), InputError> {
        let (content, name) = self.read(file, path)?;
        let text = String::from_utf8_lossy(&content);
        Ok((text.strip_prefix('\u{feff}').unwrap_or(&text).to_owned(), name))
    }

    /// Adds the location of the value at `path`, such as `traction[0].group`, to the error.
    pub(super) fn wrong(&self, path: &str, error: InputError) -> InputError {
        self.source.report(Problem::new(path, error))
    }

    /// Returns a vector with as many components as the mesh has dimensions. In 2D, the third component is zero.
    pub(super) fn coordinates(
        &self,
        values: &[f64],
        dimension: usize,
        path: &str,
    ) -> Result<[f64; 3], InputError> {
        if values.len() == dimension {
            return Ok(std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0)));
        }
        let error = InputError::new(format!("a vector in this mesh needs {dimension} components"));
        Err(self.wrong(path, error.found(format!("{values:?}"))))
    }

    pub(super) fn unit_vector(
        &self,
        values: &[f64],
        dimension: usize,
        path: &str,
    ) -> Result<[f64; 3], InputError> {
        let vector = self.coordinates(values, dimension, path)?;
        let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 && length.is_finite() {
            return Ok(vector.map(|x| x / length));
        }
        let error = InputError::new("a direction must be a finite nonzero vector");
        Err(self.wrong(path, error.found(format!("{values:?}"))))
    }

    /// Converts the error of a library to an input error with the location of the value at `path`.
    pub(super) fn at<T, E: Explain>(
        &self,
        path: &str,
        result: Result<T, E>,
    ) -> Result<T, InputError> {
        result.map_err(|error| self.wrong(path, error.explain()))
    }
}

/// Conversion of a library error to an input error.
pub(super) trait Explain {
    fn explain(&self) -> InputError;
}

impl Explain for FemError {
    fn explain(&self) -> InputError {
        match self {
            FemError::UnknownGroup { name, known } => {
                let names: Vec<&str> = known.iter().map(String::as_str).collect();
                let error = InputError::new(format!("the mesh has no group `{name}`"));
                if known.is_empty() {
                    return error.found("a mesh without groups").next(format!(
                        "name its parts in Gmsh and save it again: Physical Curve(\"{name}\") = {{…}} for edges, \
                         Physical Surface for faces and plane tissue, Physical Volume for tissue in space; once a \
                         physical group exists, Gmsh saves only the parts in such groups, so name the tissue, too"
                    ));
                }
                suggest(error.allowed(names.join(", ")), nearest(name, &names))
            }
            other => explain(other),
        }
    }
}

impl Explain for ModelError {
    fn explain(&self) -> InputError {
        match self {
            ModelError::Fem(error) => error.explain(),
            other => explain(other),
        }
    }
}

fn explain(error: &impl Display) -> InputError {
    InputError::new(error)
}

#[cfg(test)]
mod tests {
    use myovib_fem::FemError;

    use super::Explain;

    /// Regression: for a mesh without groups, the list of allowed groups was empty.
    #[test]
    fn errors_for_meshes_without_groups_show_how_to_name_one() {
        let printed = |known: &[&str]| {
            let error = FemError::UnknownGroup {
                name: "left".to_owned(),
                known: known.iter().map(|&name| name.to_owned()).collect(),
            };
            error.explain().to_string()
        };
        let of_none = printed(&[]);
        assert!(of_none.contains("Physical Curve(\"left\")"), "{of_none}");
        let of_some = printed(&["right"]);
        assert!(of_some.contains("right"), "{of_some}");
        assert!(!of_some.contains("Physical"), "{of_some}");
    }
}

//! Arrays of VTK files, encoded in base64, which is exact and needs no number parser.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::text::escape;

/// Formats the start of a file, up to its points.
pub(super) fn head(n_points: usize, n_cells: usize) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n\
         <UnstructuredGrid>\n\
         <Piece NumberOfPoints=\"{n_points}\" NumberOfCells=\"{n_cells}\">\n<Points>\n"
    )
}

/// End of a file, after its last data.
pub(super) const END: &str = "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";

/// Formats an array of 64-bit numbers; several components need names.
pub(super) fn floats(
    name: &str,
    components: &[&str],
    width: usize,
    values: impl Iterator<Item = f64>,
) -> String {
    let names = components.iter().enumerate();
    let names = names.map(|(i, name)| format!(" ComponentName{i}=\"{name}\""));
    let attributes = format!(
        "NumberOfComponents=\"{width}\"{}",
        names.collect::<String>()
    );
    array(
        "Float64",
        name,
        &attributes,
        values.flat_map(f64::to_le_bytes),
    )
}

/// Formats an array of integers.
pub(super) fn integers(name: &str, values: impl Iterator<Item = usize>) -> String {
    let bytes = values.flat_map(|value| (value as i64).to_le_bytes());
    array("Int64", name, "NumberOfComponents=\"1\"", bytes)
}

/// Reads the array `name` from a file written by this module.
pub(super) fn read_floats(text: &str, name: &str) -> Option<Vec<f64>> {
    let start = format!("<DataArray type=\"Float64\" Name=\"{}\"", escape(name));
    let (_, rest) = text.split_once(&start)?;
    let (_, rest) = rest.split_once('>')?;
    let (content, _) = rest.split_once('<')?;
    let bytes = STANDARD.decode(content).ok()?;
    let numbers = bytes.get(8..)?.as_chunks::<8>().0.iter();
    Some(numbers.map(|bytes| f64::from_le_bytes(*bytes)).collect())
}

/// Formats the number of bytes as a 64-bit integer, followed by the bytes.
fn array(kind: &str, name: &str, attributes: &str, bytes: impl Iterator<Item = u8>) -> String {
    let mut content = vec![0; 8];
    content.extend(bytes);
    let length = (content.len() - 8) as u64;
    content[..8].copy_from_slice(&length.to_le_bytes());
    format!(
        "<DataArray type=\"{kind}\" Name=\"{}\" {attributes} format=\"binary\">{}</DataArray>\n",
        escape(name),
        STANDARD.encode(content)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_back_to_the_last_bit() {
        let values = [0.1, -1.0 / 3.0, f64::MIN_POSITIVE, 6.02e23];
        let text = floats("u", &["x", "y"], 2, values.into_iter());
        assert_eq!(read_floats(&text, "u").unwrap(), values);
        assert!(read_floats(&text, "v").is_none());
        // Names come from scenes.
        let name = "coherence_a\"<b>&\u{1b}";
        let text = floats(name, &[], 1, values.into_iter());
        assert!(
            text.contains("Name=\"coherence_a&quot;&lt;b&gt;&amp;\\u{1b}\""),
            "{text}"
        );
        assert_eq!(read_floats(&text, name).unwrap(), values);
    }
}

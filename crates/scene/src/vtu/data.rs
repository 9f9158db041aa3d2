//! Arrays of VTK files in base64 encoding. The encoding is exact, and no numbers need to be parsed.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::text::escape;

/// Formats the start of a file, up to the point coordinates.
pub(super) fn head(n_points: usize, n_cells: usize) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n\
         <UnstructuredGrid>\n\
         <Piece NumberOfPoints=\"{n_points}\" NumberOfCells=\"{n_cells}\">\n<Points>\n"
    )
}

/// End of a file, after the last data section.
pub(super) const END: &str = "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";

/// Formats an array of 64-bit floating-point numbers with `width` components per point or cell. `components` contains
/// the names of the components; it may be empty.
pub(super) fn floats(
    name: &str,
    components: &[&str],
    width: usize,
    values: impl Iterator<Item = f64>,
) -> String {
    let names = components.iter().enumerate();
    let names = names.map(|(i, name)| format!(" ComponentName{i}=\"{name}\""));
    let attributes = format!("NumberOfComponents=\"{width}\"{}", names.collect::<String>());
    array("Float64", name, &attributes, values.flat_map(f64::to_le_bytes))
}

/// Formats an array of integers.
pub(super) fn integers(name: &str, values: impl Iterator<Item = usize>) -> String {
    let bytes = values.flat_map(|value| (value as i64).to_le_bytes());
    array("Int64", name, "NumberOfComponents=\"1\"", bytes)
}

/// Reads the real-valued field `name` from the text of a file written by this module. Missing values are NaN.
pub fn read_field(text: &str, name: &str) -> Option<Vec<f64>> {
    let start = format!("<DataArray type=\"Float64\" Name=\"{}\"", escape(name));
    let (_, rest) = text.split_once(&start)?;
    let (_, rest) = rest.split_once('>')?;
    numbers(rest.split_once('<')?.0)
}

/// Field read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredField {
    pub name: String,
    /// Names of the components. A scalar has one empty name.
    pub components: Vec<String>,
    /// Values of all points or cells. The components of each point or cell are adjacent.
    pub values: Vec<f64>,
    /// Whether the values belong to cells instead of points.
    pub of_cells: bool,
}

/// Reads the real-valued fields of points and cells from the text of a file written by this module.
pub(super) fn read_fields(text: &str) -> Vec<StoredField> {
    let (of_points, of_cells) = text.split_once("<CellData>").unwrap_or((text, ""));
    let of_points = of_points.split_once("<PointData>").map_or("", |(_, rest)| rest);
    let mut found = Vec::new();
    for (part, of_cells) in [(of_points, false), (of_cells, true)] {
        let arrays = part.split("<DataArray type=\"Float64\"").skip(1);
        found.extend(arrays.filter_map(|array| {
            let (head, rest) = array.split_once('>')?;
            let name = unescaped(attribute(head, "Name")?);
            let width: usize = attribute(head, "NumberOfComponents")?.parse().ok()?;
            let component = |i| attribute(head, &format!("ComponentName{i}")).unwrap_or_default();
            Some(StoredField {
                components: (0..width).map(|i| component(i).to_owned()).collect(),
                values: numbers(rest.split_once('<')?.0)?,
                name,
                of_cells,
            })
        }));
    }
    found
}

/// Reads the integer array `name` from the text of a file written by this module.
pub(super) fn read_integers(text: &str, name: &str) -> Option<Vec<usize>> {
    let (_, rest) = text.split_once(&format!("<DataArray type=\"Int64\" Name=\"{name}\""))?;
    let (_, rest) = rest.split_once('>')?;
    let bytes = STANDARD.decode(rest.split_once('<')?.0).ok()?;
    let numbers = bytes.get(8..)?.as_chunks::<8>().0.iter();
    let number = |bytes: &[u8; 8]| usize::try_from(i64::from_le_bytes(*bytes)).ok();
    numbers.map(number).collect()
}

fn attribute<'a>(head: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = head.split_once(&format!(" {name}=\""))?;
    Some(rest.split_once('"')?.0)
}

/// Reverses [`escape`], except for control characters, which remain escaped.
fn unescaped(text: &str) -> String {
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&")
}

/// Decodes an array that consists of the number of bytes, followed by the numbers.
fn numbers(content: &str) -> Option<Vec<f64>> {
    let bytes = STANDARD.decode(content).ok()?;
    let numbers = bytes.get(8..)?.as_chunks::<8>().0.iter();
    Some(numbers.map(|bytes| f64::from_le_bytes(*bytes)).collect())
}

/// Formats an array that consists of the number of bytes as a 64-bit integer, followed by the bytes.
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
        assert_eq!(read_field(&text, "u").unwrap(), values);
        assert!(read_field(&text, "v").is_none());
        // Names come from scenes and may contain any characters.
        let name = "coherence_a\"<b>&\u{1b}";
        let text = floats(name, &[], 1, values.into_iter());
        assert!(text.contains("Name=\"coherence_a&quot;&lt;b&gt;&amp;\\u{1b}\""), "{text}");
        assert_eq!(read_field(&text, name).unwrap(), values);
    }

    #[test]
    fn fields_are_read_with_their_names_and_components() {
        let vector = floats("u<&\">", &["x", "y"], 2, [1.0, 2.0, 3.0, 4.0].into_iter());
        let scalar = floats("c", &[], 1, [5.0].into_iter());
        let points = floats("points", &[], 3, [0.0; 6].into_iter());
        let text = format!(
            "<Points>{points}</Points><PointData>{vector}</PointData><CellData>{scalar}</CellData>"
        );
        let field = |name: &str, components: &[&str], values: &[f64], of_cells| StoredField {
            name: name.to_owned(),
            components: components.iter().map(|&name| name.to_owned()).collect(),
            values: values.to_vec(),
            of_cells,
        };
        let expected = [
            field("u<&\">", &["x", "y"], &[1.0, 2.0, 3.0, 4.0], false),
            field("c", &[""], &[5.0], true),
        ];
        assert_eq!(read_fields(&text), expected);
    }
}

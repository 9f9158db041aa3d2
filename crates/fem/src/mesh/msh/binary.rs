//! Conversion of binary MSH files to ASCII files of the same version.
//!
//! Integers have 4 bytes; sizes (`size_t`) and floating-point numbers have 8 bytes. All numbers are little-endian.

use std::fmt::{Display, Write};

use super::{ElementType, MshProblem, excerpt};

/// Returns whether a file is binary according to its header.
pub(super) fn is_binary(content: &[u8]) -> bool {
    let mut lines = content.split(|&byte| byte == b'\n');
    let is_msh = lines.next().is_some_and(|l| l.trim_ascii() == b"$MeshFormat");
    let format = String::from_utf8_lossy(lines.next().unwrap_or_default());
    is_msh && format.split_whitespace().nth(1) == Some("1")
}

/// Rewrites a binary file as text.
pub(super) fn to_ascii(content: &[u8]) -> Result<String, MshProblem> {
    let mut bytes = Bytes { rest: content };
    let mut text = String::new();
    bytes.line()?;
    let version = bytes.line()?.split_whitespace().next().unwrap_or_default().to_owned();
    if bytes.int()? != 1 {
        return Err(MshProblem::ByteOrder);
    }
    bytes.close("$EndMeshFormat")?;
    let _ = write!(text, "$MeshFormat\n{version} 0 8\n$EndMeshFormat\n");
    let is_version_2 = version.starts_with('2');
    while let Some(section) = bytes.next_section()? {
        let end = format!("$End{section}");
        let section_text = match section.as_str() {
            "Entities" => bytes.entities(false)?,
            "PartitionedEntities" => bytes.partitioned_entities()?,
            "Nodes" if is_version_2 => bytes.nodes_2()?,
            "Nodes" => bytes.nodes()?,
            "Elements" if is_version_2 => bytes.elements_2()?,
            "Elements" => bytes.elements()?,
            "NodeData" => bytes.node_data()?,
            "PhysicalNames" => bytes.lines_to(&end)?,
            _ => {
                bytes.skip_to(&end)?;
                continue;
            }
        };
        bytes.close(&end)?;
        let _ = write!(text, "${section}\n{section_text}{end}\n");
    }
    Ok(text)
}

/// Unread part of the file.
struct Bytes<'a> {
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], MshProblem> {
        let (head, rest) =
            self.rest.split_first_chunk::<N>().ok_or(MshProblem::Truncated("a number"))?;
        self.rest = rest;
        Ok(*head)
    }

    fn int(&mut self) -> Result<i32, MshProblem> {
        self.take().map(i32::from_le_bytes)
    }

    fn size(&mut self) -> Result<u64, MshProblem> {
        self.take().map(u64::from_le_bytes)
    }

    fn double(&mut self) -> Result<f64, MshProblem> {
        self.take().map(f64::from_le_bytes)
    }

    /// Returns the text up to the end of the line.
    fn line(&mut self) -> Result<&'a str, MshProblem> {
        let end = self.rest.iter().position(|&byte| byte == b'\n');
        let end = end.ok_or(MshProblem::Truncated("a line"))?;
        let (line, rest) = self.rest.split_at(end);
        self.rest = &rest[1..];
        let text = std::str::from_utf8(line).map_err(|_| MshProblem::Expected {
            expected: "a line of text",
            found: excerpt(&String::from_utf8_lossy(line)),
        })?;
        Ok(text.trim())
    }

    /// Returns the name of the next section, or `None` at the end of the file.
    fn next_section(&mut self) -> Result<Option<String>, MshProblem> {
        self.rest = self.rest.trim_ascii_start();
        if self.rest.is_empty() {
            return Ok(None);
        }
        let line = self.line()?;
        let name = line
            .strip_prefix('$')
            .ok_or_else(|| MshProblem::Expected { expected: "a section", found: excerpt(line) })?;
        Ok(Some(name.to_owned()))
    }

    /// Reads the last line of a section. White space before this line is allowed.
    fn close(&mut self, end: &str) -> Result<(), MshProblem> {
        self.rest = self.rest.trim_ascii_start();
        match self.rest.strip_prefix(end.as_bytes()) {
            Some(rest) => {
                self.rest = rest;
                Ok(())
            }
            None => Err(MshProblem::Expected {
                expected: "the end of a section",
                found: excerpt(&String::from_utf8_lossy(&self.rest[..self.rest.len().min(60)])),
            }),
        }
    }

    fn skip_to(&mut self, end: &str) -> Result<(), MshProblem> {
        let found = self.rest.windows(end.len()).position(|w| w == end.as_bytes());
        let found = found.ok_or(MshProblem::Truncated("the end of a section"))?;
        self.rest = &self.rest[found + end.len()..];
        Ok(())
    }

    /// Returns the lines before the end of a section.
    fn lines_to(&mut self, end: &str) -> Result<String, MshProblem> {
        let mut text = String::new();
        while !self.rest.trim_ascii_start().starts_with(end.as_bytes()) {
            let _ = writeln!(text, "{}", self.line()?);
        }
        Ok(text)
    }

    /// Copies numbers to `text`, separated by blanks.
    fn copy<T: Display>(
        &mut self,
        text: &mut String,
        count: u64,
        read: impl Fn(&mut Self) -> Result<T, MshProblem>,
    ) -> Result<(), MshProblem> {
        (0..count).try_for_each(|_| {
            let _ = write!(text, "{} ", read(self)?);
            Ok(())
        })
    }

    /// Copies a count and the same number of integers.
    fn counted_ints(&mut self, text: &mut String) -> Result<(), MshProblem> {
        let count = self.size()?;
        let _ = write!(text, "{count} ");
        self.copy(text, count, Self::int)
    }

    fn entities(&mut self, are_partitioned: bool) -> Result<String, MshProblem> {
        let counts = [self.size()?, self.size()?, self.size()?, self.size()?];
        let mut text = format!("{} {} {} {}\n", counts[0], counts[1], counts[2], counts[3]);
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..count {
                self.copy(&mut text, 1, Self::int)?;
                if are_partitioned {
                    self.copy(&mut text, 2, Self::int)?;
                    self.counted_ints(&mut text)?;
                }
                self.copy(&mut text, if dimension == 0 { 3 } else { 6 }, Self::double)?;
                self.counted_ints(&mut text)?;
                if dimension > 0 {
                    self.counted_ints(&mut text)?;
                }
                text.push('\n');
            }
        }
        Ok(text)
    }

    fn partitioned_entities(&mut self) -> Result<String, MshProblem> {
        let (n_partitions, n_ghosts) = (self.size()?, self.size()?);
        let mut text = format!("{n_partitions}\n{n_ghosts}\n");
        for _ in 0..n_ghosts {
            self.copy(&mut text, 2, Self::int)?;
            text.push('\n');
        }
        Ok(text + &self.entities(true)?)
    }

    fn nodes(&mut self) -> Result<String, MshProblem> {
        let mut text = String::new();
        let n_blocks = self.size()?;
        let _ = write!(text, "{n_blocks} ");
        self.copy(&mut text, 3, Self::size)?;
        for _ in 0..n_blocks {
            let (dimension, entity, is_parametric) = (self.int()?, self.int()?, self.int()?);
            let count = self.size()?;
            let _ = write!(text, "\n{dimension} {entity} {is_parametric} {count}\n");
            for _ in 0..count {
                let _ = writeln!(text, "{}", self.size()?);
            }
            let n_parameters = if is_parametric == 0 { 0 } else { dimension.clamp(0, 3) };
            for _ in 0..count {
                self.copy(&mut text, 3 + n_parameters as u64, Self::double)?;
                text.push('\n');
            }
        }
        Ok(text + "\n")
    }

    fn elements(&mut self) -> Result<String, MshProblem> {
        let mut text = String::new();
        let n_blocks = self.size()?;
        let _ = write!(text, "{n_blocks} ");
        self.copy(&mut text, 3, Self::size)?;
        text.push('\n');
        for _ in 0..n_blocks {
            let (dimension, entity, number) = (self.int()?, self.int()?, self.int()?);
            let count = self.size()?;
            let _ = writeln!(text, "{dimension} {entity} {number} {count}");
            let n_nodes = ElementType::find(i64::from(number))?.n_nodes();
            for _ in 0..count {
                self.copy(&mut text, 1 + n_nodes, Self::size)?;
                text.push('\n');
            }
        }
        Ok(text)
    }

    /// Reads the nodes of version 2, each with a tag and coordinates.
    fn nodes_2(&mut self) -> Result<String, MshProblem> {
        let count = self.count()?;
        let mut text = format!("{count}\n");
        for _ in 0..count {
            self.copy(&mut text, 1, Self::int)?;
            self.copy(&mut text, 3, Self::double)?;
            text.push('\n');
        }
        Ok(text)
    }

    /// Reads the elements of version 2. They are grouped in blocks with the same type and number of tags.
    fn elements_2(&mut self) -> Result<String, MshProblem> {
        let count = self.count()?;
        let mut text = format!("{count}\n");
        let mut read = 0;
        while read < count {
            let (number, in_block, n_tags) = (self.int()?, self.int()?, self.int()?);
            let n_nodes = ElementType::find(i64::from(number))?.n_nodes();
            let n_tags = u64::try_from(n_tags).unwrap_or(0);
            for _ in 0..in_block {
                let _ = write!(text, "{} {number} {n_tags} ", self.int()?);
                self.copy(&mut text, n_tags + n_nodes, Self::int)?;
                text.push('\n');
            }
            read += u64::try_from(in_block).unwrap_or(0).max(1);
        }
        Ok(text)
    }

    /// Reads the tags, which are text, and the values, which are an integer and floating-point numbers for each
    /// node.
    fn node_data(&mut self) -> Result<String, MshProblem> {
        let mut text = String::new();
        let mut last = Vec::new();
        for _ in 0..3 {
            let count = self.count()?;
            let lines = (0..count).map(|_| self.line()).collect::<Result<Vec<_>, _>>()?;
            let _ = writeln!(text, "{count}\n{}", lines.join("\n"));
            last = lines;
        }
        let integer = |index: usize| last.get(index).and_then(|word| word.parse::<u64>().ok());
        let (n_components, n_values) = (integer(1).unwrap_or(0), integer(2).unwrap_or(0));
        for _ in 0..n_values {
            self.copy(&mut text, 1, Self::int)?;
            self.copy(&mut text, n_components, Self::double)?;
            text.push('\n');
        }
        Ok(text)
    }

    /// Reads a count from a line of text.
    fn count(&mut self) -> Result<u64, MshProblem> {
        let line = self.line()?;
        line.parse().map_err(|_| MshProblem::Expected { expected: "a count", found: excerpt(line) })
    }
}

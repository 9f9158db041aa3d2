//! Scene reference of the guide, generated from the schema in the order of a scene file.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use serde_json::Value;

use super::check::written;
use super::schema;

/// A section of the reference: keys of the root, and an example in TOML.
struct Section {
    title: &'static str,
    keys: &'static [&'static str],
    example: &'static str,
}

/// The sections in the order of a scene file. Each key of the root belongs to one of them.
const SECTIONS: &[Section] = &[
    Section {
        title: "Title and analysis",
        keys: &["title", "analysis"],
        example: "title = \"A block under its weight\"\nanalysis = \"static\"",
    },
    Section {
        title: "`[time]`",
        keys: &["time"],
        example: "[time]\nend = 2.0                       # s",
    },
    Section {
        title: "`[mesh]`",
        keys: &["mesh"],
        example: "[mesh]\ntype = \"rectangle\"\nwidth = 0.1                     # m\n\
                  height = 0.02                   # m\ncells = [20, 4]",
    },
    Section {
        title: "`[[region]]`",
        keys: &["region"],
        example: "[[region]]\nname = \"inclusion\"\ncenter = [0.02, 0.0]            # m\n\
                  radii = [0.01, 0.005]           # m",
    },
    Section {
        title: "`[solid]`",
        keys: &["solid"],
        example: "[solid]\nbulk_modulus = 1e5                     # Pa, or inf\n\
                  rayleigh_stiffness = 1e-4                     # s",
    },
    Section {
        title: "`[[material]]`",
        keys: &["material"],
        example: "[[material]]\ngroup = \"muscle\"\nlaw = \"mooney-rivlin\"\n\
                  density = 1.1e3                 # kg/m³\nc10 = 1e4                       # Pa\n\
                  c01 = 2e2                       # Pa\nfiber = [1.0, 0.0]\n\
                  prony = [{ relative_modulus = 0.3, relaxation_time = 0.05 }]\n\
                  active = { type = \"given\", tension = { type = \"step\", value = 2e4, rise = 0.4 } }",
    },
    Section {
        title: "`[[fixed]]`",
        keys: &["fixed"],
        example: "[[fixed]]\ngroup = \"fixed\"\ncomponents = [\"x\"]              # free to slide along y",
    },
    Section {
        title: "`[[prescribed_displacement]]`",
        keys: &["prescribed_displacement"],
        example: "[[prescribed_displacement]]\ngroup = \"fixed\"\n\
                  y = { type = \"step\", value = 0.002, rise = 0.1 }   # m",
    },
    Section {
        title: "`[[elastic_foundation]]`",
        keys: &["elastic_foundation"],
        example: "[[elastic_foundation]]\ngroup = \"load\"\nalong = \"normal\"\nstiffness = 1e6                 # Pa/m\n\
                  damping = 1e3                   # Pa·s/m",
    },
    Section {
        title: "`[[traction]]`",
        keys: &["traction"],
        example: "[[traction]]\ngroup = \"load\"\n\
                  y = { type = \"sine\", amplitude = 50.0, frequency = 8.0 }   # Pa\n\
                  spatial_factor = \"1 - (x/0.02)^2\"",
    },
    Section {
        title: "`[[pressure]]`",
        keys: &["pressure"],
        example: "[[pressure]]\ngroup = \"load\"\nvalue = { type = \"step\", value = 200.0, rise = 0.2 }   # Pa",
    },
    Section {
        title: "`[[body_force]]`",
        keys: &["body_force"],
        example: "[[body_force]]\ny = { type = \"step\", value = -9.81, rise = 0.1 }   # m/s²",
    },
    Section {
        title: "`[initial_state]`",
        keys: &["initial_state"],
        example: "[initial_state]\ntype = \"equilibrium\"",
    },
    Section {
        title: "`[integrator]`",
        keys: &["integrator"],
        example: "[integrator]\nmethod = \"radau9\"\nrtol = 1e-5\nmax_cpu = 600.0                 # s",
    },
    Section {
        title: "`[[probe]]`",
        keys: &["probe"],
        example: "[[probe]]\nname = \"tip\"\ntype = \"point\"\nat = [0.0, 0.0]                 # m\n\
                  quantities = [\"u\", \"von-mises\"]\ninterval = 0.01                    # s",
    },
    Section {
        title: "`[fields]`",
        keys: &["fields"],
        example: "[fields]\ninterval = 0.1                     # s\nquantities = [\"u\", \"p\", \"stress\"]",
    },
    Section {
        title: "`[[stop]]`",
        keys: &["stop"],
        example: "[[stop]]\ntype = \"displacement\"\nat = [0.0, 0.0]                 # m\n\
                  above = 0.005                   # m",
    },
    Section {
        title: "`[checkpoint]`",
        keys: &["checkpoint"],
        example: "[checkpoint]\ninterval = 0.5                     # s",
    },
    Section {
        title: "`[modes]`",
        keys: &["modes"],
        example: "[modes]\ncount = 6\npreload_time = 0.0                  # s",
    },
    Section {
        title: "`[response]`",
        keys: &["response"],
        example: "[response]\nfrequencies = \"1..60:120\"         # Hz\npreload_time = 0.0              # s",
    },
    Section {
        title: "`[[parameter]]`",
        keys: &["parameter"],
        example: "[[parameter]]\nkey = \"material[0].c10\"\nlow = 1e3                       # Pa",
    },
    Section {
        title: "`[[output]]`",
        keys: &["output"],
        example: "[[output]]\nname = \"tip\"                    # column of the data\n\
                  probe = \"origin\"\ncolumn = \"u_y\"\nnoise = 2e-5                    # m",
    },
    Section {
        title: "`[rod]`",
        keys: &["rod"],
        example: "[rod]\nelements = 20\nload = { type = \"sine\", amplitude = 1.0, frequency = 8.0 }",
    },
    Section {
        title: "`[[chain]]`",
        keys: &["chain"],
        example: "[[chain]]\nname = \"belly\"\noscillators = 5\nfrequency_spread = 0.08         # Hz\n\
                  at = [0.0, 0.0]                 # m",
    },
    Section {
        title: "`[[feedback]]`",
        keys: &["feedback"],
        example: "[[feedback]]\nchain = \"belly\"\nat_zero_coherence = 1.5",
    },
];

/// Definitions that many keys share: name, type in the list of a key, title. They follow the sections.
const SHARED: &[[&str; 3]] = &[
    ["Function", "function of time", "Functions of time"],
    ["SpatialFactor", "spatial factor", "Spatial factors"],
    ["Direction", "direction", "Directions of fibers and sheets"],
    ["Quantity", "quantity", "Quantities"],
];

fn shared(name: &str) -> Option<&'static [&'static str; 3]> {
    SHARED.iter().find(|[shared, ..]| *shared == name)
}

/// Returns all keys of a scene with meanings, units, ranges, defaults and examples, as Markdown.
pub fn reference() -> String {
    let schema = schema().to_value();
    let mut page = Page {
        schema: &schema,
        text: String::from(
            "# Scene reference\n\nThe sections are in the usual order of a scene file. `[name]` is a table \
             that occurs once, `[[name]]` a table that may be repeated. Units are SI. Keys are optional unless \
             marked *required*. This page is generated by `myovib schema --markdown`.\n",
        ),
        open: VecDeque::new(),
        printed: BTreeSet::new(),
        anchors: BTreeMap::new(),
    };
    for section in SECTIONS {
        page.section(section);
    }
    for [name, _, title] in SHARED {
        page.open.push_back((*name, format!("## {title}")));
        page.definitions();
    }
    page.text
}

struct Page<'a> {
    schema: &'a Value,
    text: String,
    /// Definitions to print next, with their headings.
    open: VecDeque<(&'a str, String)>,
    printed: BTreeSet<&'a str>,
    /// Anchors of definitions with a heading; the first use gives the heading.
    anchors: BTreeMap<&'a str, String>,
}

impl<'a> Page<'a> {
    fn section(&mut self, section: &Section) {
        self.text += &format!("\n## {}\n", section.title);
        let properties = &self.schema["properties"];
        match section.keys {
            [key] => {
                let property = &properties[*key];
                let entry = references(property).into_iter().next();
                let body = entry.map_or(property, |name| self.definition(name));
                self.printed.extend(entry);
                self.text += &format!("\n{}\n", line(description(body)));
                self.body(body, key);
            }
            keys => {
                self.text.push('\n');
                for key in keys {
                    self.key(key, &properties[*key], false, key);
                }
            }
        }
        self.text += &format!("\n```toml\n{}\n```\n", section.example);
        self.definitions();
    }

    /// Prints the definitions that the text so far refers to.
    fn definitions(&mut self) {
        while let Some((name, heading)) = self.open.pop_front() {
            if !self.printed.insert(name) {
                continue;
            }
            let definition = self.definition(name);
            let about = line(description(definition));
            self.text += &format!("\n{heading}\n\n{about}\n");
            let path = heading.trim_start_matches(['#', ' ']).replace('`', "");
            self.body(definition, &path);
        }
    }

    fn definition(&self, name: &str) -> &'a Value {
        &self.schema["$defs"][name]
    }

    /// Prints the keys of an object and its alternatives.
    fn body(&mut self, schema: &'a Value, path: &str) {
        self.object(schema, path);
        self.alternatives(schema, path);
    }

    fn object(&mut self, schema: &'a Value, path: &str) {
        let Some(properties) = schema["properties"].as_object() else {
            return;
        };
        let is_required = |key: &str| {
            let required = schema["required"].as_array();
            required.is_some_and(|all| all.iter().any(|name| name == key))
        };
        let mut keys: Vec<_> = properties
            .iter()
            .filter(|(_, property)| !property["const"].is_string())
            .collect();
        // The map is sorted by name; required keys come first.
        keys.sort_by_key(|(key, _)| !is_required(key));
        if !keys.is_empty() {
            self.text.push('\n');
        }
        for (key, property) in keys {
            self.key(key, property, is_required(key), path);
        }
    }

    /// Prints a key, its type, default and meaning in one line, and named choices below it.
    fn key(&mut self, key: &str, property: &'a Value, required: bool, path: &str) {
        let presence = match &property["default"] {
            _ if required => ", *required*".to_owned(),
            Value::Null | Value::Object(_) => String::new(),
            value => format!(", default `{value}`"),
        };
        let child = format!("{path}.{key}");
        let kind = self.kind(property, &child);
        let meaning = line(description(property));
        self.text += &format!("- `{key}` ({kind}{presence}): {meaning}\n");
        for name in self.choices_of(property) {
            if self.printed.insert(name) {
                for one in choices(self.definition(name)) {
                    let (name, about) = (&one["const"], line(description(one)));
                    self.text += &format!("  - `{name}`: {about}\n");
                }
            }
        }
    }

    /// Returns the lists of names that a property allows, except shared ones.
    fn choices_of(&self, property: &'a Value) -> Vec<&'a str> {
        let mut found = Vec::new();
        for name in references(property) {
            let definition = self.definition(name);
            if is_choice(definition) && shared(name).is_none() {
                found.push(name);
            } else if !is_choice(definition) && !is_table(definition) {
                found.extend(self.choices_of(definition));
            }
        }
        found
    }

    /// Prints named choices, or the tables that a tag distinguishes.
    fn alternatives(&mut self, schema: &'a Value, path: &str) {
        for one in choices(schema) {
            let tag = one["properties"].as_object().and_then(|properties| {
                let mut keys = properties.iter();
                keys.find_map(|(key, value)| Some((key, value["const"].as_str()?)))
            });
            let about = line(description(one));
            match (tag, one["const"].as_str()) {
                (Some((key, name)), _) => {
                    self.text += &format!("\n**`{key} = \"{name}\"`**: {about}\n");
                    self.object(one, path);
                }
                (None, Some(name)) => {
                    self.text += &format!("\n- `\"{name}\"`: {about}");
                }
                (None, None) => self.alternative(one, path),
            }
        }
        if !self.text.ends_with('\n') {
            self.text.push('\n');
        }
    }

    /// Prints an alternative without a name.
    fn alternative(&mut self, one: &'a Value, path: &str) {
        let name = reference_of(one);
        let nested = name.map(|name| self.definition(name));
        match nested.filter(|definition| is_table(definition)) {
            Some(definition) => {
                self.printed.extend(name);
                if definition["properties"].is_object() {
                    let about = line(description(definition));
                    self.text += &format!("\n- table: {about}\n");
                }
                self.body(definition, path);
            }
            None => {
                let (kind, about) = (self.kind(one, path), line(description(one)));
                let about = if about.is_empty() {
                    about
                } else {
                    format!(": {about}")
                };
                self.text += &format!("\n- {kind}{about}");
            }
        }
    }

    /// Returns the type of a value with its range, and opens the definition that it refers to.
    fn kind(&mut self, schema: &'a Value, path: &str) -> String {
        if let Some(name) = reference_of(schema) {
            return self.named(name, path);
        }
        let several = schema["anyOf"].as_array().or(schema["oneOf"].as_array());
        if let Some(several) = several {
            let known = several.iter().filter(|one| one["type"] != "null");
            let kinds: Vec<_> = known.map(|one| self.kind(one, path)).collect();
            return kinds.join(" or ");
        }
        if let Some(constant) = schema["const"].as_str() {
            return format!("`\"{constant}\"`");
        }
        match type_name(schema) {
            Some("array") => {
                let entries = self.kind(&schema["items"], path);
                match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                    (Some(a), Some(b)) if a == b => format!("list of {a}: {entries}"),
                    (Some(a), Some(b)) => format!("list of {a} to {b}: {entries}"),
                    _ => format!("list: {entries}"),
                }
            }
            Some("object") => {
                let properties = schema["properties"].as_object().into_iter().flatten();
                let keys: Vec<_> = properties
                    .map(|(key, value)| format!("{key} = {}", self.kind(value, path)))
                    .collect();
                format!("`{{ {} }}`", keys.join(", "))
            }
            name => scalar(name) + &range(schema),
        }
    }

    /// Returns the type of a definition: a short description inline, or a link to its heading.
    fn named(&mut self, name: &'a str, path: &str) -> String {
        let definition = self.definition(name);
        if let Some([_, kind, title]) = shared(name) {
            return format!("[{kind}](#{})", title.to_lowercase().replace(' ', "-"));
        }
        if is_choice(definition) {
            let names: Vec<_> = choices(definition)
                .map(|one| format!("`{}`", one["const"]))
                .collect();
            return if self.printed.contains(name) || names.len() < 3 {
                names.join(" or ")
            } else {
                "name".to_owned()
            };
        }
        if !is_table(definition) {
            let several: Vec<_> = choices(definition)
                .map(|one| self.kind(one, path))
                .collect();
            return several.join(" or ");
        }
        self.open.push_back((name, format!("### `{path}`")));
        let anchor = self.anchors.entry(name);
        let anchor = anchor.or_insert_with(|| path.replace('.', ""));
        format!("[table](#{anchor})")
    }
}

fn description(schema: &Value) -> &str {
    schema["description"].as_str().unwrap_or_default()
}

/// Returns the alternatives of a definition.
fn choices(schema: &Value) -> impl Iterator<Item = &Value> {
    let one_of = schema["oneOf"].as_array().into_iter().flatten();
    let any_of = schema["anyOf"].as_array().into_iter().flatten();
    one_of.chain(any_of)
}

/// Returns whether a definition is a list of names.
fn is_choice(schema: &Value) -> bool {
    choices(schema).next().is_some() && choices(schema).all(|one| one["const"].is_string())
}

/// Returns whether a definition is a table, or several tables that a tag distinguishes.
fn is_table(schema: &Value) -> bool {
    let is_tagged = |one: &Value| {
        let properties = one["properties"].as_object().into_iter().flatten();
        properties
            .into_iter()
            .any(|(_, value)| value["const"].is_string())
    };
    schema["properties"].is_object() || choices(schema).any(is_tagged)
}

fn reference_of(schema: &Value) -> Option<&str> {
    schema["$ref"].as_str()?.strip_prefix("#/$defs/")
}

/// Returns the definitions that a property refers to, in lists and alternatives too.
fn references(schema: &Value) -> Vec<&str> {
    let entries = [&schema["items"]].into_iter().chain(choices(schema));
    let below = entries.filter(|one| one.is_object()).flat_map(references);
    reference_of(schema).into_iter().chain(below).collect()
}

fn type_name(schema: &Value) -> Option<&str> {
    match &schema["type"] {
        Value::Array(several) => several
            .iter()
            .find_map(|one| one.as_str().filter(|name| *name != "null")),
        one => one.as_str(),
    }
}

fn scalar(name: Option<&str>) -> String {
    match name {
        Some("integer") => "whole number",
        Some("string") => "text",
        Some("boolean") => "true or false",
        Some(other) => other,
        None => "value",
    }
    .to_owned()
}

fn range(schema: &Value) -> String {
    let bounds = [
        ("exclusiveMinimum", ">"),
        ("minimum", "≥"),
        ("exclusiveMaximum", "<"),
        ("maximum", "≤"),
    ];
    let ranges = bounds.iter().filter_map(|(key, sign)| {
        let bound = schema[*key].as_f64()?;
        // Widths of integer types are not physical ranges.
        (bound.abs() < 4e9).then(|| format!(" {sign} {}", written(bound)))
    });
    ranges.collect::<Vec<_>>().join(",")
}

fn line(text: &str) -> String {
    text.replace('\n', " ")
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;

    #[test]
    fn the_guide_contains_the_current_reference() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../docs/src/scene-reference.md"
        );
        let written = std::fs::read_to_string(path).unwrap_or_default();
        assert!(
            written == reference(),
            "regenerate it: myovib schema --markdown > docs/src/scene-reference.md"
        );
    }

    #[test]
    fn every_key_of_the_root_is_in_one_section() {
        let schema = schema().to_value();
        let mut keys: Vec<_> = schema["properties"].as_object().unwrap().keys().collect();
        let mut listed: Vec<_> = SECTIONS.iter().flat_map(|section| section.keys).collect();
        keys.sort();
        listed.sort();
        assert_eq!(listed, keys);
    }

    #[test]
    fn every_definition_is_printed() {
        let schema = schema().to_value();
        let page = reference();
        for (name, definition) in schema["$defs"].as_object().unwrap() {
            let mut keys = vec![definition];
            keys.extend(choices(definition));
            let properties = keys.iter().filter_map(|one| one["properties"].as_object());
            for key in properties.flat_map(|properties| properties.keys()) {
                let forms = ["`KEY`", "`KEY =", " KEY = "];
                let mut forms = forms.iter().map(|form| form.replace("KEY", key));
                assert!(forms.any(|form| page.contains(&form)), "{name}: {key}");
            }
        }
    }

    #[test]
    fn examples_match_the_schema() {
        for section in SECTIONS {
            if let Err(error) = read(section.title, section.example, &[]) {
                panic!("{error}");
            }
        }
    }
}

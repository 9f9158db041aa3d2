use super::function::{Composed, Function, Shape};
use super::*;

const MINIMAL: &str = include_str!("../../data/scenes/init.toml");

#[test]
fn the_scene_of_init_is_read_and_keeps_its_values() {
    let read = read("scene.toml", MINIMAL, &[]).unwrap();
    let solid = read.scene.solid.as_ref().unwrap();
    assert_eq!((solid.bulk_modulus.0, solid.rayleigh_stiffness), (1e5, 1e-4));
    // The copy in run.json is equivalent to the scene and can be run.
    let echo = serde_json::to_value(&read.scene).unwrap();
    assert_eq!(SceneFile::deserialize(&echo).unwrap(), read.scene);
}

#[test]
fn infinity_may_be_a_number_or_a_word_and_is_a_word_in_json() {
    for written in ["inf", "\"inf\"", "+inf"] {
        let set = [format!("solid.bulk_modulus={written}")];
        let scene = read("scene.toml", MINIMAL, &set).unwrap().scene;
        assert_eq!(scene.solid.as_ref().unwrap().bulk_modulus.0, f64::INFINITY, "{written}");
        assert_eq!(serde_json::to_value(&scene).unwrap()["solid"]["bulk_modulus"], "inf");
    }
}

/// Regression: if a tab preceded a value, the marks were not below the value.
#[test]
fn marks_are_below_a_value_after_tabs() {
    let text = MINIMAL.replace("bulk_modulus = 1e5", "\tbulk_modulus\t=\t-7e5");
    let message = read("scene.toml", &text, &[]).unwrap_err().to_string();
    let lines: Vec<&str> = message.lines().collect();
    let marks = lines.iter().position(|line| line.contains('^')).unwrap();
    // Both lines have tabs at the same positions, so they are aligned for any tab width.
    let before = |line: &str, end: &str| -> Vec<bool> {
        line[..line.find(end).unwrap()].chars().map(|c| c == '\t').collect()
    };
    let expected = before(lines[marks - 1], "-7e5");
    assert_eq!(before(lines[marks], "^"), expected, "{message}");
    assert!(expected.contains(&true), "{message}");
}

/// Regression: the tolerance 1e-17 was accepted, although sums of doubles cannot satisfy it.
#[test]
fn tolerances_below_rounding_are_refused() {
    for key in ["integrator.rtol", "integrator.oscillators.rtol"] {
        let message = read("scene.toml", MINIMAL, &[format!("{key}=1e-17")]).unwrap_err();
        assert!(message.to_string().contains("1e-14"), "{message}");
    }
}

/// Regression: a number above the range of doubles was read as `inf`, which means incompressible.
#[test]
fn a_number_that_is_too_large_is_not_infinity() {
    for text in ["1e999", "-1e999", "nan"] {
        let set = [format!("solid.bulk_modulus={text}")];
        let message = read("scene.toml", MINIMAL, &set).unwrap_err().to_string();
        assert!(message.contains(text), "{message}");
    }
}

#[test]
fn overrides_replace_add_and_need_no_quotes() {
    let set = ["solid.formulation=rate", "material[0].c10=2e4", "time.end=0.5", "modes.count=3"]
        .map(str::to_owned);
    let scene = read("scene.toml", MINIMAL, &set).unwrap().scene;
    assert_eq!(scene.solid.unwrap().formulation, Some(myovib_model::Formulation::Rate));
    assert_eq!(
        scene.material[0].law,
        material::LawConstants::from(myovib_fem::Law::MooneyRivlin { c10: 2e4, c01: 2e2 })
    );
    assert_eq!((scene.time.unwrap().end, scene.modes.unwrap().count), (0.5, 3));
}

#[test]
fn an_override_without_a_value_brings_the_default_back() {
    let set =
        ["integrator.rtol=1e-7", "integrator.rtol=", "solid.formulation=", "material[0].group="]
            .map(str::to_owned);
    let scene = read("scene.toml", MINIMAL, &set).unwrap().scene;
    assert_eq!(scene.integrator.rtol, integrator::IntegratorSettings::default().rtol);
    assert_eq!(scene.solid.unwrap().formulation, None);
    assert_eq!(scene.material[0].group, None, "in a list too");
}

#[test]
fn functions_of_time_nest() {
    let text = r#"
        [time]
        end = 1
        [[traction]]
        group = "load"
        x = 3
        y = { type = "product", of = [2.0, { type = "sum", of = [{ type = "sine", amplitude = 1, frequency = 8 }, 1] }] }
    "#;
    let scene = read("s.toml", text, &[]).unwrap().scene;
    assert_eq!(scene.traction[0].x, Some(Function::Constant(3.0)));
    assert!(matches!(
        scene.traction[0].y,
        Some(Function::Shape(Shape::Composed(Composed::Product { ref of }))) if of.len() == 2
    ));
}

/// Invalid scenes detected without a mesh; each replaces a line of the scene.
const WRONG: [(&str, &str, &str); 18] = [
    ("misspelled_key", "bulk_modulus = 1e5", "bulk_modulis = 1e5"),
    ("misspelled_section", "[time]", "[tiem]"),
    ("negative_kappa", "bulk_modulus = 1e5", "bulk_modulus = -1e5"),
    ("kappa_a_word", "bulk_modulus = 1e5", "bulk_modulus = \"soft\""),
    ("negative_beta", "rayleigh_stiffness = 1e-4", "rayleigh_stiffness = -1e-4"),
    ("missing_density", "density = 1.1e3", ""),
    ("unknown_law", "law = \"mooney-rivlin\"", "law = \"mooney\""),
    ("missing_law", "law = \"mooney-rivlin\"", ""),
    ("parameter_of_another_law", "c01 = 2e2", "c01 = 2e2\nshear_modulus = 2e4"),
    ("unknown_formulation", "rayleigh_mass = 1.0", "formulation = \"rates\""),
    ("number_as_text", "end = 2.0", "end = \"2.0\""),
    ("point_with_four_coordinates", "at = [0.0, 0.0]", "at = [0.0, 0.0, 0.0, 0.0]"),
    ("unknown_function", "type = \"ramped-sine\"", "type = \"ramped_sine\""),
    ("unknown_quantity", "quantities = [\"u\", \"p\"]", "quantities = [\"u\", \"q\"]"),
    ("order_six", "rtol = 1e-4", "rtol = 1e-4\nmax_order = 6"),
    ("order_in_a_wrong_word", "rtol = 1e-4", "rtol = 1e-4\nmax_order = \"best\""),
    ("not_a_number", "rayleigh_mass = 1.0", "rayleigh_mass = nan"),
    ("broken_toml", "[[fixed]]", "[[fixed]"),
];

#[test]
fn wrong_scenes_are_explained() {
    for (name, right, wrong) in WRONG {
        assert!(MINIMAL.contains(right), "the scene of `init` has no line `{right}`");
        let text = MINIMAL.replacen(right, wrong, 1);
        let error = read("scene.toml", &text, &[]).expect_err(name);
        insta::assert_snapshot!(name, error.to_string());
    }
}

#[test]
fn wrong_overrides_are_explained() {
    for (name, set) in [
        ("override_without_value", "solid.bulk_modulus"),
        ("override_out_of_range", "solid.bulk_modulus=-1"),
        ("override_beyond_a_list", "material[3].c10=1e4"),
    ] {
        let error = read("scene.toml", MINIMAL, &[set.to_owned()]).expect_err(name);
        insta::assert_snapshot!(name, error.to_string());
    }
}

/// Regression: an incomplete table or list was treated as text and rejected as a value of the wrong kind.
#[test]
fn overrides_that_are_no_toml_show_the_error_of_the_parser() {
    for value in ["[1, 2", "{ type = \"sine\" amplitude = 1 }", "{ value = 1, value = 2 }", "\"a"] {
        let set = format!("traction[0].y={value}");
        let error = read("scene.toml", MINIMAL, std::slice::from_ref(&set)).expect_err(value);
        let parser = toml::de::DeValue::parse(value).unwrap_err();
        assert!(error.to_string().contains(parser.message()), "{error}");
        assert!(error.to_string().contains(&set), "{error}");
    }
}

/// Regression: errors about wrong brackets did not show the correct header.
#[test]
fn headers_with_wrong_brackets_say_which_are_right() {
    for (right, wrong, next) in [
        ("[[fixed]]", "[fixed]", "write [[fixed]] instead"),
        ("[[material]]", "[material]", "write [[material]] instead"),
        ("[[traction]]", "[traction]", "write [[traction]] instead"),
        ("[[probe]]", "[probe]", "write [[probe]] instead"),
        ("[solid]", "[[solid]]", "write [solid] instead"),
        ("[mesh]", "[[mesh]]", "write [mesh] instead"),
        (
            "[[fixed]]",
            "[material.prony]\nrelative_modulus = 1.0\nrelaxation_time = 1.0\n[[fixed]]",
            "write [[material.prony]] instead",
        ),
    ] {
        assert!(MINIMAL.contains(right), "the scene of `init` has no {right}");
        let text = MINIMAL.replacen(right, wrong, 1);
        let error = read("scene.toml", &text, &[]).expect_err(wrong).to_string();
        assert!(error.contains(next), "{wrong}: {error}");
    }
}

/// Regression: errors about values of the wrong kind named headers that the scene does not have.
#[test]
fn notes_on_values_without_a_header_do_not_name_one() {
    let inline = |value: &str| {
        let text = format!("{value}\n{MINIMAL}");
        read("scene.toml", &text, &[]).expect_err(value).to_string()
    };
    let set = |value: &str| {
        read("scene.toml", MINIMAL, &[value.to_owned()]).expect_err(value).to_string()
    };
    for error in [
        inline("elastic_foundation = { group = \"left\", stiffness = 1.0 }"),
        inline("checkpoint = [{ interval = 1.0 }]"),
        inline("checkpoint = []"),
        set("fixed={ group = \"left\" }"),
        set("solid=[]"),
    ] {
        assert!(error.contains("wrong type"), "{error}");
        assert!(!error.contains("in place of"), "{error}");
    }
}

/// Regression: quantities named twice produced two equal columns, and an endless run was reported
/// as a number of the wrong kind.
#[test]
fn quantities_named_twice_and_endless_runs_are_refused() {
    let refusal = |set: &str| {
        let set = [set.to_owned()];
        read("scene.toml", MINIMAL, &set).expect_err("wrong").to_string()
    };
    let twice = refusal("probe[0].quantities=[\"u\", \"p\", \"u\"]");
    assert!(twice.contains("\"u\""), "{twice}");
    let endless = refusal("time.end=inf");
    assert!(endless.contains("`time.end`"), "{endless}");
}

#[test]
fn every_object_of_the_schema_is_closed_and_every_key_explained() {
    fn visit(schema: &serde_json::Value, path: &str) {
        if let Some(properties) = schema["properties"].as_object() {
            for (key, property) in properties {
                let explained =
                    property["description"].is_string() || property["const"].is_string();
                assert!(explained, "{path}.{key} has no description");
                visit(property, &format!("{path}.{key}"));
            }
        }
        for alternative in schema["oneOf"].as_array().into_iter().flatten() {
            visit(alternative, path);
        }
    }
    let schema = schema().to_value();
    visit(&schema, "scene");
    for (name, definition) in schema["$defs"].as_object().unwrap() {
        visit(definition, name);
        if definition["properties"].is_object() {
            assert_eq!(definition["unevaluatedProperties"], false, "{name}");
        }
    }
}

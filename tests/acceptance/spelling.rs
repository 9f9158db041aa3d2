//! Checks that spelling is American in code, comments, messages and the guide.

use std::fs;
use std::path::{Path, PathBuf};

/// Parts of words in British spelling.
const BRITISH: &str = "
    acknowledgement aeroplane aluminium analogue analyse analysing apologis artefact authoris behaviour biassed
    calibre cancelled cancelling catalogue categoris centralis centre channelled characteris cheque colour
    connexion criticis crystallis customis defence deflexion diagonalis dialogue digitis discretis distils
    emphasise emphasising equalis equalled factoris favour fibre finalis flavour formalis fuelled fulfil
    generalis grey harbour harmonis homogenis honour humour idealis inflexion initialis initialled judgement
    labelled labelling learnt levelled levelling licence linearis lustre manoeuvre marshalled materialis maximis
    meagre memoris metre minimis misspelt modelled modeller modelling modernis mould neighbour neutralis
    normalis oedem oesophag offence optimis organis orthogonalis paralyse parametris penalis plough polymeris
    practise pretence prioritis quantis randomis rasteris rationalis realisation realise recognis regularis
    rigour rumour sanitis sceptic serialis signalled signalling skilful specialis spectre stabilis standardis
    summaris symbolis symmetris synchronis theatre theoris tokenis totalled totalling towards travelled
    travelling triangularis tumour tunnelled unlabelled upwards utilis vaporis vapour vectoris vigour
    visualis whilst wilful
";

/// Words that contain a British part but are correct, or files that may use it.
const EXCEPTIONS: &[(&str, &str)] = &[
    // These words are American.
    ("analyses", ""),
    ("characteristic", ""),
    ("characteristics", ""),
    ("optimism", ""),
    ("optimistic", ""),
    // These files contain old keys of scenes, and this list.
    ("", "crates/scene/src/scene_file/renamed.rs"),
    ("", "tests/acceptance/spelling.rs"),
];

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.unwrap_or_default();
        let is_text = [".rs", ".md", ".py", ".pyi", ".js"].iter().any(|end| name.ends_with(end));
        let is_scene = name.ends_with(".toml") && name != "Cargo.toml";
        if path.is_dir() && !path.is_symlink() && !name.starts_with('.') && name != "target" {
            collect(&path, files);
        } else if path.is_file() && (is_text || is_scene) {
            files.push(path);
        }
    }
}

#[test]
fn spelling_is_american() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files =
        vec![root.join("README.md"), root.join("CONTRIBUTING.md"), root.join("CHANGELOG.md")];
    for folder in ["bench", "crates", "data/scenes", "docs/src", "examples", "python", "tests"] {
        collect(&root.join(folder), &mut files);
    }
    let british: Vec<&str> = BRITISH.split_whitespace().collect();
    let mut found = Vec::new();
    for path in &files {
        let name = path.strip_prefix(&root).unwrap_or(path).display().to_string();
        let text = fs::read_to_string(path).expect("a text").to_lowercase();
        for word in text.split(|c: char| !c.is_alphabetic()) {
            let is_allowed = |(allowed, file): &(&str, &str)| {
                (allowed.is_empty() || *allowed == word) && (file.is_empty() || *file == name)
            };
            let is_british = british.iter().any(|part| word.contains(part));
            if is_british && !EXCEPTIONS.iter().any(is_allowed) {
                found.push(format!("{name}: {word}"));
            }
        }
    }
    assert!(files.len() > 500, "{} files", files.len());
    assert!(found.is_empty(), "{}", found.join("\n"));
}

//! The libraries' messages speak of settings, never of a program's options.

use std::path::{Path, PathBuf};

/// The string literals of a Rust source.
fn literals(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = source;
    while let Some(c) = rest.chars().next() {
        // What a lone quote may stand in: comments, characters.
        let skipped = match c {
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '\'' if rest.starts_with("'\"'") || rest.starts_with("'\\'") => 3,
            _ => c.len_utf8(),
        };
        if c != '"' {
            rest = &rest[skipped..];
            continue;
        }
        let mut escaped = false;
        let end = rest[1..].find(|c| {
            let closes = c == '"' && !escaped;
            escaped = c == '\\' && !escaped;
            closes
        });
        let end = 1 + end.unwrap_or(rest.len() - 1);
        found.push(rest[1..end].to_string());
        rest = rest.get(end + 1..).unwrap_or_default();
    }
    found
}

/// Whether a text has a word that looks like an option.
fn names_an_option(text: &str) -> bool {
    text.match_indices("--").any(|(at, _)| text[at + 2..].starts_with(|c: char| c.is_ascii_lowercase()))
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let below = |path: PathBuf| match path.is_dir() {
        true => sources(&path),
        false => vec![path],
    };
    paths.flat_map(below).filter(|path| path.extension().is_some_and(|e| e == "rs")).collect()
}

fn that_name_options(package: &str) -> Vec<String> {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let files = sources(&crates.join(package).join("src"));
    assert!(!files.is_empty(), "{package} has no sources");
    let texts = files.iter().map(|file| std::fs::read_to_string(file).expect("a source"));
    texts.flat_map(|text| literals(&text)).filter(|text| names_an_option(text)).collect()
}

#[test]
fn no_message_names_an_option() {
    for package in ["girandole", "girandole-core", "girandole-reference"] {
        assert_eq!(that_name_options(package), [""; 0], "{package}");
    }
    // The control: the program's own messages do.
    assert!(that_name_options("girandole-app").len() > 10);
}

#[test]
fn literals_are_found() {
    let source = r#"
        // a comment's "quotes --a" and a lone "
        let c = ['"', '\'']; let s = "one --b \" still"; let n = x - -1; f("two\\", 'a', "three
            lines");
    "#;
    let found = literals(source);
    assert_eq!(found.len(), 3, "{found:?}");
    assert!(names_an_option(&found[0]) && !names_an_option(&found[1]) && found[2].ends_with("lines"));
    assert!(!names_an_option("a -- b, --, ---") && names_an_option("(--clamp)"));
}

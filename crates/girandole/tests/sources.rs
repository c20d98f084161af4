//! What sources say: the libraries' messages speak of settings, never of a program's options, comments that point to a file, a struct or a
//! function point to one that is there, and kernels do not branch on what a software driver would compile them anew for.

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

/// All files below a folder whose names end like this.
fn sources(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let below = |path: PathBuf| match path.is_dir() {
        true => sources(&path, extensions),
        false => vec![path],
    };
    let is_source = |path: &PathBuf| extensions.iter().any(|&e| path.extension().is_some_and(|x| x == e));
    paths.flat_map(below).filter(is_source).collect()
}

/// Values that change from dispatch to dispatch of a frame.
const CHANGING: [&str; 6] =
    ["frame.batch", "frame.sample", "frame.step", "frame.first_light", "frame.last_batch", "frame.light_set"];

/// Whether a line of WGSL branches on such a value alone, for which Mesa's software driver compiles the kernel anew.
fn branches_on_a_uniform(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or_default();
    let names = |name: &str| {
        code.match_indices(name)
            .any(|(at, _)| !code[at + name.len()..].starts_with(|c: char| c.is_alphanumeric() || c == '_'))
    };
    let branches = ["if ", "while ", "for (", "&&", "||"].iter().any(|word| code.contains(word));
    branches && !code.contains("branch_value") && CHANGING.into_iter().any(names)
}

#[test]
fn no_kernel_is_compiled_anew_for_values_that_change_in_a_frame() {
    let files = sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"), &["wgsl"]);
    assert!(files.len() > 50, "{files:?}");
    let mut found = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).expect("a shader");
        let lines = text.lines().filter(|line| branches_on_a_uniform(line));
        found.extend(lines.map(|line| format!("{}: {line}", file.display())));
    }
    assert!(found.is_empty(), "{found:#?}");
    // The controls.
    assert!(branches_on_a_uniform("  if frame.step == 1u { return; }"));
    assert!(branches_on_a_uniform("  let a = b && frame.batch > 0u;"));
    assert!(!branches_on_a_uniform("  if branch_value(frame.step, i) == 1u { return; }"));
    assert!(!branches_on_a_uniform("  if frame.samples == 1u { return; }"));
    assert!(!branches_on_a_uniform("  let wide = 2u * frame.step; // if any"));
}

fn that_name_options(package: &str) -> Vec<String> {
    let files = sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(package).join("src"), &["rs"]);
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

/// What a comment points to.
#[derive(Debug, PartialEq)]
enum Pointer<'a> {
    /// `lib/frame.wgsl`.
    File(&'a str),
    /// `Frame` in `lib/frame.wgsl`.
    Struct(&'a str, &'a str),
    /// core: View::pixel_ray
    Core(&'a str),
}

fn is_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

fn pointers(comment: &str) -> Vec<Pointer<'_>> {
    let mut found = Vec::new();
    let words = comment.split(|c: char| !is_name(c) && c != '.' && c != '/');
    let files = words.map(|word| word.trim_end_matches('.')).filter(|word| {
        word.starts_with(is_name)
            && [".rs", ".wgsl"].iter().any(|end| word.len() > end.len() && word.ends_with(end))
    });
    found.extend(files.map(Pointer::File));
    // Every second part stands between backquotes.
    let parts: Vec<&str> = comment.split('`').collect();
    for window in parts.windows(3).filter(|w| w[1] == " in " && w[2].ends_with(".wgsl")) {
        found.push(Pointer::Struct(window[0], window[2]));
    }
    for (at, label) in comment.match_indices("core: ") {
        let path = comment[at + label.len()..].split(|c: char| !is_name(c) && c != ':').next();
        if !comment[..at].ends_with(is_name) {
            found.extend(path.and_then(|p| p.rsplit(':').next()).map(Pointer::Core));
        }
    }
    found
}

#[test]
fn comments_point_to_what_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let read = |path: &PathBuf| (path.clone(), std::fs::read_to_string(path).expect("a source"));
    let mut all: Vec<(PathBuf, String)> =
        sources(&root.join("crates"), &["rs", "wgsl"]).iter().map(read).collect();
    all.push(read(&root.join("ARCHITECTURE.md")));
    let core = root.join("crates/girandole-core/src");
    let exists = |pointer: &Pointer| match *pointer {
        Pointer::File(name) => all.iter().any(|(path, _)| path.ends_with(name)),
        Pointer::Struct(name, file) => {
            all.iter().any(|(path, text)| path.ends_with(file) && text.contains(&format!("struct {name} {{")))
        }
        Pointer::Core(name) => all.iter().filter(|(path, _)| path.starts_with(&core)).any(|(path, text)| {
            let defines = |kind: &str| {
                let start = format!("{kind} {name}");
                text.match_indices(&start).any(|(at, _)| !text[at + start.len()..].starts_with(is_name))
            };
            path.file_stem().is_some_and(|stem| stem == name)
                || ["fn", "struct", "enum", "mod"].iter().any(|k| defines(k))
        }),
    };
    let mut count = 0;
    for (path, text) in &all {
        let is_code = path.extension().is_some_and(|e| e != "md");
        if path.ends_with("tests/sources.rs") {
            continue;
        }
        for line in text.lines() {
            let comment =
                if is_code { line.split_once("//").map_or("", |(_, comment)| comment) } else { line };
            for pointer in pointers(comment) {
                count += 1;
                assert!(exists(&pointer), "{}: {pointer:?} in: {line}", path.display());
            }
        }
    }
    assert!(count > 100, "{count}");
    // The control: what is not there is found missing.
    for text in ["see lib/light_map_of_old.wgsl.", "`Maps` in `lib/light.wgsl`", "(core: View::old_ray)"] {
        let found = pointers(text);
        assert!(found.iter().any(|p| !exists(p)), "{text}: {found:?}");
    }
}

#[test]
fn the_readme_has_a_program_that_is_compiled_and_names_what_it_needs() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: PathBuf| std::fs::read_to_string(path).expect("a file");
    let readme = read(package.join("../../README.md"));
    let block = |language: &str| {
        let (_, after) = readme.split_once(&format!("```{language}\n")).expect("a block");
        after.split_once("```").expect("its end").0.to_owned()
    };
    let example = read(package.join("examples/picture.rs"));
    let (_, program) = example.split_once("\n\n").expect("what it does, and how");
    assert_eq!(block("rust,no_run"), program);
    // What it calls is what its `Cargo.toml` has, in the versions of ours.
    let workspace = read(package.join("../../Cargo.toml"));
    for (name, version) in
        block("toml").lines().filter(|line| !line.contains("git")).filter_map(|line| line.split_once(" = \""))
    {
        assert!(program.contains(&format!("{name}::")), "{name}");
        let ours = [format!("{name} = \"{version}"), format!("{name} = {{ version = \"{version}")];
        assert!(ours.iter().any(|ours| workspace.contains(ours)), "{name} {version}");
    }
    // The table's first row is this version.
    let value = |key: &str| {
        let (_, after) = workspace.split_once(&format!("\n{key}")).expect(key);
        after.split('"').nth(1).expect("a value")
    };
    let (version, _) = value("version =").rsplit_once('.').expect("three numbers");
    let row = format!("|---|---|---|\n| {version} | {} | {} |\n", value("wgpu ="), value("rust-version ="));
    assert!(readme.contains(&row), "{row}");
}

/// The names that a crate's first file shows, but for those that are hidden from its documents.
fn shown(text: &str) -> Vec<String> {
    let items = text.split("pub use ").skip(1).zip(text.split("pub use "));
    let shown = items.filter(|(_, before)| !before.trim_end().ends_with("#[doc(hidden)]"));
    shown
        .flat_map(|(item, _)| {
            let path = item.split(';').next().unwrap_or_default();
            let names = path.rsplit_once("::").map_or(path, |(_, names)| names);
            names.trim_matches(['{', '}']).split(',').map(|name| name.trim().to_string()).collect::<Vec<_>>()
        })
        .filter(|name| !name.is_empty())
        .collect()
}

#[test]
fn the_face_has_what_users_need_and_no_more() {
    let hidden =
        "pub use a::{B, C};\n#[doc(hidden)]\npub use d::E;\npub use wgpu;\npub use f::{\n    G,\n    H,\n};";
    assert_eq!(shown(hidden), ["B", "C", "wgpu", "G", "H"]);
    let face =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).expect("a file");
    let names = shown(&face);
    assert!((50..=60).contains(&names.len()), "{}: {names:?}", names.len());
    for name in ["Scene", "View", "Renderer", "Viewport", "IlluminationSettings", "Image"] {
        assert!(names.iter().any(|shown| shown == name), "{name} is not shown");
    }
}

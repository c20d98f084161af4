//! The rooms of this crate lie in an order, and each sees only those before it.

use std::collections::HashMap;
use std::path::Path;

/// From the ground up.
const ROOMS: [&str; 24] = [
    "browser",
    "error",
    "shader_constants",
    "tier",
    "settings",
    "parallel_map",
    "layout",
    "records",
    "packed",
    "parallel",
    "shaders",
    "device",
    "maps",
    "stats",
    "rays",
    "gpu_scene",
    "points",
    "resident",
    "passes",
    "viewport",
    "checks",
    "prepare",
    "frame",
    "renderer",
];

/// Files of a folder and all below, as rooms and texts without comments and tests.
fn files(folder: &Path, room: Option<&str>, found: &mut Vec<(String, String)>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("a file").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() {
            files(&path, room.or(Some(name.as_str())), found);
        } else {
            let text = std::fs::read_to_string(&path).expect("text");
            let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
            let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
            found.push((room.map_or(name, str::to_owned), lines.collect::<Vec<_>>().join("\n")));
        }
    }
}

/// The identifiers that come right after `crate::`, of groups in braces all first ones.
fn imported(text: &str) -> Vec<String> {
    let identifier =
        |text: &str| -> String { text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect() };
    let mut found = Vec::new();
    for rest in text.split("crate::").skip(1) {
        match rest.strip_prefix('{') {
            None => found.push(identifier(rest)),
            Some(group) => {
                let mut depth = 0;
                let mut item = String::new();
                for c in group.chars() {
                    match c {
                        '}' if depth == 0 => break,
                        '{' => depth += 1,
                        '}' => depth -= 1,
                        ',' if depth == 0 => found.push(identifier(std::mem::take(&mut item).trim())),
                        _ => item.push(c),
                    }
                }
                found.push(identifier(item.trim()));
            }
        }
    }
    found
}

/// Imports of what lies at or above the room that has them, but itself.
fn upward(files: &[(String, String)], exported: &HashMap<String, String>) -> Vec<String> {
    let at = |room: &str| ROOMS.iter().position(|r| *r == room);
    let mut found = Vec::new();
    for (room, text) in files {
        let Some(own) = at(room) else { continue };
        for name in imported(text) {
            let of = exported.get(&name).unwrap_or(&name);
            if of != room && at(of).is_some_and(|other| other > own) {
                found.push(format!("{room} sees {of} ({name})"));
            }
        }
    }
    found
}

#[test]
fn no_room_sees_one_above_it() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = Vec::new();
    files(&source, None, &mut all);
    let outside = ["lib", "layout_tests", "order_test"];
    let unknown: Vec<&String> = all
        .iter()
        .map(|(room, _)| room)
        .filter(|room| !ROOMS.contains(&room.as_str()) && !outside.contains(&room.as_str()))
        .collect();
    assert!(unknown.is_empty(), "rooms without a place: {unknown:?}");
    // What the crate exports is of the room that it is exported from.
    let lib = all.iter().find(|(room, _)| room == "lib").expect("lib.rs").1.replace("pub use ", "crate::");
    let mut exported = HashMap::new();
    for statement in lib.split(';').filter_map(|s| s.trim().strip_prefix("crate::")) {
        let Some((room, _)) = statement.split_once("::") else { continue };
        for word in statement.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty()) {
            exported.insert(word.to_owned(), room.to_owned());
        }
    }
    assert_eq!(exported.get("Renderer").map(String::as_str), Some("renderer"));
    exported.retain(|name, _| !ROOMS.contains(&name.as_str()));
    let found = upward(&all, &exported);
    assert!(found.is_empty(), "{found:#?}");
    // The control: one that does is found, in a group and by a name that the crate exports.
    for text in ["use crate::{device::gpu, frame::record_frame};", "fn f(renderer: &crate::Renderer) {}"] {
        assert_eq!(upward(&[("maps".into(), text.into())], &exported).len(), 1, "{text}");
    }
}

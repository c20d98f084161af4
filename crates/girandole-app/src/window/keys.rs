//! What keys and the mouse do, in one table: the window acts by it, and the sheet (F1), `--help` and `docs/keys.md` show it.

use super::files::{Ask, Purpose};
use super::session::Session;
use super::tools::Tools;
use egui::{Event, InputState, Key, KeyboardShortcut, Modifiers, Ui};
use girandole_core::glam::Vec3;

/// What a key does when it is pressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    ShowKeys,
    Play,
    SavePicture,
    CopyCommand,
    NextTruth,
    NextDebugView,
    TogglePanel,
    LetGo,
    Open,
    SaveEdits,
    SaveEditsAs,
    LoadEdits,
    Export,
    Quit,
}

/// A key with its modifiers, and what it does.
pub struct Binding {
    pub shortcut: KeyboardShortcut,
    pub action: Action,
    /// The rest of a sentence that begins with the key.
    pub does: &'static str,
}

const fn plain(key: Key, action: Action, does: &'static str) -> Binding {
    Binding { shortcut: KeyboardShortcut::new(Modifiers::NONE, key), action, does }
}

const fn control(key: Key, action: Action, does: &'static str) -> Binding {
    Binding { shortcut: KeyboardShortcut::new(Modifiers::COMMAND, key), action, does }
}

const fn control_shift(key: Key, action: Action, does: &'static str) -> Binding {
    Binding { shortcut: KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), key), action, does }
}

/// All of them. Of two with the same key, the one with more modifiers comes first.
pub const BINDINGS: &[Binding] = &[
    plain(Key::F1, Action::ShowKeys, "shows this list, and hides it"),
    plain(Key::F12, Action::SavePicture, "saves the picture"),
    plain(Key::F9, Action::CopyCommand, "copies the call of girandole render that gives this picture"),
    plain(Key::Space, Action::Play, "plays motion, and stops it"),
    plain(Key::T, Action::NextTruth, "shows the truth beside the picture: path tracer, naive mode, none"),
    plain(Key::V, Action::NextDebugView, "shows the next debug view"),
    plain(Key::H, Action::TogglePanel, "hides the panel, and shows it"),
    plain(Key::Escape, Action::LetGo, "lets go of what is picked"),
    control(Key::O, Action::Open, "opens a scene"),
    control_shift(Key::S, Action::SaveEditsAs, "saves what was changed in the scene to another file"),
    control(Key::S, Action::SaveEdits, "saves what was changed in the scene (--edits)"),
    control(Key::L, Action::LoadEdits, "loads such changes: the scene of the file with these"),
    control(Key::E, Action::Export, "writes the scene as it stands to a .glb file"),
    control(Key::Q, Action::Quit, "closes the window"),
];

/// Keys that one walks by while they are held: which way, to the right, up and ahead.
pub const WALK: [(Key, Vec3); 6] = [
    (Key::W, Vec3::Z),
    (Key::A, Vec3::NEG_X),
    (Key::S, Vec3::NEG_Z),
    (Key::D, Vec3::X),
    (Key::E, Vec3::Y),
    (Key::Q, Vec3::NEG_Y),
];

/// What is held, and the mouse.
pub const HELD: [(&str, &str); 10] = [
    ("W A S D", "walk while they are held"),
    ("E Q", "lead up and down"),
    ("Shift", "makes walks four times as fast"),
    ("Drag", "looks around"),
    ("Right drag", "goes round what is under the pointer"),
    ("Middle drag", "shifts the view"),
    ("Wheel", "moves ahead and back"),
    ("Click", "picks an object, whose handles then can be dragged"),
    ("Enter", "takes what was typed into a dialog or a field of the panel"),
    (
        "Drop a file",
        "shows a .glb or .gltf scene, adds a .ply or .obj model; with Shift, a scene is added as an object",
    ),
];

/// The name of a shortcut, as in `Ctrl Q`.
pub fn name(shortcut: &KeyboardShortcut) -> String {
    let KeyboardShortcut { modifiers, logical_key } = shortcut;
    let command = if cfg!(target_os = "macos") { "Cmd" } else { "Ctrl" };
    let names = [(modifiers.command, command), (modifiers.shift, "Shift"), (modifiers.alt, "Alt")];
    let held = names.into_iter().filter(|(is_held, _)| *is_held).map(|(_, name)| name);
    held.chain([logical_key.name()]).collect::<Vec<_>>().join(" ")
}

/// Each key and what it does, those that are held and the mouse last.
pub fn rows() -> impl Iterator<Item = (String, &'static str)> {
    let pressed = BINDINGS.iter().map(|binding| (name(&binding.shortcut), binding.does));
    pressed.chain(HELD.iter().map(|(keys, does)| ((*keys).to_owned(), *does)))
}

/// The list for `--help`.
pub fn help() -> String {
    let rows = rows().map(|(keys, does)| format!("  {keys:<14} {does}\n"));
    format!("Keys, and the mouse over the picture:\n{}", rows.collect::<String>())
}

/// Does what the keys say that were pressed in this frame.
pub fn act(ui: &Ui, session: &mut Session, tools: &mut Tools) {
    for binding in BINDINGS {
        if ui.input_mut(|input| input.consume_shortcut(&binding.shortcut)) {
            perform(binding.action, session, tools);
        }
    }
}

fn perform(action: Action, session: &mut Session, tools: &mut Tools) {
    match action {
        Action::ShowKeys => tools.shows_keys = !tools.shows_keys,
        Action::Play => session.playback.playing = !session.playback.playing,
        Action::SavePicture => tools.saves = true,
        Action::CopyCommand => tools.copies = true,
        Action::NextTruth => tools.truth.against = tools.truth.against.next(),
        Action::NextDebugView => session.next_debug_view(),
        Action::TogglePanel => tools.shows_panel = !tools.shows_panel,
        Action::LetGo if tools.shows_keys => tools.shows_keys = false,
        Action::LetGo => tools.selected = None,
        Action::Open => ask(tools, Ask::Choose(Purpose::OpenScene)),
        Action::SaveEdits => ask(tools, Ask::SaveEdits),
        Action::SaveEditsAs => ask(tools, Ask::Choose(Purpose::SaveEdits)),
        Action::LoadEdits => ask(tools, Ask::Choose(Purpose::LoadEdits)),
        Action::Export => ask(tools, Ask::Choose(Purpose::ExportScene)),
        Action::Quit => tools.quits = true,
    }
}

/// Browsers have no files to choose from.
fn ask(tools: &mut Tools, ask: Ask) {
    if cfg!(not(target_arch = "wasm32")) {
        tools.asks = Some(ask);
    }
}

/// Whether what was typed is to be taken.
#[cfg(not(target_arch = "wasm32"))]
pub fn accepts(ui: &Ui) -> bool {
    ui.input(|input| input.key_pressed(Key::Enter))
}

/// Which way the keys lead that are held, to the right, up and ahead, and whether faster; `walk` holds them from frame to frame.
pub fn walked(ui: &Ui, walk: &mut Vec<Key>) -> (Vec3, bool) {
    ui.input(|input| {
        hold(walk, input);
        let held = WALK.iter().filter(|(key, _)| walk.contains(key));
        let way = held.fold(Vec3::ZERO, |way, (_, step)| way + *step);
        let is_shortcut = input.modifiers.command || input.modifiers.alt;
        (if is_shortcut { Vec3::ZERO } else { way }, input.modifiers.shift)
    })
}

/// Brings the keys that are held up to date: those that are down, but for those of a shortcut, whichever of its keys is let go first.
fn hold(walk: &mut Vec<Key>, input: &InputState) {
    walk.retain(|key| input.key_down(*key));
    for event in &input.events {
        if let Event::Key { key, pressed: true, repeat: false, modifiers, .. } = event
            && !(modifiers.command || modifiers.alt || walk.contains(key))
            && input.key_down(*key)
        {
            walk.push(*key);
        }
    }
}

/// The sheet of all keys, if it is asked for.
pub fn sheet(ui: &Ui, tools: &mut Tools) {
    let room = ui.ctx().content_rect();
    let window = egui::Window::new("Keys").open(&mut tools.shows_keys).collapsible(false).resizable(false);
    let window = window.pivot(egui::Align2::CENTER_CENTER).fixed_pos(room.center());
    window.max_height(room.height() - 80.0).max_width(room.width() - 40.0).show(ui.ctx(), |ui| {
        egui::ScrollArea::vertical().show(ui, |ui| {
            egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
                for (keys, does) in rows() {
                    ui.strong(keys);
                    ui.label(does);
                    ui.end_row();
                }
            });
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The table of `docs/keys.md`.
    fn markdown() -> String {
        let rows = rows().map(|(keys, does)| format!("| {keys} | {does} |\n"));
        format!(
            "# Keys of the window\n\nThe same list is shown by F1 and by `girandole view --help`.\n\n\
             | key | what it does |\n|---|---|\n{}",
            rows.collect::<String>()
        )
    }

    #[test]
    fn the_documentation_has_the_same_table() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/keys.md");
        let text = std::fs::read_to_string(path).unwrap_or_default().replace("\r\n", "\n");
        assert!(text == markdown(), "docs/keys.md is to be:\n{}", markdown());
    }

    #[test]
    fn no_key_is_taken_twice_and_more_modifiers_come_first() {
        for (i, a) in BINDINGS.iter().enumerate() {
            for b in &BINDINGS[i + 1..] {
                let [a, b] = [a.shortcut, b.shortcut];
                assert_ne!(a, b);
                // egui lets further modifiers pass.
                let hides = a.logical_key == b.logical_key && b.modifiers.matches_logically(a.modifiers);
                assert!(!hides, "{} is never reached, for {}", name(&b), name(&a));
            }
        }
        for (key, _) in WALK {
            assert!(BINDINGS.iter().all(|b| b.shortcut != KeyboardShortcut::new(Modifiers::NONE, key)));
            assert!(HELD[..2].iter().any(|(keys, _)| keys.split(' ').any(|k| k == key.name())), "{key:?}");
        }
    }

    /// Keys are handled here alone, so that none is missing in the table.
    #[test]
    fn no_other_file_handles_keys() {
        fn handlers(folder: &Path, found: &mut Vec<String>) {
            for entry in std::fs::read_dir(folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                if path.is_dir() {
                    handlers(&path, found);
                } else if !name.contains("tests") {
                    let text = std::fs::read_to_string(&path).expect("a source file");
                    let calls =
                        ["key_pressed(", "key_down(", "consume_key(", "consume_shortcut(", "Event::Key {"];
                    found.extend(calls.iter().any(|call| text.contains(call)).then_some(name));
                }
            }
        }
        let mut found = Vec::new();
        handlers(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/window"), &mut found);
        assert_eq!(found, ["keys.rs"], "keys that are not in the table are handled");
    }
}

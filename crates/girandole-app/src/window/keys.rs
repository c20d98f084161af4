//! What keys and the mouse do, in one table: the window acts by it, and the sheet (F1), `--help` and `docs/keys.md` show it.

use super::files::{Ask, Purpose};
use super::lamps::{self, NewLamp};
use super::session::Session;
use super::tools::Tools;
use super::{bookmarks, controls, selection};
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
    Undo,
    Redo,
    Delete,
    Duplicate,
    Add(NewLamp),
    Switch,
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

const fn shift(key: Key, action: Action, does: &'static str) -> Binding {
    Binding { shortcut: KeyboardShortcut::new(Modifiers::SHIFT, key), action, does }
}

/// All but those of [bookmarks](DIGITS). Of two with the same key, the one with more modifiers comes first.
pub const BINDINGS: &[Binding] = &[
    plain(Key::F1, Action::ShowKeys, "shows this list, and hides it"),
    plain(Key::F12, Action::SavePicture, "saves the picture"),
    plain(Key::F9, Action::CopyCommand, "copies the call of girandole render that gives this picture"),
    plain(Key::Space, Action::Play, "plays motion, and stops it"),
    plain(Key::T, Action::NextTruth, "shows the truth beside the picture: path tracer, naive mode, none"),
    plain(Key::V, Action::NextDebugView, "shows the next debug view"),
    plain(Key::H, Action::TogglePanel, "hides the panel, and shows it"),
    plain(Key::Escape, Action::LetGo, "gives up the drag at hand, or lets go of what is picked"),
    control_shift(Key::Z, Action::Redo, "makes again what was taken back"),
    control(Key::Z, Action::Undo, "takes the last change of the scene back"),
    control(Key::Y, Action::Redo, "makes again what was taken back"),
    plain(Key::Delete, Action::Delete, "takes away what is picked"),
    plain(Key::Backspace, Action::Delete, "takes away what is picked"),
    control(Key::D, Action::Duplicate, "puts a copy of what is picked beside it"),
    control(
        Key::L,
        Action::LoadEdits,
        "loads changes of the scene from a file: the scene of its own file with these",
    ),
    shift(Key::L, Action::Add(NewLamp::Spot), "puts a spot before the camera"),
    plain(Key::L, Action::Add(NewLamp::Point), "puts a lamp before the camera that shines all around"),
    plain(Key::P, Action::Add(NewLamp::Panel), "puts a panel before the camera that shines"),
    control(Key::O, Action::Open, "opens a scene"),
    plain(Key::O, Action::Switch, "switches what is picked off, or on again"),
    control_shift(Key::S, Action::SaveEditsAs, "saves what was changed in the scene to another file"),
    control(Key::S, Action::SaveEdits, "saves what was changed in the scene (--edits)"),
    control(Key::E, Action::Export, "writes the scene as it stands to a .glb file"),
    control(Key::Q, Action::Quit, "closes the window"),
];

/// Keys of bookmarks: the first one's is 1. With Ctrl they keep the view.
const DIGITS: [Key; 9] =
    [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];

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
pub const HELD: [(&str, &str); 14] = [
    ("W A S D", "walk while they are held"),
    ("E Q", "lead up and down"),
    ("Shift", "makes walks four times as fast"),
    ("Drag", "looks around"),
    ("Right drag", "goes round what is under the pointer"),
    ("Middle drag", "shifts the view"),
    ("Wheel", "moves ahead and back"),
    ("Ctrl 1 to 9", "keep the view as a bookmark, which is saved with the scene's changes"),
    ("1 to 9", "come back to that view"),
    ("Click", "picks an object or a lamp, whose handles then can be dragged"),
    ("Double click", "also lets walls and floors be moved and deleted; so does Alt with a click"),
    ("Ctrl drag", "moves by the grid's steps, turns by 15°, scales by tenths"),
    ("Enter", "takes what was typed into a dialog or a field of the panel"),
    (
        "Drop a file",
        "shows a .glb or .gltf scene, adds a .ply or .obj model, puts an .hdr or .exr picture all around; with Shift, a scene is added as an \
         object",
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

/// Whether keys act: they are not typed into a field, nor is a dialog open, which has its own.
pub fn are_free(ui: &Ui, tools: &Tools) -> bool {
    !(ui.ctx().text_edit_focused() || tools.has_dialog)
}

/// Does what the keys say that were pressed in this frame, in their order: a slow one may hold several.
pub fn act(ui: &Ui, session: &mut Session, tools: &mut Tools) {
    for (pressed, is_repeated) in pressed(ui) {
        match pressed {
            Pressed::Bound(action) if !is_repeated || matches!(action, Action::Undo | Action::Redo) => {
                perform(action, session, tools);
            }
            Pressed::Digit(number, keeps) if !(is_repeated || session.is_blank) => {
                if keeps {
                    bookmarks::store(session, tools, number)
                } else {
                    bookmarks::recall(session, number)
                }
            }
            _ => {}
        }
    }
}

/// A key of the table, or of a bookmark, and whether that one is kept.
enum Pressed {
    Bound(Action),
    Digit(usize, bool),
}

/// Takes the keys out that were pressed, with whether they only repeat.
fn pressed(ui: &Ui) -> Vec<(Pressed, bool)> {
    let mut all = Vec::new();
    let meaning = |key: Key, modifiers: Modifiers| {
        let is_meant =
            |b: &&Binding| b.shortcut.logical_key == key && modifiers.matches_logically(b.shortcut.modifiers);
        let bound = BINDINGS.iter().find(is_meant).map(|binding| Pressed::Bound(binding.action));
        let digit = || DIGITS.iter().position(|digit| *digit == key).filter(|_| !modifiers.alt);
        bound.or_else(|| digit().map(|index| Pressed::Digit(index + 1, modifiers.command)))
    };
    ui.input_mut(|input| {
        input.events.retain(|event| {
            let Event::Key { key, pressed: true, repeat, modifiers, .. } = event else { return true };
            let meant = meaning(*key, *modifiers);
            let is_meant = meant.is_some();
            all.extend(meant.map(|meant| (meant, *repeat)));
            !is_meant
        });
    });
    all
}

/// Changes the scene, unless it is not there yet, or is being changed by a drag, which is let go or given up first.
fn edit(action: Action, session: &mut Session, tools: &mut Tools) {
    if session.is_blank || tools.drag.is_some() {
        return;
    }
    match action {
        Action::Undo => selection::undo(session, tools),
        Action::Redo => selection::redo(session, tools),
        Action::Delete => selection::delete(session, tools),
        Action::Duplicate => selection::duplicate(session, tools),
        Action::Add(lamp) => lamps::add(session, tools, lamp),
        _ => lamps::switch_picked(session, tools),
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
        Action::TogglePanel => tools.panel = Some(!tools.shows_panel),
        Action::LetGo if tools.shows_keys => tools.shows_keys = false,
        Action::LetGo => controls::let_go(session, tools),
        Action::Undo
        | Action::Redo
        | Action::Delete
        | Action::Duplicate
        | Action::Add(_)
        | Action::Switch => edit(action, session, tools),
        Action::Open => tools.asks = Some(Ask::Choose(Purpose::OpenScene)),
        Action::SaveEdits => tools.asks = Some(Ask::SaveEdits),
        Action::SaveEditsAs => tools.asks = Some(Ask::Choose(Purpose::SaveEdits)),
        Action::LoadEdits => tools.asks = Some(Ask::Choose(Purpose::LoadEdits)),
        Action::Export => tools.asks = Some(Ask::Choose(Purpose::ExportScene)),
        Action::Quit => tools.quits = true,
    }
}

/// Whether what was typed is to be taken.
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

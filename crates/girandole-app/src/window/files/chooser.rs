//! A dialog of our own for systems without one: a path, and what lies in its folder.

use super::purpose::Purpose;
use crate::window::keys;
use egui::{Button, Modal, ScrollArea, TextEdit, Ui};
use std::path::{Path, PathBuf};

/// More entries of a folder than this are not listed.
const MOST: usize = 500;

/// What came of a dialog.
pub enum Done {
    Chosen(PathBuf),
    Cancelled,
}

/// A path that is being typed.
pub struct Chooser {
    purpose: Purpose,
    text: String,
    /// What was wrong with it, or is to be confirmed, and the text that this is about.
    said: Option<(String, String)>,
    /// The folder that is listed, and what lies in it.
    listed: Option<(PathBuf, Vec<Entry>)>,
    /// Whether the field had the keyboard already.
    is_focused: bool,
}

struct Entry {
    name: String,
    is_folder: bool,
}

/// What a path is good for.
#[derive(Debug, PartialEq)]
enum Verdict {
    Take(PathBuf),
    /// It is a folder: its files are listed.
    Enter(PathBuf),
    /// It would be replaced.
    Confirm(String),
    Refuse(String),
}

impl Chooser {
    /// Begins with a path.
    pub fn new(purpose: Purpose, start: &Path) -> Self {
        let folder = start.parent().unwrap_or(Path::new(""));
        let folder = std::path::absolute(if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
        let folder = folder.unwrap_or_default();
        let name = start.file_name().filter(|_| purpose.saves()).unwrap_or_default();
        let text = folder.join(name).to_string_lossy().into_owned();
        let text = if purpose.saves() || text.ends_with(std::path::MAIN_SEPARATOR) {
            text
        } else {
            as_folder(&folder)
        };
        Self { purpose, text, said: None, listed: None, is_focused: false }
    }

    /// Shows it. Returns what came of it, once.
    pub fn show(&mut self, ui: &Ui) -> Option<Done> {
        let mut done = None;
        let modal = Modal::new(egui::Id::unique("chooser")).show(ui.ctx(), |ui| {
            ui.set_width((ui.ctx().content_rect().width() - 80.0).min(560.0));
            ui.heading(self.purpose.title());
            let field = ui.add(TextEdit::singleline(&mut self.text).desired_width(f32::INFINITY));
            if !self.is_focused {
                field.request_focus();
                self.is_focused = true;
            }
            self.list(ui);
            if let Some((sentence, about)) = &self.said
                && *about == self.text
            {
                ui.label(sentence);
            }
            ui.horizontal(|ui| {
                let name = if self.purpose.saves() { "Save" } else { "Open" };
                let accepts = ui.add(Button::new(name)).clicked() || field.lost_focus() && keys::accepts(ui);
                if accepts {
                    done = self.accept();
                    field.request_focus();
                }
                if ui.button("Cancel").clicked() {
                    done = Some(Done::Cancelled);
                }
            });
        });
        if modal.should_close() {
            done = Some(Done::Cancelled);
        }
        done
    }

    /// The folders and files that there are to choose from.
    fn list(&mut self, ui: &mut Ui) {
        let folder = folder_of(&expanded(&self.text));
        if self.listed.as_ref().is_none_or(|(listed, _)| *listed != folder) {
            let entries = entries(&folder, self.purpose.kind().1);
            self.listed = Some((folder.clone(), entries));
        }
        let Some((_, entries)) = &self.listed else { return };
        let height = (ui.ctx().content_rect().height() - 260.0).clamp(60.0, 260.0);
        let mut next = None;
        ScrollArea::vertical().max_height(height).min_scrolled_height(height).auto_shrink(false).show(
            ui,
            |ui| {
                if let Some(above) = folder.parent()
                    && ui.selectable_label(false, "..").clicked()
                {
                    next = Some(as_folder(above));
                }
                for Entry { name, is_folder } in entries {
                    let shown = if *is_folder { format!("{name}/") } else { name.clone() };
                    let path = folder.join(name);
                    if ui.selectable_label(expanded(&self.text) == path, shown).clicked() {
                        next = Some(if *is_folder {
                            as_folder(&path)
                        } else {
                            path.to_string_lossy().into_owned()
                        });
                    }
                }
            },
        );
        if let Some(text) = next {
            self.text = text;
            self.is_focused = false;
        }
    }

    fn accept(&mut self) -> Option<Done> {
        let confirmed = matches!(&self.said, Some((_, about)) if *about == self.text);
        match judged(&self.text, self.purpose, confirmed) {
            Verdict::Take(path) => return Some(Done::Chosen(path)),
            Verdict::Enter(folder) => self.text = as_folder(&folder),
            Verdict::Confirm(sentence) | Verdict::Refuse(sentence) => {
                self.said = Some((sentence, self.text.clone()));
            }
        }
        None
    }
}

/// A path as it is typed: `~` is the user's own folder, and what is relative is so to where the program runs.
fn expanded(text: &str) -> PathBuf {
    let text = text.trim();
    let rest = text.strip_prefix('~').filter(|rest| rest.is_empty() || rest.starts_with(['/', '\\']));
    #[cfg(target_arch = "wasm32")]
    let home: Option<PathBuf> = None;
    #[cfg(not(target_arch = "wasm32"))]
    let home = dirs::home_dir();
    let path = match (rest, home) {
        (Some(rest), Some(home)) => home.join(rest.trim_start_matches(['/', '\\'])),
        _ => PathBuf::from(text),
    };
    std::path::absolute(&path).unwrap_or(path)
}

fn folder_of(path: &Path) -> PathBuf {
    if path.is_dir() { path.into() } else { path.parent().unwrap_or(path).into() }
}

/// With a separator at its end.
fn as_folder(path: &Path) -> String {
    let text = path.to_string_lossy().into_owned();
    if text.ends_with(std::path::MAIN_SEPARATOR) { text } else { text + std::path::MAIN_SEPARATOR_STR }
}

/// Folders, then files with one of these endings, by name.
fn entries(folder: &Path, extensions: &[&str]) -> Vec<Entry> {
    let found = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let entry = |entry: std::fs::DirEntry| {
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        let is_folder = path.is_dir();
        (!name.starts_with('.') && (is_folder || has_extension(&path, extensions)))
            .then_some(Entry { name, is_folder })
    };
    let mut entries: Vec<Entry> = found.filter_map(entry).collect();
    entries.sort_by(|a, b| b.is_folder.cmp(&a.is_folder).then_with(|| a.name.cmp(&b.name)));
    entries.truncate(MOST);
    entries
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|e| extensions.iter().any(|known| e.eq_ignore_ascii_case(known)))
}

/// What to do with what was typed; `confirmed`: it was refused as it stands already.
fn judged(text: &str, purpose: Purpose, confirmed: bool) -> Verdict {
    let mut path = expanded(text);
    let extensions = purpose.kind().1;
    if text.trim().is_empty() {
        return Verdict::Refuse("Type the path of a file, or choose one above.".into());
    }
    if path.is_dir() {
        return Verdict::Enter(path);
    }
    if !purpose.saves() {
        return match (path.is_file(), has_extension(&path, extensions)) {
            (false, _) => Verdict::Refuse(format!("There is no file {}.", path.display())),
            (true, false) => Verdict::Refuse(format!("The file must be a .{}.", extensions.join(" or ."))),
            (true, true) => Verdict::Take(path),
        };
    }
    if !has_extension(&path, extensions) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        path.set_file_name(format!("{name}.{}", extensions[0]));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    if !folder.is_dir() {
        return Verdict::Refuse(format!("There is no folder {}.", folder.display()));
    }
    if path.exists() && !confirmed {
        return Verdict::Confirm(format!("{} is there already: save again to replace it.", path.display()));
    }
    Verdict::Take(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_can_be_opened_or_written_is_taken() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("rooms")).expect("a folder");
        for name in ["a.GLB", "b.txt", "edits.json", ".hidden.glb"] {
            std::fs::write(at(name), b"").expect("written");
        }
        let judge = |name: &str, purpose| judged(&at(name).to_string_lossy(), purpose, false);
        let is_refused = |name: &str, purpose, why: &str| {
            let verdict = judge(name, purpose);
            assert!(matches!(&verdict, Verdict::Refuse(said) if said.contains(why)), "{name}: {verdict:?}");
        };
        assert_eq!(judge("a.GLB", Purpose::OpenScene), Verdict::Take(at("a.GLB")));
        assert_eq!(judge("rooms", Purpose::OpenScene), Verdict::Enter(at("rooms")));
        is_refused("b.txt", Purpose::OpenScene, ".glb or .gltf");
        is_refused("nowhere.glb", Purpose::OpenScene, "no file");
        is_refused("nowhere/x.json", Purpose::SaveEdits, "no folder");
        assert_eq!(judge("new", Purpose::SaveEdits), Verdict::Take(at("new.json")));
        assert_eq!(judge("v1.2", Purpose::SaveEdits), Verdict::Take(at("v1.2.json")));
        assert!(matches!(judge("edits", Purpose::SaveEdits), Verdict::Confirm(_)));
        let again = judged(&at("edits").to_string_lossy(), Purpose::SaveEdits, true);
        assert_eq!(again, Verdict::Take(at("edits.json")));
        assert!(matches!(judged("  ", Purpose::OpenScene, false), Verdict::Refuse(_)));
        let names: Vec<String> =
            entries(folder.path(), Purpose::OpenScene.kind().1).into_iter().map(|entry| entry.name).collect();
        assert_eq!(names, ["rooms", "a.GLB"]);
    }

    #[test]
    fn paths_are_what_people_type() {
        let home = dirs::home_dir().expect("a home");
        assert_eq!(expanded("~/rooms/a.glb"), home.join("rooms/a.glb"));
        assert_eq!(expanded(" ~ "), home);
        assert!(expanded("a.glb").is_absolute() && expanded("~user/a").ends_with("~user/a"));
        let chooser = Chooser::new(Purpose::OpenScene, Path::new("rooms/a.glb"));
        assert!(chooser.text.ends_with(std::path::MAIN_SEPARATOR), "{}", chooser.text);
        let chooser = Chooser::new(Purpose::SaveEdits, Path::new("/tmp/edits.json"));
        assert!(chooser.text.ends_with("edits.json"), "{}", chooser.text);
    }
}

//! The web page around the window: options from its address, files that were dropped on it, downloads, and what it says.
//!
//! `web/page/index.js` has the other side: the object `page`, and calls of what is exported here.

use crate::args::ViewArgs;
use crate::{output, window};
use anyhow::{Result, anyhow};
use girandole_core::files;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use wasm_bindgen::prelude::*;
use winit::window::Window;

#[wasm_bindgen]
extern "C" {
    /// Shows a sentence in place of the picture: nothing goes on.
    #[wasm_bindgen(js_namespace = page, js_name = fail)]
    fn show_failure(sentence: &str);
    /// A frame was shown, with a picture in it or without one yet.
    #[wasm_bindgen(js_namespace = page)]
    pub fn ready(has_picture: bool);
    /// Saves a file as the browser does.
    #[wasm_bindgen(js_namespace = page)]
    fn save(name: &str, bytes: &[u8]);
    /// Puts a text into the clipboard.
    #[wasm_bindgen(js_namespace = page)]
    pub fn copy(text: &str);
    /// The address's query, and what is behind its `#`.
    #[wasm_bindgen(js_namespace = page)]
    fn address() -> String;
    /// Changes both, without loading anything. Returns the whole address.
    #[wasm_bindgen(js_namespace = page, js_name = setAddress)]
    pub fn set_address(query: &str) -> String;
    #[wasm_bindgen(js_namespace = console)]
    fn info(text: &str);
}

/// What the window is on.
pub fn canvas() -> Option<web_sys::HtmlCanvasElement> {
    web_sys::window()?.document()?.get_element_by_id("canvas")?.dyn_into().ok()
}

thread_local! {
    /// What was dropped, and whether other files belong to it.
    static DROPPED: RefCell<Vec<(PathBuf, bool)>> = const { RefCell::new(Vec::new()) };
    /// Whom to tell.
    static WINDOW: RefCell<Option<Arc<Window>>> = const { RefCell::new(None) };
}

/// Opens the window by the options of the address.
pub fn start() {
    std::panic::set_hook(Box::new(|panic| show_failure(&format!("Girandole has a defect: {panic}"))));
    if let Err(error) = options().and_then(window::run) {
        fail(&error);
    }
}

fn options() -> Result<ViewArgs> {
    ViewArgs::from_address(&address(), files::hold).map_err(|error| match error.downcast_ref() {
        Some(refused) => anyhow!("the address asks for what there is not: {}", output::refusal(refused)),
        None => error,
    })
}

/// Says what ended it all.
pub fn fail(error: &anyhow::Error) {
    show_failure(&crate::sentence(error));
}

/// Says something in the console.
pub fn say(sentence: &str) {
    info(sentence);
}

/// Holds a file that was dropped on the page.
#[wasm_bindgen]
pub fn hold(path: String, bytes: Vec<u8>) {
    files::hold(Path::new(&path), bytes);
}

/// The files of these names were dropped; all of them are held.
#[wasm_bindgen]
pub fn dropped(paths: Vec<String>) {
    let paths: Vec<PathBuf> = paths.into_iter().map(PathBuf::from).collect();
    let main = window::main_file(&paths).map(|main| (main, paths.len() > 1));
    DROPPED.with_borrow_mut(|dropped| dropped.extend(main));
    WINDOW.with_borrow(|window| window.iter().for_each(|window| window.request_redraw()));
}

/// Has a window drawn once files are there.
pub fn tell(window: Arc<Window>) {
    WINDOW.set(Some(window));
}

/// What was dropped since this was last asked, and whether other files belong to it.
pub fn take_dropped() -> Vec<(PathBuf, bool)> {
    DROPPED.take()
}

/// Saves what was written since.
pub fn save_written() {
    for (path, bytes) in files::take_written() {
        save(&path.file_name().unwrap_or_default().to_string_lossy(), &bytes);
    }
}

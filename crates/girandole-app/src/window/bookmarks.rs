//! Bookmarks: views to come back to, which are cameras of the scene.

use super::camera::Eye;
use super::session::Session;
use super::tools::Tools;
use girandole_core::scene::Edit;

/// How many there may be.
const MOST: usize = 9;

/// What the camera of a bookmark is called.
fn name(number: usize) -> String {
    format!("bookmark {number}")
}

/// The index of a bookmark's camera in the scene.
pub fn bookmark(session: &Session, number: usize) -> Option<usize> {
    let name = name(number);
    session.scene.cameras.iter().position(|camera| camera.name == name)
}

/// The numbers that bookmarks may have.
pub fn numbers() -> std::ops::RangeInclusive<usize> {
    1..=MOST
}

/// Keeps where one looks from, as a camera of the scene.
pub fn store(session: &mut Session, tools: &Tools, number: usize) {
    let view = session.view(tools.picture_size);
    let Some(Eye::Free(viewpoint)) = Eye::free(&view) else { return };
    session.edit(Edit::SetCamera { name: name(number), viewpoint });
    session.end_step();
    session.notice = Some(format!("{} looks from here: {number} comes back to it", name(number)));
}

/// Looks from where a bookmark was made.
pub fn recall(session: &mut Session, number: usize) {
    if let Some(camera) = bookmark(session, number) {
        session.eye = Eye::Camera(camera);
    }
}

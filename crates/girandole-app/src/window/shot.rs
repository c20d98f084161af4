//! Pictures that are saved from the window: by the same code, and so to the byte, as `girandole render` writes them.

use super::command;
use super::pending::{self, Pending};
use super::session::Session;
use crate::args::Engine;
use crate::picture::{self, Shown};
use crate::provenance::Maker;
use anyhow::Result;
use girandole::{Renderer, Viewport};
use girandole_core::image::Image;
use girandole_reference::Provenance;
use std::path::{Path, PathBuf};

/// A picture on its way to a file.
struct Shot {
    path: PathBuf,
    shown: Shown,
    made_by: Provenance,
    /// How many are averaged.
    light_sets: u32,
    radiance: Option<Pending<girandole::Result<Image>>>,
}

/// Pictures on their way to files.
#[derive(Default)]
pub struct Shots(Vec<Shot>);

impl Shots {
    pub fn is_waiting(&self) -> bool {
        !self.0.is_empty()
    }

    /// Saves the last picture.
    pub fn take(
        &mut self,
        (renderer, viewport): (&Renderer, &Viewport),
        shown: Shown,
        (path, made_by): (&Path, Provenance),
    ) {
        let radiance = Some(Pending::new(renderer.radiance(viewport)));
        let light_sets = renderer.refined_sets(viewport);
        self.0.push(Shot { path: path.into(), shown, made_by, light_sets, radiance });
    }

    /// Writes those that have come back. Returns the files, and how many light sets each shows.
    pub fn collect(&mut self) -> Vec<Result<(PathBuf, u32)>> {
        let mut written = Vec::new();
        self.0.retain_mut(|shot| match pending::take(&mut shot.radiance) {
            Some(image) => {
                written.push(write(shot, image).map(|path| (path, shot.light_sets)));
                false
            }
            None => true,
        });
        written
    }
}

fn write(shot: &Shot, image: girandole::Result<Image>) -> Result<PathBuf> {
    let path = free(&shot.path, Path::exists);
    crate::output::check_writable(&path, &["exr", "png"])?;
    picture::write(&path, (&image?, None), shot.shown, &shot.made_by)?;
    Ok(path)
}

/// What the picture that is shown was made by: what the call of `girandole render` for it would write. Pictures
/// of light that followed what was done in the window have no such call, and say so.
pub fn made_by(session: &Session, size: [u32; 2], path: &Path) -> Result<Provenance> {
    let args = command::arguments(session, (size, path), None)?;
    let mut made_by = Maker::new(&args, Engine::Gpu, &session.scene, path)?.still(&session.scene, None)?;
    if !session.is_fresh(size) {
        made_by.set("light", "followed");
    }
    Ok(made_by)
}

/// The file, or the first that is not there yet of those with a number behind its name: no picture is lost.
pub fn free(path: &Path, exists: impl Fn(&Path) -> bool) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let numbered = (2..).map(|n| path.with_file_name(format!("{stem}-{n}.{extension}")));
    std::iter::once(path.to_path_buf()).chain(numbered).find(|path| !exists(path)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_picture_is_overwritten() {
        let there = ["a/x.png", "a/x-2.png"].map(Path::new);
        let exists = |path: &Path| there.contains(&path);
        assert_eq!(free(Path::new("a/x.png"), exists), Path::new("a/x-3.png"));
        assert_eq!(free(Path::new("a/x.exr"), exists), Path::new("a/x.exr"));
    }
}

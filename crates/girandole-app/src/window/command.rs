//! The call of `girandole render` that gives what is on the screen, to the byte.

use super::camera::Eye;
use super::session::{Session, Source};
use super::shot::free;
use crate::args::{DebugView, LightArgs, Mode, QualityArgs, RenderArgs, ViewArg};
use anyhow::{Result, anyhow};
use std::path::{Path, PathBuf};

/// The call that renders the picture to `output`. Where the scene was changed, its edits are written to a file beside it.
pub fn line(session: &Session, (size, output): ([u32; 2], &Path), adapter: Option<&str>) -> Result<String> {
    let mut args = arguments(session, (size, output), adapter)?;
    args.seen.edits = write_edits(session, output)?;
    args.command_line()
}

/// The part of an address that shows the same in a browser: options, and the edits behind a `#`, which no server is told.
#[cfg(target_arch = "wasm32")]
pub fn address(session: &Session, size: [u32; 2]) -> Result<String> {
    let mut query = arguments(session, (size, Path::new("girandole.png")), None)?.query()?;
    if !session.edits.0.is_empty() {
        query = format!("{query}#{}", crate::args::edits_in_address(&session.edits.to_json()?));
    }
    Ok(query)
}

/// The options of that call, without the edits.
pub fn arguments(
    session: &Session,
    (size, output): ([u32; 2], &Path),
    adapter: Option<&str>,
) -> Result<RenderArgs> {
    let Source { scene, object, load } = session.source.clone();
    let settings = &session.settings;
    let mut args = RenderArgs {
        scene,
        object,
        size,
        output: output.into(),
        lights: LightArgs::from(&session.light),
        mode: Mode::from(settings.mode),
        quality: QualityArgs::from((&session.options, settings)),
        debug: settings.debug.map(DebugView::from),
        exposure: settings.exposure,
        tonemap: settings.tonemap.into(),
        aa: Some(settings.samples_per_axis.try_into().map_err(|error: String| anyhow!(error))?),
        adapter: adapter.map(str::to_owned),
        transfer: session.transfers.arguments(&session.scene),
        refine: if session.refinement.on { session.refined_sets().max(1) } else { 1 },
        ..RenderArgs::defaults()?
    };
    match session.eye {
        Eye::Camera(0) => {}
        Eye::Camera(index) => args.camera = Some(index.to_string()),
        Eye::Free(viewpoint) => args.seen.view = Some(ViewArg(viewpoint)),
    }
    args.seen.load = load;
    Ok(args)
}

/// Writes what was changed to a file that is not there yet.
fn write_edits(session: &Session, output: &Path) -> Result<Option<PathBuf>> {
    if session.edits.0.is_empty() {
        return Ok(None);
    }
    let path = free(&output.with_extension("edits.json"), Path::exists);
    crate::output::check_writable(&path, &["json"])?;
    girandole_core::files::write(&path, session.edits.to_json()?.as_bytes())?;
    Ok(Some(path))
}

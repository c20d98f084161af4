//! `girandole export`: a scene as it stands, as a `.glb` file.

use crate::args::{ExportArgs, SceneArgs};
use crate::output::{check_writable, say};
use crate::scene;
use anyhow::Result;
use girandole_core::files;
use girandole_core::scene::Scene;
use std::path::Path;
use std::process::ExitCode;

/// Writes the scene that the options name.
pub fn run(args: &ExportArgs) -> Result<ExitCode> {
    check_writable(&args.output, &["glb"])?;
    let seen = SceneArgs { edits: args.edits.clone(), load: args.load.clone(), ..SceneArgs::default() };
    let (mut scene, _) = scene::load_edited(&args.scene, args.object.as_deref(), &seen)?;
    if let Some(seconds) = args.time {
        scene.set_time(seconds)?;
    }
    say(&write(&scene, &args.output)?);
    Ok(ExitCode::SUCCESS)
}

/// Writes a scene. Returns what there is to say of it.
pub fn write(scene: &Scene, path: &Path) -> Result<String> {
    check_writable(path, &["glb"])?;
    let exported = scene.export_glb()?;
    files::write(path, &exported.bytes)?;
    let wrote = format!("wrote {}", path.display());
    Ok(match exported.left_out.as_slice() {
        [] => wrote,
        left_out => format!("{wrote}, without {}", left_out.join("; without ")),
    })
}

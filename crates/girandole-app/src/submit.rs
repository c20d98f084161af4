//! `girandole submit`: hands the pieces of a sequence or of a picture to a cluster's scheduler.

mod needs;
mod pieces;
mod scripts;

use crate::args::{Farm, RenderArgs, SubmitArgs};
use crate::output::{self, say};
use crate::render;
use anyhow::{Context, Result, bail};
use girandole_core::files;
use needs::Needs;
use pieces::Pieces;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// Writes what a scheduler takes, and has Slurm take it.
pub fn run(args: &SubmitArgs) -> Result<ExitCode> {
    let render = absolute(&args.render)?;
    check(&render)?;
    let folder = std::path::absolute(&args.folder).context("there is no current folder")?;
    let pieces = Pieces::new(&render, args.pieces, args.regions)?;
    render::check(&pieces.first(&render))?;
    let submits = args.to == Farm::Slurm && !args.print && !args.dry_run;
    if submits {
        check_sbatch()?;
    }
    let mut needs = match args.print || args.dry_run || args.estimate {
        true => Needs::estimated(&render),
        false => Needs::measured(&render, &pieces, &folder)?,
    };
    needs.cores = args.cores.unwrap_or(needs.cores);
    let job = scripts::Job { program: program()?, render: &render, pieces: &pieces, folder: &folder, needs };
    let files = match args.to {
        Farm::Slurm => job.slurm(&args.sbatch)?,
        Farm::Openjd => vec![("girandole.openjd.json", job.openjd()?)],
    };
    if args.print {
        let texts: Vec<&str> = files.iter().map(|(_, text)| text.as_str()).collect();
        output::data(&texts.join("\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    make_folder(&folder)?;
    for (name, text) in &files {
        files::write(&folder.join(name), text.as_bytes())?;
    }
    let names: Vec<String> = files.iter().map(|(name, _)| folder.join(name).display().to_string()).collect();
    say(&format!("wrote {}: {pieces}", names.join(" and ")));
    if submits {
        output::data(&format!("{}\n", slurm(&folder, &files)?))?;
    } else if args.to == Farm::Openjd {
        say(&format!("`openjd run {}` does it here; farms take the file", names[0]));
    }
    Ok(ExitCode::SUCCESS)
}

/// Refuses what cannot be cut into pieces.
fn check(render: &RenderArgs) -> Result<()> {
    let given = [
        (render.piece.part.is_some(), "--part"),
        (render.piece.region.is_some(), "--region"),
        (render.piece.sets.is_some(), "--sets"),
        (render.stats.is_some(), "--stats"),
    ];
    if let Some((_, option)) = given.into_iter().find(|(is_given, _)| *is_given) {
        bail!(
            "{option} belongs to `girandole render`; `girandole submit` makes the pieces itself: leave it out"
        );
    }
    render::check(render)
}

/// The same, whatever the current folder is.
fn absolute(render: &RenderArgs) -> Result<RenderArgs> {
    let absolute = |path: &Path| std::path::absolute(path).context("there is no current folder");
    let file = |name: &str| -> Result<String> {
        let path = Path::new(name);
        if !path.is_file() {
            return Ok(name.into());
        }
        let path = absolute(path)?;
        Ok(path.to_str().with_context(|| format!("{name} is no Unicode; give it another name"))?.into())
    };
    let mut render = render.clone();
    render.scene = file(&render.scene)?;
    render.object = render.object.as_deref().map(file).transpose()?;
    render.output = absolute(&render.output)?;
    render.seen.make_absolute()?;
    Ok(render)
}

fn make_folder(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))
}

/// This program, as the workers find it on a shared disk.
fn program() -> Result<PathBuf> {
    std::env::current_exe().context("where this program is, is unknown")
}

/// Before anything is rendered or written.
fn check_sbatch() -> Result<()> {
    let answer = match Command::new("sbatch").arg("--version").stdin(Stdio::null()).output() {
        Ok(answer) => answer,
        Err(error) if error.kind() == ErrorKind::NotFound => bail!(
            "there is no sbatch: install Slurm (on Debian and Ubuntu the package slurm-wlm), or see what it would get with --print"
        ),
        Err(error) => return Err(error).context("sbatch cannot be run"),
    };
    let said = String::from_utf8_lossy(&answer.stderr);
    if !answer.status.success() {
        let last = said.trim().lines().last().unwrap_or("it does not say why");
        bail!(
            "sbatch is there, but does not work: {last}; set Slurm up on this machine, or see what it would get with --print"
        );
    }
    Ok(())
}

/// Submits scripts, the second to run when the first is done. The jobs' numbers.
fn slurm(folder: &Path, files: &[(&str, String)]) -> Result<String> {
    let mut ids: Vec<String> = Vec::new();
    for (name, _) in files {
        let mut sbatch = Command::new("sbatch");
        sbatch.arg("--parsable").args(ids.last().map(|id| format!("--dependency=afterok:{id}")));
        let answer = sbatch.arg(folder.join(name)).output().context("sbatch cannot be run")?;
        if !answer.status.success() {
            bail!("sbatch refused the job: {}", String::from_utf8_lossy(&answer.stderr).trim());
        }
        let answer = String::from_utf8_lossy(&answer.stdout).trim().to_owned();
        // A cluster's name may follow.
        ids.push(answer.split(';').next().unwrap_or_default().to_owned());
    }
    Ok(ids.join(" "))
}

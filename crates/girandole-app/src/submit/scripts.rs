//! The scripts: what is the same for all schedulers, and what each of them wants about it.

use super::needs::Needs;
use super::pieces::Pieces;
use crate::args::{RenderArgs, shown};
use crate::transfer::CACHE;
use anyhow::{Context, Result};
use girandole_core::image::Region;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What is handed over.
pub struct Job<'a> {
    pub program: PathBuf,
    pub render: &'a RenderArgs,
    pub pieces: &'a Pieces,
    pub folder: &'a Path,
    pub needs: Needs,
}

impl Job<'_> {
    /// A script of Slurm for the pieces, as an array, and for a picture a second one that joins them.
    pub fn slurm(&self, options: &[String]) -> Result<Vec<(&'static str, String)>> {
        let Needs { memory_mib, cores } = self.needs;
        let head = |more: &[String]| -> Result<String> {
            let folder = word(self.folder)?;
            let mut head = vec![
                "--job-name=girandole".into(),
                "--requeue".into(),
                "--open-mode=append".into(),
                format!("--mem={memory_mib}M"),
            ];
            head.extend(more.iter().chain(options).cloned());
            let directives: String = head.iter().map(|option| format!("#SBATCH {option}\n")).collect();
            // Of the log's name Slurm takes the quotes off.
            Ok(format!("#!/bin/sh\n{directives}export {CACHE}={folder}/cache\n"))
        };
        let log = |name: &str| -> Result<String> {
            Ok(format!(
                "--output={}",
                word(&self.folder.join(name))?.replace('%', "%%").replace("%%A_%%a", "%A_%a")
            ))
        };
        let array = [
            format!("--array=1-{}", self.pieces.count()),
            format!("--cpus-per-task={cores}"),
            log("%A_%a.log")?,
        ];
        let piece = self.piece("$SLURM_ARRAY_TASK_ID")?;
        let mut files = vec![("girandole.sbatch", format!("{}{piece}", head(&array)?))];
        if let Some(join) = self.join()? {
            files.push(("join.sbatch", format!("{}{join}", head(&[log("join.log")?])?)));
        }
        Ok(files)
    }

    /// A template of the Open Job Description (2023-09).
    pub fn openjd(&self) -> Result<String> {
        let Needs { memory_mib, cores } = self.needs;
        let cache = format!("#!/bin/sh\nexport {CACHE}={}/cache\n", word(self.folder)?);
        let step = |name: &str, text: String| {
            json!({
                "name": name,
                "hostRequirements": {"amounts": [
                    {"name": "amount.worker.vcpu", "min": cores},
                    {"name": "amount.worker.memory", "min": memory_mib},
                ]},
                "script": {
                    "actions": {"onRun": {"command": "/bin/sh", "args": ["{{Task.File.Run}}"]}},
                    "embeddedFiles": [{"name": "Run", "type": "TEXT", "data": format!("{cache}{text}")}],
                },
            })
        };
        let mut render = step("Render", self.piece("{{Task.Param.Piece}}")?);
        render["parameterSpace"] = json!({"taskParameterDefinitions": [
            {"name": "Piece", "type": "INT", "range": format!("1-{}", self.pieces.count())},
        ]});
        let mut steps = vec![render];
        if let Some(join) = self.join()? {
            let mut join = step("Join", join);
            join["dependencies"] = json!([{"dependsOn": "Render"}]);
            steps.push(join);
        }
        let template: Value =
            json!({"specificationVersion": "jobtemplate-2023-09", "name": "girandole", "steps": steps});
        Ok(format!("{}\n", serde_json::to_string_pretty(&template)?))
    }

    /// What renders the piece of this number.
    fn piece(&self, number: &str) -> Result<String> {
        match self.pieces {
            Pieces::Sequence(pieces) => {
                let part = format!("--part \"{number}/{pieces}\"");
                Ok(format!("exec {}\n", self.command(self.render, &part)?))
            }
            Pieces::Still { sets, regions } => {
                let count = sets.unwrap_or(1);
                let mut script = format!("piece=$(({number} - 1))\n");
                let part = format!("{}/part-$(printf %04d \"$((piece + 1))\").exr", word(self.folder)?);
                let mut options = format!("--output {part}");
                if sets.is_some() {
                    let all = self.render.refine;
                    script += &format!(
                        "first=$((piece % {count} * {all} / {count}))\nlast=$(((piece % {count} + 1) * {all} / {count} - 1))\n"
                    );
                    options += " --sets \"$first..$last\"";
                }
                if let Some(regions) = regions {
                    script += &format!("case $((piece / {count})) in\n{}esac\n", cases(regions));
                    options += " --region \"$region\"";
                }
                let output = RenderArgs::defaults()?.output;
                let command = self.command(&RenderArgs { output, ..self.render.clone() }, &options)?;
                Ok(format!("{script}exec {command}\n"))
            }
        }
    }

    /// What puts the pieces of a picture together.
    fn join(&self) -> Result<Option<String>> {
        if matches!(self.pieces, Pieces::Sequence(_)) {
            return Ok(None);
        }
        let count = self.pieces.count();
        let folder = word(self.folder)?;
        let mut join = format!(
            "number=1\nwhile [ $number -le {count} ]; do\n  set -- \"$@\" {folder}/part-$(printf %04d $number).exr\n  \
             number=$((number + 1))\ndone\nexec {} join \"$@\" --output {}",
            word(&self.program)?,
            word(&self.render.output)?,
        );
        for (option, value) in shown(self.render.exposure, &self.render.tonemap) {
            join += &format!(" {option}={}", value.unwrap_or_default());
        }
        Ok(Some(join + "\n"))
    }

    /// The call of this program with these options, and those of a piece.
    fn command(&self, render: &RenderArgs, piece: &str) -> Result<String> {
        let line = render.command_line()?;
        let options = line.strip_prefix("girandole render").context("the options cannot be written down")?;
        Ok(format!("{} render {piece}{options}", word(&self.program)?))
    }
}

/// By the number of a region its pixels.
fn cases(regions: &[Region]) -> String {
    regions.iter().enumerate().map(|(index, region)| format!("  {index}) region={region} ;;\n")).collect()
}

/// A path as a word of a shell.
fn word(path: &Path) -> Result<String> {
    let text =
        path.to_str().with_context(|| format!("{} is no Unicode; give it another name", path.display()))?;
    Ok(shlex::try_quote(text)?.into_owned())
}

//! Pieces of sequences, and what is handed to clusters.

use crate::{Girandole, stderr, stdout};
use std::process::Command;

const SMALL: [&str; 8] = ["render", "table", "--size", "48x36", "--lights", "16", "--engine", "cpu"];
const SEQUENCE: [&str; 6] = ["--frames", "3..8", "--fps", "2", "-o", "f.#.exr"];

fn sequence(part: &str) -> Vec<&str> {
    SMALL.into_iter().chain(SEQUENCE).chain(["--part", part]).collect()
}

#[test]
fn pieces_of_a_sequence_are_dealt_out_in_turn() {
    let all = Girandole::new();
    all.succeed(&SMALL.into_iter().chain(SEQUENCE).collect::<Vec<_>>());
    let girandole = Girandole::new();
    let said = stderr(&girandole.succeed(&sequence("2/4")));
    assert!(said.contains("wrote 2 of 2 frames"), "{said}");
    assert_eq!(girandole.files(), ["f.4.exr", "f.8.exr"]);
    for part in ["1/4", "3/4", "4/4"] {
        girandole.succeed(&sequence(part));
    }
    assert_eq!(girandole.files(), all.files());
    for name in all.files() {
        assert!(girandole.bytes(&name) == all.bytes(&name), "{name}");
    }
    let said = stderr(&girandole.succeed(&sequence("1/4")));
    assert!(said.contains("wrote 0 of 2 frames, 2 were there"), "{said}");
    // A piece beyond the frames is empty.
    assert!(stderr(&girandole.succeed(&sequence("9/9"))).contains("wrote 0 of 0 frames"));
    // Of another sequence's frames those count that are its own.
    let other = Girandole::new();
    std::fs::write(other.path().join("f.4.exr"), "something else").unwrap();
    other.succeed(&sequence("1/4"));
    assert_eq!(other.run(&sequence("2/4")).status.code(), Some(2));
    assert_eq!(other.bytes("f.4.exr"), b"something else");
}

/// A call of `submit` that prints what it would hand over.
fn printed(girandole: &Girandole, arguments: &[&str]) -> String {
    stdout(&girandole.succeed(&[&["submit"], arguments, &["--print", "--folder", "a folder"]].concat()))
}

#[test]
fn scripts_of_slurm_render_the_pieces() {
    let girandole = Girandole::new();
    let render = [&SMALL[1..], &SEQUENCE].concat();
    let script = printed(&girandole, &[&["slurm"], &render[..], &["--pieces", "4", "--cores", "3"]].concat());
    for expected in ["#SBATCH --array=1-4\n", "#SBATCH --requeue\n", "--cpus-per-task=3", "#SBATCH --mem="] {
        assert!(script.contains(expected), "{expected}: {script}");
    }
    assert!(girandole.files().is_empty(), "nothing is written");
    // What a worker does: light is sampled once for all.
    std::fs::write(girandole.path().join("job.sh"), &script).unwrap();
    for task in ["1", "3"] {
        let mut worker = Command::new("sh");
        worker.arg("job.sh").env("SLURM_ARRAY_TASK_ID", task).current_dir(girandole.path());
        let output = worker.output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
    }
    assert_eq!(girandole.files(), ["a folder", "f.3.exr", "f.5.exr", "f.7.exr", "job.sh"]);
    let more = printed(&girandole, &[&["slurm"], &render[..], &["--sbatch=--time=60"]].concat());
    assert!(more.contains("#SBATCH --time=60\n") && more.contains("#SBATCH --array=1-6\n"), "{more}");
}

#[test]
fn scripts_of_slurm_cut_pictures_and_join_them() {
    let girandole = Girandole::new();
    let still =
        ["table", "--size", "48x36", "--refine", "10", "--regions", "2x2", "--pieces", "4", "-o", "o.png"];
    let scripts = printed(&girandole, &[&["slurm"], &still[..], &["--exposure", "-1.5"]].concat());
    assert!(scripts.contains("--array=1-16\n") && scripts.contains("join \"$@\""), "{scripts}");
    assert!(scripts.contains("--exposure=-1.5") && scripts.contains("--tonemap=agx"), "{scripts}");
    // Each set of each region once: the call is printed in place of being made.
    let (render, join) = scripts.split_at(scripts.rfind("#!/bin/sh").unwrap());
    let call = |script: &str, task: &str| {
        let script = script.replace("exec ", "printf '%s|' ");
        let output = Command::new("sh").arg("-c").arg(script).env("SLURM_ARRAY_TASK_ID", task).output();
        stdout(&output.unwrap())
    };
    let mut seen = Vec::new();
    for task in 1..=16 {
        let words = call(render, &task.to_string());
        let value = |option: &str| {
            let mut words = words.split('|').skip_while(|word| *word != option);
            words.nth(1).unwrap_or_default().to_owned()
        };
        let (first, last) =
            value("--sets").split_once("..").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
        for set in first.parse::<u32>().unwrap()..=last.parse().unwrap() {
            seen.push((value("--region"), set));
        }
        assert!(value("--output").ends_with(&format!("a folder/part-{task:04}.exr")), "{words}");
        assert_eq!(value("--refine"), "10", "{words}");
    }
    seen.sort();
    let regions = ["0,0,24,18", "0,18,24,18", "24,0,24,18", "24,18,24,18"];
    let all: Vec<(String, u32)> =
        regions.iter().flat_map(|region| (0..10).map(|set| (region.to_string(), set))).collect();
    assert_eq!(seen, all);
    let join = call(join, "");
    assert!(join.contains("a folder/part-0001.exr|") && join.contains("a folder/part-0016.exr|"), "{join}");
    assert!(!join.contains("part-0017"), "{join}");
}

#[test]
fn templates_of_open_job_descriptions_hold_the_same() {
    let girandole = Girandole::new();
    let still = ["openjd", "table", "--refine", "8", "--pieces", "2", "-o", "o.exr"];
    let said = stderr(&girandole.succeed(&[&["submit"], &still[..], &["--dry-run"]].concat()));
    assert!(said.contains("openjd run"), "{said}");
    let text =
        std::fs::read_to_string(girandole.path().join("girandole-farm/girandole.openjd.json")).unwrap();
    let template: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(template["specificationVersion"], "jobtemplate-2023-09");
    let steps = template["steps"].as_array().unwrap();
    assert_eq!(steps[0]["parameterSpace"]["taskParameterDefinitions"][0]["range"], "1-2");
    assert_eq!(steps[1]["dependencies"][0]["dependsOn"], "Render");
    let script = steps[0]["script"]["embeddedFiles"][0]["data"].as_str().unwrap();
    assert!(script.contains("{{Task.Param.Piece}}") && script.contains("--sets"), "{script}");
    assert_eq!(girandole.files(), ["girandole-farm"]);
}

#[test]
fn what_is_handed_over_is_measured_first() {
    let girandole = Girandole::new();
    let render = [&SMALL[1..], &SEQUENCE].concat();
    let said = stderr(&girandole.succeed(&[&["submit", "openjd"], &render[..]].concat()));
    assert!(said.contains("the first piece took"), "{said}");
    // It is a frame of the sequence, and stays.
    assert_eq!(girandole.files(), ["f.3.exr", "girandole-farm"]);
    let said = stderr(&girandole.succeed(&[&SMALL[..], &SEQUENCE].concat()));
    assert!(said.contains("wrote 5 of 6 frames, 1 were there"), "{said}");
}

#[cfg(unix)]
#[test]
fn a_slurm_that_does_not_work_is_said_before_anything_is_rendered() {
    use std::os::unix::fs::PermissionsExt;
    let girandole = Girandole::new();
    let tools = tempfile::tempdir().unwrap();
    let submit = |expected: &str| {
        let arguments = [&["submit", "slurm"], &SMALL[1..], &SEQUENCE].concat();
        let output = girandole.command(&arguments).env("PATH", tools.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let said = stderr(&output);
        assert!(said.contains(expected) && said.lines().count() == 1, "{said}");
        assert!(girandole.files().is_empty());
    };
    submit("there is no sbatch: install Slurm");
    let sbatch = tools.path().join("sbatch");
    std::fs::write(
        &sbatch,
        "#!/bin/sh\necho 'sbatch: error: first' >&2\necho 'sbatch: fatal: no controller' >&2\nexit 1\n",
    )
    .unwrap();
    std::fs::set_permissions(&sbatch, std::fs::Permissions::from_mode(0o755)).unwrap();
    submit("does not work: sbatch: fatal: no controller");
}

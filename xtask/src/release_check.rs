//! `cargo xtask release-check`: what a version has to pass before it is published. What cannot be run here is named, with
//! what it needs, and counts as neither passed nor failed.

mod metadata;

use crate::{cargo, root};
use anyhow::{Context, Result, bail};
use metadata::Workspace;
use std::io::stderr;
use std::process::{Command, ExitCode, Stdio};

#[derive(clap::Args)]
pub struct Arguments {
    /// The version that the interfaces are compared with: a tag, a branch or a commit [default: the last tag v*]
    #[arg(long, value_name = "REV")]
    baseline_rev: Option<String>,
    /// Only these, in this order
    #[arg(value_enum, default_values_t = Check::ALL)]
    checks: Vec<Check>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Check {
    /// `cargo package`: all manifests; what is published builds from what its packages contain
    Package,
    /// `cargo deny`: licences, and which crate may depend on which
    Licences,
    /// `cargo deny`: known faults of dependencies; needs the advisory database
    Advisories,
    /// `cargo semver-checks`: the version says so where an interface changed
    Semver,
    /// The published crates build with the `rust-version` that they name
    RustVersion,
    /// The published crates build with the lowest versions of dependencies that their manifests allow
    MinimalVersions,
}

enum Outcome {
    Passed,
    Failed,
    /// Why.
    NotRun(String),
}

impl Check {
    const ALL: [Check; 6] = [
        Check::Package,
        Check::Licences,
        Check::Advisories,
        Check::Semver,
        Check::RustVersion,
        Check::MinimalVersions,
    ];

    fn name(self) -> &'static str {
        match self {
            Check::Package => "package",
            Check::Licences => "licences",
            Check::Advisories => "advisories",
            Check::Semver => "semver",
            Check::RustVersion => "rust-version",
            Check::MinimalVersions => "minimal-versions",
        }
    }

    fn run(self, workspace: &Workspace, baseline: Option<&str>) -> Result<Outcome> {
        match self {
            Check::Package => package(workspace),
            Check::Licences => deny(&["licenses", "bans"]),
            Check::Advisories => advisories(),
            Check::Semver => semver(workspace, baseline),
            Check::RustVersion => rust_version(workspace),
            Check::MinimalVersions => minimal_versions(workspace),
        }
    }
}

/// Runs the checks one after another; none hinders the next.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let workspace = Workspace::read()?;
    let mut results = Vec::new();
    for check in &arguments.checks {
        let outcome = check.run(&workspace, arguments.baseline_rev.as_deref()).unwrap_or_else(|error| {
            eprintln!("error: {error:#}");
            Outcome::Failed
        });
        println!("{}", line(*check, &outcome));
        results.push(outcome);
    }
    let count = |is: fn(&Outcome) -> bool| results.iter().filter(|outcome| is(outcome)).count();
    let failed = count(|outcome| matches!(outcome, Outcome::Failed));
    let not_run = count(|outcome| matches!(outcome, Outcome::NotRun(_)));
    println!("{} passed, {failed} failed, {not_run} not run", results.len() - failed - not_run);
    Ok(if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn line(check: Check, outcome: &Outcome) -> String {
    match outcome {
        Outcome::Passed => format!("passed: {}", check.name()),
        Outcome::Failed => format!("failed: {}", check.name()),
        Outcome::NotRun(why) => format!("not run: {}, as {why}", check.name()),
    }
}

/// Runs a command, whose words all go to standard error: standard output has the results alone.
fn passes(command: &mut Command) -> Result<Outcome> {
    let status = command.stdout(Stdio::from(stderr())).status();
    let status = status.with_context(|| format!("cannot run {}", command.get_program().display()))?;
    Ok(if status.success() { Outcome::Passed } else { Outcome::Failed })
}

/// Whether a command ends well; nothing is seen of it.
fn succeeds(command: &mut Command) -> bool {
    command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

/// What it says, where it ends well.
fn output(command: &mut Command) -> Option<String> {
    let output = command.stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Why a command of cargo's that is no part of it cannot be run.
fn missing(subcommand: &str) -> Option<Outcome> {
    let why = || format!("cargo-{subcommand} is missing; cargo install cargo-{subcommand} --locked");
    (!succeeds(cargo().args([subcommand, "--version"]))).then(|| Outcome::NotRun(why()))
}

/// Manifests of all crates, then what is published, built from its packages alone.
fn package(workspace: &Workspace) -> Result<Outcome> {
    let manifests = passes(cargo().args(["package", "--locked", "--workspace", "--no-verify"]))?;
    let Outcome::Passed = manifests else { return Ok(manifests) };
    // Otherwise each would build its dependencies anew.
    let mut command = cargo();
    command.env("CARGO_TARGET_DIR", &workspace.target);
    passes(command.args(["package", "--locked"]).args(workspace.published()))
}

fn deny(which: &[&str]) -> Result<Outcome> {
    match missing("deny") {
        Some(not_run) => Ok(not_run),
        None => passes(cargo().args(["deny", "--locked", "check"]).args(which)),
    }
}

fn advisories() -> Result<Outcome> {
    if missing("deny").is_none() && !succeeds(cargo().args(["deny", "--locked", "fetch", "db"])) {
        return Ok(Outcome::NotRun("the advisory database cannot be fetched; it is on github.com".into()));
    }
    deny(&["advisories"])
}

fn semver(workspace: &Workspace, baseline: Option<&str>) -> Result<Outcome> {
    let mut git = Command::new("git");
    git.current_dir(root()).args(["describe", "--tags", "--abbrev=0", "--match", "v*"]);
    let Some(baseline) = baseline.map(str::to_owned).or_else(|| output(&mut git)) else {
        return Ok(Outcome::NotRun(
            "there is no earlier version: no tag v*; --baseline-rev names one".into(),
        ));
    };
    if let Some(not_run) = missing("semver-checks") {
        return Ok(not_run);
    }
    let mut command = cargo();
    passes(command.args(["semver-checks", "--baseline-rev", &baseline]).args(workspace.published_libraries()))
}

fn rust_version(workspace: &Workspace) -> Result<Outcome> {
    let version = workspace.rust_version()?;
    let Some(mut cargo) = cargo_of(version) else { return Ok(toolchain_is_missing(version)) };
    passes(cargo.args(["check", "--locked", "--all-features"]).args(workspace.published()))
}

/// In a copy of the last commit, whose `Cargo.lock` has the lowest versions of what the manifests name themselves.
fn minimal_versions(workspace: &Workspace) -> Result<Outcome> {
    let Some(mut nightly) = cargo_of("nightly") else { return Ok(toolchain_is_missing("nightly")) };
    let folder = tempfile::tempdir()?;
    let mut git = Command::new("git");
    git.args(["clone", "--quiet", "--shared"]).arg(root()).arg(folder.path());
    if !git.status().context("cannot run git")?.success() {
        bail!("git cannot copy the last commit");
    }
    if !nightly
        .current_dir(folder.path())
        .args(["update", "-Z", "direct-minimal-versions"])
        .status()?
        .success()
    {
        return Ok(Outcome::Failed);
    }
    // A version that is too low may but warn: a macro, for one, that does not fill in names yet.
    let mut command = cargo();
    command
        .current_dir(folder.path())
        .env("RUSTFLAGS", "-D warnings")
        .env("CARGO_TARGET_DIR", workspace.target.join("minimal-versions"));
    passes(command.args(["check", "--locked", "--all-features"]).args(workspace.published()))
}

/// Cargo of another toolchain, in the workspace's root.
pub fn cargo_of(version: &str) -> Option<Command> {
    let installed = output(Command::new("rustup").args(["toolchain", "list", "--quiet"]))?;
    let mut command = Command::new("rustup");
    command.current_dir(root()).args(["run", toolchain(&installed, version)?, "cargo"]);
    Some(command)
}

/// Of the installed toolchains, one a line, the first of a version: `1.95` stands for `1.95.0-x86_64-…`, too.
fn toolchain<'a>(installed: &'a str, version: &str) -> Option<&'a str> {
    let of_version = |name: &&str| {
        name.strip_prefix(version).is_some_and(|rest| rest.is_empty() || rest.starts_with(['-', '.']))
    };
    installed.split_whitespace().find(of_version)
}

fn toolchain_is_missing(version: &str) -> Outcome {
    Outcome::NotRun(format!("this toolchain is missing; rustup toolchain install {version}"))
}

#[cfg(test)]
mod tests {
    use super::{Check, Outcome, line, passes, toolchain};
    use std::process::Command;

    #[test]
    fn a_toolchain_is_found_by_its_version() {
        let installed = "stable-x86_64-unknown-linux-gnu\n1.9-x86_64-unknown-linux-gnu\n1.95.0-x86_64-unknown-linux-gnu\nnightly";
        assert_eq!(toolchain(installed, "1.95"), Some("1.95.0-x86_64-unknown-linux-gnu"));
        assert_eq!(toolchain(installed, "nightly"), Some("nightly"));
        assert_eq!(toolchain(installed, "1.94"), None);
        assert_eq!(toolchain("1.95.0", "1.9"), None);
    }

    #[test]
    fn what_fails_is_not_passed_and_what_is_not_run_says_why() {
        let rustc = |argument| passes(Command::new("rustc").arg(argument)).expect("rustc starts");
        assert!(matches!(rustc("--version"), Outcome::Passed));
        assert!(matches!(rustc("--no-such-option"), Outcome::Failed));
        assert!(passes(&mut Command::new("no-such-program")).is_err());
        let not_run = Outcome::NotRun("cargo-deny is missing".into());
        assert_eq!(line(Check::Licences, &not_run), "not run: licences, as cargo-deny is missing");
    }
}

//! Finds a compiler for `wasm32-unknown-unknown`: one that has the target, or one that can build the standard library.

use anyhow::{Result, bail};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The target of browsers.
pub const TARGET: &str = "wasm32-unknown-unknown";

/// What `cargo run` and rustup's proxies set for the compiler that built this program, and must not reach another one.
const OF_THE_CALLER: [&str; 10] = [
    "CARGO",
    "LD_LIBRARY_PATH",
    "RUSTC",
    "RUSTC_WORKSPACE_WRAPPER",
    "RUSTC_WRAPPER",
    "RUSTDOC",
    "RUSTUP_HOME",
    "RUSTUP_TOOLCHAIN",
    "RUSTUP_TOOLCHAIN_SOURCE",
    "RUST_RECURSION_COUNT",
];

/// A compiler for browsers, with its Cargo.
#[derive(Debug, PartialEq, Eq)]
pub enum Toolchain {
    /// The active compiler has the target's libraries.
    Installed,
    /// The compiler of this sysroot has the sources of its libraries, which are built along.
    FromSources(PathBuf),
}

impl Toolchain {
    /// The active compiler if it has the target, else the first of `PATH` that has its sources.
    pub fn find() -> Result<Self> {
        if has_target(&active()) {
            return Ok(Self::Installed);
        }
        let mut old = None;
        for sysroot in sysroots() {
            if !has_sources(&sysroot) {
                continue;
            }
            let version = version(&sysroot);
            if version >= Some(required()) {
                return Ok(Self::FromSources(sysroot));
            }
            old = old.or(version);
        }
        bail!("{}", advice(old));
    }

    /// Cargo in the workspace's root, set up for this compiler; [`build_arguments`](Self::build_arguments) come later.
    pub fn cargo(&self) -> Command {
        let mut command = match self {
            Self::Installed => {
                Command::new(std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo")))
            }
            Self::FromSources(sysroot) => cargo_of(sysroot),
        };
        command.current_dir(crate::root());
        command
    }

    /// What `cargo build` needs to be told for the target.
    pub fn build_arguments(&self) -> Vec<&'static str> {
        match self {
            Self::Installed => vec!["--target", TARGET],
            Self::FromSources(_) => vec!["--target", TARGET, "-Zbuild-std=std,panic_abort"],
        }
    }

    /// In words.
    pub fn describe(&self) -> String {
        match self {
            Self::Installed => format!("the active compiler, which has the target {TARGET}"),
            Self::FromSources(sysroot) => {
                format!(
                    "{}, with its standard library built from source",
                    program(sysroot, "rustc").display()
                )
            }
        }
    }
}

/// Cargo of a compiler that is not the active one. Building the standard library is an unstable feature, hence
/// `RUSTC_BOOTSTRAP`.
fn cargo_of(sysroot: &Path) -> Command {
    let mut command = Command::new(program(sysroot, "cargo"));
    for name in OF_THE_CALLER {
        command.env_remove(name);
    }
    command.env("RUSTC", program(sysroot, "rustc")).env("RUSTC_BOOTSTRAP", "1");
    let mut folders = vec![sysroot.join("bin")];
    folders.extend(path_folders());
    if let Ok(path) = std::env::join_paths(&folders) {
        command.env("PATH", path);
    }
    let linker = "CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER";
    if std::env::var_os(linker).is_none() && !has_own_linker(sysroot, &folders) {
        command.env(linker, "wasm-ld");
    }
    command
}

/// Whether the compiler finds its usual linker for this target, `rust-lld`.
fn has_own_linker(sysroot: &Path, folders: &[PathBuf]) -> bool {
    let host = sysroot.join("lib/rustlib").join(host(sysroot)).join("bin");
    let name = format!("rust-lld{}", std::env::consts::EXE_SUFFIX);
    folders.iter().chain([&host]).any(|folder| folder.join(&name).is_file())
}

/// The triple that a compiler runs on.
fn host(sysroot: &Path) -> String {
    let text = output(Command::new(program(sysroot, "rustc")).arg("-vV")).unwrap_or_default();
    text.lines().find_map(|line| line.strip_prefix("host: ")).unwrap_or_default().to_string()
}

/// The compiler that Cargo would call.
fn active() -> OsString {
    std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into())
}

fn has_target(rustc: &OsString) -> bool {
    output(Command::new(rustc).args(["--print", "target-libdir", "--target", TARGET]))
        .is_some_and(|folder| Path::new(folder.trim()).is_dir())
}

fn has_sources(sysroot: &Path) -> bool {
    sysroot.join("lib/rustlib/src/rust/library/Cargo.toml").is_file() && program(sysroot, "cargo").is_file()
}

/// The sysroots of the active compiler and of all others in `PATH`, without rustup's proxies' repetitions.
fn sysroots() -> Vec<PathBuf> {
    let name = format!("rustc{}", std::env::consts::EXE_SUFFIX);
    let others = path_folders().into_iter().map(|folder| folder.join(&name)).filter(|file| file.is_file());
    let mut sysroots: Vec<PathBuf> = Vec::new();
    for rustc in std::iter::once(active()).chain(others.map(OsString::from)) {
        let Some(sysroot) = output(Command::new(rustc).args(["--print", "sysroot"])) else { continue };
        let sysroot = PathBuf::from(sysroot.trim());
        if !sysroots.contains(&sysroot) {
            sysroots.push(sysroot);
        }
    }
    sysroots
}

/// The folders of `PATH`.
pub fn path_folders() -> Vec<PathBuf> {
    std::env::var_os("PATH").map(|path| std::env::split_paths(&path).collect()).unwrap_or_default()
}

fn program(sysroot: &Path, name: &str) -> PathBuf {
    sysroot.join("bin").join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

fn version(sysroot: &Path) -> Option<[u32; 2]> {
    numbers(output(Command::new(program(sysroot, "rustc")).arg("--version"))?.strip_prefix("rustc ")?)
}

/// The oldest version that compiles the workspace.
fn required() -> [u32; 2] {
    numbers(env!("CARGO_PKG_RUST_VERSION")).unwrap_or_default()
}

/// Major and minor version at the start of a text.
fn numbers(text: &str) -> Option<[u32; 2]> {
    let mut numbers = text.split(|c: char| !c.is_ascii_digit()).map(str::parse);
    Some([numbers.next()?.ok()?, numbers.next()?.ok()?])
}

fn advice(old: Option<[u32; 2]>) -> String {
    let found = old.map_or_else(String::new, |[major, minor]| {
        let [required, least] = required();
        format!(" (there is rustc {major}.{minor} with sources, but {required}.{least} is needed)")
    });
    format!(
        "no compiler for {TARGET} was found{found}; add it with `rustup target add {TARGET}`, or on Debian install one \
         with `apt-get install rustc-web cargo-web rust-web-src lld`"
    )
}

/// What a program prints, if it succeeds.
fn output(command: &mut Command) -> Option<String> {
    let output = command.stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_read_and_compared() {
        assert_eq!(numbers("1.96.0 (ac68faa20 2026-05-25)"), Some([1, 96]));
        assert_eq!(numbers("1.95"), Some([1, 95]));
        assert_eq!(numbers("nightly"), None);
        assert!(numbers("1.100.0") > numbers("1.95"));
        assert!(required() >= [1, 95]);
        assert!(None < Some(required()));
    }

    #[test]
    fn the_advice_names_both_ways_and_what_is_too_old() {
        let words = advice(Some([1, 63]));
        for part in ["rustup target add wasm32-unknown-unknown", "rust-web-src", "rustc 1.63"] {
            assert!(words.contains(part), "{words}");
        }
        assert!(!advice(None).contains("sources"));
    }

    #[test]
    fn another_compiler_gets_nothing_of_the_active_one() {
        let command = Toolchain::FromSources("/opt/rust".into()).cargo();
        let set = |name: &str| command.get_envs().find(|(key, _)| *key == name).map(|(_, value)| value);
        assert_eq!(command.get_program(), program(Path::new("/opt/rust"), "cargo").as_os_str());
        assert_eq!(set("RUSTUP_TOOLCHAIN"), Some(None));
        assert_eq!(set("RUSTC_WRAPPER"), Some(None));
        assert_eq!(set("RUSTC"), Some(Some(program(Path::new("/opt/rust"), "rustc").as_os_str())));
        let path = set("PATH").flatten().expect("a path");
        assert_eq!(std::env::split_paths(path).next(), Some("/opt/rust/bin".into()));
    }
}

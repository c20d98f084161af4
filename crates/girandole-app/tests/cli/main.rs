//! The program from outside: exit codes, messages, files.

mod bench;
mod compare;
mod edits;
mod export;
mod help;
mod info;
#[cfg(target_os = "linux")]
mod interrupts;
mod pieces;
#[path = "../shared/pixels.rs"]
mod pixels;
mod refusals;
mod render;
mod sequence;

use std::path::Path;
use std::process::{Command, Output};

/// The program in a directory of its own.
struct Girandole {
    directory: tempfile::TempDir,
}

impl Girandole {
    fn new() -> Self {
        Self { directory: tempfile::tempdir().unwrap() }
    }

    fn path(&self) -> &Path {
        self.directory.path()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_girandole"));
        command.args(arguments).current_dir(self.path());
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Runs what has to succeed.
    fn succeed(&self, arguments: &[&str]) -> Output {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
        output
    }

    /// All files of the directory by name.
    fn files(&self) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(self.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path().join(name)).unwrap()
    }

    fn json(&self, name: &str) -> serde_json::Map<String, serde_json::Value> {
        serde_json::from_slice(&self.bytes(name)).unwrap()
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Takes the machine's adapters away, so that the program has to do without.
#[cfg(target_os = "linux")]
fn without_adapters(command: &mut Command) -> &mut Command {
    for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "__EGL_VENDOR_LIBRARY_FILENAMES"] {
        command.env(variable, "/nonexistent");
    }
    command
}

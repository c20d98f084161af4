//! The program, as `cargo xtask` calls it.

use std::process::{Command, Output};

fn called(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_girandole-web"));
    // Nothing is found, no compiler and no browser.
    command.args(arguments).env("PATH", "").env("RUSTC", "no-compiler");
    command.output().expect("the program starts")
}

#[test]
fn what_cannot_be_run_is_named() {
    let check = "package/naive-is-the-native-picture";
    let skipped = called(&["test-web", check, "--quick", "--if-possible"]);
    let said = String::from_utf8_lossy(&skipped.stderr).into_owned();
    assert!(skipped.status.success(), "{said}");
    assert!(said.starts_with(&format!("not run: {check}, as no compiler")), "{said}");
    // The control: otherwise it is a failure.
    let failed = called(&["test-web", check, "--quick"]);
    assert_eq!(failed.status.code(), Some(2), "{}", String::from_utf8_lossy(&failed.stderr));
    let known = called(&["test-web", "--list"]);
    assert!(String::from_utf8_lossy(&known.stdout).contains(check));
}

//! What `girandole bench` does without an adapter; `tests/gpu.rs` times with one.

#[cfg(target_os = "linux")]
#[test]
fn without_an_adapter_there_is_nothing_to_time() {
    use crate::{Girandole, stderr, stdout};
    let girandole = Girandole::new();
    let arguments = ["bench", "table", "--size", "64x48", "--lights", "12", "--json", "times.json"];
    let output = crate::without_adapters(&mut girandole.command(&arguments)).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert_eq!((stderr(&output).lines().count(), stdout(&output).as_str()), (1, ""), "{}", stderr(&output));
    assert!(stderr(&output).contains("adapter"), "{}", stderr(&output));
    assert!(girandole.files().is_empty());
}

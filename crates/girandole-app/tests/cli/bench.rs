//! What `girandole bench` says where there is nothing to time; `tests/gpu.rs` has the rest.

#[cfg(target_os = "linux")]
#[test]
fn without_an_adapter_there_is_nothing_to_time() {
    let girandole = crate::Girandole::new();
    let mut command = girandole.command(&["bench", "table", "--lights", "12", "--json", "times.json"]);
    let output = crate::without_adapters(&mut command).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(crate::stderr(&output).contains("adapter") && girandole.files().is_empty());
}

//! Interrupts within the write of an output.

use crate::Girandole;
use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

const FRAMES: [&str; 12] = [
    "render",
    "table",
    "--object",
    "none",
    "--size",
    "160x120",
    "--engine",
    "cpu",
    "--lights",
    "1",
    "--bounces",
    "0",
];

/// Whether files of a temporary name are there.
fn is_within_a_write(girandole: &Girandole) -> bool {
    girandole.files().iter().any(|name| name.ends_with(".part"))
}

/// Whether the first frame is there.
fn has_a_frame(girandole: &Girandole) -> bool {
    girandole.files().contains(&"f.000000.exr".into())
}

fn send(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).expect("it runs");
}

fn is_stopped(child: &Child) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).expect("it runs");
    stat.rsplit_once(')').is_some_and(|(_, rest)| rest.trim_start().starts_with('T'))
}

/// A program that writes frame after frame, stopped within the write of one that is not the first.
fn stopped(girandole: &Girandole) -> Child {
    let mut command =
        girandole.command(&[&FRAMES[..], &["--frames", "0..99999", "-o", "f.######.exr"]].concat());
    let mut child = command.stderr(Stdio::null()).spawn().expect("it starts");
    let start = Instant::now();
    loop {
        assert!(start.elapsed() < Duration::from_secs(100), "it was never stopped within a write");
        assert!(child.try_wait().expect("a child").is_none(), "it ended");
        if !has_a_frame(girandole) || !is_within_a_write(girandole) {
            std::thread::sleep(Duration::from_micros(50));
            continue;
        }
        send(&child, Signal::STOP);
        while !is_stopped(&child) {
            std::thread::sleep(Duration::from_micros(50));
        }
        if is_within_a_write(girandole) {
            return child;
        }
        send(&child, Signal::CONT);
    }
}

#[test]
fn interrupts_leave_no_half_of_a_file() {
    for signal in [Signal::INT, Signal::TERM] {
        let girandole = Girandole::new();
        let mut child = stopped(&girandole);
        send(&child, signal);
        send(&child, Signal::CONT);
        // As a shell sees it: 130 after an interrupt.
        assert_eq!(child.wait().expect("it ends").signal(), Some(signal.as_raw()));
        let files = girandole.files();
        assert!(files.iter().all(|name| name.starts_with("f.")), "a half of a file, or a claim: {files:?}");
        // What is there is whole.
        let last = girandole.files().pop().expect("a frame");
        girandole.succeed(&["compare", &last, &last]);
    }
    // The control: what cannot be caught does leave one.
    let girandole = Girandole::new();
    let mut child = stopped(&girandole);
    send(&child, Signal::KILL);
    child.wait().expect("it ends");
    assert!(is_within_a_write(&girandole));
    // The frame that it claimed is nobody's by then.
    let claims =
        |girandole: &Girandole| girandole.files().iter().filter(|name| name.ends_with(".claim")).count();
    assert_eq!(claims(&girandole), 1);
    girandole.succeed(&[&FRAMES[..], &["--frames", "0..2", "-o", "f.######.exr"]].concat());
    let named = girandole.files().into_iter().filter(|name| name.starts_with("f.")).count();
    assert!(named >= 3 && claims(&girandole) == 0, "{:?}", girandole.files());
}

//! Files of programs without a file system: what a web page was given, by its name, and what is written for it to take.

use super::pictures::{self, Decoded};
use std::collections::{BTreeMap, BTreeSet};
use std::future::poll_fn;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};
use std::pin::pin;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The bytes of each file, or why it cannot be had.
type Files = BTreeMap<PathBuf, Result<Vec<u8>, String>>;

struct State {
    held: Files,
    missing: Missing,
    written: Vec<(PathBuf, Vec<u8>)>,
}

/// What was looked for in vain.
#[derive(Default)]
struct Missing {
    files: BTreeSet<PathBuf>,
    /// Pictures that are to be decoded.
    pictures: BTreeMap<pictures::Key, Vec<u8>>,
}

static STATE: Mutex<State> = Mutex::new(State {
    held: BTreeMap::new(),
    missing: Missing { files: BTreeSet::new(), pictures: BTreeMap::new() },
    written: Vec::new(),
});

fn state() -> MutexGuard<'static, State> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Holds a file. Another one of that name leaves.
pub fn hold(path: &Path, bytes: Vec<u8>) {
    state().held.insert(path.into(), Ok(bytes));
}

/// Lets all of them go.
pub fn release() {
    state().held.clear();
}

/// Does something that reads files, and does it again as long as it lacks some that can be fetched, or pictures that can be decoded.
pub async fn gather<T>(
    mut act: impl AsyncFnMut() -> T,
    fetch: impl AsyncFn(&Path) -> Result<Vec<u8>, String>,
    decode: impl AsyncFn(&[u8]) -> Result<Decoded, String>,
) -> T {
    loop {
        let mut missing = Missing::default();
        let mut acting = pin!(act());
        // Others may act between its slices.
        let done = poll_fn(|context| {
            std::mem::swap(&mut state().missing, &mut missing);
            let polled = acting.as_mut().poll(context);
            std::mem::swap(&mut state().missing, &mut missing);
            polled
        })
        .await;
        if missing.files.is_empty() && missing.pictures.is_empty() {
            // Whoever else waits for some has them decoded again.
            pictures::release();
            return done;
        }
        for path in missing.files {
            let fetched = fetch(&path).await;
            state().held.insert(path, fetched);
        }
        for (key, bytes) in missing.pictures {
            pictures::hold(key, decode(&bytes).await);
        }
    }
}

/// Takes note that a picture is to be decoded.
pub(super) fn ask_for_picture(key: pictures::Key, bytes: &[u8]) {
    state().missing.pictures.insert(key, bytes.into());
}

/// What was written since this was last asked, in order.
pub fn take_written() -> Vec<(PathBuf, Vec<u8>)> {
    std::mem::take(&mut state().written)
}

pub(super) fn write(path: &Path, bytes: &[u8]) {
    state().written.push((path.into(), bytes.into()));
}

pub(super) fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut state = state();
    match find(&state.held, path) {
        Some(Ok(bytes)) => Ok(bytes.clone()),
        Some(Err(why)) => Err(Error::other(why.clone())),
        None => {
            state.missing.files.insert(path.into());
            Err(Error::new(ErrorKind::NotFound, "it is not there"))
        }
    }
}

pub(super) fn is_file(path: &Path) -> bool {
    let mut state = state();
    let found = find(&state.held, path).map(Result::is_ok);
    if found.is_none() {
        state.missing.files.insert(path.into());
    }
    found.unwrap_or(false)
}

/// By its path, else by its last name where one file alone has it: files that are chosen one by one come without folders.
fn find<'h>(held: &'h Files, path: &Path) -> Option<&'h Result<Vec<u8>, String>> {
    let has_name = |held: &Path| match (held.file_name(), path.file_name()) {
        (Some(a), Some(b)) => a.eq_ignore_ascii_case(b),
        _ => false,
    };
    held.get(path).or_else(|| {
        let mut same = held.iter().filter(|(path, bytes)| bytes.is_ok() && has_name(path));
        same.next().filter(|_| same.next().is_none()).map(|(_, bytes)| bytes)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_by_path_and_by_name_where_that_is_clear() {
        let held: Files =
            [("room/a.png", 1), ("room/b/wood.png", 2), ("room/c/wood.png", 3), ("Stone.PNG", 4)]
                .map(|(path, byte)| (path.into(), Ok(vec![byte])))
                .into();
        let found = |path: &str| find(&held, Path::new(path)).map(|bytes| bytes.as_ref().expect("bytes")[0]);
        assert_eq!(found("room/c/wood.png"), Some(3));
        assert_eq!(found("textures/stone.png"), Some(4), "in capitals or not");
        assert_eq!(found("other/a.png"), Some(1));
        assert_eq!(found("wood.png"), None, "there are two");
        assert_eq!(found("nowhere.png"), None);
    }

    async fn no_picture(_: &[u8]) -> Result<Decoded, String> {
        Err("it is none".into())
    }

    /// Called by the test that has the files to itself. Two pictures, of which one is broken; each is decoded once a time.
    fn pictures_are_decoded_once() {
        use std::cell::Cell;
        use std::task::{Context, Poll, Waker};
        let act = async || [b"one", b"two"].map(|bytes| (pictures::size(bytes), pictures::texels(bytes)));
        let fetch = async |_: &Path| Err("there are no files".to_owned());
        let count = Cell::new(0);
        let decode = async |bytes: &[u8]| {
            count.set(count.get() + 1);
            let texel = [bytes[0]; 4];
            match bytes {
                b"one" => Ok(Decoded { size: [1, 2], texels: Box::new(move || vec![texel; 2]) }),
                _ => Err("it is broken".to_owned()),
            }
        };
        for turn in 1..=2 {
            let gathered =
                std::pin::pin!(gather(act, fetch, decode)).poll(&mut Context::from_waker(Waker::noop()));
            let Poll::Ready([one, two]) = gathered else { panic!("nothing waits") };
            assert_eq!(one, (Ok([1, 2]), Ok(vec![[b'o'; 4]; 2])));
            assert_eq!(two, (Err("it is broken".into()), Err("it is broken".into())));
            assert_eq!(count.get(), 2 * turn);
            assert!(!pictures::is_decoded(b"one"), "they are let go");
        }
    }

    /// Called by the test that has the files to itself.
    fn who_acts_meanwhile_has_other_files_missing() {
        use crate::slices::pause;
        use std::task::{Context, Poll, Waker};
        let act = |name: &'static str| {
            async move || {
                let is_there = read(Path::new(name)).is_ok();
                pause().await;
                is_there
            }
        };
        let fetch = async |path: &Path| Ok(path.to_string_lossy().as_bytes().to_vec());
        let mut one = std::pin::pin!(gather(act("beside/one"), fetch, no_picture));
        let mut two = std::pin::pin!(gather(act("beside/two"), fetch, no_picture));
        let mut context = Context::from_waker(Waker::noop());
        let mut done = [None; 2];
        for _ in 0..4 {
            if done[0].is_none()
                && let Poll::Ready(is_there) = one.as_mut().poll(&mut context)
            {
                done[0] = Some(is_there);
            }
            if done[1].is_none()
                && let Poll::Ready(is_there) = two.as_mut().poll(&mut context)
            {
                done[1] = Some(is_there);
            }
        }
        assert_eq!(done, [Some(true); 2]);
    }

    #[test]
    fn what_is_missing_is_fetched_and_what_is_written_is_taken() {
        use std::task::{Context, Poll, Waker};
        // A scene that refers to a list, which refers to two files, of which one is nowhere.
        let act = async || {
            let list = read(Path::new("at/list"))?;
            let names = String::from_utf8(list).expect("names");
            Ok(names.split(' ').map(|name| read(&Path::new("at").join(name)).is_ok()).collect::<Vec<_>>())
        };
        let fetch = async |path: &Path| match path.to_str() {
            Some("at/list") => Ok(b"one two".to_vec()),
            Some("at/one") => Ok(vec![1]),
            _ => Err("the server says 404".to_owned()),
        };
        let gathered =
            std::pin::pin!(gather(act, fetch, no_picture)).poll(&mut Context::from_waker(Waker::noop()));
        let Poll::Ready(Ok::<_, Error>(there)) = gathered else { panic!("nothing waits") };
        assert_eq!(there, [true, false]);
        assert_eq!(read(Path::new("at/two")).expect_err("nowhere").to_string(), "the server says 404");
        assert!(is_file(Path::new("at/one")) && !is_file(Path::new("at/two")));
        hold(Path::new("at/two"), vec![2]);
        assert!(is_file(Path::new("at/two")));
        release();
        assert!(!is_file(Path::new("at/two")));
        write(Path::new("a.png"), &[1]);
        assert_eq!(take_written(), [(PathBuf::from("a.png"), vec![1])]);
        assert!(take_written().is_empty());
        who_acts_meanwhile_has_other_files_missing();
        pictures_are_decoded_once();
    }
}

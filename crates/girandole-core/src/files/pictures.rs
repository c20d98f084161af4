//! Pictures that a web page decoded for a program in it.

use super::held::ask_for_picture;
use std::cell::RefCell;
use std::collections::BTreeMap;
use xxhash_rust::xxh3::xxh3_128;

/// What a picture is known by: its bytes' hash.
pub(super) type Key = u128;

/// A decoded picture, which stays with the page.
pub struct Decoded {
    /// Width and height, texels.
    pub size: [u32; 2],
    /// Copies its texels, row by row from the top: RGBA, not premultiplied.
    pub texels: Box<dyn Fn() -> Vec<[u8; 4]>>,
}

thread_local! {
    /// Those that are held, or why one cannot be decoded.
    static HELD: RefCell<BTreeMap<Key, Result<Decoded, String>>> = const { RefCell::new(BTreeMap::new()) };
}

pub(super) fn hold(key: Key, decoded: Result<Decoded, String>) {
    HELD.with_borrow_mut(|held| held.insert(key, decoded));
}

pub(super) fn release() {
    HELD.take();
}

/// Whether the page has decoded it, or tried; asks for it where it has not.
pub(crate) fn is_decoded(bytes: &[u8]) -> bool {
    held(bytes, |_| ()).is_some()
}

pub(crate) fn size(bytes: &[u8]) -> Result<[u32; 2], String> {
    with(bytes, |decoded| decoded.size)
}

pub(crate) fn texels(bytes: &[u8]) -> Result<Vec<[u8; 4]>, String> {
    with(bytes, |decoded| (decoded.texels)())
}

fn with<T>(bytes: &[u8], act: impl FnOnce(&Decoded) -> T) -> Result<T, String> {
    let decoded = held(bytes, |decoded| decoded.as_ref().map(act).map_err(Clone::clone));
    decoded.unwrap_or_else(|| Err("it waits for that".into()))
}

fn held<T>(bytes: &[u8], act: impl FnOnce(&Result<Decoded, String>) -> T) -> Option<T> {
    let key = xxh3_128(bytes);
    let result = HELD.with_borrow(|held| held.get(&key).map(act));
    if result.is_none() {
        ask_for_picture(key, bytes);
    }
    result
}

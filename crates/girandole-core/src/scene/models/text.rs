//! The statements of OBJ and MTL files.

use std::borrow::Cow;

/// Text of any encoding that modelling programs write: UTF-8, UTF-16 with a mark, else Latin-1.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    let utf16 = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes.as_chunks().0.iter().map(|&pair| unit(pair)).collect();
        String::from_utf16_lossy(&units).into()
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] | rest => match std::str::from_utf8(rest) {
            Ok(text) => text.into(),
            Err(_) => rest.iter().map(|&byte| char::from(byte)).collect::<String>().into(),
        },
    }
}

/// Calls a function with the number of a line from 1 up, its first word and the rest, for each line that has any.
/// Lines that end with a backslash go on in the next one; comments are left out.
///
/// # Errors
/// The function's first one.
pub(super) fn statements<E>(
    text: &str,
    mut each: impl FnMut(usize, &str, &str) -> Result<(), E>,
) -> Result<(), E> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    let mut lines = text.split(end).enumerate();
    let mut joined = String::new();
    while let Some((number, first)) = lines.next() {
        let mut line = without_comment(first);
        if let Some(begin) = line.strip_suffix('\\') {
            joined.clear();
            joined.push_str(begin);
            for (_, next) in lines.by_ref() {
                let next = without_comment(next);
                joined.push(' ');
                joined.push_str(next.strip_suffix('\\').unwrap_or(next));
                if !next.ends_with('\\') {
                    break;
                }
            }
            line = &joined;
        }
        let line = line.trim();
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        if !key.is_empty() {
            each(number + 1, key, rest.trim())?;
        }
    }
    Ok(())
}

/// A line up to a `#` that begins a word: names may have others.
fn without_comment(line: &str) -> &str {
    let begins_word = |at: usize| line[..at].chars().next_back().is_none_or(char::is_whitespace);
    let end = line.match_indices('#').map(|(at, _)| at).find(|&at| begins_word(at));
    line[..end.unwrap_or(line.len())].trim_end()
}

/// The numbers at the start of a text; where something else is among them, that word.
pub(super) fn numbers<const N: usize>(text: &str) -> Result<([f64; N], usize), &str> {
    let mut result = [0.0; N];
    let mut count = 0;
    let text = text.split('#').next().unwrap_or_default();
    for (slot, word) in result.iter_mut().zip(text.split_whitespace()) {
        *slot = word.parse().map_err(|_| word)?;
        count += 1;
    }
    Ok((result, count))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Vec<(usize, String, String)> {
        let mut found = Vec::new();
        let all: Result<(), ()> = statements(text, |line, key, rest| {
            found.push((line, key.into(), rest.into()));
            Ok(())
        });
        all.expect("no errors");
        found
    }

    #[test]
    fn lines_go_on_after_a_backslash_and_end_before_a_comment() {
        let found = read("# a \\\nv 1\\\r\n 2 \\ \r\n\t3 # end \\\nusemtl a#b\n\n  f\t1#2");
        let expected = [(2, "v", "1  2   3"), (5, "usemtl", "a#b"), (7, "f", "1#2")];
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for ((line, key, rest), wanted) in found.iter().zip(expected) {
            let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
            assert_eq!((*line, key.as_str(), words(rest)), (wanted.0, wanted.1, words(wanted.2)));
        }
        assert_eq!(read("v 1\rv 2\r").len(), 2, "as old Macs end lines");
        assert_eq!(read("v 1 \\").len(), 1);
    }

    #[test]
    fn numbers_of_every_form_are_read() {
        assert_eq!(numbers::<5>("1. +1 -.5 1e-3 2# 3"), Ok(([1.0, 1.0, -0.5, 1e-3, 2.0], 5)));
        assert_eq!(numbers::<3>("1 2"), Ok(([1.0, 2.0, 0.0], 2)));
        assert_eq!(numbers::<3>("1 2,5 3"), Err("2,5"));
    }

    #[test]
    fn text_of_every_encoding_is_read() {
        assert_eq!(decode(b"caf\xe9"), "caf\u{e9}");
        assert_eq!(decode("\u{feff}caf\u{e9}".as_bytes()), "caf\u{e9}");
        assert_eq!(decode(b"\xfe\xff\0a"), "a");
    }
}

//! Shaders without comments and indents: a third of what they take, compressed. Nobody reads them in a page.

/// The first `N` bytes of a text without its comments, indents and empty lines, and how many there are of them.
pub(super) const fn of<const N: usize>(text: &str) -> ([u8; N], usize) {
    let text = text.as_bytes();
    let (mut kept, mut count) = ([0; N], 0);
    let (mut at, mut is_begun) = (0, false);
    while at < text.len() {
        if text[at] == b'/' && at + 1 < text.len() && text[at + 1] == b'/' {
            while at < text.len() && text[at] != b'\n' {
                at += 1;
            }
            continue;
        }
        let is_end = text[at] == b'\n';
        if is_begun || !(is_end || text[at] == b' ') {
            if count < N {
                kept[count] = text[at];
            }
            count += 1;
            is_begun = !is_end;
        }
        at += 1;
    }
    (kept, count)
}

/// The same as a text.
pub(super) const fn text(kept: &'static [u8]) -> &'static str {
    match std::str::from_utf8(kept) {
        Ok(text) => text,
        Err(_) => panic!("only comments have other than ASCII characters"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::ALL;
    use super::*;

    #[test]
    fn comments_and_indents_are_left_out() {
        const WHOLE: &str = "// What it does.\n\nfn f() {\n    g(1); // twice\n\n    g(2);\n}\n";
        const TERSE: [u8; of::<0>(WHOLE).1] = of(WHOLE).0;
        assert_eq!(text(&TERSE), "fn f() {\ng(1); \ng(2);\n}\n");
    }

    #[test]
    fn all_else_stays() {
        const ROOM: usize = 1 << 16;
        for source in ALL {
            let (kept, count) = of::<ROOM>(source.text);
            let kept = std::str::from_utf8(&kept[..count]).expect("a text");
            let lines = source.text.lines().map(|line| line.split("//").next().unwrap_or_default());
            assert!(kept.split_whitespace().eq(lines.flat_map(str::split_whitespace)), "{}", source.name);
            assert!(count < source.text.len(), "{}", source.name);
        }
    }
}

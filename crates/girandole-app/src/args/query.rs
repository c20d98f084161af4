//! Options in the address of a web page: `?scene=table&lights=1024` is `girandole view table --lights 1024`.

use super::{RenderArgs, ViewArgs, parse};
use anyhow::{Context, Result};
use clap::Args;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};
use std::path::Path;

/// The name of the scene, which is no option.
const SCENE: &str = "scene";
const EDITS: &str = "edits";

/// What needs no escape in a query, and is easier to read without.
const ESCAPED: &AsciiSet =
    &NON_ALPHANUMERIC.remove(b'-').remove(b'_').remove(b'.').remove(b',').remove(b':').remove(b'/');

/// Options of the window that say nothing of the picture, or nothing that the page does not know itself.
const LEFT_OUT: [&str; 5] = ["--output", "--size", "--stats", "--adapter", "--refine"];

/// The file that edits in an address are held as.
const EDITS_FILE: &str = "edits.json";

/// Edits as they stand behind the `#` of an address.
pub fn edits_in_address(json: &str) -> String {
    format!("{EDITS}={}", encoded(json))
}

impl ViewArgs {
    /// The options that an address names: its query, with the question mark or without, and what is behind its `#`. Edits that it holds
    /// are to be held as a file.
    ///
    /// # Errors
    /// Where it is no Unicode, and for what `girandole view` refuses.
    pub fn from_address(query: &str, hold: impl Fn(&Path, Vec<u8>)) -> Result<Self> {
        let mut words = Vec::new();
        let mut scene = None;
        for pair in query.trim_start_matches('?').split(['&', '#']).filter(|pair| !pair.is_empty()) {
            let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
            match (decoded(name)?, decoded(value)?) {
                (name, value) if name == SCENE => scene = Some(value),
                (name, value) if name == EDITS && value.trim_start().starts_with('{') => {
                    hold(Path::new(EDITS_FILE), value.into_bytes());
                    words.push(format!("--{EDITS}={EDITS_FILE}"));
                }
                (name, value) if value.is_empty() => words.push(format!("--{name}")),
                (name, value) => words.push(format!("--{name}={value}")),
            }
        }
        words.extend(scene.into_iter().flat_map(|scene| ["--".into(), scene]));
        Ok(parse("view", &words)?)
    }
}

impl RenderArgs {
    /// The query of a page that shows this picture, without its question mark: what differs from a page without one.
    ///
    /// # Errors
    /// Where a file's name is no Unicode.
    pub fn query(&self) -> Result<String> {
        let view = ViewArgs::augment_args(clap::Command::new("view"));
        let is_known = |name: &str| {
            let long = name.trim_start_matches('-');
            !LEFT_OUT.contains(&name) && view.get_arguments().any(|option| option.get_long() == Some(long))
        };
        let defaults = Self::defaults()?;
        let mut pairs = Vec::new();
        if self.scene != defaults.scene {
            pairs.push(format!("{SCENE}={}", encoded(&self.scene)));
        }
        for ((name, value), (_, default)) in self.choices()?.into_iter().zip(defaults.choices()?) {
            let Some(value) = value.filter(|value| default.as_ref() != Some(value) && is_known(name)) else {
                continue;
            };
            pairs.push(format!("{}={}", name.trim_start_matches('-'), encoded(&value)));
        }
        if self.refine > 1 {
            pairs.push("refine".into());
        }
        Ok(pairs.join("&"))
    }
}

fn encoded(value: &str) -> String {
    utf8_percent_encode(value, ESCAPED).to_string()
}

fn decoded(text: &str) -> Result<String> {
    let text = text.replace('+', "%20");
    let decoded = percent_decode_str(&text).decode_utf8().context("the address is no Unicode")?;
    Ok(decoded.into_owned())
}

#[cfg(test)]
mod tests {
    use super::super::{Cli, Command};
    use super::*;
    use clap::Parser;

    fn from_address(address: &str) -> Result<ViewArgs> {
        ViewArgs::from_address(address, |_, _| panic!("it holds no edits"))
    }

    fn rendered(line: &str) -> RenderArgs {
        let words = shlex::split(line).expect("words");
        match Cli::try_parse_from(words).expect("a call").command {
            Some(Command::Render(args)) => *args,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn queries_lead_back_to_the_options() {
        let line = "girandole render table --lights 16 --mode naive --view 0,1.7,2,0,0.8,0,0,1,0,60 --seed 3 \
                    --exposure -1.5 --environment 1,0.5,0.25 --size 64x48 --time 2 -o a.exr";
        let query = rendered(line).query().expect("a query");
        assert!(query.starts_with("scene=table&view=0,1.7,2,0,0.8,0,0,1,0,60&"), "{query}");
        assert!(!query.contains("size") && !query.contains("time"), "{query}");
        let view = from_address(&format!("?{query}")).expect("options");
        assert_eq!((view.scene.as_str(), view.lights.lights, view.lights.seed), ("table", 16, 3));
        assert_eq!(view.exposure, girandole_core::tonemap::Exposure::Ev(-1.5));
        assert_eq!((view.seen.view, view.seen.load.environment), {
            let args = rendered(line);
            (args.seen.view, args.seen.load.environment)
        });
        assert_eq!(rendered("girandole render").query().expect("a query"), "");
    }

    #[test]
    fn names_are_escaped_and_flags_have_no_value() {
        let args = RenderArgs { refine: 8, ..rendered("girandole render 'my room & more.glb'") };
        let query = args.query().expect("a query");
        assert_eq!(query, "scene=my%20room%20%26%20more.glb&refine");
        let view = from_address(&query).expect("options");
        assert!(view.refine && view.scene == "my room & more.glb");
        assert_eq!(from_address("scene=a+b.glb").expect("options").scene, "a b.glb");
    }

    #[test]
    fn edits_come_with_the_address() {
        let json = r#"{"version": 1, "edits": [{"set_time": {"seconds": 1.5}}]}"#;
        let held = std::cell::RefCell::new(Vec::new());
        let address = format!("?lights=16#{}", edits_in_address(json));
        assert!(address.is_ascii() && !address.contains(['"', ' ', '{']), "{address}");
        let view =
            ViewArgs::from_address(&address, |path, bytes| held.borrow_mut().push((path.to_owned(), bytes)));
        let view = view.expect("options");
        assert_eq!((view.lights.lights, &view.seen.edits), (16, &Some("edits.json".into())));
        assert_eq!(held.into_inner(), [("edits.json".into(), json.as_bytes().to_vec())]);
    }

    #[test]
    fn what_is_unknown_is_refused() {
        for query in ["?nothing=1", "?lights=many", "?lights=%ff"] {
            assert!(from_address(query).is_err(), "{query}");
        }
    }
}

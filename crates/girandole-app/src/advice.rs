//! The library's errors in the program's terms: what went wrong is the library's half of the sentence, what to do is said
//! in options of the command line, or of a page's address.

use girandole::{Error, Remedy};
use girandole_core::scene::gltf::RESTING;
use girandole_core::scene::{HARDLY_METRES, LIKELY_Z_UP};

/// Where options are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// After the program's name: `--lights 16`.
    CommandLine,
    /// In a page's address: `lights=16`.
    Address,
}

/// Where this program gets its options.
const HERE: Place = if cfg!(target_arch = "wasm32") { Place::Address } else { Place::CommandLine };

/// One sentence with the options that help.
pub fn sentence(error: &Error) -> String {
    sentence_in(HERE, error)
}

fn sentence_in(place: Place, error: &Error) -> String {
    match (error, place) {
        (Error::NoAdapter, Place::CommandLine) => format!("{error} or use --engine cpu"),
        (Error::NoAdapter, Place::Address) => {
            "the browser lends no GPU; allow it hardware acceleration, or open the page in another one".into()
        }
        (Error::Unsupported { adapter, what }, Place::CommandLine) => {
            format!(
                "the adapter {adapter} lacks {what}; choose another one with --adapter, or render with --engine cpu"
            )
        }
        (Error::Unsupported { adapter, what }, Place::Address) => {
            format!("the adapter {adapter} lacks {what}; open the page in another browser, or on another GPU")
        }
        (Error::TooLarge { what, remedy }, _) => format!("{what}; {}", options(place, *remedy)),
        (Error::Device(what), Place::CommandLine) => {
            format!("the GPU failed: {what}; try a smaller --memory or another --adapter")
        }
        (Error::Device(what), Place::Address) => {
            format!(
                "the GPU failed: {what}; load the page again, with a smaller {}",
                option(place, "memory", "")
            )
        }
        (Error::UnknownAdapter { .. } | Error::Scene(_), _) => error.to_string(),
    }
}

/// Adds the option that helps, if there is one.
pub fn add_to_warning(warning: &mut String) {
    if warning.ends_with(RESTING) {
        warning.push_str(&format!(" with {}", option(HERE, "clip", "")));
    }
    if warning.ends_with(HARDLY_METRES) {
        let scale = option(HERE, "scale", "");
        warning
            .push_str(&format!(": give {scale}, 0.01 if they are centimetres, 1000 if they are kilometres"));
    } else if warning.ends_with(LIKELY_Z_UP) {
        warning.push_str(&format!(": give {} if so", option(HERE, "up", "z")));
    }
}

/// An option, with a value or without one.
fn option(place: Place, name: &str, value: &str) -> String {
    match place {
        Place::CommandLine if value.is_empty() => format!("--{name}"),
        Place::CommandLine => format!("--{name} {value}"),
        Place::Address => format!("{name}={value} in the address"),
    }
}

fn options(place: Place, remedy: Remedy) -> String {
    let option = |name: &str, value: &str| option(place, name, value);
    let of_page = |page: &str, otherwise: String| match place {
        Place::Address => page.to_owned(),
        Place::CommandLine => otherwise,
    };
    match remedy {
        Remedy::MemoryOrFewerLights { mib } => {
            format!("give at least {}, or fewer {}", option("memory", &mib.to_string()), option("lights", ""))
        }
        Remedy::MemoryOrSmallerMaps { mib } => {
            let (memory, maps) = (option("memory", &mib.to_string()), option("map-size", ""));
            format!("give at least {memory}, or a smaller {maps}")
        }
        Remedy::FewerLights => format!("give fewer {}", option("lights", "")),
        Remedy::SmallerMaps => format!("give a smaller {}", option("map-size", "")),
        Remedy::MapSize { from, to } => format!("{} takes {from} to {to}", option("map-size", "")),
        Remedy::NarrowerFilter { to } => format!("{} takes 1 to {to}, or off", option("pcf", "")),
        Remedy::PictureSize { to } => {
            of_page("make the page smaller", format!("--size takes 1 to {to} each"))
        }
        Remedy::SmallerPictureOrNaive => {
            let picture = of_page("make the page smaller", "give a smaller --size".into());
            format!("{picture}, or {}", option("mode", "naive"))
        }
        Remedy::Naive => format!("give {}", option("mode", "naive")),
        Remedy::SmallerScene => of_page("use a smaller scene", "use a smaller scene or --engine cpu".into()),
        Remedy::TextureSize { to } => {
            let scaled = format!("scale it to {to} at the most");
            of_page(&scaled, format!("{scaled}, or use --engine cpu"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// The words of a sentence that look like options, each with whether `girandole render` has it.
    fn options_of(sentence: &str) -> Vec<(String, bool)> {
        let cli = crate::args::Cli::command();
        let render = cli.find_subcommand("render").expect("render");
        let is_known = |name: &str| render.get_arguments().any(|a| a.get_long() == Some(name));
        let words = sentence.split(|c: char| !c.is_ascii_lowercase() && c != '-');
        let names = words.filter_map(|word| word.strip_prefix("--"));
        names.map(|name| (name.to_string(), is_known(name))).collect()
    }

    /// Whether a page's sentence names options as its address does, and only those that `girandole view` has.
    fn is_for_a_page(error: &Error) {
        let text = sentence_in(Place::Address, error);
        assert!(!text.contains("--"), "{text}");
        let cli = crate::args::Cli::command();
        let view = cli.find_subcommand("view").expect("view");
        for word in text.split_whitespace() {
            let Some((name, _)) = word.split_once('=') else { continue };
            assert!(view.get_arguments().any(|a| a.get_long() == Some(name)), "{text}");
        }
    }

    #[test]
    fn errors_name_options_that_exist() {
        for remedy in [
            Remedy::MemoryOrFewerLights { mib: 300 },
            Remedy::MemoryOrSmallerMaps { mib: 300 },
            Remedy::FewerLights,
            Remedy::SmallerMaps,
            Remedy::MapSize { from: 16, to: 8192 },
            Remedy::NarrowerFilter { to: 16 },
            Remedy::PictureSize { to: 8192 },
            Remedy::SmallerPictureOrNaive,
            Remedy::Naive,
            Remedy::SmallerScene,
            Remedy::TextureSize { to: 65535 },
        ] {
            let error = Error::TooLarge { what: "it is too large".into(), remedy };
            let text = sentence(&error);
            let options = options_of(&text);
            assert!(text.starts_with("it is too large; ") && !options.is_empty(), "{text}");
            assert!(options.iter().all(|(_, known)| *known), "{text}");
            is_for_a_page(&error);
        }
        let lacks = Error::Unsupported { adapter: "A".into(), what: "compute shaders".into() };
        for error in [Error::NoAdapter, lacks, Error::Device("it was lost".into())] {
            let options = options_of(&sentence(&error));
            assert!(!options.is_empty() && options.iter().all(|(_, known)| *known), "{error}");
            is_for_a_page(&error);
        }
        for what in [HARDLY_METRES, LIKELY_Z_UP] {
            let mut warning = what.to_owned();
            add_to_warning(&mut warning);
            let options = options_of(&warning);
            assert!(options.len() == 1 && options[0].1, "{warning}");
        }
        // The control: another program's option is not known.
        assert_eq!(options_of("give --frobnicate, or --memory 3").iter().filter(|(_, k)| !k).count(), 1);
    }
}

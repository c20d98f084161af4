//! The library's errors in the program's terms: what went wrong is the library's half of the sentence, what to do is said
//! in options of the command line.

use girandole::core::scene::gltf::RESTING;
use girandole::core::scene::{HARDLY_METRES, LIKELY_Z_UP};
use girandole::{Error, Remedy};

/// One sentence with the options that help.
pub fn sentence(error: &Error) -> String {
    match error {
        Error::NoAdapter => format!("{error} or use --engine cpu"),
        Error::Unsupported { adapter, what } => {
            format!(
                "the adapter {adapter} lacks {what}; choose another one with --adapter, or render with --engine cpu"
            )
        }
        Error::TooLarge { what, remedy } => format!("{what}; {}", options(*remedy)),
        Error::Device(what) => format!("the GPU failed: {what}; try a smaller --memory or another --adapter"),
        Error::UnknownAdapter { .. } | Error::Scene(_) => error.to_string(),
    }
}

/// Adds the option that helps, if there is one.
pub fn add_to_warning(warning: &mut String) {
    if warning.ends_with(RESTING) {
        warning.push_str(" with --clip");
    }
    if warning.ends_with(HARDLY_METRES) {
        warning.push_str(": give --scale, 0.01 if they are centimetres, 1000 if they are kilometres");
    } else if warning.ends_with(LIKELY_Z_UP) {
        warning.push_str(": give --up z if so");
    }
}

fn options(remedy: Remedy) -> String {
    match remedy {
        Remedy::MemoryOrFewerLights { mib } => format!("give at least --memory {mib}, or fewer --lights"),
        Remedy::MemoryOrSmallerMaps { mib } => {
            format!("give at least --memory {mib}, or a smaller --map-size")
        }
        Remedy::FewerLights => "give fewer --lights".into(),
        Remedy::SmallerMaps => "give a smaller --map-size".into(),
        Remedy::MapSize { from, to } => format!("--map-size takes {from} to {to}"),
        Remedy::NarrowerFilter { to } => format!("--pcf takes 1 to {to}, or off"),
        Remedy::PictureSize { to } => format!("--size takes 1 to {to} each"),
        Remedy::SmallerPictureOrNaive => "give a smaller --size, or --mode naive".into(),
        Remedy::Naive => "give --mode naive".into(),
        Remedy::SmallerScene => "use a smaller scene or --engine cpu".into(),
        Remedy::TextureSize { to } => format!("scale it to {to} at the most, or use --engine cpu"),
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
            let text = sentence(&Error::TooLarge { what: "it is too large".into(), remedy });
            let options = options_of(&text);
            assert!(text.starts_with("it is too large; ") && !options.is_empty(), "{text}");
            assert!(options.iter().all(|(_, known)| *known), "{text}");
        }
        let lacks = Error::Unsupported { adapter: "A".into(), what: "compute shaders".into() };
        for error in [Error::NoAdapter, lacks, Error::Device("it was lost".into())] {
            let options = options_of(&sentence(&error));
            assert!(!options.is_empty() && options.iter().all(|(_, known)| *known), "{error}");
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

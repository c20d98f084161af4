//! Options of what moves: one moment, or a numbered sequence.

use clap::Args;
use girandole::MapUpdates;
use girandole_core::illumination::Rewalk;
use girandole_core::lights::Pace;
use std::path::{Path, PathBuf};

/// Which light samples follow the scene from frame to frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RewalkArg {
    /// None: one set for the whole sequence.
    #[default]
    Off,
    /// As many as so many paths of light a frame leave.
    Paths(u32),
    /// All of them, at each frame.
    All,
}

impl RewalkArg {
    /// With samples that come and go in so many frames.
    pub fn with_fade(self, fade: u32) -> Rewalk {
        match self {
            Self::Off => Rewalk::Off,
            Self::Paths(paths) => Rewalk::Paths(Pace { paths, fade }),
            Self::All => Rewalk::All,
        }
    }
}

impl std::fmt::Display for RewalkArg {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Off => write!(f, "off"),
            Self::Paths(paths) => write!(f, "{paths}"),
            Self::All => write!(f, "all"),
        }
    }
}

/// Options of motion.
#[derive(Args, Clone, Copy, Debug, PartialEq)]
pub struct MotionArgs {
    /// The moment of the scene's animations, in seconds; they repeat
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, conflicts_with = "frames")]
    pub time: Option<f64>,

    /// Renders a sequence: frames A to B, both included. The picture's name has a run of # for the number. Frames that
    /// are there already are kept, so that a sequence that was cut off goes on, and several processes share the work. Files of
    /// such names that are not of this sequence (of another scene, by other options, or damaged) are an error
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    pub frames: Option<Frames>,

    /// Replaces those of the frames that are not of this sequence, or damaged
    #[arg(long, requires = "frames")]
    pub overwrite: bool,

    /// Frames a second of a sequence; frame 0 is at 0 seconds
    #[arg(long, value_name = "N", default_value_t = 30.0, value_parser = parse_fps, requires = "frames")]
    pub fps: f64,

    /// Light samples of a sequence. off: one set for all frames; what moves blocks light and reflects none, and emitters take their
    /// samples along. N: so many of the paths of light that something happened to are walked again at each frame, so that what
    /// moves reflects light, and samples come and go little by little. all: other ones at each frame; pictures flicker where they
    /// are few
    #[arg(long, value_name = "off|N|all", default_value = "off", value_parser = parse_rewalk, requires = "frames")]
    pub rewalk: RewalkArg,

    /// Frames over which light samples that come or go with --rewalk N spread a change of a quarter of the picture's mean
    /// brightness, at any pixel; 0 = at once
    #[arg(long, value_name = "FRAMES", default_value_t = Pace::default().fade, requires = "frames", value_parser = clap::value_parser!(u32).range(..=1000))]
    pub fade: u32,

    /// Shadow maps that a frame of a sequence draws at most, after the first one: those that show what moved, and those that come into
    /// view; fewer take less time, shadows of what moves lag behind, and lights that come into view shine later. The order is that of a sequence from frame 0 on, whichever frames are rendered. With Xms, as many
    /// as X milliseconds are likely to suffice for: then a frame is another one each time (engine gpu)
    #[arg(long, value_name = "N|all|Xms", default_value = "all", value_parser = parse_updates, requires = "frames")]
    pub updates: UpdatesArg,

    /// No shadow map is older than so many frames, whatever --updates says (engine gpu)
    #[arg(long, value_name = "FRAMES", requires = "updates")]
    pub max_map_age: Option<u32>,
}

impl MotionArgs {
    /// Which light samples follow the scene's changes.
    pub fn rewalk(&self) -> Rewalk {
        self.rewalk.with_fade(self.fade)
    }

    /// The budget of shadow maps, where one takes so many milliseconds, if that is known.
    pub fn map_updates(&self, ms_per_map: Option<f64>) -> MapUpdates {
        let most = self.updates.most(ms_per_map);
        MapUpdates { most, oldest: self.max_map_age, ..MapUpdates::default() }
    }
}

/// Frames of a sequence, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    pub first: u32,
    pub last: u32,
}

impl Frames {
    pub fn count(self) -> usize {
        (self.last - self.first) as usize + 1
    }

    pub fn iter(self) -> impl Iterator<Item = u32> {
        self.first..=self.last
    }

    /// The file of a frame: the last run of # in the pattern's file name is its number, with leading zeros.
    pub fn file(pattern: &Path, frame: u32) -> Option<PathBuf> {
        let (before, width, after) = Self::parts(pattern)?;
        Some(pattern.with_file_name(format!("{before}{frame:0width$}{after}")))
    }

    /// The frame whose file has this name.
    pub fn number(pattern: &Path, name: &str) -> Option<u32> {
        let (before, _, after) = Self::parts(pattern)?;
        let number = name.strip_prefix(before)?.strip_suffix(after)?.parse().ok()?;
        let file = Self::file(pattern, number)?;
        (number < MOST_FRAMES && file.file_name()?.to_str()? == name).then_some(number)
    }

    /// What is before and after the last run of # in a file's name, and its length.
    fn parts(pattern: &Path) -> Option<(&str, usize, &str)> {
        let name = pattern.file_name()?.to_str()?;
        let end = name.rfind('#')? + 1;
        let start = name[..end].trim_end_matches('#').len();
        Some((&name[..start], end - start, &name[end..]))
    }
}

impl std::fmt::Display for Frames {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}..{}", self.first, self.last)
    }
}

/// Stale shadow maps that a frame draws.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum UpdatesArg {
    /// All of them.
    #[default]
    All,
    /// At most so many.
    Maps(u32),
    /// As many as so many milliseconds are likely to suffice for.
    Milliseconds(f64),
}

impl UpdatesArg {
    /// In numbers, where a map takes so many milliseconds, if that is known.
    pub fn most(self, ms_per_map: Option<f64>) -> Option<u32> {
        match self {
            Self::All => None,
            Self::Maps(most) => Some(most),
            Self::Milliseconds(ms) => Some(ms_per_map.map_or(1, |each| (ms / each) as u32).max(1)),
        }
    }
}

impl std::fmt::Display for UpdatesArg {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::All => write!(f, "all"),
            Self::Maps(most) => write!(f, "{most}"),
            Self::Milliseconds(ms) => write!(f, "{ms}ms"),
        }
    }
}

/// `off`, `all`, or a number of paths.
pub(super) fn parse_rewalk(text: &str) -> Result<RewalkArg, String> {
    match (text, text.parse()) {
        ("off", _) => Ok(RewalkArg::Off),
        ("all", _) => Ok(RewalkArg::All),
        (_, Ok(paths @ 1..)) => Ok(RewalkArg::Paths(paths)),
        _ => Err("give off, all or a number of paths from 1 up".into()),
    }
}

/// `all`, a number of maps, or milliseconds.
pub fn parse_updates(text: &str) -> Result<UpdatesArg, String> {
    let ms = |text: &str| text.parse().ok().filter(|ms| (1e-3..=1e6).contains(ms));
    match (text.strip_suffix("ms").and_then(ms), text) {
        (Some(ms), _) => Ok(UpdatesArg::Milliseconds(ms)),
        (_, "all") => Ok(UpdatesArg::All),
        (_, number) => number
            .parse()
            .map(UpdatesArg::Maps)
            .map_err(|_| "give a number of shadow maps, milliseconds as in 5ms, or `all`".into()),
    }
}

/// `all`, or a number of maps.
pub fn parse_numbered_updates(text: &str) -> Result<UpdatesArg, String> {
    match parse_updates(text) {
        Ok(UpdatesArg::Milliseconds(_)) => Err("give a number of shadow maps, or `all`".into()),
        other => other,
    }
}

const MOST_FRAMES: u32 = 1_000_000;

/// `A..B`, in any order.
pub(super) fn parse_ends(text: &str) -> Option<[u32; 2]> {
    text.split_once("..").and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]))
}

fn parse_frames(text: &str) -> Result<Frames, String> {
    match parse_ends(text) {
        Some([first, last]) if first <= last && last < MOST_FRAMES => Ok(Frames { first, last }),
        Some(_) => Err(format!("the first must not be after the last, and both below {MOST_FRAMES}")),
        None => Err("give the first and the last frame as in 0..239".into()),
    }
}

pub(super) fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse::<f64>().ok().filter(|s| (0.0..=1e9).contains(s));
    seconds.ok_or_else(|| "give a number of seconds from 0 up".into())
}

pub(super) fn parse_fps(text: &str) -> Result<f64, String> {
    let fps = text.parse::<f64>().ok().filter(|n| (1e-3..=1e6).contains(n));
    fps.ok_or_else(|| "give a number of frames a second, such as 24 or 29.97".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_take_the_place_of_the_last_run() {
        let file = |pattern: &str, frame| Frames::file(Path::new(pattern), frame);
        let expect = |path: &str| Some(PathBuf::from(path));
        assert_eq!(file("frame.####.exr", 7), expect("frame.0007.exr"));
        assert_eq!(file("a#b/c##-#.png", 12), expect("a#b/c##-12.png"));
        assert_eq!(file("#.png", 123_456), expect("123456.png"));
        assert_eq!(file("a#b/frame.png", 1), None);
        let number = |name| Frames::number(Path::new("a#b/c##-#.##.png"), name);
        assert_eq!(["c##-#.07.png", "c##-#.123.png"].map(number), [Some(7), Some(123)]);
        for other in [
            "c##-#.7.png",
            "c##-#.007.png",
            "c##-#.+7.png",
            "c##-#..png",
            "c##-#.07.exr",
            "c##-#.1000000.png",
        ] {
            assert_eq!(number(other), None, "{other}");
        }
    }

    #[test]
    fn budgets_are_numbers_or_times() {
        let most = |text, each| parse_updates(text).map(|updates| updates.most(each));
        assert_eq!((most("all", None), most("50", Some(2.0))), (Ok(None), Ok(Some(50))));
        let times = [Some(0.5), Some(100.0), None].map(|each| most("7.5ms", each));
        assert_eq!(times, [Ok(Some(15)), Ok(Some(1)), Ok(Some(1))]);
        for wrong in ["-1", "5s", "0ms", "nanms", "ms", "some"] {
            assert!(parse_updates(wrong).is_err(), "{wrong}");
        }
        assert!(parse_numbered_updates("5ms").is_err() && parse_numbered_updates("5").is_ok());
    }

    #[test]
    fn light_follows_by_a_number_of_paths() {
        assert_eq!(parse_rewalk("off"), Ok(RewalkArg::Off));
        assert_eq!(parse_rewalk("150"), Ok(RewalkArg::Paths(150)));
        for wrong in ["0", "-3", "1.5", "some", ""] {
            assert!(parse_rewalk(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn ranges_have_both_ends() {
        let frames = parse_frames("3..5").expect("a range");
        assert_eq!((frames.count(), frames.iter().collect::<Vec<_>>()), (3, vec![3, 4, 5]));
        assert_eq!(parse_frames("4..4").expect("a range").count(), 1);
        for wrong in ["5..3", "7", "a..b", "..4", "0..1000000", "-1..3", "0..=3"] {
            assert!(parse_frames(wrong).is_err(), "{wrong}");
        }
        for wrong in ["-1", "nan", "inf", "later"] {
            assert!(parse_seconds(wrong).is_err() && parse_fps(wrong).is_err(), "{wrong}");
        }
        assert!(parse_fps("0").is_err() && parse_fps("29.97").is_ok() && parse_seconds("0").is_ok());
    }
}

//! Options of pieces of the work, of which others make the rest.

use super::Frames;
use super::command_line::Choice;
use super::motion::parse_ends;
use clap::Args;
use girandole_core::image::Region;

/// What is made of a sequence or of a picture.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq)]
pub struct PieceArgs {
    /// Renders piece K of N of a sequence alone, K from 1: every N-th frame from the K-th on, so that pieces take alike long
    #[arg(long, value_name = "K/N", value_parser = parse_part, requires = "frames")]
    pub part: Option<Part>,

    /// Renders a part of the picture alone (engine gpu): so many pixels in x and y from one on, counted from the top left corner. They
    /// are, to the bit, those of the whole, and `girandole join` puts parts together. A .png of one needs an --exposure in stops
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region)]
    pub region: Option<Region>,

    /// Renders light sets A to B alone, both included, of the --refine N sets 0 to N-1, and writes what `girandole join` needs to
    /// average them with the others: an .exr of their mean, sums and squared differences. If that is there already, nothing is done
    #[arg(long, value_name = "A..B", value_parser = parse_sets)]
    pub sets: Option<[u32; 2]>,
}

impl PieceArgs {
    /// Whether a frame of a sequence belongs to it, or would if the sequence went on to there.
    pub fn has(&self, frames: Frames, number: u32) -> bool {
        self.part.is_none_or(|part| part.has(number.wrapping_sub(frames.first)))
    }

    /// Whether it is less than a picture, which [`crate::join`] completes.
    pub fn is_partial(&self) -> bool {
        self.region.is_some() || self.sets.is_some()
    }

    pub(super) fn choices(&self) -> [Choice; 3] {
        let Self { part, region, sets } = self;
        [
            ("--part", part.map(|part| part.to_string())),
            ("--region", region.map(|region| region.to_string())),
            ("--sets", sets.map(|[first, last]| format!("{first}..{last}"))),
        ]
    }
}

/// A piece of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// From 1.
    pub index: u32,
    pub count: u32,
}

impl Part {
    /// Whether the frame at this place from the first on belongs to it.
    pub fn has(self, place: u32) -> bool {
        place % self.count == self.index - 1
    }
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

fn parse_part(text: &str) -> Result<Part, String> {
    let numbers = text.split_once('/').map(|(index, count)| [index, count].map(str::parse::<u32>));
    match numbers {
        Some([Ok(index), Ok(count)]) if (1..=count).contains(&index) => Ok(Part { index, count }),
        Some([Ok(_), Ok(_)]) => Err("pieces are counted from 1, and none is after the last".into()),
        _ => Err("give a piece and how many there are, as in 3/8".into()),
    }
}

fn parse_region(text: &str) -> Result<Region, String> {
    text.parse().map_err(String::from)
}

/// Two ends, both included.
pub fn parse_sets(text: &str) -> Result<[u32; 2], String> {
    match parse_ends(text) {
        Some(ends @ [first, last]) if first <= last => Ok(ends),
        Some(_) => Err("the first must not be after the last".into()),
        None => Err("give the first and the last light set as in 0..15".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_share_all_frames() {
        let parts: Vec<Part> = (1..=3).map(|index| Part { index, count: 3 }).collect();
        for place in 0..20 {
            assert_eq!(parts.iter().filter(|part| part.has(place)).count(), 1, "{place}");
        }
        assert!(parts[0].has(0) && parts[1].has(1) && parts[1].has(4) && parts[2].has(5));
    }

    #[test]
    fn ranges_are_checked() {
        assert_eq!(parse_part("3/8"), Ok(Part { index: 3, count: 8 }));
        for wrong in ["0/8", "9/8", "1/0", "1", "a/b", "-1/2", "1/2/3", ""] {
            assert!(parse_part(wrong).is_err(), "{wrong}");
        }
        assert_eq!((parse_sets("0..15"), parse_sets("4..4")), (Ok([0, 15]), Ok([4, 4])));
        for wrong in ["5..3", "7", "a..b", "..4", "0..=3", ""] {
            assert!(parse_sets(wrong).is_err(), "{wrong}");
        }
    }
}

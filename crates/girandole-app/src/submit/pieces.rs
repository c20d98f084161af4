//! What the pieces of a sequence or of a picture are.

use crate::args::{Frames, RenderArgs};
use anyhow::{Result, bail};
use girandole_core::image::Region;

/// Pieces, if nothing is said of them, at most.
const PIECES: u32 = 16;

/// The pieces that workers render.
#[derive(Clone, Debug, PartialEq)]
pub enum Pieces {
    /// So many, of frames.
    Sequence(u32),
    /// Of a picture: so many pieces of light sets for each of these regions; none where they are not cut.
    Still { sets: Option<u32>, regions: Option<Vec<Region>> },
}

impl Pieces {
    /// Of what these options render.
    ///
    /// # Errors
    /// Where there is one piece.
    pub fn new(render: &RenderArgs, wanted: Option<u32>, [columns, rows]: [u32; 2]) -> Result<Self> {
        if let Some(frames) = render.motion.frames {
            if columns * rows > 1 {
                bail!("--regions belongs to single pictures; leave it or --frames out");
            }
            let frames = frames.count() as u32;
            return Ok(Self::Sequence(wanted.unwrap_or(PIECES).min(frames)));
        }
        let [width, height] = render.size;
        if columns > width || rows > height {
            bail!("--regions {columns}x{rows} are more than the picture has pixels");
        }
        let regions = (columns * rows > 1).then(|| regions(render.size, [columns, rows]));
        let sets = (render.refine > 1).then(|| wanted.unwrap_or(PIECES).min(render.refine));
        if sets.unwrap_or(1) == 1 && regions.is_none() {
            bail!("this is one piece; give --frames, --refine or --regions, or take `girandole render`");
        }
        Ok(Self::Still { sets, regions })
    }

    /// The options of a first piece: the first frame, or the first light set of the first region.
    pub fn first(&self, render: &RenderArgs) -> RenderArgs {
        let mut first = render.clone();
        match self {
            Self::Sequence(_) => {
                let frames = render.motion.frames;
                first.motion.frames = frames.map(|frames| Frames { last: frames.first, ..frames });
            }
            Self::Still { sets, regions } => {
                first.output = render.output.with_extension("exr");
                first.piece.sets = sets.map(|_| [0, 0]);
                first.piece.region = regions.as_ref().and_then(|regions| regions.first().copied());
            }
        }
        first
    }

    /// How many there are.
    pub fn count(&self) -> u32 {
        match self {
            Self::Sequence(pieces) => *pieces,
            Self::Still { sets, regions } => {
                sets.unwrap_or(1) * regions.as_ref().map_or(1, |regions| regions.len() as u32)
            }
        }
    }
}

impl std::fmt::Display for Pieces {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Sequence(pieces) => write!(f, "{pieces} pieces of a sequence"),
            Self::Still { .. } => {
                write!(f, "{} pieces of a picture, and a job that joins them", self.count())
            }
        }
    }
}

/// A picture, cut evenly.
fn regions(size: [u32; 2], counts: [u32; 2]) -> Vec<Region> {
    let ends = |axis: usize| {
        let at = move |i: u32| (u64::from(size[axis]) * u64::from(i) / u64::from(counts[axis])) as u32;
        (0..counts[axis]).map(move |i| (at(i), at(i + 1)))
    };
    let region = |(top, bottom): (u32, u32)| {
        ends(0).map(move |(left, right)| Region { first: [left, top], size: [right - left, bottom - top] })
    };
    ends(1).flat_map(region).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_are_all_of_a_picture() {
        for (size, counts) in [([160, 120], [2, 2]), ([7, 5], [7, 3]), ([101, 1], [4, 1])] {
            let regions = regions(size, counts);
            assert_eq!(regions.len() as u32, counts[0] * counts[1]);
            let mut pixels = vec![0; (size[0] * size[1]) as usize];
            for region in &regions {
                assert!(region.is_in(size));
                region.rows(size[0]).flatten().for_each(|pixel| pixels[pixel] += 1);
            }
            assert!(pixels.iter().all(|&times| times == 1), "{regions:?}");
        }
    }

    #[test]
    fn what_is_one_piece_is_refused() -> Result<()> {
        let mut render = RenderArgs::defaults()?;
        assert!(Pieces::new(&render, None, [1, 1]).is_err());
        assert_eq!(Pieces::new(&render, None, [2, 3])?.count(), 6);
        render.refine = 64;
        assert!(Pieces::new(&render, Some(1), [1, 1]).is_err());
        assert_eq!(Pieces::new(&render, None, [1, 1])?.count(), 16);
        assert_eq!(Pieces::new(&render, Some(5), [2, 2])?.count(), 20);
        render.refine = 3;
        assert_eq!(Pieces::new(&render, None, [1, 1])?.count(), 3);
        assert!(Pieces::new(&render, None, [2000, 1]).is_err());
        Ok(())
    }
}

//! `girandole join`: puts parts of a picture together, of pixels, of light sets, or of both.

use crate::args::{JoinArgs, parse_sets, shown};
use crate::output::{self, say};
use crate::picture::{self, MOST_PIXELS, Shown};
use crate::provenance::{FIRST, OF_PARTS, what_differs};
use anyhow::{Context, Result, bail};
use girandole_core::image::{Image, Region};
use girandole_reference::image_file::{self, Part};
use girandole_reference::{PictureSum, Provenance};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Puts parts together, or says in a sentence why they are no picture.
pub fn run(args: &JoinArgs) -> Result<ExitCode> {
    output::check_writable(&args.output, &["exr", "png"])?;
    let (whole, parts) = find(&args.parts)?;
    let size = whole.size()?;
    let regions = by_region(&whole, parts)?;
    check_pixels(size, regions.keys().map(|&(first, size)| Region { first, size }))?;
    let mut picture = Joined::new(size);
    for (&(first, size), files) in &regions {
        picture.put(Region { first, size }, files)?;
    }
    let Whole { mut made_by, .. } = whole;
    if !args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        for (option, value) in shown(args.exposure, &args.tonemap) {
            made_by.set(option.trim_start_matches('-'), value.unwrap_or_default());
        }
    }
    let Joined { image, coverage } = picture;
    let shown = Shown::new(args.exposure, args.tonemap.into(), None);
    picture::write(&args.output, (&image, coverage.as_deref()), shown, &made_by)?;
    let [width, height] = size;
    say(&format!("wrote {} ({width}×{height}) from {} parts", args.output.display(), args.parts.len()));
    Ok(ExitCode::SUCCESS)
}

/// The picture that parts belong to.
struct Whole {
    made_by: Provenance,
}

impl Whole {
    fn size(&self) -> Result<[u32; 2]> {
        let size = self.made_by.0.get("size").and_then(|size| {
            let (width, height) = size.split_once('x')?;
            Some([width.parse().ok()?, height.parse().ok()?])
        });
        let size = size.context("the parts do not say how many pixels the picture has")?;
        if size.map(u64::from).iter().product::<u64>() > MOST_PIXELS {
            bail!(
                "a picture of {}×{} pixels is too large to be joined; use its parts as they are",
                size[0],
                size[1]
            );
        }
        Ok(size)
    }

    /// How many light sets it is the mean of.
    fn sets(&self) -> u32 {
        self.made_by.0.get("refine").and_then(|sets| sets.parse().ok()).unwrap_or(1).max(1)
    }
}

/// A part's file, and what it holds.
struct PartFile {
    path: PathBuf,
    region: Region,
    /// First and last light set, if it is not of all.
    sets: Option<[u32; 2]>,
}

/// What the parts are of.
fn find(paths: &[PathBuf]) -> Result<(Whole, Vec<PartFile>)> {
    let mut whole: Option<Whole> = None;
    let mut parts = Vec::with_capacity(paths.len());
    for path in paths {
        let name = path.display();
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            bail!("{name} is no .exr file, as parts are that can be put together");
        }
        let made_by = Provenance::read(path)?;
        let mut made_by = made_by.with_context(|| format!("{name} does not say what it was made by"))?;
        let [region, sets] = OF_PARTS.map(|key| made_by.0.remove(key));
        if region.is_none() && sets.is_none() {
            bail!("{name} is a whole picture, no part of one");
        }
        if let Some(difference) = whole.as_ref().and_then(|w| w.made_by.difference(&made_by, &FIRST)) {
            let first = paths[0].display();
            bail!("{name} does not belong to {first}: {}", what_differs(&difference));
        }
        let of_all = whole.get_or_insert(Whole { made_by });
        let region = match region {
            Some(region) => region.parse().ok(),
            None => Some(Region::whole(of_all.size()?)),
        };
        let region = region.filter(|region| region.is_in(of_all.size().unwrap_or_default()));
        let region = region.with_context(|| format!("{name} does not say which pixels it has"))?;
        let has_them = |[_, last]: &[u32; 2]| *last < of_all.sets();
        let sets = sets.map(|sets| parse_sets(&sets).ok().filter(has_them));
        if sets == Some(None) {
            bail!("{name} does not say which light sets it has");
        }
        let sets = sets.flatten();
        parts.push(PartFile { path: path.clone(), region, sets });
    }
    let whole = whole.context("there are no parts")?;
    Ok((whole, parts))
}

type ByRegion = BTreeMap<([u32; 2], [u32; 2]), Vec<PartFile>>;

/// The parts by the pixels that they have, those of each with all light sets, in order.
fn by_region(whole: &Whole, parts: Vec<PartFile>) -> Result<ByRegion> {
    let mut regions = ByRegion::new();
    for part in parts {
        regions.entry((part.region.first, part.region.size)).or_default().push(part);
    }
    for files in regions.values_mut() {
        files.sort_by_key(|part| part.sets);
        let all = whole.sets();
        let mut next = 0;
        for (index, part) in files.iter().enumerate() {
            let [first, last] = part.sets.unwrap_or([0, all - 1]);
            if first < next {
                let before = files[index.saturating_sub(1)].path.display();
                bail!("{before} and {} hold the same pixels of the same light sets", part.path.display());
            }
            if first > next {
                bail!("the light sets {next}..{} of the pixels {} are missing", first - 1, part.region);
            }
            next = last + 1;
        }
        if let Some(part) = files.first().filter(|_| next < all) {
            bail!("the light sets {next}..{} of the pixels {} are missing", all - 1, part.region);
        }
    }
    Ok(regions)
}

/// Whether these pixels are all of a picture, each of them once.
fn check_pixels([width, height]: [u32; 2], regions: impl Iterator<Item = Region>) -> Result<()> {
    let mut is_there = vec![false; width as usize * height as usize];
    for region in regions {
        for row in region.rows(width) {
            if is_there[row.clone()].contains(&true) {
                bail!("some of the pixels {region} are in another part, too");
            }
            is_there[row].fill(true);
        }
    }
    let Some(first) = is_there.iter().position(|is| !is) else { return Ok(()) };
    // As many as lie beside it, and below.
    let (x, y) = (first % width as usize, first / width as usize);
    let row = |y: usize| &is_there[y * width as usize..(y + 1) * width as usize];
    let columns = row(y)[x..].iter().take_while(|is| !**is).count();
    let rows = (y..height as usize).take_while(|&y| !row(y)[x..x + columns].contains(&true)).count();
    bail!("the pixels {x},{y},{columns},{rows} are missing")
}

/// A picture that parts are put into.
struct Joined {
    image: Image,
    coverage: Option<Vec<f32>>,
}

impl Joined {
    fn new([width, height]: [u32; 2]) -> Self {
        Self { image: Image::new(width, height), coverage: None }
    }

    /// Puts the mean of the light sets of some pixels there.
    fn put(&mut self, region: Region, files: &[PartFile]) -> Result<()> {
        let mut sum = PictureSum::new(region.size[0], region.size[1]);
        let (mut plain, mut coverage) = (None, None);
        for file in files {
            let part = read(&file.path, file)?;
            coverage = part.coverage;
            match part.sum {
                Some(more) => drop(sum.merge(&more)),
                None => plain = Some(part.image),
            }
        }
        let Image { width, pixels, .. } = &mut self.image;
        region.put(&plain.unwrap_or_else(|| sum.mean()).pixels, pixels, *width);
        if let Some(coverage) = coverage {
            let all = self.coverage.get_or_insert_with(|| vec![0.0; pixels.len()]);
            region.put(&coverage, all, *width);
        }
        Ok(())
    }
}

/// The pixels of a part, as many as it says.
fn read(path: &Path, file: &PartFile) -> Result<Part> {
    let part = image_file::read_part(path, file.sets.map(|[first, last]| last - first + 1))?;
    let size = [part.image.width, part.image.height];
    if size != file.region.size {
        bail!("{} has {}×{} pixels, and says {}", path.display(), size[0], size[1], file.region);
    }
    Ok(part)
}

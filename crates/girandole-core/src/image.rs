//! Pictures in linear floating point.

use glam::Vec3;
use std::ops::Range;

/// A picture: linear Rec. 709 radiance, rows from the top down.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Pixels in x.
    pub width: u32,
    /// Pixels in y.
    pub height: u32,
    /// `width × height` pixels.
    pub pixels: Vec<Vec3>,
}

impl Image {
    /// A black picture.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![Vec3::ZERO; width as usize * height as usize] }
    }

    /// The mean of all pixels, summed in double precision.
    pub fn mean(&self) -> Vec3 {
        let sum: glam::DVec3 = self.pixels.iter().map(|p| p.as_dvec3()).sum();
        (sum / self.pixels.len().max(1) as f64).as_vec3()
    }
}

/// A rectangle of a picture's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Region {
    /// The first pixel in x and y, from the top left corner.
    pub first: [u32; 2],
    /// Pixels in x and y.
    pub size: [u32; 2],
}

impl Region {
    /// All of a picture.
    pub fn whole(size: [u32; 2]) -> Self {
        Self { first: [0, 0], size }
    }

    /// One past the last pixel in x and y.
    pub fn end(&self) -> [u64; 2] {
        [0, 1].map(|axis| u64::from(self.first[axis]) + u64::from(self.size[axis]))
    }

    /// Whether it has pixels, and all of them lie in a picture of so many.
    pub fn is_in(&self, size: [u32; 2]) -> bool {
        !self.size.contains(&0) && (0..2).all(|axis| self.end()[axis] <= u64::from(size[axis]))
    }

    /// Where its rows lie in the list of pixels of a picture of this width.
    pub fn rows(&self, width: u32) -> impl Iterator<Item = Range<usize>> + use<> {
        let Self { first: [x, y], size: [columns, rows] } = *self;
        (y..y + rows).map(move |row| {
            let start = row as usize * width as usize + x as usize;
            start..start + columns as usize
        })
    }

    /// Puts what its pixels hold, row by row, where it lies in a picture of this width.
    pub fn put<T: Copy>(&self, values: &[T], picture: &mut [T], width: u32) {
        for (row, values) in self.rows(width).zip(values.chunks(self.size[0].max(1) as usize)) {
            picture[row].copy_from_slice(values);
        }
    }
}

/// `X,Y,WIDTH,HEIGHT`.
impl std::fmt::Display for Region {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { first: [x, y], size: [width, height] } = self;
        write!(f, "{x},{y},{width},{height}")
    }
}

/// The way back.
impl std::str::FromStr for Region {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let numbers: Option<Vec<u32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[x, y, width, height]) if width > 0 && height > 0 => {
                Ok(Self { first: [x, y], size: [width, height] })
            }
            _ => Err(
                "give the first pixel from the top left corner, and how many in x and y, as in 0,0,640,480",
            ),
        }
    }
}

/// Relative luminance of linear Rec. 709 RGB.
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_are_read_as_they_are_written() {
        let region = Region { first: [3, 4], size: [5, 6] };
        assert_eq!((region.to_string().parse(), " 3, 4,5,6".parse()), (Ok(region), Ok(region)));
        for wrong in
            ["", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,0", "-1,2,3,4", "a,b,c,d", "4294967296,0,1,1"]
        {
            assert!(wrong.parse::<Region>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn regions_lie_in_pictures() {
        let region = |first, size| Region { first, size };
        assert!(region([3, 4], [5, 6]).is_in([8, 10]) && !region([3, 4], [5, 6]).is_in([7, 10]));
        assert!(!region([u32::MAX, 0], [2, 1]).is_in([u32::MAX, 1]) && !region([0, 0], [0, 1]).is_in([8, 8]));
        let rows: Vec<_> = region([2, 1], [3, 2]).rows(8).collect();
        assert_eq!(rows, [10..13, 18..21]);
        let mut picture = [0; 24];
        region([2, 1], [3, 2]).put(&[1, 2, 3, 4, 5, 6], &mut picture, 8);
        assert_eq!((&picture[9..14], &picture[17..22]), (&[0, 1, 2, 3, 0][..], &[0, 4, 5, 6, 0][..]));
        assert_eq!(picture.iter().sum::<i32>(), 21);
        assert_eq!(Region::whole([4, 2]).rows(4).collect::<Vec<_>>(), [0..4, 4..8]);
    }
}

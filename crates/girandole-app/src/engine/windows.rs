//! Pictures that are larger than the device's: drawn window by window, each a picture of its own.

use girandole_core::glam::Vec2;
use girandole_core::image::{Image, Region};
use girandole_core::scene::View;

/// Pixels along a side that are drawn at once, which every device can.
const MOST: u32 = 8192;

/// A part of a picture that is drawn at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Its pixels.
    rect: Region,
    /// Those of them that are asked for, counted from its first.
    part: Option<Region>,
}

impl Window {
    /// Whether a picture is larger than what is drawn at once.
    pub fn are_several(size: [u32; 2]) -> bool {
        size.iter().any(|&side| side > MOST)
    }

    /// Those that have some of the pixels that are asked for; one, where the picture is no larger. Where they lie does not depend on
    /// what is asked for, so that pixels do not.
    pub fn all(size: [u32; 2], asked: Option<Region>) -> Vec<Self> {
        if !Self::are_several(size) {
            return vec![Self { rect: Region::whole(size), part: asked }];
        }
        let wanted = asked.unwrap_or(Region::whole(size));
        let ends = |axis: usize| {
            let count = size[axis].div_ceil(MOST);
            let at = move |i: u32| (u64::from(size[axis]) * u64::from(i) / u64::from(count)) as u32;
            (0..count).map(move |i| [at(i), at(i + 1)])
        };
        let mut windows = Vec::new();
        for rows in ends(1) {
            for columns in ends(0) {
                let [x, y] = [(columns, 0), (rows, 1)].map(|([first, end], axis)| {
                    let (from, to) = (wanted.first[axis], wanted.first[axis] + wanted.size[axis]);
                    let part = [first.max(from), end.min(to)];
                    (first, end - first, part[0].saturating_sub(first), part[1].saturating_sub(part[0]))
                });
                let part = Region { first: [x.2, y.2], size: [x.3, y.3] };
                if !part.size.contains(&0) {
                    let rect = Region { first: [x.0, y.0], size: [x.1, y.1] };
                    windows.push(Self { rect, part: Some(part) });
                }
            }
        }
        windows
    }

    /// Its pixels in x and y.
    pub fn size(&self) -> [u32; 2] {
        self.rect.size
    }

    /// What is drawn of it; `None` = all.
    pub fn part(&self) -> Option<Region> {
        self.part
    }

    /// The view of a picture of so many pixels, as far as it is seen through this.
    pub fn view(&self, view: &View, size: [u32; 2]) -> View {
        if self.rect == Region::whole(size) {
            return *view;
        }
        let share =
            Vec2::new(self.rect.size[0] as f32 / size[0] as f32, self.rect.size[1] as f32 / size[1] as f32);
        // From the picture's middle to the window's, in halves of the picture, up and to the right.
        let middle = |axis: usize| {
            let twice = 2.0 * f64::from(self.rect.first[axis]) + f64::from(self.rect.size[axis]);
            twice / f64::from(size[axis]) - 1.0
        };
        let shift = Vec2::new(middle(0) as f32, -middle(1) as f32);
        View { half_extent: view.half_extent * share, center: (view.center + shift) / share, ..*view }
    }

    /// Puts what was drawn of it where it lies in a picture of the pixels that are asked for.
    pub fn put(&self, drawn: &Image, asked: Region, picture: &mut Image) {
        let part = self.part.unwrap_or(Region::whole(self.rect.size));
        let first = [0, 1].map(|axis| self.rect.first[axis] + part.first[axis] - asked.first[axis]);
        Region { first, size: part.size }.put(&drawn.pixels, &mut picture.pixels, picture.width);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use girandole_core::glam::{DVec3, Vec3};
    use girandole_core::scene::builtin::{self, MovingObject};

    #[test]
    fn windows_show_every_pixel_once_and_where_it_is() {
        let scene = builtin::build("table", MovingObject::None).expect("a room");
        let whole = View { center: Vec2::new(0.1, -0.2), ..View::new(&scene, &scene.cameras[0], 2.0) };
        let size = [20_000, 10_001];
        for asked in [
            None,
            Some(Region { first: [6000, 4990], size: [1500, 30] }),
            Some(Region { first: [19_999, 0], size: [1, 10_001] }),
        ] {
            let region = asked.unwrap_or(Region::whole(size));
            let windows = Window::all(size, asked);
            let count: u64 = windows
                .iter()
                .filter_map(Window::part)
                .map(|p| u64::from(p.size[0]) * u64::from(p.size[1]))
                .sum();
            assert_eq!(count, u64::from(region.size[0]) * u64::from(region.size[1]), "{windows:?}");
            for window in &windows {
                assert!(window.size().iter().all(|&side| side <= MOST));
                let part = window.part().expect("a part");
                let view = window.view(&whole, size).relative_to(DVec3::ZERO);
                let all = whole.relative_to(DVec3::ZERO);
                for at in [[0, 0], [part.size[0] - 1, 0], [part.size[0] / 2, part.size[1] - 1]] {
                    let inner = [part.first[0] + at[0], part.first[1] + at[1]];
                    let outer = [window.rect.first[0] + inner[0], window.rect.first[1] + inner[1]];
                    let pixel = |at: [u32; 2]| Vec2::new(at[0] as f32 + 0.5, at[1] as f32 + 0.5);
                    let (_, a) = view.pixel_ray(pixel(inner), window.size());
                    let (_, b) = all.pixel_ray(pixel(outer), size);
                    // A hundredth of a pixel.
                    let error = (a - b).length() / (2.0 * whole.half_extent.x / size[0] as f32);
                    assert!(error < 0.02, "{window:?} {at:?}: {error} pixels");
                }
            }
        }
        // One that the device can draw at once is drawn so.
        assert_eq!(Window::all([8192, 5], None), [Window { rect: Region::whole([8192, 5]), part: None }]);
        assert_eq!(Window::all([8192, 5], None)[0].view(&whole, [8192, 5]), whole);
    }

    #[test]
    fn windows_are_put_together() {
        let size = [9000, 2];
        let asked = Region { first: [4400, 0], size: [200, 2] };
        let color = |x: u32, y: u32| Vec3::new(x as f32, y as f32, 1.0);
        let mut picture = Image::new(200, 2);
        for window in Window::all(size, Some(asked)) {
            let part = window.part().expect("a part");
            let first = window.rect.first;
            let pixels = (0..part.size[1])
                .flat_map(|y| (0..part.size[0]).map(move |x| (x, y)))
                .map(|(x, y)| color(first[0] + part.first[0] + x, first[1] + part.first[1] + y))
                .collect();
            window.put(&Image { width: part.size[0], height: part.size[1], pixels }, asked, &mut picture);
        }
        let expected: Vec<Vec3> = (0..2).flat_map(|y| (4400..4600).map(move |x| color(x, y))).collect();
        assert_eq!(picture.pixels, expected);
    }
}

//! Faces as files list them, and how they are cut into triangles.

use super::{MaterialId, Parsed};
use crate::scene::gltf::MAX_TRIANGLES;
use earcut::Earcut;
use glam::{DVec2, DVec3, Vec2, Vec3};

/// Corners of a polygon that has to be cut by ears: the time grows by the square at worst.
const MOST_CORNERS: usize = 10_000;

/// A model as its file lists it: the corners of faces refer to lists of their own.
#[derive(Default)]
pub(super) struct Polygons {
    /// Metres.
    pub positions: Vec<Vec3>,
    /// Linear RGB of each position; or none.
    pub colors: Vec<Vec3>,
    /// Of any length.
    pub normals: Vec<Vec3>,
    /// v counted upwards.
    pub uvs: Vec<Vec2>,
    /// Those of all faces, one after the other.
    pub corners: Vec<Corner>,
    pub faces: Vec<Face>,
    /// How many triangles the faces make.
    triangles: usize,
}

/// What a corner of a face refers to; [`NONE`](crate::scene::NONE) where it has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub position: u32,
    pub uv: u32,
    pub normal: u32,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    /// Where its corners end; they begin where those of the face before do.
    pub end: u32,
    pub material: MaterialId,
    pub smoothing: Smoothing,
}

/// Which edges a face without normals is smooth at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Smoothing {
    /// Those that are not sharp.
    ByAngle,
    /// Those that it shares with faces of its group.
    Group(u32),
    /// None.
    Off,
}

/// A part of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// Indices into [`Polygons::corners`].
    pub corners: [u32; 3],
    pub face: u32,
}

impl Polygons {
    /// Adds a face; one of fewer than three corners is none.
    pub fn add_face(
        &mut self,
        corners: impl IntoIterator<Item = Corner>,
        material: MaterialId,
        smoothing: Smoothing,
    ) -> Parsed<bool> {
        let first = self.corners.len();
        self.corners.extend(corners);
        let count = self.corners.len() - first;
        if count < 3 {
            self.corners.truncate(first);
            return Ok(false);
        }
        self.triangles += count - 2;
        if self.triangles > MAX_TRIANGLES {
            return Err(format!("it has more than {MAX_TRIANGLES} triangles; simplify it"));
        }
        self.faces.push(Face { end: self.corners.len() as u32, material, smoothing });
        Ok(true)
    }

    /// Where a corner is.
    pub fn position(&self, corner: u32) -> Vec3 {
        self.positions[self.corners[corner as usize].position as usize]
    }

    /// The triangles of all faces, in order.
    ///
    /// # Errors
    /// What is wrong with a face that cannot be cut.
    pub fn cut(&self) -> Parsed<Vec<Part>> {
        let mut parts = Vec::with_capacity(self.triangles);
        let mut knife = Knife::default();
        let mut first = 0;
        for (number, face) in self.faces.iter().enumerate() {
            knife.points.clear();
            knife.points.extend((first..face.end).map(|corner| self.position(corner).as_dvec3()));
            knife.cut()?;
            parts.extend(knife.triangles.iter().map(|triangle| {
                let corners = triangle.map(|corner| first + corner);
                Part { corners, face: number as u32 }
            }));
            first = face.end;
        }
        Ok(parts)
    }
}

/// Cuts polygons into triangles.
#[derive(Default)]
struct Knife {
    points: Vec<DVec3>,
    /// Of the last polygon, by its corners.
    triangles: Vec<[u32; 3]>,
    /// Corners that are not where the last one was.
    kept: Vec<u32>,
    flat: Vec<[f64; 2]>,
    ears: Vec<u32>,
    earcut: Earcut<f64>,
}

impl Knife {
    fn cut(&mut self) -> Parsed<()> {
        self.triangles.clear();
        let count = self.points.len() as u32;
        let fan = (1..count - 1).map(|i| [0, i, i + 1]);
        if count == 3 || !self.flatten() {
            self.triangles.extend(fan);
            return Ok(());
        }
        let area = |[a, b, c]: [usize; 3]| {
            let [a, b, c] = [a, b, c].map(|i| DVec2::from(self.flat[i]));
            (b - a).perp_dot(c - a)
        };
        // Convex polygons, and others of which the first corner sees all: as everybody cuts them.
        if (1..self.flat.len() - 1).all(|i| area([0, i, i + 1]) > 0.0) {
            let kept = &self.kept;
            self.triangles.extend((1..kept.len() - 1).map(|i| [kept[0], kept[i], kept[i + 1]]));
            return Ok(());
        }
        if self.flat.len() > MOST_CORNERS {
            return Err(format!(
                "it has a face of {count} corners, and more than {MOST_CORNERS} are not cut; cut it into triangles"
            ));
        }
        self.earcut.earcut(self.flat.iter().copied(), &[] as &[u32], &mut self.ears);
        for ear in self.ears.as_chunks::<3>().0 {
            let [a, b, c] = *ear;
            let turned = if area([a, b, c].map(|i| i as usize)) < 0.0 { [a, c, b] } else { [a, b, c] };
            self.triangles.push(turned.map(|i| self.kept[i as usize]));
        }
        Ok(())
    }

    /// Projects the polygon along an axis so that it turns counter-clockwise. Along an axis, what lies on a line stays
    /// on one. Not for polygons without area.
    fn flatten(&mut self) -> bool {
        let points = &self.points;
        self.kept.clear();
        self.kept.extend((0..points.len() as u32).filter(|&i| {
            let last = if i == 0 { points.len() - 1 } else { i as usize - 1 };
            points[i as usize] != points[last]
        }));
        let Some(&origin) = self.kept.first() else { return false };
        let at = |i: usize| points[self.kept[i % self.kept.len()] as usize] - points[origin as usize];
        let normal: DVec3 = (0..self.kept.len()).map(|i| at(i).cross(at(i + 1))).sum();
        if self.kept.len() < 3 || !(normal.is_finite() && normal != DVec3::ZERO) {
            return false;
        }
        let size = normal.abs();
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((axis + 1) % 3, (axis + 2) % 3);
        if normal[axis] < 0.0 {
            (x, y) = (y, x);
        }
        self.flat.clear();
        self.flat.extend(self.kept.iter().map(|&i| {
            let point = points[i as usize];
            [point[x], point[y]]
        }));
        true
    }
}

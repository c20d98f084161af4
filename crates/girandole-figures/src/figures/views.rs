//! Views of an experiment's own, and what their pixels show.

use anyhow::{Context, Result};
use girandole_core::glam::{DAffine3, DVec3, Vec2, Vec3};
use girandole_core::image::{Image, Region};
use girandole_core::scene::{ClipPlanes, FieldOfView, Geometry, ObjectId, Scene, Transform, View, Viewpoint};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::CompareOptions;

/// The view from a point to another one, with a vertical angle in degrees.
///
/// # Errors
/// Where the two are the same.
pub fn looking(eye: DVec3, target: DVec3, degrees: f64, size: [u32; 2]) -> Result<View> {
    let field = FieldOfView::Perspective { degrees };
    let viewpoint = Viewpoint { eye, target, up: DVec3::Y, field, clip: ClipPlanes::NONE };
    Ok(viewpoint.view(size[0] as f32 / size[1] as f32)?)
}

/// What a pixel's centre shows.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Whose surface it is.
    pub object: ObjectId,
    /// Index into the geometry's triangles.
    pub triangle: u32,
    /// Weights of the triangle's corners.
    pub weights: Vec3,
    /// Where it is, relative to the geometry's origin.
    pub position: Vec3,
    /// Shading normal.
    pub normal: Vec3,
}

/// What the pixels of a picture show, row by row; nothing where it is the background.
pub fn points(tracer: &SceneTracer, view: &View, size: [u32; 2]) -> Vec<Option<Point>> {
    let geometry = tracer.geometry();
    let view = view.relative_to(geometry.origin);
    let point = |i: u32| {
        let at = Vec2::new((i % size[0]) as f32, (i / size[0]) as f32) + 0.5;
        let (origin, direction) = view.pixel_ray(at, size);
        let hit = tracer.closest_visible(origin, direction)?;
        let triangle = &geometry.triangles[hit.triangle as usize];
        let weights =
            Vec3::new(1.0 - hit.barycentric.x - hit.barycentric.y, hit.barycentric.x, hit.barycentric.y);
        let mixed = |of: &[Vec3]| -> Vec3 {
            (0..3).map(|corner| of[triangle.vertices[corner] as usize] * weights[corner]).sum()
        };
        Some(Point {
            object: ObjectId(triangle.object),
            triangle: hit.triangle,
            weights,
            position: mixed(&geometry.positions),
            normal: mixed(&geometry.normals).normalize_or_zero(),
        })
    };
    (0..size[0] * size[1]).map(point).collect()
}

/// The pixels that show an object and whose neighbours do so too: a path tracer's are means of nothing else.
pub fn within(points: &[Option<Point>], object: ObjectId, size: [u32; 2]) -> Vec<bool> {
    let [width, height] = size.map(|side| side as usize);
    let shows = |x: usize, y: usize| points[y * width + x].is_some_and(|point| point.object == object);
    let is_within = |i: usize| {
        let (x, y) = (i % width, i / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.into_iter().all(|y| (x.saturating_sub(1)..(x + 2).min(width)).all(|x| shows(x, y)))
    };
    (0..points.len()).map(is_within).collect()
}

/// Compares these pixels alone.
pub fn only(chosen: &[bool], size: [u32; 2]) -> CompareOptions {
    let pixels = chosen.iter().map(|&is_chosen| if is_chosen { Vec3::ZERO } else { Vec3::X }).collect();
    let mask = Image { width: size[0], height: size[1], pixels };
    CompareOptions { mask: Some(mask), ..CompareOptions::default() }
}

/// The view of a part of a picture.
pub fn part(view: &View, size: [u32; 2], region: Region) -> View {
    let share = |pixel: u64, axis: usize| pixel as f32 / size[axis] as f32;
    let first = [0, 1].map(|axis| share(u64::from(region.first[axis]), axis));
    let end = [0, 1].map(|axis| share(region.end()[axis], axis));
    view.part(first, end)
}

/// The mean of these pixels; nothing where there is none.
pub fn mean(image: &Image, chosen: &[bool]) -> Option<DVec3> {
    let pixels = || image.pixels.iter().zip(chosen).filter(|(_, is_chosen)| **is_chosen);
    let count = pixels().count();
    (count > 0).then(|| pixels().map(|(pixel, _)| pixel.as_dvec3()).sum::<DVec3>() / count as f64)
}

/// The least part of a picture that has these pixels, and `margin` more at each side.
///
/// # Errors
/// Where there is no such pixel.
pub fn around(chosen: &[bool], size: [u32; 2], margin: u32) -> Result<Region> {
    let places =
        || (0..size[0] * size[1]).filter(|&i| chosen[i as usize]).map(|i| [i % size[0], i / size[0]]);
    let side = |axis: usize| -> Option<[u32; 2]> {
        let first = places().map(|place| place[axis]).min()?.saturating_sub(margin);
        let end = places().map(|place| place[axis]).max()? + 1 + margin;
        Some([first, end.min(size[axis])])
    };
    let [x, y] = [0, 1].map(side);
    let (x, y) = x.zip(y).context("what is looked for is not in the picture")?;
    Ok(Region { first: [x[0], y[0]], size: [x[1] - x[0], y[1] - y[0]] })
}

/// Puts an object on a root node elsewhere: its largest extent becomes `size` metres, and the middle of its box
/// is at `place`.
pub fn put(scene: &mut Scene, object: ObjectId, size: f64, place: DVec3) {
    let geometry = Geometry::new(scene);
    let vertices = geometry.objects[object.index()].vertices.clone();
    let corners = || vertices.clone().map(|v| geometry.positions[v as usize]);
    let (low, high) =
        (corners().fold(Vec3::INFINITY, Vec3::min), corners().fold(Vec3::NEG_INFINITY, Vec3::max));
    let scale = size / f64::from((high - low).max_element());
    let middle = ((low + high) * 0.5).as_dvec3() + geometry.origin;
    let node = &mut scene.nodes[scene.objects[object.index()].node];
    let DAffine3 { matrix3, translation } = node.local.affine();
    let translation = (translation - middle) * scale + place;
    node.local = Transform::Affine(DAffine3 { matrix3: matrix3 * scale, translation });
    scene.touch();
}

/// Puts an object on a root node elsewhere: its largest extent becomes `size` metres, and it stands at `foot`.
pub fn stand(scene: &mut Scene, object: ObjectId, size: f64, foot: DVec3) {
    put(scene, object, size, foot);
    let geometry = Geometry::new(scene);
    let vertices = geometry.objects[object.index()].vertices.clone();
    let heights = vertices.map(|vertex| f64::from(geometry.positions[vertex as usize].y) + geometry.origin.y);
    let low = heights.fold(f64::INFINITY, f64::min);
    put(scene, object, size, foot + DVec3::Y * (foot.y - low));
}

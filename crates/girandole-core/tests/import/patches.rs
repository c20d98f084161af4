//! Planar convex patches.

use girandole_core::glam::{DVec3, Mat3, Quat, Vec3};
use girandole_core::scene::{MaterialId, Mesh, MeshTriangle, mark_patches};
use proptest::prelude::*;

/// Triangles as they are, whatever their order and first corner.
fn inventory(mesh: &Mesh) -> Vec<([u32; 3], MaterialId)> {
    let mut list: Vec<_> = mesh
        .triangles
        .iter()
        .map(|t| {
            let mut v = t.vertices;
            let least = (0..3).min_by_key(|&i| v[i]).unwrap_or(0);
            v.rotate_left(least);
            (v, t.material)
        })
        .collect();
    list.sort_unstable();
    list
}

/// What every patch promises; a sentence where it does not hold.
fn check(before: &Mesh, after: &Mesh, min_area: f64) -> Result<(), String> {
    if inventory(before) != inventory(after) || before.positions != after.positions {
        return Err("triangles were lost or changed".into());
    }
    let point = |v: u32| after.positions[v as usize].as_dvec3();
    let extent = after.positions.iter().map(|p| p.length()).fold(0.0, f32::max);
    let close = f64::from(extent) * 5e-6;
    let mut next = 0;
    for patch in &after.patches {
        if patch.triangles.start != next || patch.triangles.is_empty() {
            return Err("patches do not come first, one after the other".into());
        }
        next = patch.triangles.end;
        let triangles = &after.triangles[patch.triangles.start as usize..patch.triangles.end as usize];
        let n = patch.outline.len();
        if n < 3 {
            return Err("an outline of less than three corners".into());
        }
        let corner = |i: usize| point(patch.outline[i % n]);
        let sum =
            (0..n).fold(DVec3::ZERO, |s, i| s + (corner(i) - corner(0)).cross(corner(i + 1) - corner(0)));
        let (normal, outlined) = (sum.normalize(), sum.length() * 0.5);
        let mut area = 0.0;
        for t in triangles {
            let [a, b, c] = t.vertices.map(point);
            let cross = (b - a).cross(c - a);
            area += cross.length() * 0.5;
            if cross.normalize().dot(normal) < 0.99999 || t.material != triangles[0].material {
                return Err("a triangle of another direction or material".into());
            }
            for v in t.vertices {
                if (point(v) - corner(0)).dot(normal).abs() > close {
                    return Err("not planar".into());
                }
                if (after.normals[v as usize].as_dvec3() - normal).length() > 2e-3 {
                    return Err("not flat".into());
                }
                // Inside of all sides: with the areas equal, the triangles are the polygon.
                if (0..n).any(|i| {
                    let side = (corner(i + 1) - corner(i)).normalize();
                    normal.cross(side).dot(point(v) - corner(i)) < -close
                }) {
                    return Err("a triangle outside of the outline".into());
                }
            }
        }
        let mut perimeter = 0.0;
        for i in 0..n {
            let (a, b) = (corner(i + 1) - corner(i), corner(i + 2) - corner(i + 1));
            perimeter += a.length();
            if a.cross(b).dot(normal) <= 0.0 {
                return Err("not convex, or a collinear corner".into());
            }
        }
        if (area - outlined).abs() > close * perimeter + 1e-6 * area {
            return Err(format!("triangles of {area} m² in an outline of {outlined} m²"));
        }
        if area < min_area * 0.999 {
            return Err("too small a patch".into());
        }
    }
    Ok(())
}

fn marked(mesh: &Mesh, min_area: f32) -> Mesh {
    let mut after = mesh.clone();
    mark_patches(&mut after, min_area);
    if let Err(sentence) = check(mesh, &after, f64::from(min_area)) {
        panic!("{sentence}");
    }
    after
}

/// Cells of a unit grid in the XY plane, each of two triangles with vertices of its own; `0` = no cell, otherwise
/// bits say material and diagonal.
fn grid(cells: &[Vec<u8>], xs: &[f32], ys: &[f32], place: Mat3, shift: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    for (y, row) in cells.iter().enumerate() {
        for (x, &cell) in row.iter().enumerate() {
            if cell == 0 {
                continue;
            }
            let first = mesh.positions.len() as u32;
            for (dx, dy) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                mesh.positions.push(place * Vec3::new(xs[x + dx], ys[y + dy], 0.0) + shift);
                mesh.normals.push((place * Vec3::Z).normalize());
            }
            let corners = if cell & 2 == 0 { [[0, 1, 2], [0, 2, 3]] } else { [[0, 1, 3], [1, 2, 3]] };
            for c in corners {
                mesh.triangles.push(MeshTriangle {
                    vertices: c.map(|v| v + first),
                    material: MaterialId((cell >> 2).into()),
                });
            }
        }
    }
    mesh
}

fn even(n: usize) -> Vec<f32> {
    (0..=n).map(|i| i as f32).collect()
}

fn plain(cells: &[Vec<u8>]) -> Mesh {
    grid(cells, &even(cells[0].len()), &even(cells.len()), Mat3::IDENTITY, Vec3::ZERO)
}

#[test]
fn a_tessellated_wall_is_one_patch() {
    let wall = marked(&plain(&vec![vec![1; 60]; 60]), 0.1);
    assert_eq!((wall.patches.len(), wall.patches[0].outline.len()), (1, 4));
    assert_eq!(wall.patches[0].triangles, 0..7200);
}

#[test]
fn an_l_and_a_ring_become_a_few_convex_patches() {
    let mut l = vec![vec![1; 2]; 2];
    l[1][1] = 0;
    assert_eq!(marked(&plain(&l), 0.1).patches.len(), 2);
    // Tessellated, and with a hole.
    let mut large = vec![vec![1; 24]; 24];
    large.iter_mut().skip(8).for_each(|row| row[8..].fill(0));
    let patches = marked(&plain(&large), 0.1).patches.len();
    assert!((2..=8).contains(&patches), "{patches}");
    let mut ring = vec![vec![1; 3]; 3];
    ring[1][1] = 0;
    let patches = marked(&plain(&ring), 0.1).patches.len();
    assert!((4..=6).contains(&patches), "{patches}");
}

#[test]
fn boxes_have_six_patches_whatever_their_vertices() {
    let mut split = Mesh::default();
    split.add_box(Vec3::splat(-1.0), Vec3::ONE, MaterialId(3));
    let expected = split.patches.clone();
    split.patches.clear();
    let after = marked(&split, 0.0);
    assert_eq!(after.patches.len(), 6);
    assert!(after.patches.iter().zip(&expected).all(|(a, b)| a.triangles == b.triangles));
    // Smooth normals at shared corners: no side is flat.
    let mut round = split.clone();
    round.normals = round.positions.iter().map(|p| p.normalize()).collect();
    assert!(marked(&round, 0.0).patches.is_empty());
}

#[test]
fn materials_sizes_and_t_junctions_part_patches() {
    let two = vec![vec![1, 5]];
    assert_eq!(marked(&plain(&two), 0.1).patches.len(), 2);
    assert_eq!(marked(&plain(&[vec![1, 1]]), 1.5).patches.len(), 1);
    assert_eq!(marked(&plain(&two), 1.5).patches.len(), 0, "each is too small");
    // A large cell beside two small ones: they share no whole edge.
    let mut junction = plain(&[vec![1], vec![1]]);
    let big = grid(&[vec![1]], &[1.0, 3.0], &[0.0, 2.0], Mat3::IDENTITY, Vec3::ZERO);
    let first = junction.positions.len() as u32;
    junction.positions.extend(big.positions);
    junction.normals.extend(big.normals);
    junction.triangles.extend(
        big.triangles
            .iter()
            .map(|t| MeshTriangle { vertices: t.vertices.map(|v| v + first), material: MaterialId(0) }),
    );
    assert_eq!(marked(&junction, 0.1).patches.len(), 2);
}

#[test]
fn two_sheets_back_to_back_stay_apart() {
    let mut mesh = plain(&[vec![1, 1]]);
    let count = mesh.positions.len() as u32;
    let back: Vec<MeshTriangle> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.vertices.map(|v| v + count);
            MeshTriangle { vertices: [a, c, b], material: MaterialId(0) }
        })
        .collect();
    mesh.positions.extend_from_within(..);
    mesh.normals.extend(vec![Vec3::NEG_Z; count as usize]);
    mesh.triangles.extend(back);
    assert_eq!(marked(&mesh, 0.1).patches.len(), 2);
}

#[test]
fn a_disc_is_one_patch_and_a_sphere_none() {
    let mut disc = Mesh::default();
    let n = 2000_u32;
    disc.positions.push(Vec3::ZERO);
    for i in 0..n {
        let angle = i as f32 / n as f32 * std::f32::consts::TAU;
        disc.positions.push(Vec3::new(angle.cos(), angle.sin(), 0.0));
        disc.triangles.push(MeshTriangle { vertices: [0, i + 1, (i + 1) % n + 1], material: MaterialId(0) });
    }
    disc.normals = vec![Vec3::Z; disc.positions.len()];
    assert_eq!(marked(&disc, 0.1).patches.len(), 1);
    let mut dome = disc.clone();
    dome.positions[0].z = 0.5;
    assert!(marked(&dome, 0.0).patches.is_empty(), "its normals are not its faces'");
}

#[test]
fn a_large_crooked_floor_takes_no_time() {
    // 200 000 triangles that no single polygon holds. Quadratic behaviour would take hours.
    let cells: Vec<Vec<u8>> =
        (0..320).map(|y| (0..320).map(|x| u8::from((x / 40 + y / 40) % 3 != 1)).collect()).collect();
    let floor = marked(&plain(&cells), 0.1);
    assert!(floor.patches.len() < 2000, "{}", floor.patches.len());
}

#[test]
fn broken_patches_are_found() {
    let before = plain(&[vec![1, 1], vec![1, 0]]);
    let good = marked(&before, 0.1);
    let found = |change: &dyn Fn(&mut Mesh)| {
        let mut bad = good.clone();
        change(&mut bad);
        check(&before, &bad, 0.1).expect_err("a broken promise")
    };
    assert!(found(&|m| m.triangles[0] = m.triangles[1]).contains("lost"));
    assert!(found(&|m| m.patches[0].outline.reverse()).contains("direction"));
    assert!(
        found(&|m| {
            m.patches[0].outline.pop();
        })
        .contains("outside")
    );
    assert!(found(&|m| m.patches[0].triangles.end -= 1).contains("outline of"));
    assert!(found(&|m| m.patches[1].triangles.start += 1).contains("one after the other"));
    assert!(found(&|m| m.normals[0] = Vec3::X).contains("flat"));
    assert!(check(&before, &good, 100.0).expect_err("all are smaller").contains("small"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_floor_keeps_the_promises(
        cells in prop::collection::vec(prop::collection::vec(0_u8..8, 7), 6),
        fill in 0_u8..4,
        widths in prop::collection::vec(0.05_f32..3.0, 7),
        depths in prop::collection::vec(0.05_f32..3.0, 6),
        turn in prop::array::uniform4(-1.0_f32..1.0),
        shift in prop::array::uniform3(-20.0_f32..20.0),
        min_area in 0.0_f32..2.0,
    ) {
        let turn = Quat::from_array(turn);
        prop_assume!(turn.length() > 0.1);
        // From single cells of two materials to almost one whole floor.
        let cells: Vec<Vec<u8>> = cells
            .iter()
            .map(|row| row.iter().map(|&c| if fill > 0 && c < 2 * fill { 1 } else { c }).collect())
            .collect();
        let sums = |list: &[f32]| {
            let mut at = 0.0;
            std::iter::once(0.0).chain(list.iter().map(|w| { at += w; at })).collect::<Vec<f32>>()
        };
        let place = Mat3::from_quat(turn.normalize());
        let before = grid(&cells, &sums(&widths), &sums(&depths), place, Vec3::from(shift));
        let mut after = before.clone();
        mark_patches(&mut after, min_area);
        prop_assert_eq!(check(&before, &after, f64::from(min_area)), Ok(()));
        let solid: usize = cells.iter().flatten().filter(|&&c| c != 0).count();
        if min_area == 0.0 {
            prop_assert!(after.patches.iter().map(|p| p.triangles.len()).sum::<usize>() == 2 * solid);
        }
        // All of it becomes patches when none is too small.
        let mut all = before.clone();
        mark_patches(&mut all, 0.0);
        prop_assert_eq!(check(&before, &all, 0.0), Ok(()));
        prop_assert_eq!(all.patches.iter().map(|p| p.triangles.len()).sum::<usize>(), 2 * solid);
        prop_assert!(all.patches.len() <= solid.max(1) * 2);
    }

    #[test]
    fn any_fan_keeps_the_promises(
        angles in prop::collection::vec(0.0_f32..std::f32::consts::TAU, 3..40),
        radii in prop::collection::vec(0.2_f32..2.0, 40),
        turn in prop::array::uniform4(-1.0_f32..1.0),
    ) {
        // A star-shaped polygon around the origin.
        let turn = Quat::from_array(turn);
        prop_assume!(turn.length() > 0.1);
        let mut angles = angles;
        angles.sort_by(f32::total_cmp);
        angles.dedup_by(|a, b| (*a - *b).abs() < 1e-3);
        let n = angles.len() as u32;
        prop_assume!(n >= 3 && (0..n as usize).all(|i| {
            let next = angles[(i + 1) % n as usize] + if i + 1 == n as usize { std::f32::consts::TAU } else { 0.0 };
            next - angles[i] < 3.0
        }));
        let turn = turn.normalize();
        let mut before = Mesh { positions: vec![Vec3::ZERO], ..Mesh::default() };
        for (i, (&a, r)) in (0..n).zip(angles.iter().zip(&radii)) {
            before.positions.push(turn * (Vec3::new(a.cos(), a.sin(), 0.0) * *r));
            before.triangles.push(MeshTriangle { vertices: [0, i + 1, (i + 1) % n + 1], material: MaterialId(0) });
        }
        before.normals = vec![turn * Vec3::Z; before.positions.len()];
        let mut after = before.clone();
        mark_patches(&mut after, 0.0);
        prop_assert_eq!(check(&before, &after, 0.0), Ok(()));
        prop_assert!(!after.patches.is_empty());
    }
}

//! What tells how wrong stale maps are: the texels of each map that are, and the occluders as they are now, in a hierarchy of
//! boxes. It is made for a frame of which somebody wants to know, not kept.
//!
//! Clusters of triangles lie in an order in which neighbours are near each other (`maps/occluders.rs`), so that a box about
//! each [`BLOCKER_GROUP`] of them is all that it takes. Those of static objects come first; those of dynamic ones begin with
//! a group of their own.

use crate::gpu_scene::previous_transforms::PreviousTransforms;
use crate::layout::Light;
use crate::maps::atlas::Atlas;
use crate::maps::bounds::Bounds;
use crate::maps::occluders::{CLUSTER, Clusters};
use crate::records::{OccluderBox, StaleMapsHeader, StalePart};
use crate::shader_constants::NONE;
use girandole_core::glam::Vec3;

/// Clusters that share a box.
pub(crate) const BLOCKER_GROUP: u32 = 32;
/// What boxes are enlarged by, as a share of their coordinates: flat ones have a thickness then.
const ROUNDING: f32 = 1e-5;

/// The words that shaders bind as `stale_maps`, see lib/blockers.wgsl.
pub(crate) fn stale_words(atlas: &Atlas, lights: &[Light], old: &PreviousTransforms) -> Vec<u32> {
    let sets = atlas.occluders.sets();
    let still = sets.map(|set| (set, 0..set.first_dynamic()));
    let moving = sets.map(|set| (set, set.first_dynamic()..set.bounds.len()));
    let (mut groups, mut boxes, mut triangles, mut first_moving) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for (index, part) in [still, moving].into_iter().enumerate() {
        if index == 1 {
            first_moving = groups.len() as u32;
        }
        let clusters: Vec<(&Clusters, usize)> =
            part.into_iter().flat_map(|(set, range)| range.map(move |cluster| (set, cluster))).collect();
        for group in clusters.chunks(BLOCKER_GROUP as usize) {
            groups.push(enlarged(&Bounds::about(group.iter().map(|(set, cluster)| &set.bounds[*cluster]))));
            boxes.extend(group.iter().map(|(set, cluster)| enlarged(&set.bounds[*cluster])));
            triangles.extend(group.iter().flat_map(|(set, cluster)| padded(set.of_cluster(*cluster))));
            boxes.resize(groups.len() * BLOCKER_GROUP as usize, NOWHERE);
            triangles.resize(boxes.len() * CLUSTER as usize, NONE);
        }
    }
    let parts: Vec<StalePart> = atlas
        .cache
        .stale_parts(lights)
        .zip(&old.rows)
        .map(|(part, &previous_row)| StalePart {
            first_column: part.first[0],
            first_row: part.first[1],
            end_column: part.end[0],
            end_row: part.end[1],
            previous_row,
        })
        .collect();
    let groups_at = StaleMapsHeader::WORDS + parts.len() * StalePart::WORDS;
    let clusters_at = groups_at + groups.len() * OccluderBox::WORDS;
    let header = StaleMapsHeader {
        groups_at: groups_at as u32,
        groups: groups.len() as u32,
        first_moving,
        clusters_at: clusters_at as u32,
        triangles_at: (clusters_at + boxes.len() * OccluderBox::WORDS) as u32,
    };
    [
        bytemuck::cast_slice(&[header]),
        bytemuck::cast_slice(&parts),
        bytemuck::cast_slice(&groups),
        bytemuck::cast_slice(&boxes),
        &triangles,
    ]
    .concat()
}

/// Where no ray comes.
const NOWHERE: OccluderBox = OccluderBox { center: [f32::MAX; 3], half_extent: [0.0; 3] };

fn enlarged(bounds: &Bounds) -> OccluderBox {
    let Bounds { center, half_extent } = *bounds;
    let most = (center.abs() + half_extent).max_element();
    OccluderBox {
        center: center.to_array(),
        half_extent: (half_extent + Vec3::splat(ROUNDING * most)).to_array(),
    }
}

/// A cluster's triangles, as many as a full one has.
fn padded(triangles: &[u32]) -> impl Iterator<Item = u32> {
    triangles.iter().copied().chain(std::iter::repeat(NONE)).take(CLUSTER as usize)
}

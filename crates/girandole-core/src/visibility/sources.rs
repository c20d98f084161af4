//! Surfaces that become receivers together: all static ones, and those of each dynamic object.

use super::groups::{PatchSide, ReceiverGroups};
use super::surfaces::Surfaces;

/// What a tree of receivers is of.
#[derive(Clone, Debug)]
pub(super) enum Root {
    Patch { simple: u32, back: bool },
    Mesh(u32),
}

/// Sides of simple patches, and meshes.
#[derive(Clone, Debug, Default)]
pub(super) struct Sources {
    sides: Vec<PatchSide>,
    meshes: Vec<u32>,
    /// Of the sides, if there are any.
    groups: Option<ReceiverGroups>,
}

impl Sources {
    /// Those of the objects that are accepted.
    pub fn of(surfaces: &Surfaces, accept: impl Fn(u32) -> bool) -> Self {
        let patches =
            (0..surfaces.patches.len() as u32).filter(|&i| accept(surfaces.patches[i as usize].object));
        let meshes =
            (0..surfaces.meshes.len() as u32).filter(|&i| accept(surfaces.meshes[i as usize].object));
        Self::new(surfaces, patches, meshes)
    }

    /// Those of one object; surfaces are in the order of their objects.
    pub fn of_object(surfaces: &Surfaces, object: u32) -> Self {
        let [first, end] = [object, object + 1]
            .map(|object| surfaces.patches.partition_point(|patch| patch.object < object) as u32);
        let [first_mesh, end_mesh] = [object, object + 1]
            .map(|object| surfaces.meshes.partition_point(|mesh| mesh.object < object) as u32);
        Self::new(surfaces, first..end, first_mesh..end_mesh)
    }

    fn new(
        surfaces: &Surfaces,
        patches: impl Iterator<Item = u32>,
        meshes: impl Iterator<Item = u32>,
    ) -> Self {
        let mut sides: Vec<PatchSide> = Vec::new();
        for simple in patches {
            sides.push((simple, false));
            if surfaces.patches[simple as usize].double_sided {
                sides.push((simple, true));
            }
        }
        let groups = (!sides.is_empty()).then(|| ReceiverGroups::new(surfaces, &sides));
        Self { sides, meshes: meshes.collect(), groups }
    }

    /// The roots of their receivers, in order.
    pub fn roots(&self) -> impl ExactSizeIterator<Item = Root> + '_ {
        (0..self.sides.len() + self.meshes.len()).map(|index| self.root(index))
    }

    /// One of them.
    pub fn root(&self, index: usize) -> Root {
        match self.sides.get(index) {
            Some(&(simple, back)) => Root::Patch { simple, back },
            None => Root::Mesh(self.meshes[index - self.sides.len()]),
        }
    }

    /// The patches.
    pub fn patches(&self) -> impl Iterator<Item = u32> + '_ {
        self.sides.iter().filter(|(_, back)| !back).map(|(simple, _)| *simple)
    }

    /// The meshes.
    pub fn meshes(&self) -> &[u32] {
        &self.meshes
    }

    /// The mesh that is all there is.
    pub fn one_mesh(&self) -> Option<u32> {
        match *self.meshes {
            [mesh] if self.sides.is_empty() => Some(mesh),
            _ => None,
        }
    }

    /// The sides of patches.
    pub fn sides(&self) -> &[PatchSide] {
        &self.sides
    }

    /// Their groups, if there are any.
    pub fn groups(&self) -> Option<&ReceiverGroups> {
        self.groups.as_ref()
    }

    /// Area of the patches, both sides of those that have two, m².
    pub fn area(&self, surfaces: &Surfaces) -> f64 {
        self.sides.iter().map(|(simple, _)| surfaces.patches[*simple as usize].area).sum()
    }
}

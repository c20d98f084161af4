//! What names the parts of a scene: indices into its lists that cannot be taken for each other.

use super::{Material, Node, Object, PunctualLight};
use std::fmt;
use std::ops::{Index, IndexMut};

macro_rules! id {
    ($(#[$doc:meta])* $name:ident of $item:ty) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "import", derive(serde::Serialize, serde::Deserialize))]
        pub struct $name(pub u32);

        impl $name {
            /// The index in the scene's list.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl From<usize> for $name {
            fn from(index: usize) -> Self {
                Self(u32::try_from(index).unwrap_or(super::NONE))
            }
        }

        /// The number alone: [fingerprints](super::Fingerprint) are of what is printed.
        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }

        impl Index<$name> for Vec<$item> {
            type Output = $item;

            fn index(&self, id: $name) -> &$item {
                &self[id.index()]
            }
        }

        impl IndexMut<$name> for Vec<$item> {
            fn index_mut(&mut self, id: $name) -> &mut $item {
                &mut self[id.index()]
            }
        }
    };
}

id! {
    /// A node of the transform hierarchy: [`Scene::nodes`](super::Scene::nodes) takes it as an index. An object is not the node that
    /// it is on:
    ///
    /// ```compile_fail,E0308
    /// # use girandole_core::scene::{Mesh, Scene, Transform};
    /// let mut scene = Scene::default();
    /// let object = scene.add_object("ball", Mesh::default(), Transform::IDENTITY);
    /// scene.set_transform(object, Transform::IDENTITY)?;
    /// # Ok::<(), girandole_core::Error>(())
    /// ```
    ///
    /// ```
    /// # use girandole_core::scene::{Mesh, Scene, Transform};
    /// # let mut scene = Scene::default();
    /// # let object = scene.add_object("ball", Mesh::default(), Transform::IDENTITY);
    /// scene.set_transform(scene.objects[object].node, Transform::IDENTITY)?;
    /// # Ok::<(), girandole_core::Error>(())
    /// ```
    NodeId of Node
}

id! {
    /// An object: [`Scene::objects`](super::Scene::objects) takes it as an index. It is never used again for another one.
    ObjectId of Object
}

id! {
    /// A material: [`Scene::materials`](super::Scene::materials) takes it as an index.
    MaterialId of Material
}

id! {
    /// A punctual light: [`Scene::lights`](super::Scene::lights) takes it as an index. It is never used again for another one.
    LightId of PunctualLight
}

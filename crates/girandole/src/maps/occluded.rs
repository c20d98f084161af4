//! Dynamic objects that lights cannot see, as one static polygon hides them: they are drawn into no map of those lights, and what they do
//! changes none.

use girandole_core::scene::{Object, ObjectId, Scene};
use girandole_core::visibility::VisibilityDatabase;

/// For each object and light, whether it is dynamic and hidden as a whole; nothing, where that is not known.
#[derive(Clone, Debug, Default)]
pub(crate) struct OccludedObjects(Vec<Vec<bool>>);

impl OccludedObjects {
    pub fn of(scene: &Scene, database: Option<&VisibilityDatabase>) -> Self {
        let Some(database) = database else { return Self::default() };
        let hidden = |(id, object): (usize, &Object)| {
            if object.dynamic && !object.removed { database.hidden_from(id.into()) } else { Vec::new() }
        };
        Self(scene.objects.iter().enumerate().map(hidden).collect())
    }

    pub fn is_hidden(&self, object: ObjectId, light: usize) -> bool {
        self.0.get(object.0 as usize).and_then(|hidden| hidden.get(light)) == Some(&true)
    }
}

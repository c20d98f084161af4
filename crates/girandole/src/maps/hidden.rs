//! Dynamic objects that lights cannot see, as one static polygon hides them: they are drawn into no map of those lights, and what they do
//! changes none.

use girandole_core::scene::{ObjectId, Scene};
use girandole_core::visibility::VisibilityDatabase;
use std::collections::BTreeMap;

/// For each dynamic object and light, whether the object is hidden as a whole; nothing, where that is not known.
#[derive(Clone, Debug, Default)]
pub(crate) struct HiddenMovers(BTreeMap<ObjectId, Vec<bool>>);

impl HiddenMovers {
    pub fn of(scene: &Scene, database: Option<&VisibilityDatabase>) -> Self {
        let Some(database) = database else { return Self::default() };
        let dynamic = scene.objects.iter().enumerate().filter(|(_, o)| o.dynamic && !o.removed);
        Self(dynamic.map(|(id, _)| (id.into(), database.hidden_from(id.into()))).collect())
    }

    pub fn is_hidden(&self, object: ObjectId, light: usize) -> bool {
        self.0.get(&object).is_some_and(|hidden| hidden[light])
    }
}

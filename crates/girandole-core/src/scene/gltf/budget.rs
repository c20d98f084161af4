//! The memory that an import may take. What a file promises is asked for here before memory is taken, as an estimate of the bytes
//! that the scene will hold, flattened, and of what is held on the way there: a file of a few kilobytes cannot take more than
//! [`LEAST`], whatever it promises, and a large one as much more as its size makes likely.
//!
//! Worked example: a mesh of 2000 vertices and 3000 triangles takes 0.6 MB, and each object that shows it 0.3 MB.

use super::Parsed;
use std::cell::Cell;

/// Bytes that any file may take.
const LEAST: u64 = 3 << 29;
/// Bytes that it may take beyond that for each byte of its own: compressed meshes and pictures become up to so much larger.
const EACH: u64 = 100;

/// A vertex of a mesh: the mesh's arrays, and its part while it is read.
pub(super) const MESH_VERTEX: u64 = 160;
/// A triangle of a mesh: the mesh's and its part's, and what finds duplicates and patches.
pub(super) const MESH_TRIANGLE: u64 = 110;
/// A vertex of an object: flattened, and where the frame of reference is found.
const OBJECT_VERTEX: u64 = 100;
/// A triangle of an object: flattened, and where coincident ones are found.
const OBJECT_TRIANGLE: u64 = 40;
/// An object with its node, but for its mesh.
const OBJECT: u64 = 500;
/// A vertex of a morph target.
pub(super) const MORPHED_VERTEX: u64 = 48;
/// A joint of a vertex.
pub(super) const JOINT: u64 = 16;
/// A value of an animation.
pub(super) const KEY: u64 = 32;
/// A texel that stays.
pub(super) const TEXEL: u64 = 4;
/// A texel while it is decoded.
pub(super) const DECODED_TEXEL: u64 = 16;
/// A `{` of JSON: the largest thing that is made of one.
const JSON_OBJECT: u64 = 1000;
/// A `,` of JSON.
const JSON_ELEMENT: u64 = 40;

/// What is left.
pub(super) struct Budget {
    all: Cell<u64>,
    taken: Cell<u64>,
    is_refused: Cell<bool>,
}

impl Budget {
    /// For a file of so many bytes.
    pub fn new(bytes: usize) -> Self {
        let budget = Self { all: Cell::new(LEAST), taken: Cell::new(0), is_refused: Cell::new(false) };
        budget.grow(bytes);
        budget
    }

    /// Adds what another file of so many bytes, to which the first refers, makes likely.
    pub fn grow(&self, bytes: usize) {
        self.all.set(self.all.get().saturating_add((bytes as u64).saturating_mul(EACH)));
    }

    /// Bytes that are left.
    pub fn left(&self) -> u64 {
        self.all.get().saturating_sub(self.taken.get())
    }

    /// Takes so many elements of this size.
    pub fn take(&self, count: usize, each: u64) -> Parsed<()> {
        let taken = self.taken.get().saturating_add((count as u64).saturating_mul(each));
        if taken > self.all.get() {
            return Err(self.refuse(format!(
                "it takes more than {} MiB of memory, many times what its size makes likely; simplify it or take parts away",
                self.all.get() >> 20
            )));
        }
        self.taken.set(taken);
        Ok(())
    }

    /// Gives back what was taken for a while.
    pub fn give_back(&self, count: usize, each: u64) {
        self.taken.set(self.taken.get().saturating_sub((count as u64).saturating_mul(each)));
    }

    /// Takes what the parser will make of a JSON text.
    pub fn take_json(&self, text: &[u8]) -> Parsed<()> {
        let count = |wanted: u8| text.iter().filter(|&&byte| byte == wanted).count();
        self.take(text.len(), 2)?;
        self.take(count(b'{'), JSON_OBJECT)?;
        self.take(count(b','), JSON_ELEMENT)
    }

    /// Takes objects of so many triangles and vertices together.
    pub fn take_objects(&self, count: usize, triangles: usize, vertices: usize) -> Parsed<()> {
        self.take(count, OBJECT)?;
        self.take(triangles, OBJECT_TRIANGLE)?;
        self.take(vertices, OBJECT_VERTEX)
    }

    /// Notes that the file as a whole is refused for this reason: it promises what it does not hold, or too much.
    pub fn refuse(&self, reason: String) -> String {
        self.is_refused.set(true);
        reason
    }

    /// Whether it is.
    pub fn is_refused(&self) -> bool {
        self.is_refused.get()
    }
}

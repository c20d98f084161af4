// Elements of multipass shading (Barczak §4.3.5): sets of receivers with sets of lights. In `elements`, first six words for
// each: where its members are and how many, where its lights are and how many, its vertices in a pass, and the vertices
// of all elements before it. A member is a leaf, and the chunks of the element's leaves before it.

const ELEMENT_WORDS = 6u;

struct MultipassParams {
  elements: u32,
  lights_per_pass: u32,
  lights_in_all: u32,
  padding: u32,
}

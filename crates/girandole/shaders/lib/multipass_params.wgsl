// Elements of multipass shading (Barczak §4.3.5): sets of receivers with sets of lights. `elements` holds them as words:
// first all of them as `Element`, then their members as `Member`, and the indices of their lights.

struct MultipassParams {
  elements: u32,
  lights_per_pass: u32,
  lights_in_all: u32,
  padding: u32,
}

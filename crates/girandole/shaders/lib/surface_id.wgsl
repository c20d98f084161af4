// The id of the surface that a pixel shows, 24 bits: equal for pixels of one plane or of one curved object; 0 = nothing.

const CURVED = 0x800000u; // normals vary
const SHINY = 0x400000u; // its reflection cannot be interpolated

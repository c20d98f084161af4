// Adds what is sent towards the ends of mirrored rays.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var irradiance: texture_2d<f32>;
@group(2) @binding(2) var directional: texture_2d<f32>;

override HAS_SPECULAR: bool; // whether any material has a specular lobe

@compute @workgroup_size(TILE, TILE)
fn add_mirrored(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let id = textureLoad(triangle_ids, pixel, 0).x;
  if id == 0u { return; }
  let at = mirror_image_at(pixel);
  let m = materials[triangles[id - 1u].material];
  let hit = with_coordinates(pixel, hit_at(pixel, id - 1u));
  var diffuse = diffuse_material(triangles[id - 1u].material);
  if HAS_TEXTURES { diffuse = DiffuseMaterial(diffuse.material, reflection(hit, m).albedo / PI, m.emission * emission_factor(hit, m)); }
  let point = vec2u(pixel.x, pixel.y - frame.band.x);
  var other = vec4f(0.0);
  if HAS_SPECULAR { other = textureLoad(directional, point, 0); }
  let sent = radiance_of(diffuse, textureLoad(irradiance, point, 0).xyz, other) + environment_of(hit, m, -other.w);
  mirror_image[at] += vec4f(mirror_image[at + 1u].xyz * sent, 0.0);
}

// core: image::luminance. Relative luminance of linear Rec. 709.
fn luminance(rgb: vec3f) -> f32 { return dot(rgb, vec3f(0.2126, 0.7152, 0.0722)); }

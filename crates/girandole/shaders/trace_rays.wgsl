// Rays of the caller's.

struct CallersRay { origin: vec3f, t_max: f32, direction: vec3f, ignored: u32 }

@group(2) @binding(0) var<storage, read> callers_rays: array<CallersRay>;
@group(2) @binding(1) var<storage, read_write> hits: array<RayHit>;

fn trace_callers(invocation: vec3u, is_any: bool) {
  let index = invocation.y * GROUPS_PER_ROW * WORKGROUP + invocation.x;
  if index >= arrayLength(&callers_rays) { return; }
  let ray = callers_rays[index];
  hits[index] = trace_ray(ray.origin, ray.direction, ray.t_max, ray.ignored, is_any);
}

@compute @workgroup_size(WORKGROUP)
fn closest_hits(@builtin(global_invocation_id) invocation: vec3u) { trace_callers(invocation, false); }

@compute @workgroup_size(WORKGROUP)
fn any_hits(@builtin(global_invocation_id) invocation: vec3u) { trace_callers(invocation, true); }

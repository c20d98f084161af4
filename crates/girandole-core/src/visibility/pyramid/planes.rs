//! The planes of a pyramid, and whether receiver and light face each other.

use super::{Facing, Plane, Pyramid, SphereAxis};
use crate::visibility::boxes::SweptBox;
use crate::visibility::clusters::Cluster;
use crate::visibility::groups::ReceiverGroup;
use crate::visibility::primitives::{ROUNDING, Tolerance, box_extent};
use crate::visibility::shapes::{Apex, Hull, MAX_CORNERS, PatchPlane, Shape};
use crate::visibility::surfaces::MAX_TILT;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// Radians from their common axis within which receivers face about the same way.
const MAX_SPREAD: f64 = 1.0;

impl Pyramid {
    /// Sets the planes for a pair, unless no point of the receiver and the light face each other.
    pub fn set(&mut self, apex: &Apex, shape: Shape, tolerance: &Tolerance) -> Facing {
        self.needs_planes = true;
        self.set_shape(apex, shape, tolerance)
    }

    /// How many of the receiver's points and the light face each other, where there is nothing to be tested.
    pub fn facing(&mut self, apex: &Apex, shape: Shape, tolerance: &Tolerance) -> Facing {
        self.needs_planes = false;
        self.set_shape(apex, shape, tolerance)
    }

    fn set_shape(&mut self, apex: &Apex, shape: Shape, tolerance: &Tolerance) -> Facing {
        self.bundle.count = 0;
        self.slabs.count = 0;
        (self.swept, self.sphere_axis, self.axis) = (None, None, None);
        (self.apex, self.tolerance, self.count) = (*apex, *tolerance, 0);
        match shape {
            Shape::Patch { corners, plane } => self.set_patch(apex, corners, &plane, tolerance),
            Shape::Cluster(cluster) => {
                let room = tolerance.ray_offset + tolerance.coordinate;
                if self.needs_planes {
                    let bounds = [cluster.low - room, cluster.high + room];
                    self.swept = Some(SweptBox::new(apex, bounds, tolerance.side));
                }
                self.set_cluster(apex, cluster, room, tolerance)
            }
            Shape::Group(group) => self.set_group(apex, group, tolerance),
        }
    }

    fn push(&mut self, normal: DVec3, offset: f64, margin: f64) {
        self.planes[self.count] = Plane { normal, offset, margin };
        self.count += 1;
    }

    fn set_patch(&mut self, apex: &Apex, corners: &[DVec3], plane: &PatchPlane, t: &Tolerance) -> Facing {
        let PatchPlane { normal, offset, tilt } = *plane;
        let n = corners.len().min(MAX_CORNERS);
        let mut origins = [DVec3::ZERO; MAX_CORNERS];
        let mut floor = t.ray_offset - t.coordinate;
        let mut ceiling = None;
        let mut facing = Facing::Some;
        if apex.finite {
            // Behind the patch, or the patch behind the light?
            let (mut reach, mut low, mut high): (f64, f64, f64) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
            for corner in &corners[..n] {
                let away = *corner - apex.position;
                let z = apex.normal.dot(away);
                reach = reach.max(away.length_squared());
                (low, high) = (low.min(z), high.max(z));
            }
            reach = reach.sqrt();
            let height = plane.height(apex.position);
            let uncertainty = t.coordinate + ROUNDING * reach;
            if height < -(uncertainty + tilt * reach) || high <= -uncertainty {
                return Facing::None;
            }
            if height >= 0.0 && low >= 0.0 {
                facing = Facing::All;
            }
            floor = floor.min(height);
            ceiling =
                Some((low.max(-uncertainty) + t.ray_offset * normal.dot(apex.normal).min(0.0)).min(0.0));
        } else {
            let cosine = -normal.dot(apex.normal);
            if cosine < -(2.0 * ROUNDING + tilt) {
                return Facing::None;
            }
            if cosine < 0.0 {
                floor = f64::NEG_INFINITY;
            } else {
                facing = Facing::All;
            }
        }
        if !self.needs_planes {
            return facing;
        }
        let mut centroid = DVec3::ZERO;
        for (to, corner) in origins.iter_mut().zip(&corners[..n]) {
            *to = *corner + normal * t.ray_offset;
            centroid += *to;
        }
        centroid /= n as f64;
        self.hull = Hull::Polygon(origins, n, normal * -t.less);
        // Sides: any direction is valid, as the offset is the hull's.
        for i in 0..n {
            let (a, b) = (origins[i], origins[(i + 1) % n]);
            let (edge, towards) = (b - a, apex.towards(a));
            let mut side = edge.cross(towards);
            let squared = side.length_squared();
            if squared.is_nan() || squared <= 1e-18 * edge.length_squared() * towards.length_squared() {
                continue;
            }
            side *= squared.sqrt().recip();
            if side.dot(centroid - a) < 0.0 {
                side = -side;
            }
            let mut least = if apex.finite { side.dot(apex.position) } else { f64::INFINITY };
            for corner in &origins[..n] {
                least = least.min(side.dot(*corner));
            }
            self.push(side, least, t.side);
        }
        if floor > f64::NEG_INFINITY {
            self.push(normal, offset + floor, t.coordinate);
        }
        if let Some(z) = ceiling {
            self.push(apex.normal, apex.normal.dot(apex.position) + z, t.coordinate);
        }
        facing
    }

    /// `room` is how far the ray origins may lie outside the cluster's bounds.
    fn set_cluster(&mut self, apex: &Apex, cluster: &Cluster, room: f64, t: &Tolerance) -> Facing {
        let (center, radius) = (cluster.center, cluster.radius + room);
        let bounds = [cluster.low - room, cluster.high + room];
        let away = if apex.finite { center - apex.position } else { apex.normal };
        let distance = away.length();
        let sine = if apex.finite { (radius / distance).min(1.0) } else { 0.0 };
        let Some(mut facing) = facing_of(cluster, -away / distance, sine) else { return Facing::None };
        self.hull = Hull::Sphere(center, radius, bounds);
        if apex.finite {
            let (low, high) = box_extent(apex.normal, bounds);
            let plane = apex.normal.dot(apex.position);
            let z = apex.normal.dot(center) - plane;
            let (low, high) = ((low - plane).max(z - radius), (high - plane).min(z + radius));
            let uncertainty = t.coordinate + ROUNDING * (distance + radius);
            if high <= -uncertainty {
                return Facing::None;
            }
            if low < 0.0 {
                facing = Facing::Some;
            }
            self.push(apex.normal, plane + low.max(-uncertainty - t.ray_offset).min(0.0), t.coordinate);
            if distance <= radius {
                // The light lies within the sphere: the box that encloses both.
                let (low, high) = (bounds[0].min(apex.position), bounds[1].max(apex.position));
                for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                    self.push(axis, axis.dot(low), t.side);
                    self.push(-axis, -axis.dot(high), t.side);
                }
                return facing;
            }
        }
        if !self.needs_planes {
            return facing;
        }
        let axis = away / distance;
        let sphere_axis = SphereAxis { direction: axis, sine, cosine: (1.0 - sine * sine).sqrt() };
        self.sphere_axis = Some(sphere_axis);
        let across = axis.any_orthonormal_vector();
        for across in [across, axis.cross(across)] {
            for across in [across, -across] {
                let (normal, offset) = self.tangent(&sphere_axis, across);
                self.push(normal, offset, t.side);
            }
        }
        let (_, far) = box_extent(axis, bounds);
        self.push(-axis, -far.min(axis.dot(center) + radius), t.side);
        facing
    }

    /// The plane through the light that touches the sphere on the side opposite to `across` (unit, perpendicular to
    /// the axis).
    pub(super) fn tangent(&self, axis: &SphereAxis, across: DVec3) -> (DVec3, f64) {
        let Hull::Sphere(center, radius, _) = self.hull else { return (across, f64::NEG_INFINITY) };
        if !self.apex.finite {
            return (across, across.dot(center) - radius);
        }
        let normal = across * axis.cosine + axis.direction * axis.sine;
        (normal, normal.dot(self.apex.position).min(normal.dot(center) - radius))
    }

    /// Like a cluster; if its members face about the same way, a plane below the lowest of them bounds the pyramid too.
    fn set_group(&mut self, apex: &Apex, group: &ReceiverGroup, t: &Tolerance) -> Facing {
        let Cluster { center, radius, axis, angle, .. } = group.bounds;
        let facing = self.set_cluster(apex, &group.bounds, t.coordinate, t);
        if facing == Facing::None || angle > MAX_SPREAD {
            return facing;
        }
        let mut floor = group.floor + t.ray_offset * libm::cos(angle) - t.coordinate;
        if apex.finite {
            // Behind all of them, whichever of their normals counts?
            let reach = apex.position.distance(center) + radius;
            let height = axis.dot(apex.position);
            if height < group.floor - (t.coordinate + (ROUNDING + MAX_TILT + angle) * reach) {
                return Facing::None;
            }
            floor = floor.min(height);
        } else if axis.dot(apex.normal) > 0.0 {
            return facing;
        }
        self.push(axis, floor, t.coordinate);
        facing
    }
}

/// How many of a cluster's triangles face a light in this direction; `sine` is of the angle that the cluster appears under.
/// `None` where all face away from all of the light's directions.
fn facing_of(cluster: &Cluster, direction: DVec3, sine: f64) -> Option<Facing> {
    let (angle_sine, angle_cosine) = cluster.angle_sine_cosine;
    let spread_cosine = (1.0 - sine * sine).sqrt();
    // Of both angles together. From a right angle on some may face the light and some may not, whatever its direction.
    let both_cosine = angle_cosine * spread_cosine - angle_sine * sine;
    if cluster.angle >= FRAC_PI_2 || both_cosine <= 0.0 {
        return Some(Facing::Some);
    }
    let both_sine = angle_sine * spread_cosine + angle_cosine * sine;
    let turned_cosine = cluster.axis.dot(direction);
    if turned_cosine <= -both_sine {
        return None;
    }
    match turned_cosine > both_sine {
        true => Some(Facing::All),
        false => Some(Facing::Some),
    }
}

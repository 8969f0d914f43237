//! Where the picture is taken from: a camera, its pixel rays, and the same rays as seen by each volume's index space.

use bregma_field::{Bounds, Ray, WorldPoint};
use glam::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

/// How depth becomes size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Projection {
    /// Vertical field of view in degrees.
    Perspective {
        /// Angle between the top and the bottom of the picture.
        fov_deg: f64,
    },
    /// Height of the view in mm.
    Orthographic {
        /// Distance between the top and the bottom of the picture.
        height_mm: f64,
    },
}

/// A pinhole or orthographic camera; LPS mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Where the viewer stands.
    pub eye_mm: DVec3,
    /// What the centre of the picture shows.
    pub target_mm: DVec3,
    /// A direction that points up in the picture; need not be perpendicular to the view.
    pub up: DVec3,
    /// Perspective or orthographic.
    pub projection: Projection,
}

/// Default vertical field of view.
pub const FOV_DEG: f64 = 30.0;

/// The picture's axes in the world, unit vectors.
#[derive(Clone, Copy, Debug)]
pub struct Basis {
    /// To the right in the picture.
    pub right: DVec3,
    /// Up in the picture.
    pub up: DVec3,
    /// Into the picture.
    pub forward: DVec3,
}

/// A point that moves linearly with the pixel: `base + x·per_x + y·per_y`.
#[derive(Clone, Copy, Debug)]
pub struct PixelAffine {
    /// Value at pixel (0, 0).
    pub base: DVec3,
    /// Change for one pixel to the right.
    pub per_x: DVec3,
    /// Change for one pixel down.
    pub per_y: DVec3,
}

impl PixelAffine {
    /// The value at pixel (x, y).
    pub fn at(&self, x: u32, y: u32) -> DVec3 {
        self.base + f64::from(x) * self.per_x + f64::from(y) * self.per_y
    }
}

/// All rays of a picture: pixel (x, y) sees `origin(x, y) + s·direction(x, y)`, s ≥ 0. Directions are not unit: s is the
/// depth along the view axis in mm, the same for every volume, and `t = s·|direction|` in the world.
#[derive(Clone, Copy, Debug)]
pub struct PixelRays {
    /// Where s is 0.
    pub origin: PixelAffine,
    /// Change of position per mm of depth.
    pub direction: PixelAffine,
}

/// A picture's pixels, and which point of each is looked through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Raster {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// From a pixel's middle to the right and down, in pixels.
    pub point_px: [f64; 2],
}

impl Raster {
    /// Through the middles.
    pub fn new(size: [u32; 2]) -> Self {
        Self { size, point_px: [0.0; 2] }
    }
}

/// Point number `sample` of a pixel, from its middle to the right and down, in pixels, −½ to ½. Number 0 is the middle, and the first of them,
/// however many, lie evenly: of any 2ⁿ that begin at a multiple of it, one is in each of 2ⁿ equal boxes of any shape ((0,2)-sequence of Sobol' 1967, as
/// Kollig and Keller 2002 compute it, moved by half a pixel).
pub fn point_in_pixel(sample: u32) -> [f64; 2] {
    let (mut second, mut column, mut rest) = (0_u32, 1_u32 << 31, sample);
    while rest > 0 {
        second ^= if rest & 1 == 1 { column } else { 0 };
        (column, rest) = (column ^ column >> 1, rest >> 1);
    }
    // As signed numbers, the upper half lies before the middle.
    [sample.reverse_bits(), second].map(|bits| f64::from(bits.cast_signed()) / 4_294_967_296.0)
}

impl PixelRays {
    /// The same rays through another point of each pixel.
    pub(crate) fn through(&self, [x, y]: [f64; 2]) -> Self {
        let moved = |a: PixelAffine| PixelAffine { base: a.base + x * a.per_x + y * a.per_y, ..a };
        Self { origin: moved(self.origin), direction: moved(self.direction) }
    }

    /// The same rays with s = 0 moved to depth `s_mm`, so that positions near there lose no digits to cancellation.
    pub fn rebased(&self, s_mm: f64) -> Self {
        let (o, d) = (self.origin, self.direction);
        let origin = PixelAffine { base: o.base + s_mm * d.base, per_x: o.per_x + s_mm * d.per_x, per_y: o.per_y + s_mm * d.per_y };
        Self { origin, direction: d }
    }

    /// The same rays in the space that `map` leads to; the parameter s stays what it was.
    pub fn mapped(&self, map: &DAffine3) -> Self {
        let vector = |v: DVec3| map.transform_vector3(v);
        let (o, d) = (self.origin, self.direction);
        let origin = PixelAffine { base: map.transform_point3(o.base), per_x: vector(o.per_x), per_y: vector(o.per_y) };
        Self { origin, direction: PixelAffine { base: vector(d.base), per_x: vector(d.per_x), per_y: vector(d.per_y) } }
    }
}

impl Camera {
    /// The orbit of `bounds`: azimuth 0 looks at the face (from anterior), 90 at the left side; elevation raises the eye.
    pub fn orbit(bounds: &Bounds, azimuth_deg: f64, elevation_deg: f64) -> Self {
        Self::orbit_with_fov(bounds, azimuth_deg, elevation_deg, FOV_DEG)
    }

    /// The orbit at the distance from which a vertical field of view of `fov_deg` just holds `bounds`.
    pub fn orbit_with_fov(bounds: &Bounds, azimuth_deg: f64, elevation_deg: f64, fov_deg: f64) -> Self {
        let (sin_az, cos_az) = azimuth_deg.to_radians().sin_cos();
        let (sin_el, cos_el) = elevation_deg.to_radians().sin_cos();
        let distance = bounds.radius_mm / (fov_deg / 2.0).to_radians().sin();
        let eye_mm = bounds.centre_mm + distance * DVec3::new(cos_el * sin_az, -cos_el * cos_az, sin_el);
        Self { eye_mm, target_mm: bounds.centre_mm, up: DVec3::Z, projection: Projection::Perspective { fov_deg } }
    }

    /// The orbit at which `points` just fill a picture that is `aspect` times as wide as it is high, but for a rim of a twentieth; of none,
    /// the orbit of nothing.
    ///
    /// ```text
    /// a point at x across and z behind the target's plane is seen where |x − c| ≤ t·(d + z): with t, the tangent of half the view,
    ///     d = max over both axes of (max(x − t·z) − min(x + t·z)) / 2t,   c = (max(x − t·z) + min(x + t·z)) / 2
    /// ```
    pub fn framing(points: &[DVec3], azimuth_deg: f64, elevation_deg: f64, aspect: f64) -> Self {
        let unit = Bounds { centre_mm: points.first().copied().unwrap_or_default(), radius_mm: 1.0 };
        Self::orbit(&unit, azimuth_deg, elevation_deg).framed(points, aspect)
    }

    /// The same from where this perspective camera looks.
    pub fn framed(&self, points: &[DVec3], aspect: f64) -> Self {
        let mut camera = *self;
        let Basis { right, up, forward } = camera.basis();
        let Some(first) = points.first().copied() else { return camera };
        let along = |axis: DVec3| points.iter().map(move |p| (*p - first).dot(axis));
        // The distance that an axis asks for, and the middle of what is seen along it.
        let fitted = |axis: DVec3, tangent: f64| {
            let farthest =
                |sign: f64| along(axis).zip(along(forward)).map(|(x, z)| sign * x - tangent * z).fold(f64::NEG_INFINITY, f64::max);
            let (most, least) = (farthest(1.0), -farthest(-1.0));
            ((most - least) / (2.0 * tangent), (most + least) / 2.0)
        };
        let half = 0.95 * camera.half_height();
        let [(wide, x), (high, y)] = [fitted(right, half * aspect), fitted(up, half)];
        let (nearest, farthest) = along(forward).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        let foot = first + x * right + y * up;
        // No point lies on the eye's own plane.
        camera.eye_mm = foot - wide.max(high).max(1e-3 - nearest) * forward;
        camera.target_mm = foot + 0.5 * (nearest + farthest) * forward;
        camera
    }

    /// The picture's axes. A view along `up` takes another axis for it; an eye on its target looks from anterior.
    pub fn basis(&self) -> Basis {
        let forward = (self.target_mm - self.eye_mm).try_normalize().unwrap_or(DVec3::Y);
        let right = [self.up, DVec3::NEG_Y, DVec3::Z]
            .iter()
            // Within 1e-6 of parallel the cross product has lost half its digits: another axis is as good.
            .find_map(|up| {
                forward.cross(up.normalize_or_zero()).try_normalize().filter(|_| forward.cross(up.normalize_or_zero()).length() > 1e-6)
            })
            .unwrap_or(DVec3::X);
        Basis { right, up: right.cross(forward), forward }
    }

    /// The same view along parallel rays, that shows its target as large.
    pub fn parallel(&self) -> Self {
        let distance_mm = match self.projection {
            Projection::Perspective { .. } => (self.target_mm - self.eye_mm).length(),
            Projection::Orthographic { .. } => 1.0,
        };
        // An eye on its target sees nothing; at a millionth of a mm it sees as little.
        let height_mm = 2.0 * self.half_height() * distance_mm.max(1e-6);
        Self { projection: Projection::Orthographic { height_mm }, ..*self }
    }

    /// Half the height of the picture: per mm of depth (perspective) or in mm (orthographic).
    pub(crate) fn half_height(&self) -> f64 {
        match self.projection {
            Projection::Perspective { fov_deg } => (fov_deg.to_radians() / 2.0).tan(),
            Projection::Orthographic { height_mm } => height_mm / 2.0,
        }
    }

    /// All pixel rays of a picture of `width`×`height`, in the world. Pixel (x, y), y down, looks along
    /// `forward + (2(x+½)/W − 1)·h·W/H·right + (1 − 2(y+½)/H)·h·up`, h = tan(fov/2).
    pub fn pixel_rays(&self, width: u32, height: u32) -> PixelRays {
        let Basis { right, up, forward } = self.basis();
        let (w, h, half) = (f64::from(width), f64::from(height), self.half_height());
        let (per_x, per_y) = (right * (2.0 * half / h), up * (-2.0 * half / h));
        let corner = right * (half * w / h * (1.0 / w - 1.0)) + up * (half * (1.0 - 1.0 / h));
        let still = |base| PixelAffine { base, per_x: DVec3::ZERO, per_y: DVec3::ZERO };
        match self.projection {
            Projection::Perspective { .. } => {
                PixelRays { origin: still(self.eye_mm), direction: PixelAffine { base: forward + corner, per_x, per_y } }
            }
            Projection::Orthographic { .. } => {
                PixelRays { origin: PixelAffine { base: self.eye_mm + corner, per_x, per_y }, direction: still(forward) }
            }
        }
    }

    /// The ray of pixel (x, y), for real-valued x and y measured from the centre of pixel (0, 0).
    pub fn ray(&self, x: f64, y: f64, width: u32, height: u32) -> Ray {
        let rays = self.pixel_rays(width, height);
        let at = |a: &PixelAffine| a.base + x * a.per_x + y * a.per_y;
        Ray { origin: WorldPoint(at(&rays.origin)), direction: at(&rays.direction).normalize() }
    }

    /// Where a point of the world appears, in the pixels of [`Camera::ray`]; `None` when it is not in front of the eye.
    pub fn project(&self, p: WorldPoint, width: u32, height: u32) -> Option<(f64, f64)> {
        let Basis { right, up, forward } = self.basis();
        let v = p.0 - self.eye_mm;
        let depth = v.dot(forward);
        let scale = match self.projection {
            Projection::Perspective { .. } => depth,
            Projection::Orthographic { .. } => 1.0,
        };
        let (w, h, half) = (f64::from(width), f64::from(height), self.half_height());
        let x = (v.dot(right) / (scale * half * w / h) + 1.0) * w / 2.0 - 0.5;
        let y = (1.0 - v.dot(up) / (scale * half)) * h / 2.0 - 0.5;
        (depth > 0.0).then_some((x, y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds { centre_mm: DVec3::new(3.0, -2.0, 7.0), radius_mm: 50.0 };

    #[test]
    fn azimuth_0_looks_at_the_face_with_the_left_side_on_the_right() {
        // Fails if LPS is mirrored anywhere between camera and picture: the classic error of this field.
        let camera = Camera::orbit(&BOUNDS, 0.0, 0.0);
        let Basis { right, up, forward } = camera.basis();
        assert!((forward - DVec3::Y).length() < 1e-12 && (up - DVec3::Z).length() < 1e-12);
        assert!((right - DVec3::X).length() < 1e-12, "the patient's left (+x) is on the viewer's right");
    }

    #[test]
    fn framed_points_fill_the_picture_but_for_its_rim() {
        // Fails if a point lies outside, or the picture has more room around them than its rim.
        let points: Vec<DVec3> = (0..60).map(f64::from).map(|n| DVec3::new(90.0 * n.sin(), 30.0 * (1.7 * n).cos(), 2.0 * n)).collect();
        for (azimuth_deg, elevation_deg, [w, h]) in [(35.0, 10.0, [400, 500]), (0.0, 90.0, [800, 300]), (200.0, -40.0, [64, 64])] {
            let camera = Camera::framing(&points, azimuth_deg, elevation_deg, f64::from(w) / f64::from(h));
            let [x, y] = [f64::from(w), f64::from(h)].map(|n| n / 2.0);
            let rim = points.iter().map(|p| camera.project(WorldPoint(*p), w, h).unwrap());
            let farthest = rim.map(|(px, py)| ((px + 0.5 - x) / x).abs().max(((py + 0.5 - y) / y).abs())).fold(0.0, f64::max);
            assert!((farthest - 0.95).abs() < 1e-9, "{farthest}");
        }
        assert!(Camera::framing(&[], 0.0, 0.0, 1.0).basis().forward.is_finite());
    }

    #[test]
    fn pixel_rays_follow_the_agreed_formula_and_project_back() {
        for projection in [Projection::Perspective { fov_deg: 40.0 }, Projection::Orthographic { height_mm: 80.0 }] {
            let camera = Camera { projection, ..Camera::orbit(&BOUNDS, 30.0, 20.0) };
            let (w, h) = (320, 200);
            let rays = camera.pixel_rays(w, h).rebased(10.0);
            for (x, y) in [(0, 0), (319, 199), (17, 101)] {
                let ray = camera.ray(f64::from(x), f64::from(y), w, h);
                let p = rays.origin.at(x, y) + 55.0 * rays.direction.at(x, y);
                assert!((p - ray.origin.0).cross(ray.direction).length() < 1e-10, "{projection:?} {x} {y}");
                let (px, py) = camera.project(WorldPoint(p), w, h).unwrap();
                assert!((px - f64::from(x)).abs() < 1e-9 && (py - f64::from(y)).abs() < 1e-9);
            }
            let Basis { right, up, forward } = camera.basis();
            if let Projection::Perspective { fov_deg } = projection {
                let tan = (fov_deg / 2.0_f64).to_radians().tan();
                let expected = forward + (2.0 * 17.5 / 320.0 - 1.0) * tan * 1.6 * right + (1.0 - 2.0 * 101.5 / 200.0) * tan * up;
                assert!((camera.ray(17.0, 101.0, w, h).direction - expected.normalize()).length() < 1e-12);
            }
        }
    }

    #[test]
    fn looking_straight_down_still_has_an_up() {
        let basis = Camera::orbit(&BOUNDS, 0.0, 90.0).basis();
        assert!(basis.up.is_finite() && (basis.up.length() - 1.0).abs() < 1e-12);
        assert!((basis.up - DVec3::NEG_Y).length() < 1e-6, "from above, the face is up: {:?}", basis.up);
    }
}

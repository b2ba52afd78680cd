//! The radiance field that a panorama with depth has captured: every real surface already carries all real light, lights
//! what it faces, and blocks what is behind it.

#[cfg(feature = "gpu")]
pub(crate) mod gpu;
mod hidden;
mod infinity;
mod irradiance;
mod lamps;
mod mirrors;

use super::{Environment, LightSample, LightTarget, RealHit, RealWorld, proxy::reflectance_from};
use crate::bvh::Ray;
use crate::objects::Ball;
use crate::prt::{DepthField, FieldHit, FieldOptions, HiddenSide};
use glam::{Quat, Vec2, Vec3};
use irradiance::IrradianceMap;
use lamps::Lamps;
use mirrors::Mirrors;
use pano_core::{color, distribution::SphereDistribution, image::Image, image::RadianceImage, progress::Progress, sphere};
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;

/// How a captured field is prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CapturedOptions {
    /// How depth becomes a surface.
    pub field: FieldOptions,
    /// Largest diffuse reflectance, [0, 1]; what a surface sends out beyond that is its own emission, which no shadow
    /// touches. .9 is white paper; lower protects more lamps and weakens shadows on white surfaces.
    pub reflectance_cap: f32,
    /// Columns of the map of irradiance from which reflectance is read (rows: half), near the objects; elsewhere a quarter.
    /// Higher follows existing shadows more closely; cost grows with the square. 0: no map, and every surface is black.
    pub irradiance_width: usize,
    /// Pairs of rays per texel of that map. The noise of the irradiance falls with the root and is filtered afterwards.
    pub irradiance_samples: u32,
    /// Pairs of rays by which the light on a side that the panorama has not seen is estimated, each time a ray meets one. One
    /// is as good as more for diffuse surfaces, whose rays are many; mirrors show the noise. 0: it has the colour of its front.
    pub hidden_samples: u32,
    /// Whether objects see in surfaces that mirror what lies in the mirror direction of their own rays, see
    /// [`RealWorld::sent_back`]; else what the panorama saw in them. It needs `irradiance_width`.
    pub mirrors: bool,
    /// Changes the random numbers of all of these. The frames of a film have the same, or real surfaces would flicker.
    pub seed: u32,
}

impl Default for CapturedOptions {
    fn default() -> Self {
        Self {
            field: FieldOptions::default(),
            reflectance_cap: 0.9,
            irradiance_width: 512,
            irradiance_samples: 8,
            hidden_samples: 1,
            mirrors: true,
            seed: 0,
        }
    }
}

/// [`RealHit::surface`] of what the panorama shows.
const SEEN: u32 = 0;
/// [`RealHit::surface`] of a side that is only assumed; light is not aimed at it and it has no reflectance of its own.
const HIDDEN_SIDE: u32 = 1;
/// Columns of the table that light is sampled from; finer ones miss the cache and gain nothing measurable.
const LIGHT_TABLE_WIDTH: usize = 512;
/// The map of irradiance that only back faces are read from has one in this many of its samples.
const FIRST_MAP: u32 = 4;
/// Rays that start nearer than this to the capture point are the panorama's own; metres.
pub(super) const AT_CAPTURE: f32 = 1e-4;
/// How far above its surface a ray starts, as a share of the distance to the capture point. The surface meets itself
/// exactly, so this only has to cover rounding.
pub(super) const LEAVE: f32 = 5e-4;

/// How bright a back face is that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Back {
    /// As its front.
    AsFront,
    /// As its front's material is in the light that it faces itself.
    Lit,
}

/// A panorama with depth as a world of rays.
#[derive(Clone, Debug)]
pub struct CapturedWorld {
    radiance: Arc<RadianceImage>,
    field: DepthField,
    world_from_pano: Quat,
    capture: Vec3,
    light: Option<SphereDistribution>,
    lamps: Lamps,
    /// Which texel infinity shows, also where the panorama shows something else; `None`: the panorama has depth everywhere.
    infinity: Option<Image<u32>>,
    irradiance: Option<IrradianceMap>,
    /// Where surfaces mirror, once irradiance is known.
    mirrors: Option<Mirrors>,
    cap: f32,
    hidden_samples: u32,
    seed: u32,
}

impl CapturedWorld {
    /// From an equirectangular picture in Pano's convention and its depth (distance along the ray in metres, not finite
    /// where nothing is; it may have another size), captured at `capture` and turned into the world by `world_from_pano`.
    ///
    /// `objects` are the bounds of what will be put there: irradiance is measured finely where they can change it.
    ///
    /// `None` if `progress` cancels.
    pub fn new(
        radiance: Arc<RadianceImage>,
        depth: &Image<f32>,
        world_from_pano: Quat,
        capture: Vec3,
        objects: &[Ball],
        options: &CapturedOptions,
        progress: &dyn Progress,
    ) -> Option<Self> {
        let luminance = reduced_luminance(&radiance);
        let field = DepthField::new(depth, &options.field);
        let mut world = Self {
            lamps: if options.field.back_faces { Lamps::find(&luminance, &field) } else { Lamps::default() },
            field,
            infinity: infinity::what_infinity_shows(radiance.size(), depth),
            radiance,
            world_from_pano,
            capture,
            light: SphereDistribution::new(&luminance),
            irradiance: None,
            mirrors: None,
            cap: options.reflectance_cap,
            hidden_samples: options.hidden_samples,
            seed: options.seed,
        };
        if options.irradiance_width > 0 {
            let coarse = |world: &Self, samples| IrradianceMap::coarse(world, options.irradiance_width, samples, progress);
            let samples = options.irradiance_samples;
            if options.field.back_faces {
                // What back faces send out needs a map, and the map needs them: of the first little is left in the second.
                world.irradiance = Some(coarse(&world, samples.div_ceil(FIRST_MAP))?);
            }
            world.irradiance = Some(coarse(&world, samples)?.refined(&world, objects, options, progress)?);
            if options.mirrors {
                world.mirrors = mirrors::find(&world, options.irradiance_width);
            }
        }
        Some(world)
    }

    /// Irradiance at a hit.
    pub fn irradiance(&self, hit: &RealHit) -> Vec3 {
        self.irradiance
            .as_ref()
            .map_or(Vec3::ZERO, |map| map.look(self.to_pano(hit.position), self.world_from_pano.inverse() * hit.normal))
    }

    fn to_pano(&self, position: Vec3) -> Vec3 {
        self.world_from_pano.inverse() * (position - self.capture)
    }

    /// The ray's origin and direction in the panorama's frame.
    fn ray_to_pano(&self, ray: &Ray) -> (Vec3, Vec3) {
        (self.to_pano(ray.origin), self.world_from_pano.inverse() * ray.direction)
    }

    /// The surface that the panorama itself shows along `direction` (panorama frame).
    fn look(&self, direction: Vec3) -> Option<RealHit> {
        let radiance =
            |hit| RealHit { radiance: Some(sphere::bilinear(&self.radiance, sphere::uv_from_direction(direction))), ..hit };
        self.look_at_surface(direction).map(radiance)
    }

    /// The same without what it shows.
    fn look_at_surface(&self, direction: Vec3) -> Option<RealHit> {
        let (inverse, plane) = self.field.look(direction);
        if inverse <= 0.0 {
            return None;
        }
        let at = direction / inverse;
        let normal = self.world_from_pano * -plane.try_normalize()?;
        Some(RealHit {
            t: 1.0 / inverse,
            position: self.capture + self.world_from_pano * at,
            normal,
            // The panorama's own view samples no light.
            facet: normal,
            surface: SEEN,
            radiance: None,
        })
    }

    /// The nearest surface on the ray as it lights others: its normal is the facet's, and a back face shows the radiance of the
    /// front it is made of. With how the depth field was met; `None`: by the panorama's own view.
    fn nearest(&self, ray: &Ray) -> Option<(RealHit, Option<FieldHit>)> {
        let (origin, direction) = self.ray_to_pano(ray);
        if origin.length_squared() < AT_CAPTURE * AT_CAPTURE {
            return self.look(direction).filter(|h| h.t < ray.t_max).map(|h| (h, None));
        }
        let hit = self.field.march(origin, direction, ray.t_max).hit()?;
        let (surface, shown) = match hit.hidden_side {
            Some(HiddenSide::BackFace(q) | HiddenSide::BackLayer(q)) => (HIDDEN_SIDE, q),
            None => (SEEN, origin + direction * hit.t),
        };
        let normal = self.world_from_pano * hit.normal;
        let radiance = Some(self.shown(shown, hit.at_gap));
        Some((RealHit { t: hit.t, position: ray.at(hit.t), normal, facet: normal, surface, radiance }, Some(hit)))
    }

    /// A hit of [`Self::nearest`] with its back face as bright as told.
    #[inline]
    fn shining(&self, (hit, met): (RealHit, Option<FieldHit>), back: Back) -> RealHit {
        match (back, met.and_then(|m| m.hidden_side)) {
            (Back::Lit, Some(HiddenSide::BackFace(q))) => RealHit { radiance: Some(self.relit(&hit, q)), ..hit },
            _ => hit,
        }
    }

    /// [`RealWorld::reach`], back faces as bright as told.
    #[inline]
    fn reach_by(&self, ray: &Ray, sample: &LightSample, back: Back) -> Option<Option<RealHit>> {
        let behind = self.nearest(ray);
        let reached = match (sample.target, &behind) {
            (LightTarget::Anything, _) | (LightTarget::Infinity, None) => true,
            (LightTarget::Surface(target), Some((hit, _))) if hit.surface == SEEN => {
                // The same patch of the surface, up to rounding.
                let tolerance = 1e-3 * (hit.t + (target - self.capture).length());
                target.distance_squared(hit.position) < tolerance * tolerance
            }
            _ => false,
        };
        // Lighting a back face takes rays: only one that was aimed at.
        reached.then(|| behind.map(|met| self.shining(met, back)))
    }

    /// Density per steradian of aiming at light that the panorama has seen.
    fn panorama_pdf(&self, direction: Vec3, behind: Option<&RealHit>) -> f32 {
        let Some(light) = &self.light else { return 0.0 };
        match behind {
            None => {
                // Only what the panorama sees of infinity is aimed at.
                let d = self.world_from_pano.inverse() * direction;
                if self.field.inverse_distance(d) <= 0.0 { light.pdf(d) } else { 0.0 }
            }
            Some(hit) if hit.surface == HIDDEN_SIDE => 0.0,
            Some(hit) => {
                // Density per steradian at the capture point, per area there, per steradian here.
                let at = self.to_pano(hit.position);
                let r2 = at.length_squared();
                let seen = at / r2.sqrt();
                let cos_capture = (self.world_from_pano * seen).dot(hit.facet).abs();
                let cos_here = direction.dot(hit.facet).abs().max(1e-6);
                let pdf = light.pdf(seen) * hit.t * hit.t * cos_capture / (r2 * cos_here);
                if pdf.is_finite() { pdf } else { 0.0 }
            }
        }
    }

    /// Radiance shown at a point; across a gap the nearest texel's, never a mixture of front and back.
    fn shown(&self, at: Vec3, at_gap: bool) -> Vec3 {
        let uv = sphere::uv_from_direction(at);
        if !at_gap {
            return sphere::bilinear(&self.radiance, uv);
        }
        let taps = sphere::bilinear_taps(self.radiance.width(), self.radiance.height(), uv);
        let nearest = taps.into_iter().max_by(|a, b| a.weight.total_cmp(&b.weight)).unwrap_or_default();
        self.radiance.get(nearest.x, nearest.y)
    }
}

impl RealWorld for CapturedWorld {
    #[inline]
    fn hit(&self, ray: &Ray) -> Option<RealHit> {
        let (hit, met) = self.nearest(ray)?;
        Some(match met {
            Some(met) if met.hidden_side.is_none() => {
                let direction = self.world_from_pano.inverse() * ray.direction;
                let normal = self.field.smooth_normal(self.to_pano(hit.position), direction, &met);
                RealHit { normal: self.world_from_pano * normal, ..hit }
            }
            met => self.shining((hit, met), Back::Lit),
        })
    }

    #[inline]
    fn surface(&self, ray: &Ray) -> Option<RealHit> {
        let (origin, direction) = self.ray_to_pano(ray);
        if origin.length_squared() < AT_CAPTURE * AT_CAPTURE {
            return self.look_at_surface(direction).filter(|hit| hit.t < ray.t_max);
        }
        self.hit(ray)
    }

    fn blocks(&self, ray: &Ray) -> bool {
        let (origin, direction) = self.ray_to_pano(ray);
        if origin.length_squared() < AT_CAPTURE * AT_CAPTURE {
            return self.surface(ray).is_some();
        }
        self.field.march(origin, direction, ray.t_max).hit().is_some()
    }

    fn shown_surface(&self, hit: RealHit, direction: Vec3, mut u: f32) -> RealHit {
        let at = self.to_pano(hit.position);
        // Only the panorama's own view blends its texels.
        if at.dot(self.world_from_pano.inverse() * direction) < 0.9999 * at.length() || !self.field.near_gap(at) {
            return hit;
        }
        let (w, h) = self.radiance.size();
        let taps = sphere::bilinear_taps(w, h, sphere::uv_from_direction(at));
        let mut chosen = taps[3];
        for tap in taps {
            if u < tap.weight {
                chosen = tap;
                break;
            }
            u -= tap.weight;
        }
        let uv = Vec2::new((chosen.x as f32 + 0.5) / w as f32, (chosen.y as f32 + 0.5) / h as f32);
        match self.look(sphere::direction_from_uv(uv)) {
            Some(texel) => RealHit { radiance: Some(self.radiance.get(chosen.x, chosen.y)), ..texel },
            // The share of infinity does not change.
            None => RealHit { radiance: Some(Vec3::ZERO), ..hit },
        }
    }

    #[inline]
    fn infinity(&self, direction: Vec3) -> Vec3 {
        let uv = sphere::uv_from_direction(self.world_from_pano.inverse() * direction);
        match &self.infinity {
            Some(shows) => sphere::bilinear_of(shows.size(), uv, |x, y| self.radiance.data()[shows.get(x, y) as usize]),
            None => sphere::bilinear(&self.radiance, uv),
        }
    }

    fn reflectance(&self, hit: &RealHit) -> Vec3 {
        let radiance = hit.radiance.filter(|_| hit.surface == SEEN);
        radiance.map_or(Vec3::ZERO, |radiance| reflectance_from(radiance, self.irradiance(hit), self.cap))
    }

    fn beyond_diffuse(&self, hit: &RealHit) -> Vec3 {
        let diffuse = || self.irradiance(hit) * (self.cap * FRAC_1_PI);
        let radiance = hit.radiance.filter(|_| hit.surface == SEEN && self.irradiance.is_some());
        radiance.map_or(Vec3::ZERO, |radiance| (radiance - diffuse()).max(Vec3::ZERO))
    }

    fn sent_back(&self, hit: &RealHit, direction: Vec3) -> Option<Vec3> {
        let shown = hit.radiance?;
        // Only the side that the panorama shows is known to mirror.
        let seen = hit.surface == SEEN && hit.normal.dot(hit.position - self.capture) < 0.0;
        let Some(mirrors) = self.mirrors.as_ref().filter(|_| seen) else { return Some(shown) };
        let reflectance = sphere::bilinear(mirrors, sphere::uv_from_direction(self.to_pano(hit.position)));
        let beyond = if reflectance > 0.0 { self.beyond_diffuse(hit) } else { Vec3::ZERO };
        if beyond == Vec3::ZERO {
            return Some(shown);
        }
        let image = mirrors::image_in(self, hit, direction) * reflectance;
        let image = image * (mirrors::BRIGHTEST * color::luminance(beyond) / color::luminance(image)).min(1.0);
        Some(shown - beyond + image)
    }

    #[inline]
    fn sample_light(&self, from: Vec3, u: Vec2) -> Option<LightSample> {
        let from_pano = self.to_pano(from);
        let at_lamps = self.lamps.share(from_pano);
        if u.x < at_lamps {
            let direction = self.lamps.sample(from_pano, Vec2::new(u.x / at_lamps, u.y))?;
            return Some(LightSample { direction: self.world_from_pano * direction, target: LightTarget::Anything });
        }
        let u = Vec2::new((u.x - at_lamps) / (1.0 - at_lamps), u.y);
        let direction = self.light.as_ref()?.sample(u)?.direction;
        let inverse = self.field.inverse_distance(direction);
        if inverse <= 0.0 {
            return Some(LightSample { direction: self.world_from_pano * direction, target: LightTarget::Infinity });
        }
        let target = self.capture + self.world_from_pano * (direction / inverse);
        Some(LightSample { direction: (target - from).try_normalize()?, target: LightTarget::Surface(target) })
    }

    #[inline]
    fn light_pdf(&self, from: Vec3, direction: Vec3, behind: Option<&RealHit>) -> f32 {
        let from = self.to_pano(from);
        let at_lamps = self.lamps.share(from);
        let by_panorama = (1.0 - at_lamps) * self.panorama_pdf(direction, behind);
        if at_lamps == 0.0 {
            return by_panorama;
        }
        by_panorama + at_lamps * self.lamps.pdf(from, self.world_from_pano.inverse() * direction)
    }

    #[inline]
    fn reach(&self, ray: &Ray, sample: &LightSample) -> Option<Option<RealHit>> {
        self.reach_by(ray, sample, Back::Lit)
    }

    #[inline]
    fn environment(&self) -> Environment<'_> {
        Environment { radiance: &self.radiance, light: self.light.as_ref(), pano_from_world: self.world_from_pano.inverse() }
    }

    fn sees_itself(&self) -> bool {
        true
    }

    #[inline]
    fn leave(&self, hit: &RealHit) -> Vec3 {
        hit.position + hit.normal * (LEAVE * (hit.position - self.capture).length())
    }
}

/// The panorama's luminance, averaged down to the size of the light table.
fn reduced_luminance(radiance: &RadianceImage) -> Image<f32> {
    let (w, h) = radiance.size();
    let k = w.div_ceil(LIGHT_TABLE_WIDTH).max(1);
    if k == 1 || w % k != 0 || h % k != 0 {
        return radiance.map(color::luminance);
    }
    Image::from_fn(w / k, h / k, |x, y| {
        let sum: f32 = (0..k * k).map(|i| color::luminance(radiance.get(x * k + i % k, y * k + i / k))).sum();
        sum / (k * k) as f32
    })
}

#[cfg(test)]
mod lamp_tests;
#[cfg(test)]
mod tests;

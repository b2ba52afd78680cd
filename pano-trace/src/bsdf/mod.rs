//! Scattering at surfaces: Lambert; GGX conductor and dielectric coat with height-correlated Smith shadowing and
//! visible-normal sampling; smooth and rough dielectric bodies with exact Fresnel terms; thin sheets.
//!
//! A [`Bsdf`] is made per hit from a [`pano_core::material::Material`] whose textures have been read. Its specular
//! reflection joins metal and coat in one lobe, which they share but for the Fresnel term; the diffuse lobe under a coat is
//! scaled by the energy the coat leaves it on the way in and out (Kelemen & Szirmay-Kalos 2001), so that a white material
//! reflects everything.

mod coat;
mod fresnel;
mod ggx;
#[cfg(feature = "gpu")]
pub mod gpu;

pub use coat::CoatTable;

pub(crate) use fresnel::{dielectric, gloss as gloss_fresnel};
pub(crate) use ggx::{masking, sample_visible_normal, shadowing};

use fresnel::schlick;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};

/// Below this GGX width a lobe is treated as perfectly smooth: its peak, 1/(π α²), leaves what f32 resolves.
pub const SMOOTH_ALPHA: f32 = 1e-3;

/// The parameters of a surface point, textures read.
#[derive(Clone, Copy, Debug)]
pub struct BsdfParams<'a> {
    /// Diffuse reflectance, reflectance of metal, tint of transmission.
    pub base_color: Vec3,
    /// Share of metal, [0, 1].
    pub metallic: f32,
    /// GGX width (roughness squared), [0, 1].
    pub alpha: f32,
    /// Strength of the coat, [0, 1].
    pub specular: f32,
    /// Colour of the coat's reflection, [0, 1].
    pub specular_color: Vec3,
    /// Refractive index of the body over that of its surroundings, ≥ 1.
    pub ior: f32,
    /// Share of the non-metal that lets light in, [0, 1].
    pub transmission: f32,
    /// A sheet instead of a body.
    pub thin: bool,
    /// The coat's directional albedo for `ior`; without it there is no coat.
    pub coat: Option<&'a CoatTable>,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Unit direction, away from the surface.
    pub direction: Vec3,
    /// f·|cos| / pdf.
    pub weight: Vec3,
    /// Density per steradian; meaningless for a `specular` sample.
    pub pdf_solid_angle: f32,
    /// The direction came from a perfectly smooth lobe: no other strategy can find it.
    pub specular: bool,
}

/// The value for a pair of directions, smooth lobes left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct BsdfValue {
    /// f·|cos|.
    pub f_cos: Vec3,
    /// Density per steradian with which [`Bsdf::sample`] finds the direction.
    pub pdf_solid_angle: f32,
}

/// Scattering at one point, for light that leaves towards one fixed direction.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<'a> {
    tangent: Vec3,
    bitangent: Vec3,
    normal: Vec3,
    geometric: Vec3,
    /// Outgoing direction in the frame; z < 0 inside a body.
    out: Vec3,
    alpha: f32,
    /// Reflectance at normal incidence of the metal part, times its share.
    metal_f0: Vec3,
    metal: f32,
    /// Strength of the coat, times the share of the opaque dielectric.
    coat: Vec3,
    ior: f32,
    /// Diffuse reflectance, with the coat's way out already taken off.
    diffuse: Vec3,
    /// The coat's strength as far as it darkens the diffuse lobe on the way in.
    coat_shade: f32,
    coat_table: Option<&'a CoatTable>,
    transmission: f32,
    tint: Vec3,
    thin: bool,
    /// Probabilities of choosing the diffuse, reflecting and transmitting lobe.
    choose: [f32; 3],
}

/// A surface in four numbers, seen from one side. See [`Bsdf::lobes`].
#[derive(Clone, Copy, Debug)]
pub struct Lobes {
    /// Share of the mean radiance by normal that is sent back diffusely.
    pub diffuse: Vec3,
    /// Share of the mean radiance in the lobe about the mirrored direction that is sent back.
    pub specular: Vec3,
    /// Roughness of that lobe, [0, 1].
    pub roughness: f32,
    /// Share of the light that enters the body.
    pub transmission: f32,
}

impl<'a> Bsdf<'a> {
    /// At a point with unit `geometric` and shading `normal` (both to the outside), for light leaving along unit `out`.
    ///
    /// An opaque surface is two-sided. Where `out` is below the shading normal's horizon the geometric one is used.
    pub fn new(params: &BsdfParams<'a>, geometric: Vec3, normal: Vec3, out: Vec3) -> Self {
        let p = params;
        let outside = geometric.dot(out) >= 0.0;
        let opaque = p.transmission <= 0.0 || p.metallic >= 1.0 || p.thin;
        let flip = if outside || !opaque { 1.0 } else { -1.0 };
        let side = if outside { 1.0 } else { -1.0 };
        let (geometric, mut normal) = (geometric * flip, normal * flip);
        if normal.dot(out) * side * flip <= 1e-4 {
            normal = geometric;
        }
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let local = Vec3::new(out.dot(tangent), out.dot(bitangent), out.dot(normal));

        let dielectric_share = 1.0 - p.metallic;
        let opaque_share = dielectric_share * (1.0 - p.transmission);
        let has_coat = p.specular > 0.0 && opaque_share > 0.0 && p.coat.is_some() && p.ior > 1.0;
        let strength = if has_coat { p.specular * p.specular_color } else { Vec3::ZERO };
        let coat_shade = strength.max_element();
        let cos = local.z.abs().min(1.0);
        let (coat_albedo, left) = match p.coat.filter(|_| has_coat) {
            Some(table) => {
                let (e, mean) = (table.albedo(p.alpha, cos), table.mean(p.alpha));
                (coat_shade * e, (1.0 - coat_shade * e) / (1.0 - coat_shade * mean))
            }
            None => (0.0, 1.0),
        };
        let diffuse = p.base_color * (opaque_share * left);
        let transmission = dielectric_share * p.transmission;
        let mut bsdf = Self {
            tangent,
            bitangent,
            normal,
            geometric,
            out: local,
            alpha: if p.alpha < SMOOTH_ALPHA { 0.0 } else { p.alpha },
            metal_f0: p.base_color * p.metallic,
            metal: p.metallic,
            coat: strength * opaque_share,
            ior: p.ior,
            diffuse,
            coat_shade,
            coat_table: p.coat.filter(|_| has_coat),
            transmission,
            tint: p.base_color,
            thin: p.thin,
            choose: [0.0; 3],
        };
        // Choose lobes in proportion to what they roughly reflect towards `out`.
        let reflected = schlick(bsdf.metal_f0, bsdf.metal, cos).max_element() + coat_albedo * opaque_share;
        let scattered = p.base_color.max_element() * opaque_share * (1.0 - coat_albedo);
        let sum = reflected + scattered + transmission;
        if sum > 0.0 {
            bsdf.choose = [scattered / sum, reflected / sum, transmission / sum];
        }
        bsdf
    }

    /// Lambert with reflectance `albedo`, seen from the side `normal` points to.
    pub fn lambert(albedo: Vec3, normal: Vec3, out: Vec3) -> Self {
        let params = BsdfParams {
            base_color: albedo,
            metallic: 0.0,
            alpha: 1.0,
            specular: 0.0,
            specular_color: Vec3::ONE,
            ior: 1.0,
            transmission: 0.0,
            thin: false,
            coat: None,
        };
        Self::new(&params, normal, normal, out)
    }

    /// Whether every lobe is perfectly smooth (or black), so that sampling lights is of no use.
    pub fn is_specular(&self) -> bool {
        self.choose[0] <= 0.0 && (self.alpha == 0.0 || (self.choose[1] <= 0.0 && (self.thin || self.choose[2] <= 0.0)))
    }

    /// Shading normal, on the side of the outgoing direction for opaque surfaces.
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Geometric normal on the side to which a ray along `direction` leaves, for offsetting its origin.
    #[inline]
    pub fn offset_normal(&self, direction: Vec3) -> Vec3 {
        if self.geometric.dot(direction) >= 0.0 { self.geometric } else { -self.geometric }
    }

    /// What the surface makes of light that is the same all around its lobes, for lookups in convolved maps.
    pub fn lobes(&self) -> Lobes {
        let roughness = self.alpha.sqrt();
        let cos = self.out.z.abs().min(1.0);
        let left = self.coat_table.map_or(1.0, |table| 1.0 - self.coat_shade * table.mean(self.alpha));
        let coat = self.coat_table.map_or(0.0, |table| table.albedo(self.alpha, cos));
        let (scale, bias) = split_sum(roughness, cos);
        let specular = match roughness {
            // A mirror reflects by the Fresnel term itself.
            0.0 => self.reflectance(cos),
            _ => self.metal_f0 * scale + Vec3::splat(self.metal * bias) + self.coat * coat,
        };
        Lobes { diffuse: self.diffuse * left, specular, roughness, transmission: self.transmission }
    }

    /// f·|cos| and the density for light that comes from unit `direction`.
    #[inline]
    pub fn eval(&self, direction: Vec3) -> BsdfValue {
        let wi = Vec3::new(direction.dot(self.tangent), direction.dot(self.bitangent), direction.dot(self.normal));
        // Directions on which the shading and the geometric side disagree would let light through closed surfaces.
        if wi.z == 0.0 || self.out.z == 0.0 || (wi.z > 0.0) != (direction.dot(self.geometric) > 0.0) {
            return BsdfValue::default();
        }
        self.eval_local(wi)
    }

    fn eval_local(&self, wi: Vec3) -> BsdfValue {
        let mut value = BsdfValue::default();
        let same_side = (wi.z > 0.0) == (self.out.z > 0.0);
        if same_side && self.choose[0] > 0.0 {
            let cos = wi.z.abs();
            value.f_cos += self.diffuse * (self.way_in(cos) * cos * FRAC_1_PI);
            value.pdf_solid_angle += self.choose[0] * cos * FRAC_1_PI;
        }
        if self.alpha == 0.0 {
            return value;
        }
        // The upper half space is that of `out`; for bodies seen from inside it lies below the normal.
        if same_side && self.choose[1] > 0.0 {
            let (o, i) = (Vec3::new(self.out.x, self.out.y, self.out.z.abs()), Vec3::new(wi.x, wi.y, wi.z.abs()));
            let half = (o + i).normalize();
            let common = ggx::distribution(half.z, self.alpha) / (4.0 * o.z);
            value.f_cos += self.reflectance(o.dot(half)) * (common * ggx::shadowing(o.z, i.z, self.alpha));
            value.pdf_solid_angle += self.choose[1] * common * ggx::masking(o.z, self.alpha);
        }
        if self.choose[2] > 0.0 && !self.thin {
            let (f_cos, pdf) = self.eval_body(wi, same_side);
            value.f_cos += f_cos;
            value.pdf_solid_angle += self.choose[2] * pdf;
        }
        value
    }

    /// Rough dielectric body (Walter et al. 2007), as radiance: what enters a body is divided by the squared index.
    fn eval_body(&self, wi: Vec3, same_side: bool) -> (Vec3, f32) {
        let wo = self.out;
        let entering = wo.z > 0.0;
        let eta = if entering { self.ior } else { 1.0 / self.ior };
        let eta_path = if same_side { 1.0 } else { eta };
        let half = wi * eta_path + wo;
        if half.length_squared() < 1e-12 {
            return (Vec3::ZERO, 0.0);
        }
        let half = if half.z < 0.0 { -half.normalize() } else { half.normalize() };
        let (oh, ih) = (wo.dot(half), wi.dot(half));
        if oh * wo.z <= 0.0 || ih * wi.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let fresnel = dielectric(oh.abs(), eta);
        let d = ggx::distribution(half.z, self.alpha);
        let (co, ci) = (wo.z.abs(), wi.z.abs());
        let g = ggx::shadowing(co, ci, self.alpha);
        let visible = d * ggx::masking(co, self.alpha) * oh.abs() / co;
        if same_side {
            let value = self.transmission * d * g * fresnel / (4.0 * co);
            (Vec3::splat(value), visible / (4.0 * oh.abs()) * fresnel)
        } else {
            let denominator = (ih + oh / eta_path).powi(2);
            let jacobian = ih.abs() / denominator;
            let value = d * (1.0 - fresnel) * g * (ih * oh / denominator).abs() / (co * eta_path * eta_path);
            (self.tint * (self.transmission * value), visible * jacobian * (1.0 - fresnel))
        }
    }

    /// Draws a direction with four numbers in [0, 1). `None` if the light is absorbed.
    #[inline]
    pub fn sample(&self, u: [f32; 4]) -> Option<BsdfSample> {
        let [diffuse, reflect, _] = self.choose;
        let at = Vec2::new(u[0], u[1]);
        let (wi, specular) = if u[2] < diffuse {
            let disc = concentric_disc(at);
            let z = (1.0 - disc.length_squared()).max(0.0).sqrt();
            (Vec3::new(disc.x, disc.y, z.copysign(self.out.z)), None)
        } else if u[2] < diffuse + reflect {
            let up = Vec3::new(self.out.x, self.out.y, self.out.z.abs());
            let half = if self.alpha == 0.0 { Vec3::Z } else { ggx::sample_visible_normal(up, self.alpha, at) };
            let wi = reflect_about(up, half);
            if wi.z <= 0.0 {
                return None;
            }
            let specular = (self.alpha == 0.0).then(|| self.reflectance(up.z) / reflect);
            (Vec3::new(wi.x, wi.y, wi.z.copysign(self.out.z)), specular)
        } else if self.choose[2] > 0.0 {
            self.sample_body(at, u[3])?
        } else {
            return None;
        };
        let direction = (self.tangent * wi.x + self.bitangent * wi.y + self.normal * wi.z).normalize();
        if (wi.z > 0.0) != (direction.dot(self.geometric) > 0.0) {
            return None;
        }
        if let Some(weight) = specular {
            return Some(BsdfSample { direction, weight, pdf_solid_angle: 0.0, specular: true });
        }
        let value = self.eval_local(wi);
        (value.pdf_solid_angle > 0.0).then(|| BsdfSample {
            direction,
            weight: value.f_cos / value.pdf_solid_angle,
            pdf_solid_angle: value.pdf_solid_angle,
            specular: false,
        })
    }

    /// A direction through or off the body, with its weight if the choice was a perfectly smooth one.
    fn sample_body(&self, at: Vec2, u: f32) -> Option<(Vec3, Option<Vec3>)> {
        let share = self.transmission / self.choose[2];
        let wo = self.out;
        if self.thin {
            // Both faces, with all reflections between them.
            let r = dielectric(wo.z.abs(), self.ior);
            let r = 2.0 * r / (1.0 + r);
            let reflected = Vec3::new(-wo.x, -wo.y, wo.z);
            return Some(if u < r { (reflected, Some(Vec3::splat(share))) } else { (-wo, Some(self.tint * share)) });
        }
        let eta = if wo.z > 0.0 { self.ior } else { 1.0 / self.ior };
        let up = Vec3::new(wo.x, wo.y, wo.z.abs());
        let half = if self.alpha == 0.0 { Vec3::Z } else { ggx::sample_visible_normal(up, self.alpha, at) };
        let cos = up.dot(half);
        let fresnel = dielectric(cos, eta);
        let reflecting = u < fresnel;
        let wi = if reflecting {
            reflect_about(up, half)
        } else {
            let sin2 = (1.0 - cos * cos).max(0.0) / (eta * eta);
            if sin2 >= 1.0 {
                return None;
            }
            half * (cos / eta - (1.0 - sin2).sqrt()) - up / eta
        };
        // A microfacet may send light to the wrong side of the macroscopic surface: it is lost (single scattering).
        if (wi.z > 0.0) != reflecting || wi.z == 0.0 {
            return None;
        }
        let wi = Vec3::new(wi.x, wi.y, wi.z * wo.z.signum());
        let smooth = (self.alpha == 0.0).then(|| if reflecting { Vec3::splat(share) } else { self.tint * (share / (eta * eta)) });
        Some((wi, smooth))
    }

    /// Fresnel reflectance of metal and coat together at a microfacet.
    #[inline]
    fn reflectance(&self, cos: f32) -> Vec3 {
        let mut f = schlick(self.metal_f0, self.metal, cos);
        if self.coat_table.is_some() {
            f += self.coat * dielectric(cos, self.ior);
        }
        f
    }

    /// What the coat leaves of the light on its way in to the diffuse base.
    #[inline]
    fn way_in(&self, cos: f32) -> f32 {
        self.coat_table.map_or(1.0, |table| 1.0 - self.coat_shade * table.albedo(self.alpha, cos))
    }
}

/// Scale and bias of the reflectance at normal incidence that make it a GGX conductor's directional albedo: the fit of Karis
/// (2014, "Physically based shading on mobile") to the split sum, within 2 %.
fn split_sum(roughness: f32, cos: f32) -> (f32, f32) {
    let r = [1.0 - roughness, 0.0425 - 0.0275 * roughness, 1.04 - 0.572 * roughness, 0.022 * roughness - 0.04];
    let a = (r[0] * r[0]).min((-9.28 * cos).exp2()) * r[0] + r[1];
    (-1.04 * a + r[2], 1.04 * a + r[3])
}

/// Mirror image of `w` about the unit vector `half`.
#[inline]
fn reflect_about(w: Vec3, half: Vec3) -> Vec3 {
    half * (2.0 * w.dot(half)) - w
}

/// Uniform point of the unit disc (Shirley & Chiu 1997), which keeps the stratification of `u`.
#[inline]
pub(crate) fn concentric_disc(u: Vec2) -> Vec2 {
    let o = u * 2.0 - 1.0;
    if o == Vec2::ZERO {
        return o;
    }
    let (r, phi) = if o.x.abs() > o.y.abs() { (o.x, PI / 4.0 * (o.y / o.x)) } else { (o.y, PI / 2.0 - PI / 4.0 * (o.x / o.y)) };
    Vec2::new(r * phi.cos(), r * phi.sin())
}

#[cfg(test)]
mod tests;

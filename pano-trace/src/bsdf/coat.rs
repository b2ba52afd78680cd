//! Directional albedo of a rough dielectric coat, tabulated: what it reflects of the light from one direction.

use super::{fresnel::dielectric, ggx};
use glam::{Vec2, Vec3};

pub(super) const ALPHAS: usize = 17;
pub(super) const COSINES: usize = 33;

/// Directional albedo over (α, cos θ) of a GGX dielectric reflection with strength 1, for one refractive index.
#[derive(Clone, Debug)]
pub struct CoatTable {
    albedo: Vec<[f32; COSINES]>,
    mean: [f32; ALPHAS],
}

impl CoatTable {
    /// Integrates the table for refractive index `ior` ≥ 1; takes some milliseconds.
    pub fn new(ior: f32) -> Self {
        let mut albedo = vec![[0.0; COSINES]; ALPHAS];
        for (a, row) in albedo.iter_mut().enumerate() {
            for (c, value) in row.iter_mut().enumerate() {
                *value = integrate(a as f32 / (ALPHAS - 1) as f32, (c as f32 / (COSINES - 1) as f32).max(1e-3), ior);
            }
        }
        // The mean of the *interpolated* albedo, ∫E 2μ dμ, exactly: over a segment of a piecewise linear function.
        let mut mean = [0.0; ALPHAS];
        for (m, row) in mean.iter_mut().zip(&albedo) {
            let h = 1.0 / (COSINES - 1) as f32;
            *m = (0..COSINES - 1)
                .map(|c| {
                    let (x, e0, e1) = (c as f32 * h, row[c], row[c + 1]);
                    h * (x * (e0 + e1) + h * (e0 + 2.0 * e1) / 3.0)
                })
                .sum();
        }
        Self { albedo, mean }
    }

    /// Albedo for GGX width `alpha` towards cosine `cos`, both in [0, 1].
    #[inline]
    pub fn albedo(&self, alpha: f32, cos: f32) -> f32 {
        let (a, fa) = split(alpha, ALPHAS);
        let (c, fc) = split(cos, COSINES);
        let row = |a: usize| self.albedo[a][c] + (self.albedo[a][c + 1] - self.albedo[a][c]) * fc;
        row(a) + (row(a + 1) - row(a)) * fa
    }

    /// The table as shaders read it: the albedo, one row of cosines after the other, and then the means.
    #[cfg(feature = "gpu")]
    pub fn values(&self) -> impl Iterator<Item = f32> {
        self.albedo.iter().flatten().chain(&self.mean).copied()
    }

    /// Cosine-weighted mean albedo for GGX width `alpha`.
    #[inline]
    pub fn mean(&self, alpha: f32) -> f32 {
        let (a, f) = split(alpha, ALPHAS);
        self.mean[a] + (self.mean[a + 1] - self.mean[a]) * f
    }
}

#[inline]
fn split(x: f32, n: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let i = (x as usize).min(n - 2);
    (i, x - i as f32)
}

/// Mean of F·G₂/G₁ over visible normals, on a grid of midpoints.
fn integrate(alpha: f32, cos: f32, ior: f32) -> f32 {
    const N: usize = 24;
    if alpha < super::SMOOTH_ALPHA {
        return dielectric(cos, ior);
    }
    let out = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let mut sum = 0.0;
    for i in 0..N * N {
        let u = Vec2::new(((i % N) as f32 + 0.5) / N as f32, ((i / N) as f32 + 0.5) / N as f32);
        let half = ggx::sample_visible_normal(out, alpha, u);
        let wi = super::reflect_about(out, half);
        if wi.z > 0.0 {
            sum += dielectric(out.dot(half), ior) * ggx::shadowing(out.z, wi.z, alpha) / ggx::masking(out.z, alpha);
        }
    }
    sum / (N * N) as f32
}

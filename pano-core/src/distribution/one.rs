//! Discrete distribution by inverted CDF. A guide table (the cutpoint method, Chen & Asau 1974; compared with alias tables
//! by Cline et al. 2009) finds the entry in constant expected time and, unlike an alias table, keeps the order of the
//! samples and so their stratification.

/// Picks an index with probability proportional to its weight.
#[derive(Clone, Debug)]
pub struct Distribution1d {
    /// cdf[i] = P(index < i); n + 1 entries from 0 to 1.
    cdf: Vec<f32>,
    /// guide[k] = the last i with cdf[i] ≤ k/n.
    guide: Vec<u32>,
    total: f64,
}

impl Distribution1d {
    /// From non-negative weights; NaN, infinite and negative ones count as 0. `None` if nothing is left.
    pub fn new(weights: &[f32]) -> Option<Self> {
        let usable = |w: f32| if w.is_finite() && w > 0.0 { f64::from(w) } else { 0.0 };
        let total: f64 = weights.iter().map(|&w| usable(w)).sum();
        if total <= 0.0 {
            return None;
        }
        let n = weights.len();
        let mut cdf = Vec::with_capacity(n + 1);
        let mut sum = 0.0;
        for &w in weights {
            cdf.push((sum / total) as f32);
            sum += usable(w);
        }
        cdf.push(1.0);
        let mut guide = Vec::with_capacity(n);
        let mut i = 0;
        for k in 0..n {
            while cdf[i + 1] <= k as f32 / n as f32 {
                i += 1;
            }
            guide.push(i as u32);
        }
        Some(Self { cdf, guide, total })
    }

    /// The index for `u` in [0, 1), and where inside the index's share of the unit interval `u` fell, in [0, 1).
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32) {
        let n = self.guide.len();
        let mut i = self.guide[((u * n as f32) as usize).min(n - 1)] as usize;
        while i + 1 < n && self.cdf[i + 1] <= u {
            i += 1;
        }
        // A trailing run of weights too small for f32 has no width: step back to an index that has.
        while i > 0 && self.cdf[i + 1] <= self.cdf[i] {
            i -= 1;
        }
        let width = self.cdf[i + 1] - self.cdf[i];
        (i, ((u - self.cdf[i]) / width).clamp(0.0, 1.0 - f32::EPSILON / 2.0))
    }

    /// Probability of `index`.
    #[inline]
    pub fn probability(&self, index: usize) -> f32 {
        self.cdf[index + 1] - self.cdf[index]
    }

    /// The probabilities of the entries before each, and 1: as shaders read them.
    #[cfg(feature = "gpu")]
    pub fn cdf(&self) -> &[f32] {
        &self.cdf
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }
}

//! What a test may conclude from noisy numbers.

/// Mean of independent repetitions and its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Standard error of the mean.
    pub error: f64,
}

impl Estimate {
    /// From at least two repetitions.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt() }
    }

    /// Difference from `other` in standard errors of the difference; 0 if both are known exactly and equal.
    pub fn deviation(&self, other: &Self) -> f64 {
        let difference = self.mean - other.mean;
        if difference == 0.0 { 0.0 } else { difference / self.error.hypot(other.error) }
    }
}

/// Probability that a standard normal number exceeds `z` in absolute value (Abramowitz & Stegun 7.1.26, error below 1e-6 of
/// the tail for z ≤ 8, where the continued fraction takes over).
pub fn two_sided_tail(z: f64) -> f64 {
    let z = z.abs();
    if z < 2.0 {
        // Taylor series of the density's integral.
        let (mut term, mut sum) = (z, z);
        for k in 1..60 {
            term *= -z * z / (2.0 * f64::from(k));
            sum += term / f64::from(2 * k + 1);
        }
        return 1.0 - 2.0 * sum / std::f64::consts::TAU.sqrt();
    }
    // Mills' ratio as a continued fraction.
    let mut fraction = z;
    for k in (1..200).rev() {
        fraction = z + f64::from(k) / fraction;
    }
    2.0 * (-0.5 * z * z).exp() / (std::f64::consts::TAU.sqrt() * fraction)
}

/// The deviation that the largest of `count` independent standard normal numbers exceeds with probability `alpha` (Šidák).
pub fn sidak_bound(count: usize, alpha: f64) -> f64 {
    let each = 1.0 - (1.0 - alpha).powf(1.0 / count as f64);
    let (mut lo, mut hi) = (0.0, 12.0);
    for _ in 0..60 {
        let middle = 0.5 * (lo + hi);
        if two_sided_tail(middle) > each { lo = middle } else { hi = middle }
    }
    hi
}

/// The smallest k that a binomial number of `count` trials of probability `p` exceeds with probability at most `alpha`.
pub fn binomial_bound(count: usize, p: f64, alpha: f64) -> usize {
    let mut probability = (1.0 - p).powi(count as i32);
    let mut at_most = probability;
    let mut k = 0;
    while 1.0 - at_most > alpha {
        probability *= (count - k) as f64 / (k + 1) as f64 * p / (1.0 - p);
        k += 1;
        at_most += probability;
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_of_the_normal_distribution() {
        for (z, tail) in [(0.0, 1.0), (1.0, 0.317_310_5), (1.96, 0.049_995_8), (3.0, 2.699_796e-3), (5.0, 5.733_031e-7)] {
            assert!((two_sided_tail(z) / tail - 1.0).abs() < 1e-6, "{z}: {}", two_sided_tail(z));
        }
    }

    #[test]
    fn bounds_of_many_tests() {
        // One test at 0.27 % is 3 standard errors; 100 tests at 1 % need 3.89.
        assert!((sidak_bound(1, 2.699_796e-3) - 3.0).abs() < 1e-5);
        assert!((sidak_bound(100, 0.01) - 3.89).abs() < 0.01);
        // 1000 · 0.0027 = 2.7 expected: P(X > 8) = 0.0023, P(X > 9) = 0.0006.
        assert_eq!(binomial_bound(1000, 2.7e-3, 1e-3), 9);
        assert_eq!(binomial_bound(10, 0.0, 1e-3), 0);
    }

    #[test]
    fn estimates_of_a_known_sample() {
        let e = Estimate::of(&[1.0, 2.0, 3.0, 4.0]);
        assert!((e.mean - 2.5).abs() < 1e-12 && (e.error - (5.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12);
        assert_eq!(e.deviation(&e), 0.0);
    }
}

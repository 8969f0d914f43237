//! Student's and Fisher's distributions, by the regularised incomplete beta function.

/// Student's t.
#[derive(Clone, Copy, Debug)]
pub struct Student {
    /// Degrees of freedom, above 0.
    pub freedom: f64,
}

impl Student {
    /// Half the width of the interval about 0 that holds 95 of 100; 1.96 for many degrees of freedom.
    pub fn within_95(self) -> f64 {
        let beyond = |t: f64| beta(0.5 * self.freedom, 0.5, self.freedom / (self.freedom + t * t));
        let (mut low, mut high) = (1.0, 1e3);
        // Sixty halvings of a thousand leave 1e-15.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if beyond(middle) > 0.05 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

/// Fisher's ratio of two variances.
#[derive(Clone, Copy, Debug)]
pub struct F {
    /// Degrees of freedom of the one above.
    pub above: f64,
    /// Of the one below.
    pub below: f64,
}

impl F {
    /// How often a ratio is beyond this one by chance.
    pub fn beyond(self, ratio: f64) -> f64 {
        if ratio.is_finite() { beta(0.5 * self.below, 0.5 * self.above, self.below / (self.below + self.above * ratio)) } else { 0.0 }
    }
}

/// The regularised incomplete beta function I_x(a, b), by Lentz's method on its continued fraction (DLMF 8.17.22).
fn beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    // It converges fast below the mean only.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - beta(b, a, 1.0 - x);
    }
    let front = (libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * (1.0 - x).ln()).exp() / a;
    let away = |v: f64| if v.abs() < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { v };
    let (mut c, mut d) = (1.0, 1.0 / away(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for m in 1..300 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let before = fraction;
        for term in [even, odd] {
            d = 1.0 / away(1.0 + term * d);
            c = away(1.0 + term / c);
            fraction *= c * d;
        }
        if (fraction - before).abs() <= f64::EPSILON * fraction.abs() {
            break;
        }
    }
    front * fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_agree_with_printed_tables() {
        // Fails if degrees of freedom are halved twice, or a tail is the other one (NIST handbook, 1.3.6.7.2 and .3).
        for (freedom, t) in [(1.0, 12.706), (3.0, 3.182), (10.0, 2.228), (30.0, 2.042), (1e6, 1.960)] {
            assert!((Student { freedom }.within_95() - t).abs() < 6e-4, "{freedom}");
        }
        for (above, below, ratio) in [(3.0, 3.0, 9.277), (3.0, 10.0, 3.708), (3.0, 60.0, 2.758), (6.0, 20.0, 2.599)] {
            assert!((F { above, below }.beyond(ratio) - 0.05).abs() < 5e-5, "{above} {below}");
        }
    }
}

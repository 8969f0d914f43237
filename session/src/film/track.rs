//! A number that goes through given ones at given times, without overshooting: piecewise cubic, monotone where they are (Fritsch and Carlson
//! 1980, SIAM J. Numer. Anal. 17, 238–246; slopes by Fritsch and Butland 1984).

/// The number at a time, of points in order of time; before the first and after the last it is theirs, and of none there is none.
pub fn at(points: &[(f64, f64)], t: f64) -> Option<f64> {
    let (first, last) = (points.first()?, points.last()?);
    if t <= first.0 {
        return Some(first.1);
    }
    if t >= last.0 {
        return Some(last.1);
    }
    let n = points.partition_point(|(at, _)| *at <= t) - 1;
    let ((t0, v0), (t1, v1)) = (points[n], points[n + 1]);
    let (width, slopes) = (t1 - t0, [slope(points, n), slope(points, n + 1)]);
    let u = (t - t0) / width;
    let (square, rest) = (u * u, 1.0 - u);
    let [a, b] = [(1.0 + 2.0 * u) * rest * rest, square * (3.0 - 2.0 * u)];
    Some(a * v0 + b * v1 + width * u * rest * (rest * slopes[0] - u * slopes[1]))
}

/// The slope at a point: none at the ends and where the number turns, so that each key is come to at rest there.
fn slope(points: &[(f64, f64)], n: usize) -> f64 {
    if n == 0 || n + 1 >= points.len() {
        return 0.0;
    }
    let [before, after] = [n - 1, n].map(|k| {
        let width = points[k + 1].0 - points[k].0;
        (width, (points[k + 1].1 - points[k].1) / width)
    });
    if before.1 * after.1 <= 0.0 {
        return 0.0;
    }
    // The harmonic mean, weighed so that the longer side counts more.
    let weights = [2.0 * after.0 + before.0, after.0 + 2.0 * before.0];
    (weights[0] + weights[1]) / (weights[0] / before.1 + weights[1] / after.1)
}

#[cfg(test)]
mod tests {
    use super::at;

    #[test]
    fn a_number_goes_through_its_points_and_never_beyond_them() {
        // Fails if a key is missed, a film jumps at one, or an isovalue overshoots between two that are alike.
        let points = [(0.0, 100.0), (1.0, 100.0), (1.5, 400.0), (4.0, 390.0), (5.0, -20.0)];
        for (t, v) in points {
            assert!((at(&points, t).unwrap() - v).abs() < 1e-12);
        }
        let mut last = 100.0;
        for n in 0..=5000 {
            let t = f64::from(n) / 1000.0;
            let v = at(&points, t).unwrap();
            let k = points.iter().rposition(|p| p.0 <= t).unwrap().min(3);
            let (low, high) = (points[k].1.min(points[k + 1].1), points[k].1.max(points[k + 1].1));
            assert!(v >= low - 1e-9 && v <= high + 1e-9, "{v} at {t}");
            assert!((v - last).abs() < 1.5, "no jump");
            last = v;
        }
        assert_eq!(
            (at(&points, -1.0), at(&points, 9.0), at(&[], 0.0), at(&[(2.0, 7.0)], 0.0)),
            (Some(100.0), Some(-20.0), None, Some(7.0))
        );
    }
}

//! Symmetric matrices of few rows: their eigenvectors, and what follows from them.

/// A symmetric matrix by rows.
pub type Symmetric<const N: usize> = [[f64; N]; N];

/// Eigenvalues, ascending, and unit eigenvectors in the same order (Jacobi 1846; Golub and Van Loan, "Matrix Computations", 8.5). The same
/// bytes on every machine: sums have one order.
pub fn eigen<const N: usize>(matrix: &Symmetric<N>) -> ([f64; N], [[f64; N]; N]) {
    let mut a = *matrix;
    let mut v = std::array::from_fn::<_, N, _>(|i| std::array::from_fn::<_, N, _>(|j| f64::from(u8::from(i == j))));
    // Each sweep squares what is left beside the diagonal; six to eight do for nine digits more than there are.
    for _ in 0..32 {
        let beside: f64 = (0..N).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j].powi(2)).sum();
        if beside == 0.0 {
            break;
        }
        for p in 0..N {
            for q in p + 1..N {
                if a[p][q] != 0.0 {
                    rotate(&mut a, &mut v, p, q);
                }
            }
        }
    }
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by(|i, j| a[*i][*i].total_cmp(&a[*j][*j]));
    (order.map(|i| a[i][i]), order.map(|i| std::array::from_fn(|row| v[row][i])))
}

/// Turns rows and columns p and q so that their common entry is 0.
fn rotate<const N: usize>(a: &mut Symmetric<N>, v: &mut [[f64; N]; N], p: usize, q: usize) {
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    let turned = |x: f64, y: f64| (c * x - s * y, s * x + c * y);
    for row in a.iter_mut().chain(v) {
        (row[p], row[q]) = turned(row[p], row[q]);
    }
    for column in 0..N {
        (a[p][column], a[q][column]) = turned(a[p][column], a[q][column]);
    }
    (a[p][q], a[q][p]) = (0.0, 0.0);
}

/// The inverse on the eigenvectors whose eigenvalue is above `least`; 0 on the others.
pub fn inverse<const N: usize>(matrix: &Symmetric<N>, least: f64) -> Symmetric<N> {
    let (values, vectors) = eigen(matrix);
    let mut inverse = [[0.0; N]; N];
    for (value, vector) in values.iter().zip(&vectors).filter(|(value, _)| **value > least) {
        add_outer(&mut inverse, vector, 1.0 / value);
    }
    inverse
}

/// Adds `weight`·r·rᵀ.
pub fn add_outer<const N: usize>(matrix: &mut Symmetric<N>, r: &[f64; N], weight: f64) {
    for i in 0..N {
        for j in 0..N {
            matrix[i][j] += weight * r[i] * r[j];
        }
    }
}

/// Matrix times vector.
pub fn times<const N: usize>(matrix: &Symmetric<N>, r: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| (0..N).map(|j| matrix[i][j] * r[j]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_synthetic::Random;

    #[test]
    fn eigenvectors_are_what_the_matrix_only_stretches() {
        // Fails if rows and columns of a rotation are mixed, eigenvalues are not put in order with their vectors, or an inverse is none.
        let mut random = Random(3);
        for _ in 0..100 {
            let mut matrix = [[0.0; 7]; 7];
            for _ in 0..7 {
                add_outer(&mut matrix, &std::array::from_fn(|_| random.unit() - 0.5), 1.0);
            }
            let (values, vectors) = eigen(&matrix);
            assert!(values.is_sorted());
            for (value, vector) in values.iter().zip(&vectors) {
                let stretched = times(&matrix, vector);
                assert!((0..7).all(|i| (stretched[i] - value * vector[i]).abs() < 1e-14), "{value}");
            }
            let x: [f64; 7] = std::array::from_fn(|_| random.unit());
            let back = times(&inverse(&matrix, 0.0), &times(&matrix, &x));
            // Half of the digits at a condition number of a hundred million.
            assert!((0..7).all(|i| (back[i] - x[i]).abs() < 1e-8 * values[6] / values[0].max(1e-8)), "{back:?}");
        }
    }

    #[test]
    fn what_a_matrix_flattens_stays_flat() {
        // Fails if an undetermined direction is divided by its rounding.
        let mut matrix = [[0.0; 3]; 3];
        add_outer(&mut matrix, &[1.0, 1.0, 0.0], 2.0);
        let back = times(&inverse(&matrix, 1e-9), &[4.0, 4.0, 7.0]);
        assert!((back[0] - 1.0).abs() < 1e-15 && (back[1] - 1.0).abs() < 1e-15 && back[2] == 0.0, "{back:?}");
    }
}

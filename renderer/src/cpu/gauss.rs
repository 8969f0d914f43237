//! Gauss and Legendre's quadrature with four points in [0, 1], exact for powers up to 7.

/// The points, and what each weighs.
pub(crate) const NODES: [f32; 4] = [0.069_431_84, 0.330_009_5, 0.669_990_54, 0.930_568_16];
pub(crate) const WEIGHTS: [f32; 4] = [0.173_927_43, 0.326_072_57, 0.326_072_57, 0.173_927_43];

/// The integrals from 0 to each node of the cubic through values at the nodes (Butcher's array of the method of order 8; Hairer, Nørsett and
/// Wanner 1993, II.7).
pub(crate) const UNTIL: [[f32; 4]; 4] = [
    [0.086_963_71, -0.026_604_18, 0.012_627_463, -0.003_555_149_8],
    [0.188_118_12, 0.163_036_29, -0.027_880_428, 0.006_735_500_4],
    [0.167_191_92, 0.353_953, 0.163_036_29, -0.014_190_695],
    [0.177_482_58, 0.313_445_12, 0.352_676_75, 0.086_963_71],
];

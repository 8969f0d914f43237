// The cubic along a segment of a cell, in Bernstein form. The twin of renderer/src/roots/bernstein.rs, which says why.

#import interpolant

// Bernstein coefficients over the segment p → q of the trilinear interpolant.
fn bernstein(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> vec4<f32> {
    // px_y0z0 reads: x at p, on the edge y = 0, z = 0.
    let px_y0z0 = blend(lower.x, lower.y, p.x);
    let px_y1z0 = blend(lower.z, lower.w, p.x);
    let px_y0z1 = blend(upper.x, upper.y, p.x);
    let px_y1z1 = blend(upper.z, upper.w, p.x);
    let qx_y0z0 = blend(lower.x, lower.y, q.x);
    let qx_y1z0 = blend(lower.z, lower.w, q.x);
    let qx_y0z1 = blend(upper.x, upper.y, q.x);
    let qx_y1z1 = blend(upper.z, upper.w, q.x);
    let pp_z0 = blend(px_y0z0, px_y1z0, p.y);
    let pp_z1 = blend(px_y0z1, px_y1z1, p.y);
    let pq_z0 = blend(px_y0z0, px_y1z0, q.y);
    let pq_z1 = blend(px_y0z1, px_y1z1, q.y);
    let qp_z0 = blend(qx_y0z0, qx_y1z0, p.y);
    let qp_z1 = blend(qx_y0z1, qx_y1z1, p.y);
    let qq_z0 = blend(qx_y0z0, qx_y1z0, q.y);
    let qq_z1 = blend(qx_y0z1, qx_y1z1, q.y);
    return vec4<f32>(
        blend(pp_z0, pp_z1, p.z),
        (blend(qp_z0, qp_z1, p.z) + blend(pq_z0, pq_z1, p.z) + blend(pp_z0, pp_z1, q.z)) / 3.0,
        (blend(qq_z0, qq_z1, p.z) + blend(qp_z0, qp_z1, q.z) + blend(pq_z0, pq_z1, q.z)) / 3.0,
        blend(qq_z0, qq_z1, q.z),
    );
}

//! Sixteen rays side by side. Everything that is done for a ray on the CPU is written once over these types and compiled for every set of
//! vector instructions that the machine may have; which one runs is found out when the program starts. Multiplications and additions are
//! never fused, and every operation rounds as IEEE 754 says, so that all of them draw the same picture to the bit.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8, i32x16, mask32x16};
use std::ops::{Add, Mul, Sub};

/// Rays side by side: what AVX-512 holds in a register, others in two or four.
pub(crate) const LANES: usize = 16;

pub(crate) type Floats<S> = f32x16<S>;
pub(crate) type Ints<S> = i32x16<S>;
pub(crate) type Mask<S> = mask32x16<S>;
/// Points or vectors: x, y and z of all lanes.
pub(crate) type Vecs<S> = [Floats<S>; 3];

/// The same for each axis, whose number `$a` is. A macro, as vectors only stay in registers in code that is inlined for certain.
macro_rules! axes {
    ($a:ident => $value:expr) => {
        [
            {
                let $a = 0;
                $value
            },
            {
                let $a = 1;
                $value
            },
            {
                let $a = 2;
                $value
            },
        ]
    };
}
pub(crate) use axes;

/// Numbers of the lanes that are set.
#[inline(always)]
pub(crate) fn numbers<S: Simd>(of: Mask<S>) -> impl Iterator<Item = usize> {
    let mut bits = of.to_bitmask();
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}

/// a at w = 0 to b at w = 1. This form keeps the sign that a and b share, whatever is rounded; a + (b − a)·w does not.
#[inline(always)]
pub(crate) fn mix<S: Simd>(a: Floats<S>, b: Floats<S>, w: Floats<S>) -> Floats<S> {
    a * (1.0 - w) + b * w
}

#[inline(always)]
pub(crate) fn lerp<S: Simd>(p: &Vecs<S>, q: &Vecs<S>, u: Floats<S>) -> Vecs<S> {
    axes!(a => mix(p[a], q[a], u))
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(p: &Vecs<S>, q: &Vecs<S>) -> Floats<S> {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

/// float64 for all lanes.
#[derive(Clone, Copy)]
pub(crate) struct Doubles<S: Simd>(f64x8<S>, f64x8<S>);

impl<S: Simd> Doubles<S> {
    #[inline(always)]
    pub fn splat(simd: S, v: f64) -> Self {
        Self(f64x8::splat(simd, v), f64x8::splat(simd, v))
    }

    #[inline(always)]
    pub fn of(v: Floats<S>) -> Self {
        let (low, high) = v.widen();
        Self(low, high)
    }

    #[inline(always)]
    pub fn to_floats(self) -> Floats<S> {
        self.0.narrow(self.1)
    }

    /// These in the lanes of `of`, others elsewhere.
    #[inline(always)]
    pub fn chosen(self, of: Mask<S>, others: Self) -> Self {
        let (low, high) = of.widen();
        Self(low.select(self.0, others.0), high.select(self.1, others.1))
    }

    /// Of as many numbers as there are lanes.
    #[inline(always)]
    pub fn from_slice(simd: S, v: &[f64]) -> Self {
        let (low, high) = v.split_at(LANES / 2);
        Self(f64x8::from_slice(simd, low), f64x8::from_slice(simd, high))
    }

    #[inline(always)]
    pub fn to_array(self) -> [f64; LANES] {
        let mut v = [0.0; LANES];
        v[..LANES / 2].copy_from_slice(self.0.as_slice());
        v[LANES / 2..].copy_from_slice(self.1.as_slice());
        v
    }

    #[inline(always)]
    pub fn floor(self) -> Self {
        Self(self.0.floor(), self.1.floor())
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
}

macro_rules! lane_by_lane {
    ($($operator:ident $function:ident),*) => {
        $(impl<S: Simd> $operator for Doubles<S> {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(self.0.$function(other.0), self.1.$function(other.1))
            }
        })*
    };
}
lane_by_lane!(Add add, Sub sub, Mul mul);

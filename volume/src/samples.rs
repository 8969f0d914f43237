//! The numbers of a scan, kept in the type of their file.

/// One sample type: how it widens to the floats that the mathematics is done in. All widenings are exact.
pub trait Sample: Copy + Send + Sync + PartialOrd + 'static {
    /// Its name in `--raw`, in `info` and in messages.
    const NAME: &'static str;
    /// Widened to float32; exact, as integers have at most 16 bits.
    fn to_f32(self) -> f32;
    /// As a whole number; exact for integers.
    fn to_i32(self) -> i32;
    /// Widened to float64; exact.
    fn to_f64(self) -> f64 {
        f64::from(self.to_f32())
    }
}

macro_rules! sample {
    ($($t:ty),*) => {$(
        impl Sample for $t {
            const NAME: &'static str = stringify!($t);
            #[inline(always)]
            fn to_f32(self) -> f32 { f32::from(self) }
            #[inline(always)]
            fn to_i32(self) -> i32 { self as i32 }
        }
    )*};
}
sample!(u8, i16, u16, f32);

/// The samples of a volume, i fastest, then j, then k.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Unsigned bytes.
    U8(Vec<u8>),
    /// Signed 16-bit integers, as CT stores them.
    I16(Vec<i16>),
    /// Unsigned 16-bit integers.
    U16(Vec<u16>),
    /// Finite float32.
    F32(Vec<f32>),
}

/// Runs `$body` with `$s` bound to the typed slice inside a [`Samples`], compiled once for each type.
#[macro_export]
macro_rules! with_samples {
    ($samples:expr, $s:ident => $body:expr) => {
        match $samples {
            $crate::Samples::U8($s) => $body,
            $crate::Samples::I16($s) => $body,
            $crate::Samples::U16($s) => $body,
            $crate::Samples::F32($s) => $body,
        }
    };
}

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        with_samples!(self, s => s.len())
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The name of the sample type: `u8`, `i16`, `u16` or `f32`.
    pub fn type_name(&self) -> &'static str {
        fn name<T: Sample>(_: &[T]) -> &'static str {
            T::NAME
        }
        with_samples!(self, s => name(s))
    }

    /// Memory that the samples take.
    pub fn bytes(&self) -> usize {
        with_samples!(self, s => size_of_val(s.as_slice()))
    }

    /// Sample number `index`, widened.
    pub fn get_f64(&self, index: usize) -> f64 {
        with_samples!(self, s => s[index].to_f64())
    }
}

//! Arithmetic of AVX2 and AVX-512 registers. The two differ only in the names of the intrinsics.
//!
//! Safety of every `unsafe` block in this file: see the documentation of the module that uses the macro.

/// Implements [`Register`](super::elementary::Register) for a register type, from the given intrinsics, and defines a
/// function that runs kernels on such registers.
macro_rules! arithmetic {
    (
        $lanes:ident:
        run with $features:literal,
        operators($($operator:ident $method:ident $intrinsic:ident),*),
        splat $splat:ident, multiply_add $multiply_add:ident, min $min:ident, max $max:ident, xor $xor:ident, round $round:ident,
        integers: splat $splat_integer:ident, add $add_integer:ident, sub $sub_integer:ident,
        shift_left $shift_left:ident, shift_right $shift_right:ident,
        to $to_integer:ident, from $from_integer:ident,
        bits: to $to_bits:ident, from $from_bits:ident,
        select($value:ident, $then:ident, $otherwise:ident) $select:expr
    ) => {
        $crate::lanes::elementary::register_scalar!($lanes, $crate::lanes::elementary::exp, $crate::lanes::elementary::ln);

        $crate::operators::operators! {
            {} $lanes, a, b:
            // SAFETY: see the module documentation.
            $($operator $method Self(unsafe { $intrinsic(a.0, b.0) })),*;
            Neg Self(unsafe { $xor(a.0, $splat(-0.0)) })
        }

        /// Runs a kernel. [`is_available`] must return true.
        pub(super) fn run<K: $crate::lanes::Kernel>(kernel: K) -> K::Output {
            #[target_feature(enable = $features)]
            fn run_with_features<K: $crate::lanes::Kernel>(kernel: K) -> K::Output {
                kernel.run::<$lanes>()
            }
            debug_assert!(is_available());
            // SAFETY: see the module documentation.
            unsafe { run_with_features(kernel) }
        }

        impl $crate::lanes::elementary::Register for $lanes {
            #[inline(always)]
            fn splat(value: f32) -> Self {
                // SAFETY: see the module documentation.
                Self(unsafe { $splat(value) })
            }
            #[inline(always)]
            fn multiply_add(self, b: Self, c: Self) -> Self {
                // SAFETY: see the module documentation.
                Self(unsafe { $multiply_add(self.0, b.0, c.0) })
            }
            #[inline(always)]
            fn select(self, then: Self, otherwise: Self) -> Self {
                let ($value, $then, $otherwise) = (self.0, then.0, otherwise.0);
                // SAFETY: see the module documentation.
                Self(unsafe { $select })
            }
            #[inline(always)]
            fn clamp(self, low: f32, high: f32) -> Self {
                // SAFETY: see the module documentation.
                Self(unsafe { $min($max(self.0, $splat(low)), $splat(high)) })
            }
            #[inline(always)]
            fn round(self) -> Self {
                use std::arch::x86_64::{_MM_FROUND_NO_EXC, _MM_FROUND_TO_NEAREST_INT};
                const NEAREST: i32 = _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC;
                // SAFETY: see the module documentation.
                Self(unsafe { $round::<NEAREST>(self.0) })
            }
            #[inline(always)]
            fn power_of_two(self) -> Self {
                // SAFETY: see the module documentation.
                Self(unsafe {
                    let biased = $add_integer($to_integer(self.0), $splat_integer(127));
                    $from_bits($shift_left::<23>(biased))
                })
            }
            #[inline(always)]
            fn split(self) -> (Self, Self) {
                // SAFETY: see the module documentation.
                unsafe {
                    let bits = $to_bits(self.0);
                    let offset = $sub_integer(
                        bits,
                        $splat_integer($crate::lanes::elementary::SQRT_HALF_BITS),
                    );
                    let exponent = $shift_right::<23>(offset);
                    let mantissa = $sub_integer(bits, $shift_left::<23>(exponent));
                    (Self($from_bits(mantissa)), Self($from_integer(exponent)))
                }
            }
        }
    };
}

pub(super) use arithmetic;

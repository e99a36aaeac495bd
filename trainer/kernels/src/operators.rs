//! Operators of number types.

/// Implements the operators of a type, given its generic parameters in braces, as expressions of `a` and `b`.
macro_rules! operators {
    (
        $generics:tt $type:ty, $a:ident, $b:ident:
        $($operator:ident $method:ident $value:expr),*; Neg $negative:expr
    ) => {
        $($crate::operators::operators!(
            @implement $generics $operator $method $type, $a, ($b: Self) $value
        );)*
        $crate::operators::operators!(@implement $generics Neg neg $type, $a, () $negative);
    };
    (
        @implement {$($generics:tt)*} $operator:ident $method:ident $type:ty,
        $a:ident, ($($b:ident: Self)?) $value:expr
    ) => {
        impl<$($generics)*> std::ops::$operator for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self $(, $b: Self)?) -> Self {
                let $a = self;
                $value
            }
        }
    };
}
pub(crate) use operators;

//! Saving and restoring the numbers that change while a recursion runs, so it can be continued elsewhere.
//!
//! One function visits these numbers for both purposes: reading the numbers saves the recursion, and writing them
//! restores it, so the two orders cannot differ. A restored recursion continues with bit-identical results. Counters
//! are visited as numbers as well; they stay below `2^53`, up to which f64 represents integers exactly. Shape and
//! options are not part of the state: restore it into a recursion that was built with the same shape and options.

/// Part of a recursion with numbers that can be saved.
pub trait State {
    /// Passes every number to `each`, which may change it.
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64));
}

/// Visits several parts in the given order.
pub fn visit_all(parts: &mut [&mut dyn State], each: &mut dyn FnMut(&mut f64)) {
    for part in parts {
        part.visit(each);
    }
}

impl State for f64 {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        each(self);
    }
}

impl State for bool {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let mut number = f64::from(u8::from(*self));
        each(&mut number);
        *self = number != 0.0;
    }
}

/// Upper limit of restored 64-bit counters; `MAX_COUNT_32` is the limit for 32-bit counters. No run reaches them, so
/// counting never overflows even after invalid numbers were restored.
const MAX_COUNT: f64 = 9_007_199_254_740_992.0;
const MAX_COUNT_32: f64 = 2_147_483_648.0;
const MAX_COUNT_USIZE: f64 = if usize::BITS > 32 { MAX_COUNT } else { MAX_COUNT_32 };

macro_rules! counters {
    ($($type:ty, $most:expr);+) => {$(
        impl State for $type {
            fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
                let mut number = *self as f64;
                each(&mut number);
                *self = if number > $most { $most as $type } else { number as $type };
            }
        }
    )+};
}
counters!(u32, MAX_COUNT_32; u64, MAX_COUNT; usize, MAX_COUNT_USIZE);

impl<T: State> State for [T] {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.iter_mut().for_each(|part| part.visit(each));
    }
}

impl<T: State, const N: usize> State for [T; N] {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.as_mut_slice().visit(each);
    }
}

impl<T: State + ?Sized> State for &mut T {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        (**self).visit(each);
    }
}

/// Implements [`State`] for a type by the named fields: `state!([const N: usize] Type<N> { field, field })`. If
/// `, bounded` follows the fields, the type must have a method of that name that limits indices, lengths and counts to
/// their valid ranges, since the restored numbers may come from any source.
#[macro_export]
macro_rules! state {
    ([$($generics:tt)*] $type:ty { $($field:ident),+ $(,)? }) => {
        impl<$($generics)*> $crate::state::State for $type {
            fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
                $crate::state::visit_all(&mut [$(&mut self.$field),+], each);
            }
        }
    };
    ([$($generics:tt)*] $type:ty { $($field:ident),+ $(,)? }, $bounded:ident) => {
        impl<$($generics)*> $crate::state::State for $type {
            fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
                $crate::state::visit_all(&mut [$(&mut self.$field),+], each);
                self.$bounded();
            }
        }
    };
}

//! The numbers that change while a recursion runs, so that it can be saved and go on elsewhere.
//!
//! One function visits them in both directions: to read them is to save, to write them is to
//! restore, and the two cannot differ in order. A restored recursion goes on with the same digits.
//! Counters are numbers as well; those of a recursion stay below `2^53`, up to which f64 holds them
//! exactly. Shape and options are not part of the state: restore it into a recursion that was made
//! with the same ones.

/// A part of a recursion with numbers to be saved.
pub trait State {
    /// Shows every number to `each`, which may change it.
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64));
}

/// Visits the parts in their order.
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

macro_rules! counters {
    ($($type:ty),+) => {$(
        impl State for $type {
            fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
                let mut number = *self as f64;
                each(&mut number);
                *self = number as $type;
            }
        }
    )+};
}
counters!(u32, u64, usize);

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

/// Makes a type a [`State`] of the fields that are named:
/// `state!([const N: usize] Type<N> { field, field })`.
#[macro_export]
macro_rules! state {
    ([$($generics:tt)*] $type:ty { $($field:ident),+ $(,)? }) => {
        impl<$($generics)*> $crate::state::State for $type {
            fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
                $crate::state::visit_all(&mut [$(&mut self.$field),+], each);
            }
        }
    };
}

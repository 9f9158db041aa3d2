//! Data at a fixed address, so that C may keep a pointer to it.

use std::ptr::NonNull;

/// An owned heap value whose address does not change when the owner is moved.
///
/// Unlike a `Box`, moving a `Pinned` does not assert unique access, so pointers passed to C remain valid. Rule: C uses
/// its copy of the pointer only during calls through a `&mut` of the owner, while no reference from
/// [`get`](Pinned::get) or [`get_mut`](Pinned::get_mut) is live.
pub(crate) struct Pinned<T>(NonNull<T>);

impl<T> Pinned<T> {
    pub(crate) fn new(value: T) -> Self {
        Self(NonNull::from(Box::leak(Box::new(value))))
    }

    pub(crate) fn get(&self) -> &T {
        // SAFETY: the value is owned and alive. During a shared borrow of the owner, the calls in which C writes
        // through its pointer are impossible.
        unsafe { self.0.as_ref() }
    }

    pub(crate) fn get_mut(&mut self) -> &mut T {
        // SAFETY: as in `get`, with a unique borrow of the owner.
        unsafe { self.0.as_mut() }
    }

    /// Returns the address to be passed to C.
    pub(crate) fn address(&self) -> NonNull<T> {
        self.0
    }

    /// Returns the owned value.
    pub(crate) fn into_inner(self) -> T {
        let address = self.0.as_ptr();
        std::mem::forget(self);
        // SAFETY: the address came from a Box in `new`; self is forgotten, so the value is released only here.
        *unsafe { Box::from_raw(address) }
    }
}

impl<T> Drop for Pinned<T> {
    fn drop(&mut self) {
        // SAFETY: the address came from a Box in `new` and is freed only here.
        drop(unsafe { Box::from_raw(self.0.as_ptr()) });
    }
}

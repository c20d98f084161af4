//! Samples on emitters.

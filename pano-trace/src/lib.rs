//! Ray tracing for virtual objects in 360° pictures: BVH, BSDFs, panoramic ray tracing, delta path tracing.

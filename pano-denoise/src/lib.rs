//! Edge-preserving filters for path-traced layers.

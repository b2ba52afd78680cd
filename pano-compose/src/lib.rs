//! Differential compositing, the effect plan, and the frame pipeline that joins Pano'\''s stages.

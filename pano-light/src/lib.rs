//! Light from a 360° picture: inverse tone mapping, light detection, image-based lighting.

//! What a file's R, G and B are, and the way from there to linear Rec.709.

use glam::{DMat3, DVec3, Vec2};

/// CIE 1931 (x, y) of a file's primaries and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chromaticities {
    /// Red primary.
    pub red: Vec2,
    /// Green primary.
    pub green: Vec2,
    /// Blue primary.
    pub blue: Vec2,
    /// White point.
    pub white: Vec2,
}

impl Chromaticities {
    /// ITU-R BT.709 with white D65, as OpenEXR's specification gives it.
    pub const REC709: Self = Self {
        red: Vec2::new(0.64, 0.33),
        green: Vec2::new(0.30, 0.60),
        blue: Vec2::new(0.15, 0.06),
        white: Vec2::new(0.3127, 0.3290),
    };

    /// The matrix to linear Rec.709, with Bradford adaptation of the white; `Some(None)` if these are Rec.709 already (within
    /// the ±0.001 to which files round them); `None` if the numbers are no set of primaries.
    pub(super) fn to_rec709(self) -> Option<Option<DMat3>> {
        let close = |a: Vec2, b: Vec2| (a - b).abs().max_element() < 1e-3;
        let target = Self::REC709;
        if close(self.red, target.red)
            && close(self.green, target.green)
            && close(self.blue, target.blue)
            && close(self.white, target.white)
        {
            return Some(None);
        }
        // Bradford's cone response matrix (Lam 1985), columns here.
        let cone = DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);
        let adapt = DMat3::from_diagonal((cone * xyz(target.white)) / (cone * xyz(self.white)));
        let matrix = target.xyz_from_rgb().inverse() * cone.inverse() * adapt * cone * self.xyz_from_rgb();
        matrix.is_finite().then_some(Some(matrix))
    }

    /// XYZ of linear RGB, with Y = 1 for white.
    fn xyz_from_rgb(self) -> DMat3 {
        let primaries = DMat3::from_cols(xyz(self.red), xyz(self.green), xyz(self.blue));
        primaries * DMat3::from_diagonal(primaries.inverse() * xyz(self.white))
    }
}

/// XYZ of a chromaticity, with Y = 1.
fn xyz(xy: Vec2) -> DVec3 {
    let (x, y) = (f64::from(xy.x), f64::from(xy.y));
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rec709_needs_no_matrix_and_nonsense_has_none() {
        assert_eq!(Chromaticities::REC709.to_rec709(), Some(None));
        assert_eq!(Chromaticities { white: Vec2::ZERO, ..Chromaticities::REC709 }.to_rec709(), None);
        assert_eq!(Chromaticities { green: Vec2::new(0.64, 0.33), ..Chromaticities::REC709 }.to_rec709(), None);
    }

    /// White stays white under any white point, and Rec.2020 has its published matrix to Rec.709 (ITU-R BT.2087).
    #[test]
    fn white_stays_white_and_rec2020_is_as_published() {
        let rec2020 = Chromaticities {
            red: Vec2::new(0.708, 0.292),
            green: Vec2::new(0.170, 0.797),
            blue: Vec2::new(0.131, 0.046),
            white: Vec2::new(0.3127, 0.3290),
        };
        let d60 = Chromaticities { white: Vec2::new(0.32168, 0.33767), ..rec2020 };
        for source in [rec2020, d60] {
            let matrix = source.to_rec709().unwrap().unwrap();
            assert!((matrix * DVec3::ONE).distance(DVec3::ONE) < 1e-6, "{source:?}");
        }
        let red = rec2020.to_rec709().unwrap().unwrap() * DVec3::X;
        assert!(red.distance(DVec3::new(1.6605, -0.1246, -0.0182)) < 1e-3, "{red}");
    }
}

//! AprilTags in a perspective picture, by the detector of `kornia-apriltag`.

use glam::Vec2;
use kornia_apriltag::decoder::Detection;
use kornia_apriltag::family::TagFamilyKind;
use kornia_apriltag::{AprilTagDecoder, DecodeTagsConfig};
use kornia_image::{Image as KorniaImage, ImageSize};
use pano_core::color::luminance;
use pano_core::image::RadianceImage;
use pano_core::{Error, Result};

/// A marker in a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    pub(super) id: u32,
    /// Top right, bottom right, bottom left and top left of the print, in pixels.
    pub(super) at: [Vec2; 4],
}

/// Looks for the markers of one family.
pub(super) struct Detector {
    family: TagFamilyKind,
}

/// By how much the detector reduces the picture before it looks for squares, one after the other: the smallest need every pixel,
/// and large ones are missed at some angles unless reduced. Their edges are refined in the whole picture.
const REDUCTIONS: [usize; 3] = [1, 2, 4];
/// Decisions with a smaller margin (in 8-bit codes) are chance.
const LEAST_MARGIN: f32 = 10.0;

impl Detector {
    pub(super) fn new(family: &str) -> Result<Self> {
        Ok(Self { family: kind_of(family)? })
    }

    /// All markers in `picture`; none if the picture is too small for any, or too large for the detector.
    pub(super) fn detect(&self, picture: &RadianceImage) -> Vec<Corners> {
        self.try_detect(picture).unwrap_or_default()
    }

    fn try_detect(&self, picture: &RadianceImage) -> Option<Vec<Corners>> {
        let (width, height) = picture.size();
        // Linear, or blurred edges would lie to one side; bright light clips, and dark pictures are lifted, as the white of the
        // paper is what counts.
        let mut sorted: Vec<f32> = picture.data().iter().map(|&p| luminance(p)).collect();
        let white = sorted.len() * 98 / 100;
        let (_, white, _) = sorted.select_nth_unstable_by(white.min(picture.data().len() - 1), f32::total_cmp);
        let scale = if *white > 0.0 { 0.9 / *white } else { 1.0 };
        let gray = picture.data().iter().map(|&p| (luminance(p) * scale * 255.0).round() as u8).collect();
        let size = ImageSize { width, height };
        let image = KorniaImage::<u8, 1>::new(size, gray).ok()?;
        let mut found: Vec<Detection> = Vec::new();
        for factor in REDUCTIONS {
            let mut config = DecodeTagsConfig::new(vec![self.family.clone()]).ok()?;
            config.downscale_factor = factor;
            let Ok(mut decoder) = AprilTagDecoder::new(config, size) else { continue };
            let good = decoder.decode(&image).unwrap_or_default().into_iter().filter(|d| d.decision_margin >= LEAST_MARGIN);
            let new: Vec<Detection> = good.filter(|d| found.iter().all(|known| known.id != d.id)).collect();
            found.extend(new);
        }
        // The quad's corners come in the order they were found; the homography knows how the print is turned.
        let corner = |d: &Detection, x: f32, y: f32| {
            let at = d.quad.homography_project(x, y);
            Vec2::new(at.x, at.y)
        };
        let corners = |d: &Detection| [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(x, y)| corner(d, x, y));
        Some(found.iter().map(|d| Corners { id: d.id.into(), at: corners(d) }).collect())
    }
}

/// The family of that name.
pub(super) fn kind_of(family: &str) -> Result<TagFamilyKind> {
    use TagFamilyKind as K;
    Ok(match family {
        "tag36h11" => K::Tag36H11,
        "tag16h5" => K::Tag16H5,
        "tag25h9" => K::Tag25H9,
        "tag36h10" => K::Tag36H10,
        "tagcircle21h7" => K::TagCircle21H7,
        "tagcircle49h12" => K::TagCircle49H12,
        "tagcustom48h12" => K::TagCustom48H12,
        "tagstandard41h12" => K::TagStandard41H12,
        "tagstandard52h13" => K::TagStandard52H13,
        other => return Err(Error::argument(format!("markers: there is no family `{other}`"))),
    })
}

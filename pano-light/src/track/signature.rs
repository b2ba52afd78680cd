//! What a frame looks like, in a few numbers: to tell a cut from a change of light.

use crate::WorkingMap;
use crate::expand::LUMA_WEIGHTS;

/// Columns and rows of the small picture.
const SIZE: (usize, usize) = (25, 12);
/// Of the mean luminance, added before logarithms: changes in the dark are not seen.
const DARK: f32 = 0.05;
/// Below this correlation of what the rows show beside their means, two frames are different pictures. Successive frames of
/// video correlate above 0.9, also when a lamp goes on; of unrelated panoramas few correlate above 0.3.
const ALIKE: f32 = 0.4;
/// Mean difference of log-luminance, without a common change of exposure, below which two frames are the same whatever their
/// correlation: in an almost uniform picture that is one of noise.
const EQUAL: f32 = 0.15;

/// Log-luminance of a 25×12 reduction.
#[derive(Clone, Debug)]
pub(super) struct Signature {
    cells: Vec<f32>,
}

impl Signature {
    pub(super) fn of(map: &WorkingMap) -> Self {
        let (w, h) = SIZE;
        let (cw, ch) = (WorkingMap::WIDTH / w, WorkingMap::HEIGHT / h);
        let mut cells = vec![0.0; w * h];
        for (y, row) in map.radiance().data().chunks_exact(WorkingMap::WIDTH).enumerate() {
            for (x, pixels) in row.chunks_exact(cw).enumerate() {
                cells[y / ch * w + x] += pixels.iter().map(|p| p.dot(LUMA_WEIGHTS)).sum::<f32>();
            }
        }
        // Median, not mean: a flickering sun must not change what the rest looks like.
        let mut sorted = cells.clone();
        sorted.sort_by(f32::total_cmp);
        let dark = (DARK * sorted[sorted.len() / 2]).max(1e-20);
        cells.iter_mut().for_each(|c| *c = (*c + dark).ln());
        Self { cells }
    }

    /// Whether `next` shows another place.
    pub(super) fn is_cut(&self, next: &Self) -> bool {
        let n = self.cells.len() as f32;
        let exposure = self.cells.iter().zip(&next.cells).map(|(a, b)| b - a).sum::<f32>() / n;
        let difference = self.cells.iter().zip(&next.cells).map(|(a, b)| (b - a - exposure).abs()).sum::<f32>() / n;
        difference > EQUAL && correlation(&self.beside_rows(), &next.beside_rows()) < ALIKE
    }

    /// Cells without their rows' means: bright skies over dark grounds are alike everywhere.
    fn beside_rows(&self) -> Vec<f32> {
        let rows = self.cells.chunks_exact(SIZE.0);
        rows.flat_map(|row| {
            let mean = row.iter().sum::<f32>() / row.len() as f32;
            row.iter().map(move |c| c - mean)
        })
        .collect()
    }
}

/// Of values with mean 0; 0 where one is constant.
fn correlation(a: &[f32], b: &[f32]) -> f32 {
    let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
    let norm = (product(a, a) * product(b, b)).sqrt();
    if norm > 0.0 { product(a, b) / norm } else { 0.0 }
}

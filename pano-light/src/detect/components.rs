//! Connected components of a mask on the sphere's upper half.

use pano_core::image::Image;

/// The components of `mask`, as indices of their pixels, in the order their first pixels are met: 8-connected, the left
/// and the right edge of the picture are neighbours. Found breadth-first.
pub(crate) fn components(mask: &Image<bool>) -> Vec<Vec<usize>> {
    let (w, h) = mask.size();
    let mut open = mask.data().to_vec();
    let mut found = Vec::new();
    for start in 0..open.len() {
        if !open[start] {
            continue;
        }
        open[start] = false;
        let mut pixels = vec![start];
        let mut next = 0;
        while let Some(&pixel) = pixels.get(next) {
            next += 1;
            let (x, y) = (pixel % w, pixel / w);
            for y in y.saturating_sub(1)..=(y + 1).min(h - 1) {
                for x in [(x + w - 1) % w, x, (x + 1) % w] {
                    let neighbour = y * w + x;
                    if open[neighbour] {
                        open[neighbour] = false;
                        pixels.push(neighbour);
                    }
                }
            }
        }
        found.push(pixels);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of pixels of each component of a mask drawn with `#`.
    fn sizes(rows: &[&str]) -> Vec<usize> {
        let mask = Image::from_fn(rows[0].len(), rows.len(), |x, y| rows[y].as_bytes()[x] == b'#');
        components(&mask).iter().map(Vec::len).collect()
    }

    #[test]
    fn diagonals_and_the_seam_connect_and_the_upper_edge_does_not() {
        assert_eq!(sizes(&["#....", ".#..."]), [2]);
        assert_eq!(sizes(&["#....", "....#"]), [2], "over the seam, diagonally");
        assert_eq!(sizes(&["#.#..", "....."]), [1, 1]);
        assert_eq!(sizes(&["#", "#"]), [2], "one column is its own neighbour");
        assert_eq!(sizes(&["...", "..."]), [0usize; 0]);
        assert_eq!(sizes(&["##.##", ".....", "..#.."]), [4, 1]);
    }
}

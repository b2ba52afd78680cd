//! How far hierarchical and linear marching agree in a panorama's depth: `agreement DEPTH.exr [RAYS [STEPS]]`, or in that of the
//! demo's room if there is no file (`-`).

use pano_core::camera::Projection;
use pano_core::depth::DepthFormat;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: usize| arguments.get(k).map_or(Ok(default), |text| text.parse());
    let depth = match arguments.first().map(String::as_str) {
        None | Some("-") => pano_compose::demo::room_depth(2048)?,
        Some(file) => pano_core::io::read_depth(file, &DepthFormat::default(), Projection::Panorama)?.into_image(),
    };
    let (rays, steps) = (number(1, 1_000_000)?, number(2, 8192)?);
    let found = pano_tests::agreement::agreement(&depth, rays, steps);
    println!("{rays} rays, {steps} steps: {:.3} % agree; {} differ away from gaps", 100.0 * found.share(), found.unexplained);
    Ok(())
}

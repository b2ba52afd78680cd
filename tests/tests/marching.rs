//! Marching in the demo's room.

use pano_tests::agreement::agreement;

/// Over the min/max pyramid as in small equal steps, for 99.9 % of random rays; where the two differ, the ray meets the rim of
/// a gap, whose half cell is thinner than a step, or two surfaces within a step. (`--example agreement` does it with any depth and any number of rays.)
#[test]
fn hierarchical_and_linear_marching_agree_in_the_demo_room() {
    let depth = pano_compose::demo::room_depth(1024).unwrap();
    let found = agreement(&depth, 40_000, 4096);
    assert!(found.share() >= 0.999 && found.unexplained <= 4, "{found:?}");
}

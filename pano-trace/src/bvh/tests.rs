use super::*;
use glam::{Affine3A, Quat, Vec3};
use proptest::prelude::*;
use std::sync::Arc;

type Soup = (Vec<Vec3>, Vec<[u32; 3]>);

fn soup(max: usize) -> impl Strategy<Value = Soup> {
    let vertex = (-2.0f32..2.0, -2.0f32..2.0, -2.0f32..2.0).prop_map(|(x, y, z)| Vec3::new(x, y, z));
    prop::collection::vec([vertex.clone(), vertex.clone(), vertex], 1..max).prop_map(|t| {
        let n = t.len() as u32;
        (t.concat(), (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    })
}

fn unit() -> impl Strategy<Value = Vec3> {
    (-1.0f32..1.0, 0.0f32..std::f32::consts::TAU)
        .prop_map(|(y, l)| Vec3::new((1.0 - y * y).sqrt() * l.sin(), y, (1.0 - y * y).sqrt() * l.cos()))
}

/// Möller–Trumbore in f64 over every face.
fn brute_force(soup: &Soup, ray: &Ray) -> Option<f64> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    soup.1
        .iter()
        .filter_map(|t| {
            let [a, b, c] = t.map(|v| soup.0[v as usize].as_dvec3());
            let (e1, e2) = (b - a, c - a);
            let p = d.cross(e2);
            let det = e1.dot(p);
            if det.abs() < 1e-12 {
                return None;
            }
            let s = o - a;
            let (u, q) = (s.dot(p) / det, s.cross(e1));
            let (v, t) = (d.dot(q) / det, e2.dot(q) / det);
            // Rays that pass within 1e-5 of an edge may go either way in f32.
            (u > 1e-5 && v > 1e-5 && u + v < 1.0 - 1e-5 && t > 1e-6).then_some(t)
        })
        .min_by(f64::total_cmp)
}

proptest! {
    #[test]
    fn instances_find_what_brute_force_finds(
        soup in soup(60), origin in (-4.0f32..4.0, -4.0f32..4.0, -4.0f32..4.0), d in unit(), yaw in -3.0f32..3.0, scale in 0.1f32..3.0,
    ) {
        let place = Affine3A::from_scale_rotation_translation(Vec3::splat(scale), Quat::from_rotation_y(yaw), Vec3::new(0.3, -0.2, 0.1));
        let tlas = Tlas::build([(Arc::new(Blas::build(&soup.0, &soup.1)), place)]);
        let ray = Ray::new(Vec3::from(origin), d);
        let world: Soup = (soup.0.iter().map(|&p| place.transform_point3(p)).collect(), soup.1.clone());
        let found = tlas.intersect(&ray);
        if let Some(expected) = brute_force(&world, &ray) {
            let hit = found.expect("a hit");
            prop_assert!(hit.hit.t as f64 <= expected + 1e-3);
            prop_assert!(tlas.occluded(&ray.up_to(expected as f32 * 1.01 + 1e-3)));
        }
        if let Some(h) = found {
            // The barycentrics name the same point as the distance.
            let [a, b, c] = world.1[h.hit.triangle as usize].map(|v| world.0[v as usize]);
            let w = h.hit.barycentric;
            let p = a * (1.0 - w.x - w.y) + b * w.x + c * w.y;
            // A face seen edge on is badly conditioned; compare along its normal's reach.
            let n = (b - a).cross(c - a).normalize_or_zero();
            if n.dot(d).abs() > 0.05 {
                prop_assert!(p.distance(ray.at(h.hit.t)) < 1e-2, "{p} {}", ray.at(h.hit.t));
            }
            prop_assert!(tlas.occluded(&ray));
            prop_assert!(!tlas.occluded(&ray.up_to(h.hit.t * 0.99)) || tlas.intersect(&ray.up_to(h.hit.t * 0.99)).is_some());
        }
    }

    #[test]
    fn faces_along_a_ray_are_those_that_one_ray_after_another_finds(
        soup in soup(120), origin in (-4.0f32..4.0, -4.0f32..4.0, -4.0f32..4.0), d in unit(), left_out in 0u32..3,
    ) {
        let blas = Arc::new(Blas::build(&soup.0, &soup.1));
        let places = [0.0f32, 0.7, 1.9].map(|x| (blas.clone(), Affine3A::from_translation(Vec3::X * x)));
        let among = |i: u32| i != left_out;
        let tlas = Tlas::build(places.clone());
        let alone = Tlas::build((0..3u32).filter(|&i| among(i)).map(|i| places[i as usize].clone()));
        let ray = Ray::new(Vec3::from(origin), d).up_to(6.0);
        let mut faces = tlas.faces_among(&ray, among);
        let mut beyond = 0.0;
        loop {
            let expected = alone.intersect_beyond(&ray, beyond);
            let found = faces.next_beyond(beyond);
            prop_assert_eq!(found.map(|hit| hit.hit.t), expected.map(|hit| hit.hit.t));
            let Some(hit) = found else { break };
            prop_assert!(among(hit.instance));
            beyond = hit.hit.t * (1.0 + 1e-6) + 1e-7;
        }
    }

    #[test]
    fn a_moved_instance_is_a_moved_ray(soup in soup(20), d in unit(), shift in (-5.0f32..5.0, -5.0f32..5.0, -5.0f32..5.0)) {
        let blas = Arc::new(Blas::build(&soup.0, &soup.1));
        let shift = Vec3::from(shift);
        let here = Tlas::build([(blas.clone(), Affine3A::IDENTITY)]);
        let there = Tlas::build([(blas, Affine3A::from_translation(shift))]);
        let (a, b) = (here.intersect(&Ray::new(Vec3::ZERO, d)), there.intersect(&Ray::new(shift, d)));
        // Rounding of the shift may move a ray over an edge: distances agree or both are edge cases.
        if let (Some(a), Some(b)) = (a, b) && a.hit.triangle == b.hit.triangle {
            prop_assert!((a.hit.t - b.hit.t).abs() < 1e-3 * (1.0 + a.hit.t) || soup.1.len() > 1);
        }
    }

    #[test]
    fn an_offset_point_does_not_meet_its_own_plane(p in (-9.0f32..9.0, -9.0f32..9.0, -9.0f32..9.0), n in unit(), d in unit()) {
        prop_assume!(n.dot(d) > 1e-3);
        let p = Vec3::from(p);
        let (t, b) = n.any_orthonormal_pair();
        let blas = Blas::build(&[p + t * 3.0, p - t * 2.0 + b * 2.0, p - t * 2.0 - b * 2.0], &[[0, 1, 2]]);
        prop_assert!(!blas.occluded(&Ray::new(offset_point(p, n), d)));
    }
}

#[test]
fn degenerate_faces_and_nothing_at_all_are_never_hit() {
    let blas = Blas::build(&[Vec3::ZERO, Vec3::X, Vec3::X * 2.0], &[[0, 1, 2], [0, 0, 0]]);
    assert!(blas.intersect(&Ray::new(Vec3::new(0.5, 1.0, 0.0), Vec3::NEG_Y)).is_none());
    let empty = Tlas::build([]);
    assert!(empty.intersect(&Ray::new(Vec3::ZERO, Vec3::X)).is_none() && !empty.occluded(&Ray::new(Vec3::ZERO, Vec3::X)));
}

#[test]
fn the_nearest_of_two_instances_wins_whatever_their_order() {
    let quad = ([Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)], [[0, 1, 2]]);
    let blas = Arc::new(Blas::build(&quad.0, &quad.1));
    for (near, order) in [(0, [-2.0, -5.0]), (1, [-5.0, -2.0])] {
        let tlas = Tlas::build(order.map(|z| (blas.clone(), Affine3A::from_translation(Vec3::Z * z))));
        let hit = tlas.intersect(&Ray::new(Vec3::ZERO, Vec3::NEG_Z)).unwrap();
        assert_eq!((hit.instance, hit.hit.t), (near, 2.0));
    }
}

/// Exactly through an edge or a corner, from both sides: no ray falls between two faces.
#[test]
fn rays_through_edges_meet_a_face() {
    let corners = [Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 0.0, -1.0), Vec3::new(1.0, 0.0, 1.0), Vec3::new(-1.0, 0.0, 1.0)];
    let points = [&corners[..], &[Vec3::ZERO]].concat();
    for faces in [&[[0, 1, 2], [0, 2, 3]][..], &[[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]] {
        let blas = Blas::build(&points, faces);
        for side in [1.0, -1.0] {
            for at in [Vec3::ZERO, Vec3::new(0.5, 0.0, 0.5), Vec3::new(-0.25, 0.0, -0.25)] {
                for slope in [Vec3::ZERO, Vec3::new(0.5, 0.0, 0.5), Vec3::X] {
                    let origin = at + (Vec3::Y * side - slope) * 2.0;
                    let ray = Ray::new(origin, (at - origin).normalize());
                    assert!(blas.intersect(&ray).is_some() && blas.occluded(&ray), "{faces:?} {ray:?}");
                }
            }
        }
    }
}

/// A builder that splits by position finds no plane between faces that lie in one place: it must end all the same.
#[test]
fn faces_in_one_place_are_met_as_one() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mut triangles = vec![[0, 1, 2]; 50_000];
    // The same place the other way round.
    triangles.extend(vec![[0, 2, 1]; 50_000]);
    let blas = Blas::build(&corners, &triangles);
    let tlas = Tlas::build(vec![(Arc::new(blas), Affine3A::IDENTITY); 3]);
    let at = |x: f32, y: f32| Ray::new(Vec3::new(x, y, 2.0), Vec3::NEG_Z);
    assert_eq!(tlas.intersect(&at(0.2, 0.3)).map(|hit| hit.hit.t), Some(2.0));
    assert!(tlas.occluded(&at(0.2, 0.3)) && tlas.intersect(&at(0.7, 0.7)).is_none());
}

/// A sphere of a million faces: rays at it meet it where the sphere is, rays past it nothing.
#[test]
fn a_million_faces_are_a_sphere() {
    // 20·4⁸ = 1 310 720 faces.
    let sphere = pano_core::builtin::primitives::icosphere(1.0, 8);
    assert!(sphere.triangles.len() > 1_000_000);
    let tlas = Tlas::build([(Arc::new(Blas::build(&sphere.positions, &sphere.triangles)), Affine3A::IDENTITY)]);
    for i in 0..2000 {
        let angle = i as f32 * 2.399_963;
        let height = (i as f32 + 0.5) / 1000.0 - 1.0;
        let level = (1.0 - height * height).sqrt();
        let from = Vec3::new(level * angle.cos(), height, level * angle.sin());
        let side = from.any_orthonormal_vector();
        let hit = tlas.intersect(&Ray::new(3.0 * from, -from)).unwrap_or_else(|| panic!("{from} is missed"));
        // The faces' sagitta is 2·10⁻⁶.
        assert!((hit.hit.t - 2.0).abs() < 1e-5, "{}", hit.hit.t);
        assert!(tlas.intersect(&Ray::new(3.0 * from + 1.001 * side, -from)).is_none(), "{from}");
    }
}
